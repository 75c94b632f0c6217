/* instructions.h: the vector instructions that elements and linear solvers use. Results are bitwise the same with the
 * same instructions; with different ones they agree to rounding.
 * Functions that return no status cannot fail. */
#ifndef FLESH_INSTRUCTIONS_H
#define FLESH_INSTRUCTIONS_H

#include "flesh/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum flesh_instructions {
  FLESH_INSTRUCTIONS_AUTO,     /* the best that this machine has */
  FLESH_INSTRUCTIONS_PORTABLE, /* the base set of the architecture; two tets at once */
  FLESH_INSTRUCTIONS_AVX2,     /* x86-64-v3: with FMA; four tets at once */
  FLESH_INSTRUCTIONS_AVX512,   /* x86-64-v4: F, VL, DQ, BW, CD; eight tets at once */
  FLESH_INSTRUCTIONS_COUNT
} flesh_instructions;

/* Returns "auto", "portable", "avx2" or "avx512"; "unknown" for anything else. */
FLESH_API const char *flesh_instructions_name(flesh_instructions instructions);

/* Finds an instruction set that this machine has: AUTO becomes the best one, others stay. FLESH_ERR_ARGUMENT when the
 * machine lacks the one asked for; *usable is then unchanged. */
FLESH_API int flesh_instructions_find(flesh_instructions asked, flesh_instructions *usable);

#ifdef __cplusplus
}
#endif
#endif
