/* lanes.h: flesh_real is a double or, in a file compiled with -DFLESH_LANES=n, n doubles side by side, so that the same
 * code computes one value or n at once.
 *
 * The compiler's vector types have + - * / and comparisons, also with a double on one side. This file adds the rest,
 * and only this file contains machine-specific code. */
#ifndef FLESH_MATH_LANES_H
#define FLESH_MATH_LANES_H

#include <math.h>
#include <stdint.h>

#include "base/unroll.h"

#ifndef FLESH_LANES
#define FLESH_LANES 1
#endif

#if FLESH_LANES == 1

typedef double flesh_real;
typedef int flesh_mask; /* 0 or 1 */

static inline double flesh_all(double value) { return value; }
static inline double flesh_lane(double value, int lane) { return (void)lane, value; }
static inline void flesh_set_lane(double *value, int lane, double to) { (void)lane, *value = to; }
static inline int flesh_any(int mask) { return mask; }
static inline double flesh_select(int mask, double yes, double no) { return mask ? yes : no; }
static inline double flesh_sqrt(double value) { return sqrt(value); }
static inline double flesh_abs(double value) { return fabs(value); }

#else

#if defined(__SSE2__)
#include <immintrin.h>
#endif

typedef double flesh_real __attribute__((vector_size(8 * FLESH_LANES)));
typedef int64_t flesh_mask __attribute__((vector_size(8 * FLESH_LANES))); /* 0 or -1 in each lane */

static inline flesh_real flesh_all(double value) { return value - (flesh_real){0}; }
static inline double flesh_lane(flesh_real value, int lane) { return value[lane]; }
static inline void flesh_set_lane(flesh_real *value, int lane, double to) { (*value)[lane] = to; }

static inline int flesh_any(flesh_mask mask)
{
#if defined(__AVX512DQ__) && FLESH_LANES == 8
  return _mm512_movepi64_mask((__m512i)mask) != 0;
#elif defined(__AVX__) && FLESH_LANES == 4
  return _mm256_movemask_pd((__m256d)mask) != 0;
#else
  int64_t any = 0;
  for (int lane = 0; lane < FLESH_LANES; lane++) any |= mask[lane];
  return any != 0;
#endif
}

static inline flesh_real flesh_select(flesh_mask mask, flesh_real yes, flesh_real no)
{
#if defined(__AVX512DQ__) && FLESH_LANES == 8
  return (flesh_real)_mm512_mask_blend_pd(_mm512_movepi64_mask((__m512i)mask), (__m512d)no,
                                          (__m512d)yes);
#elif defined(__AVX__) && FLESH_LANES == 4
  return (flesh_real)_mm256_blendv_pd((__m256d)no, (__m256d)yes, (__m256d)mask);
#else
  return (flesh_real)((mask & (flesh_mask)yes) | (~mask & (flesh_mask)no));
#endif
}

static inline flesh_real flesh_sqrt(flesh_real value)
{
#if defined(__AVX512F__) && FLESH_LANES == 8
  return (flesh_real)_mm512_sqrt_pd((__m512d)value);
#elif defined(__AVX__) && FLESH_LANES == 4
  return (flesh_real)_mm256_sqrt_pd((__m256d)value);
#else
  flesh_real root;
  for (int lane = 0; lane < FLESH_LANES; lane++) root[lane] = sqrt(value[lane]);
  return root;
#endif
}

static inline flesh_real flesh_abs(flesh_real value)
{
  return (flesh_real)((flesh_mask)value & INT64_MAX);
}

/* Exchanges lanes of a and b: of every 2 * step lanes, `step` stay and `step` swap, so that for step 1 a becomes a_0
 * b_0 a_2 b_2 ... and b becomes a_1 b_1 a_3 b_3 ... */
static inline void flesh_exchange(int step, flesh_real *a, flesh_real *b)
{
  flesh_real x = *a, y = *b;
#if FLESH_LANES == 8
  if (step == 4) {
    *a = __builtin_shufflevector(x, y, 0, 1, 2, 3, 8, 9, 10, 11);
    *b = __builtin_shufflevector(x, y, 4, 5, 6, 7, 12, 13, 14, 15);
  } else if (step == 2) {
    *a = __builtin_shufflevector(x, y, 0, 1, 8, 9, 4, 5, 12, 13);
    *b = __builtin_shufflevector(x, y, 2, 3, 10, 11, 6, 7, 14, 15);
  } else {
    *a = __builtin_shufflevector(x, y, 0, 8, 2, 10, 4, 12, 6, 14);
    *b = __builtin_shufflevector(x, y, 1, 9, 3, 11, 5, 13, 7, 15);
  }
#elif FLESH_LANES == 4
  if (step == 2) {
    *a = __builtin_shufflevector(x, y, 0, 1, 4, 5);
    *b = __builtin_shufflevector(x, y, 2, 3, 6, 7);
  } else {
    *a = __builtin_shufflevector(x, y, 0, 4, 2, 6);
    *b = __builtin_shufflevector(x, y, 1, 5, 3, 7);
  }
#else
  (void)step;
  *a = __builtin_shufflevector(x, y, 0, 2);
  *b = __builtin_shufflevector(x, y, 1, 3);
#endif
}

/* Transposes: lane l of vector c becomes lane c of vector l. */
static inline void flesh_transpose(flesh_real v[FLESH_LANES])
{
  FLESH_UNROLL(3)
  for (int step = 1; step < FLESH_LANES; step *= 2)
    FLESH_UNROLL(8)
    for (int k = 0; k < FLESH_LANES; k++)
      if (!(k & step)) flesh_exchange(step, &v[k], &v[k + step]);
}

/* Vectors of FLESH_LANES and of two doubles at any address of a double. */
typedef flesh_real flesh_real_at __attribute__((aligned(8), may_alias));
typedef double flesh_two_at __attribute__((vector_size(16), aligned(8), may_alias));
/* Vector of four doubles at a multiple of 32 bytes. */
typedef double flesh_four __attribute__((vector_size(32), may_alias));

/* Transposes between four numbers of one lane side by side and one number of all lanes. */
static inline void flesh_mix_four(flesh_real v[4])
{
  FLESH_UNROLL(2)
  for (int step = 1; step < 4 && step < FLESH_LANES; step *= 2)
    FLESH_UNROLL(4)
    for (int k = 0; k < 4; k++)
      if (!(k & step)) flesh_exchange(step, &v[k], &v[k + step]);
}

#if FLESH_LANES == 8
/* Loads the four numbers at each of two addresses. */
static inline flesh_real flesh_two_fours(const double *a, const double *b)
{
#ifdef __AVX512F__ /* one instruction for the second four; GCC 12 needs two */
  return (flesh_real)_mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_load_pd(a)), _mm256_load_pd(b), 1);
#else
  return __builtin_shufflevector(*(const flesh_four *)a, *(const flesh_four *)b, 0, 1, 2, 3, 4, 5, 6, 7);
#endif
}
#endif

/* Sets lane l of v[k] to number k of the four at place[l] minus that at from[l], for every lane l; addresses are
 * multiples of 32 bytes. */
static inline void flesh_load_from(const double *const from[FLESH_LANES], const double *const place[FLESH_LANES],
                                   flesh_real v[4])
{
#if FLESH_LANES == 8
  /* Order of the lanes that shuffles of quarters turn into the right one. */
  static const int low[4] = {0, 1, 4, 5};
  flesh_real by_lane[4], even[2], odd[2];
  FLESH_UNROLL(4)
  for (int k = 0; k < 4; k++)
    by_lane[k] = flesh_two_fours(place[low[k]], place[low[k] + 2]) - flesh_two_fours(from[low[k]], from[low[k] + 2]);
  FLESH_UNROLL(2)
  for (int h = 0; h < 2; h++) {
    even[h] = __builtin_shufflevector(by_lane[2 * h], by_lane[2 * h + 1], 0, 8, 2, 10, 4, 12, 6, 14);
    odd[h] = __builtin_shufflevector(by_lane[2 * h], by_lane[2 * h + 1], 1, 9, 3, 11, 5, 13, 7, 15);
  }
  v[0] = __builtin_shufflevector(even[0], even[1], 0, 1, 4, 5, 8, 9, 12, 13);
  v[1] = __builtin_shufflevector(odd[0], odd[1], 0, 1, 4, 5, 8, 9, 12, 13);
  v[2] = __builtin_shufflevector(even[0], even[1], 2, 3, 6, 7, 10, 11, 14, 15);
  v[3] = __builtin_shufflevector(odd[0], odd[1], 2, 3, 6, 7, 10, 11, 14, 15);
#elif FLESH_LANES == 4
  FLESH_UNROLL(4)
  for (int k = 0; k < 4; k++) v[k] = *(const flesh_real_at *)place[k] - *(const flesh_real_at *)from[k];
  flesh_mix_four(v);
#else /* the transposed `from` can be reused for other places */
  flesh_real less[4];
  for (int k = 0; k < 4; k++) {
    v[k] = *(const flesh_real_at *)(place[k % 2] + (k & 2));
    less[k] = *(const flesh_real_at *)(from[k % 2] + (k & 2));
  }
  flesh_mix_four(v);
  flesh_mix_four(less);
  for (int k = 0; k < 4; k++) v[k] -= less[k];
#endif
}

/* Adds lane l of v[k] to number k of the four at place[l], for one lane after the other; addresses are multiples of 32
 * bytes. */
static inline void flesh_add_four(double *const place[FLESH_LANES], flesh_real v[4])
{
  flesh_mix_four(v);
#if FLESH_LANES == 8
  FLESH_UNROLL(4)
  for (int k = 0; k < 4; k++) *(flesh_four *)place[k] += __builtin_shufflevector(v[k], v[k], 0, 1, 2, 3);
  FLESH_UNROLL(4)
  for (int k = 0; k < 4; k++) *(flesh_four *)place[k + 4] += __builtin_shufflevector(v[k], v[k], 4, 5, 6, 7);
#elif FLESH_LANES == 4
  FLESH_UNROLL(4)
  for (int k = 0; k < 4; k++) *(flesh_real_at *)place[k] += v[k];
#else
  for (int k = 0; k < 4; k++) *(flesh_real_at *)(place[k % 2] + (k & 2)) += v[k];
#endif
}

#endif

/* Return the larger or smaller number; b if one of the two is NaN. */
#if FLESH_LANES == 2 && defined(__SSE2__) /* one instruction; compilers need six */
static inline flesh_real flesh_max(flesh_real a, flesh_real b) { return (flesh_real)_mm_max_pd((__m128d)a, (__m128d)b); }
static inline flesh_real flesh_min(flesh_real a, flesh_real b) { return (flesh_real)_mm_min_pd((__m128d)a, (__m128d)b); }
#else
static inline flesh_real flesh_max(flesh_real a, flesh_real b) { return flesh_select(a > b, a, b); }
static inline flesh_real flesh_min(flesh_real a, flesh_real b) { return flesh_select(a < b, a, b); }
#endif

#endif
