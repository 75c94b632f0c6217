/* lanes.h: vectors of four lanes, three for a node's components and one for padding, in the compiler's own vector types.
 *
 * Blocks are nine numbers without padding. A row of a block is loaded as four lanes, the fourth of which is the next number
 * in memory: it meets only other fourth lanes, which are dropped in the end. */
#ifndef FLESH_LINEAR_LANES_H
#define FLESH_LINEAR_LANES_H

#include <stdint.h>
#ifdef __AVX512F__
#include <immintrin.h>
#endif

typedef double flesh_double4 __attribute__((vector_size(32)));
typedef float flesh_float4 __attribute__((vector_size(16)));
/* Vectors with one lane for each of eight corners. */
typedef double flesh_double8 __attribute__((vector_size(64)));
typedef float flesh_float8 __attribute__((vector_size(32)));
/* Vectors of bits of numbers, in single precision or nearly. */
typedef uint32_t flesh_word4 __attribute__((vector_size(16)));
typedef uint32_t flesh_word16 __attribute__((vector_size(64)));
typedef float flesh_float16 __attribute__((vector_size(64)));
/* Vectors of unknown alignment. */
typedef uint32_t flesh_word4_loose __attribute__((vector_size(16), aligned(4), may_alias));
typedef uint32_t flesh_word16_loose __attribute__((vector_size(64), aligned(4), may_alias));
typedef double flesh_double4_loose __attribute__((vector_size(32), aligned(8), may_alias));
typedef float flesh_float4_loose __attribute__((vector_size(16), aligned(4), may_alias));
typedef double flesh_double8_loose __attribute__((vector_size(64), aligned(8), may_alias));

/* Numbers side by side, as many as a register holds. */
#if defined(__AVX512F__)
enum { FLESH_ASIDE = 8 };
#elif defined(__AVX__)
enum { FLESH_ASIDE = 4 };
#else
enum { FLESH_ASIDE = 2 };
#endif
typedef double flesh_aside __attribute__((vector_size(8 * FLESH_ASIDE)));
typedef double flesh_aside_loose __attribute__((vector_size(8 * FLESH_ASIDE), aligned(8), may_alias));

#define FLESH_LANES_DOUBLE(pointer) (*(const flesh_double4_loose *)(pointer))
#define FLESH_LANES_FLOAT(pointer) (*(const flesh_float4_loose *)(pointer))
#define FLESH_LANES_DOUBLE8(pointer) (*(flesh_double8_loose *)(pointer))
#define FLESH_LANES_ASIDE(pointer) (*(flesh_aside_loose *)(pointer))

#ifdef __AVX512F__
/* Four lanes of single precision, four times: one instruction, which GCC 12 does not find by itself. */
#define FLESH_LANES_REPEATED(pointer) ((flesh_float16)_mm512_broadcast_f32x4(_mm_load_ps(pointer)))
#endif

/* Keeps lanes in their register: compilers would load again what is used twice, and products are limited by loads. */
#if defined(__AVX512VL__) /* one register holds four */
#define FLESH_LANES_KEEP(lanes) __asm__("" : "+v"(lanes))
#elif defined(__AVX__)
#define FLESH_LANES_KEEP(lanes) __asm__("" : "+x"(lanes))
#else
#define FLESH_LANES_KEEP(lanes) ((void)0)
#endif

/* Prefetches a line that is read once in a pass, so that it does not push data that is used again, such as vectors, out of
 * the caches. */
#define FLESH_EXPECT_ONCE(pointer) __builtin_prefetch(pointer, 0, 0)

/* Four lanes in double precision. */
#define FLESH_LANES_WIDE(lanes) __builtin_convertvector(lanes, flesh_double4)
/* Four lanes in single precision. */
#define FLESH_LANES_NARROW(lanes) __builtin_convertvector(lanes, flesh_float4)

/* {sum of a's, of b's, of c's first three lanes, anything}, in either precision. */
#define FLESH_LANES_SUMS(a, b, c)                                                                  \
  (__builtin_shufflevector(__builtin_shufflevector(a, b, 0, 4, 1, 5), c, 0, 1, 4, 4) +             \
   __builtin_shufflevector(__builtin_shufflevector(a, b, 0, 4, 1, 5), c, 2, 3, 5, 5) +             \
   __builtin_shufflevector(__builtin_shufflevector(a, b, 2, 6, 2, 6), c, 0, 1, 6, 6))

#endif
