/* linear.c: chooses the linear solver for a machine's instructions. */
#include "linear/linear.h"

const flesh_linear *flesh_linear_for(flesh_instructions instructions)
{
#ifdef FLESH_HAVE_X86_64
  if (instructions == FLESH_INSTRUCTIONS_AUTO) flesh_instructions_find(FLESH_INSTRUCTIONS_AUTO, &instructions);
  if (instructions == FLESH_INSTRUCTIONS_AVX512) return &flesh_linear_avx512;
  if (instructions == FLESH_INSTRUCTIONS_AVX2) return &flesh_linear_avx2;
#endif
  (void)instructions;
  return &flesh_linear_portable;
}
