/* sliced_ell.h: nodes side by side in single precision, one vector for each component, with conversions from and to four
 * lanes per node. */
#ifndef FLESH_LINEAR_SLICED_ELL_H
#define FLESH_LINEAR_SLICED_ELL_H

#include "linear/lanes.h"
#ifdef __AVX__
#include <immintrin.h>
#endif

/* Number of nodes side by side, and SHUFFLE, which takes from every four lanes i, j, k and l of a's or, less four, of b's. */
#ifdef __AVX__
enum { FLESH_SLICE = 8 }; /* sixteen are no faster, and more of them are empty */
#define FLESH_SLICE_SHUFFLE(a, b, i, j, k, l)                                                              \
  __builtin_shufflevector(a, b, FLESH_SLICE_OF(i), FLESH_SLICE_OF(j), FLESH_SLICE_OF(k), FLESH_SLICE_OF(l), \
                          FLESH_SLICE_OF(i) + 4, FLESH_SLICE_OF(j) + 4, FLESH_SLICE_OF(k) + 4,             \
                          FLESH_SLICE_OF(l) + 4)
#else
enum { FLESH_SLICE = 4 };
#define FLESH_SLICE_SHUFFLE(a, b, i, j, k, l) __builtin_shufflevector(a, b, i, j, k, l)
#endif
#define FLESH_SLICE_OF(lane) ((lane) < 4 ? (lane) : (lane) + 4)
typedef float flesh_sliced_ell __attribute__((vector_size(4 * FLESH_SLICE)));

/* Joins the four lanes of one of every four nodes, side by side; `more` is not needed if a slice has only four nodes. */
static inline __attribute__((always_inline)) flesh_sliced_ell flesh_sliced_ell_join(flesh_float4 first,
                                                                                    flesh_float4 more)
{
#ifdef __AVX__
  return (flesh_sliced_ell)_mm256_insertf128_ps(_mm256_castps128_ps256((__m128)first), (__m128)more, 1);
#else
  (void)more;
  return first;
#endif
}

/* Returns the four lanes of the g-th of the joined nodes. */
static inline __attribute__((always_inline)) flesh_float4 flesh_sliced_ell_part(flesh_sliced_ell joined, int g)
{
#ifdef __AVX__
  return (flesh_float4)(g ? _mm256_extractf128_ps((__m256)joined, 1) : _mm256_castps256_ps128((__m256)joined));
#else
  (void)g;
  return joined;
#endif
}

/* Joins three numbers each, scaled and rounded; a fourth is read. */
static inline __attribute__((always_inline)) flesh_sliced_ell
flesh_sliced_ell_rounded(double scale, const double *first, const double *more)
{
#ifdef __AVX512F__
  const __m512d both = _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_loadu_pd(first)), _mm256_loadu_pd(more), 1);
  return (flesh_sliced_ell)_mm512_cvtpd_ps(_mm512_set1_pd(scale) * both);
#else
  return flesh_sliced_ell_join(FLESH_LANES_NARROW(scale * FLESH_LANES_DOUBLE(first)),
                          FLESH_LANES_NARROW(scale * FLESH_LANES_DOUBLE(more)));
#endif
}

/* Converts the joined nodes to vectors of components. */
static inline __attribute__((always_inline)) void flesh_sliced_ell_turn(const flesh_sliced_ell node[4],
                                                                        flesh_sliced_ell component[3])
{
  const flesh_sliced_ell xy01 = FLESH_SLICE_SHUFFLE(node[0], node[1], 0, 4, 1, 5);
  const flesh_sliced_ell xy23 = FLESH_SLICE_SHUFFLE(node[2], node[3], 0, 4, 1, 5);
  const flesh_sliced_ell z01 = FLESH_SLICE_SHUFFLE(node[0], node[1], 2, 6, 3, 7);
  const flesh_sliced_ell z23 = FLESH_SLICE_SHUFFLE(node[2], node[3], 2, 6, 3, 7);
  component[0] = FLESH_SLICE_SHUFFLE(xy01, xy23, 0, 1, 4, 5);
  component[1] = FLESH_SLICE_SHUFFLE(xy01, xy23, 2, 3, 6, 7);
  component[2] = FLESH_SLICE_SHUFFLE(z01, z23, 0, 1, 4, 5);
}

/* Gathers the components of the nodes whose four lanes are at these places [FLESH_SLICE] in `vectors`. */
static inline __attribute__((always_inline)) void flesh_sliced_ell_gather(const float *vectors, const unsigned *place,
                                                                     flesh_sliced_ell component[3])
{
  flesh_sliced_ell node[4];
  for (int q = 0; q < 4; q++)
    node[q] = flesh_sliced_ell_join(*(const flesh_float4 *)(vectors + place[q]),
                               *(const flesh_float4 *)(vectors + place[q + FLESH_SLICE - 4]));
  flesh_sliced_ell_turn(node, component);
}

/* Adds components to the nodes in `vectors`, one node after the other, as several may be at one place. Adds 0 to fourth
 * lanes. */
static inline __attribute__((always_inline)) void flesh_sliced_ell_add(float *vectors, const unsigned *place,
                                                                  const flesh_sliced_ell component[3])
{
  const flesh_sliced_ell zero = {0};
  const flesh_sliced_ell xy01 = FLESH_SLICE_SHUFFLE(component[0], component[1], 0, 4, 1, 5);
  const flesh_sliced_ell xy23 = FLESH_SLICE_SHUFFLE(component[0], component[1], 2, 6, 3, 7);
  const flesh_sliced_ell z01 = FLESH_SLICE_SHUFFLE(component[2], zero, 0, 4, 1, 5);
  const flesh_sliced_ell z23 = FLESH_SLICE_SHUFFLE(component[2], zero, 2, 6, 3, 7);
  const flesh_sliced_ell node[4] = {
      FLESH_SLICE_SHUFFLE(xy01, z01, 0, 1, 4, 5), FLESH_SLICE_SHUFFLE(xy01, z01, 2, 3, 6, 7),
      FLESH_SLICE_SHUFFLE(xy23, z23, 0, 1, 4, 5), FLESH_SLICE_SHUFFLE(xy23, z23, 2, 3, 6, 7)};
  for (int g = 0; g < FLESH_SLICE / 4; g++)
    for (int q = 0; q < 4; q++)
      *(flesh_float4 *)(vectors + place[4 * g + q]) += flesh_sliced_ell_part(node[q], g);
}

#endif
