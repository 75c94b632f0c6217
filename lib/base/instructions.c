/* instructions.c: the instruction sets that the processor has and the library was built with. */
#include "flesh/instructions.h"

#include "base/error.h"

static const char *const names[FLESH_INSTRUCTIONS_COUNT] = {"auto", "portable", "avx2", "avx512"};

const char *flesh_instructions_name(flesh_instructions instructions)
{
  return (unsigned)instructions < FLESH_INSTRUCTIONS_COUNT ? names[instructions] : "unknown";
}

static int has(flesh_instructions instructions)
{
#ifdef FLESH_HAVE_X86_64
  int avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
             __builtin_cpu_supports("bmi2");
  if (instructions == FLESH_INSTRUCTIONS_AVX2) return avx2;
  if (instructions == FLESH_INSTRUCTIONS_AVX512)
    return avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512cd");
#endif
  return instructions == FLESH_INSTRUCTIONS_PORTABLE;
}

int flesh_instructions_find(flesh_instructions asked, flesh_instructions *usable)
{
  FLESH_NEED({usable, "usable"});
  if ((unsigned)asked >= FLESH_INSTRUCTIONS_COUNT)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "instructions is number %d; it must be one of auto, portable, avx2, avx512",
                      (int)asked);
  if (asked == FLESH_INSTRUCTIONS_AUTO) {
    asked = FLESH_INSTRUCTIONS_AVX512;
    while (!has(asked)) asked--;
  }
  if (!has(asked))
    return flesh_fail(FLESH_ERR_ARGUMENT, "instructions is %s, which this machine lacks",
                      names[asked]);
  *usable = asked;
  return FLESH_OK;
}
