/* six.h: three numbers of one node or block and three of another side by side, in single precision: a row of two blocks
 * that follow one another is six numbers of memory. One vector of eight lanes holds them, the last two of which may be
 * anything, or, where the processor has none, two of four. */
#ifndef FLESH_SPARSE_SIX_H
#define FLESH_SPARSE_SIX_H

#include "sparse/lanes.h"

#define SIX_INLINE static inline __attribute__((always_inline))

#ifdef __AVX__
#include <immintrin.h>

typedef float flesh_six __attribute__((vector_size(32)));
typedef float flesh_six_loose __attribute__((vector_size(32), aligned(4), may_alias));

/* Six numbers in memory; two behind them are read. */
SIX_INLINE flesh_six flesh_six_row(const float *row) { return *(const flesh_six_loose *)row; }

/* The first three numbers of each. */
SIX_INLINE flesh_six flesh_six_both(flesh_float4 a, flesh_float4 b)
{
  return __builtin_shufflevector(a, b, 0, 1, 2, 4, 5, 6, 6, 6);
}

/* The first three numbers and zeros. */
SIX_INLINE flesh_six flesh_six_one(flesh_float4 a)
{
  return __builtin_shufflevector(a, (flesh_float4){0}, 0, 1, 2, 4, 4, 5, 6, 7);
}

/* The vectors of two nodes. */
SIX_INLINE flesh_six flesh_six_nodes(const float *a, const float *b)
{
#ifdef __AVX512VL__ /* one instruction more than a load */
  return (flesh_six)_mm256_mask_loadu_ps(_mm256_zextps128_ps256(_mm_load_ps(a)), 0x38, b - 3);
#else
  return flesh_six_both(*(const flesh_float4 *)a, *(const flesh_float4 *)b);
#endif
}

SIX_INLINE flesh_six flesh_six_product(flesh_six a, flesh_six b) { return a * b; }

/* sum + a b; where the compiler chose what to fuse, products by the same matrix would differ in bits. */
SIX_INLINE flesh_six flesh_six_sum(flesh_six sum, flesh_six a, flesh_six b)
{
#ifdef __FMA__
  return (flesh_six)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)sum);
#else
  return sum + a * b;
#endif
}

/* Each of a node's three numbers in all lanes; one load and three shuffles are less work than three loads. */
SIX_INLINE void flesh_six_spread(const float *node, flesh_six all[3])
{
  const __m256 twice = _mm256_broadcast_ps((const __m128 *)node);
  all[0] = (flesh_six)_mm256_permute_ps(twice, 0x00);
  all[1] = (flesh_six)_mm256_permute_ps(twice, 0x55);
  all[2] = (flesh_six)_mm256_permute_ps(twice, 0xaa);
}

/* The three numbers of the first and of the second; a fourth may be anything. */
SIX_INLINE flesh_float4 flesh_six_first(flesh_six a) { return __builtin_shufflevector(a, a, 0, 1, 2, 3); }
SIX_INLINE flesh_float4 flesh_six_second(flesh_six a)
{
#ifdef __AVX512VL__
  const __m256i turned = _mm256_alignr_epi32((__m256i)a, (__m256i)a, 3);
  return flesh_six_first((flesh_six)turned);
#else
  return __builtin_shufflevector(a, a, 3, 4, 5, 6);
#endif
}

/* Sums of the six numbers of a, of b and of c; the fourth may be anything. */
SIX_INLINE flesh_float4 flesh_six_sums(flesh_six a, flesh_six b, flesh_six c)
{
#ifdef __AVX512VL__
  const __m256 ab = _mm256_unpacklo_ps((__m256)a, (__m256)b) + _mm256_maskz_unpackhi_ps(0x0f, (__m256)a, (__m256)b);
  const __m256 cc = (__m256)c + _mm256_maskz_permute_ps(0x0f, (__m256)c, 0x0e);
  const __m256 all = _mm256_shuffle_ps(ab, cc, 0x44) + _mm256_shuffle_ps(ab, cc, 0x1e);
  return (flesh_float4)(_mm256_castps256_ps128(all) + _mm256_extractf128_ps(all, 1));
#else
  const flesh_float4 of_a = flesh_six_first(a) + flesh_six_second(a), of_b = flesh_six_first(b) + flesh_six_second(b);
  const flesh_float4 of_c = flesh_six_first(c) + flesh_six_second(c);
  return FLESH_LANES_SUMS(of_a, of_b, of_c);
#endif
}

/* Three numbers times scale and a fourth that may be anything; one behind the three is read. */
SIX_INLINE flesh_float4 flesh_six_rounded(double scale, const double *three)
{
  return FLESH_LANES_NARROW(scale * FLESH_LANES_DOUBLE(three));
}

#define FLESH_SIX_KEEP(six) FLESH_LANES_KEEP(six)

#else

typedef struct flesh_six {
  flesh_float4 a, b;
} flesh_six;

SIX_INLINE flesh_six flesh_six_row(const float *row)
{
  return (flesh_six){FLESH_LANES_FLOAT(row), FLESH_LANES_FLOAT(row + 3)};
}
SIX_INLINE flesh_six flesh_six_both(flesh_float4 a, flesh_float4 b) { return (flesh_six){a, b}; }
SIX_INLINE flesh_six flesh_six_one(flesh_float4 a) { return (flesh_six){a, {0}}; }
SIX_INLINE flesh_six flesh_six_nodes(const float *a, const float *b)
{
  return (flesh_six){*(const flesh_float4 *)a, *(const flesh_float4 *)b};
}
SIX_INLINE flesh_six flesh_six_product(flesh_six a, flesh_six b) { return (flesh_six){a.a * b.a, a.b * b.b}; }
SIX_INLINE flesh_six flesh_six_sum(flesh_six sum, flesh_six a, flesh_six b)
{
  return (flesh_six){sum.a + a.a * b.a, sum.b + a.b * b.b};
}
SIX_INLINE void flesh_six_spread(const float *node, flesh_six all[3])
{
  for (int r = 0; r < 3; r++) {
    const flesh_float4 four = node[r] - (flesh_float4){0};
    all[r] = (flesh_six){four, four};
  }
}
SIX_INLINE flesh_float4 flesh_six_first(flesh_six a) { return a.a; }
SIX_INLINE flesh_float4 flesh_six_second(flesh_six a) { return a.b; }
SIX_INLINE flesh_float4 flesh_six_sums(flesh_six a, flesh_six b, flesh_six c)
{
  const flesh_float4 of_a = a.a + a.b, of_b = b.a + b.b, of_c = c.a + c.b;
  return FLESH_LANES_SUMS(of_a, of_b, of_c);
}
SIX_INLINE flesh_float4 flesh_six_rounded(double scale, const double *three)
{
  return (flesh_float4){(float)(scale * three[0]), (float)(scale * three[1]), (float)(scale * three[2]), 0};
}
#define FLESH_SIX_KEEP(six) ((void)0)

#endif

#endif
