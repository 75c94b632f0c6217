/* tet_lanes.h: FLESH_LANES tets side by side for kernels: from the nodes' vectors to the gradients in
 * the tets, and back from forces and blocks to the nodes and their pairs.
 *
 * With x_a the tet's nodes and g_a the gradients of its shape functions, F = sum x_a g_a^T; a first
 * Piola-Kirchhoff stress P gives node a volume * P g_a. */
#ifndef FLESH_EFFECT_TET_LANES_H
#define FLESH_EFFECT_TET_LANES_H

#include <stddef.h>

#include "effect/tet_kernel.h"
#include "math/mat3.h"

/* The compiler must see through these to keep a batch in registers. */
#define INLINE static inline __attribute__((always_inline))

/* The compiler must not make variants of this: where products and sums fuse alike, the bits do not
 * depend on what was asked. */
#ifdef __clang__
#define COMPILED_ONCE __attribute__((noinline))
#else
#define COMPILED_ONCE __attribute__((noinline, noclone))
#endif

/* flesh_elastic -> flesh_elastic_avx2 */
#define FLESH_PASTE(name, set)       name##_##set
#define FLESH_PASTE_VALUE(name, set) FLESH_PASTE(name, set)
#define FLESH_OF_SET(name)           FLESH_PASTE_VALUE(name, FLESH_SET)

extern const flesh_tet_kernel FLESH_OF_SET(flesh_elastic), FLESH_OF_SET(flesh_stiffness),
    FLESH_OF_SET(flesh_viscous);

/* Shapes are asked for this many batches before they are needed; read once in a pass, they are not to push other data
 * out of the caches. */
#define AHEAD 4

/* A batch's tets. */
typedef struct tets {
  const int *node; /* of its first tet */
  int first, used, material;
  flesh_real g[3][3], volume;
} tets;

INLINE void load_tets(const flesh_batches *batches, int index, tets *t)
{
  const flesh_real_at *shape =
      (const flesh_real_at *)(batches->shapes + (size_t)index * 10 * FLESH_LANES);
  if (index + AHEAD < batches->count)
    for (int k = 0; k < 10 * FLESH_LANES; k += 8) /* a line of 64 bytes each */
      __builtin_prefetch(batches->shapes + (size_t)(index + AHEAD) * 10 * FLESH_LANES + k, 0, 0);
  t->material = batches->material[index];
  t->first = batches->first[index];
  t->used = batches->first[index + 1] - t->first;
  t->node = batches->nodes + 4 * (size_t)t->first;
  for (int a = 0; a < 3; a++)
    for (int j = 0; j < 3; j++) t->g[a][j] = shape[3 * a + j];
  t->volume = shape[9];
}

/* sum over nodes of x_a g_a^T: the deformation gradient of positions, its rate of velocities. */
INLINE void gradient_of(const tets *t, const double *x, flesh_real F[9])
{
  int repeated[4 * FLESH_LANES];
  const int *node = t->node;
  if (t->used < FLESH_LANES) { /* the lanes not used see the last tet */
    for (int l = 0; l < 4 * FLESH_LANES; l++)
      repeated[l] = node[l < 4 * t->used ? l : 4 * t->used - 4 + l % 4];
    node = repeated;
  }
#pragma GCC unroll 3
  for (int i = 0; i < 3; i++) {
#define POSITION(a, l) x[3 * (size_t)node[4 * (l) + (a)] + i]
#define FIRST(l)       POSITION(0, l)
#define SECOND(l)      POSITION(1, l)
#define THIRD(l)       POSITION(2, l)
#define FOURTH(l)      POSITION(3, l)
    flesh_real x0 = FLESH_EACH_LANE(FIRST), d1 = FLESH_EACH_LANE(SECOND) - x0;
    flesh_real d2 = FLESH_EACH_LANE(THIRD) - x0, d3 = FLESH_EACH_LANE(FOURTH) - x0;
#undef FOURTH
#undef THIRD
#undef SECOND
#undef FIRST
#undef POSITION
    for (int j = 0; j < 3; j++)
      F[3 * i + j] = d1 * t->g[0][j] + d2 * t->g[1][j] + d3 * t->g[2][j];
  }
}

/* Row i of the forces on the nodes, by row i of volume * P. */
INLINE void force_row(const tets *t, int i, const flesh_real P[3], flesh_real f[4][3])
{
  for (int a = 0; a < 3; a++) f[a + 1][i] = flesh_vec3_dot(P, t->g[a]);
  f[0][i] = -(f[1][i] + f[2][i] + f[3][i]);
}

/* Adds every lane's forces f [4 nodes][3] to its nodes, x and y together. */
static inline void scatter_forces(const tets *t, flesh_real f[4][3], double *r)
{
  double xy[4][2][FLESH_LANES], z[4][FLESH_LANES];
  for (int a = 0; a < 4; a++) {
    flesh_exchange(1, &f[a][0], &f[a][1]);
    *(flesh_real_at *)xy[a][0] = f[a][0]; /* x and y of the even lanes */
    *(flesh_real_at *)xy[a][1] = f[a][1];
    *(flesh_real_at *)z[a] = f[a][2];
  }
  for (int l = 0; l < t->used; l++)
    for (int a = 0; a < 4; a++) {
      double *place = r + 3 * (size_t)t->node[4 * l + a];
      *(flesh_two_at *)place += *(const flesh_two_at *)(xy[a][l & 1] + (l & ~1));
      place[2] += z[a][l];
    }
}

/* Where a matrix is beyond the caches (that of MANY tets), the blocks of the tets this far ahead are asked for: both
 * lines that each may lie in. */
enum { TETS_AHEAD = 32, MANY = 130000 };

INLINE void expect_blocks(const flesh_batches *batches, int index, const int *slots, const double *values)
{
  const int ahead = index + TETS_AHEAD / FLESH_LANES;
  if (batches->first[batches->count] < MANY || ahead >= batches->count) return;
  const int *slot = slots + 10 * (size_t)batches->first[ahead], *end = slots + 10 * (size_t)batches->first[ahead + 1];
  for (; slot < end; slot++) {
    const double *block = values + 9 * (size_t)*slot;
    __builtin_prefetch(block, 1);
    __builtin_prefetch(block + 8, 1);
  }
}

/* Adds every lane's block to its place; slots are 10 apart from tet to tet. */
static inline void add_block(const flesh_real block[9], const int *slot, int used, double *values)
{
  flesh_real by_tet[8 / FLESH_LANES][FLESH_LANES];
  for (int part = 0; part < 8 / FLESH_LANES; part++) {
    for (int c = 0; c < FLESH_LANES; c++) by_tet[part][c] = block[part * FLESH_LANES + c];
    flesh_transpose(by_tet[part]);
  }
  for (int l = 0; l < FLESH_LANES && l < used; l++) {
    double *place = values + 9 * (size_t)slot[10 * l];
    for (int part = 0; part < 8 / FLESH_LANES; part++)
      *(flesh_real_at *)(place + part * FLESH_LANES) += by_tet[part][l];
    place[8] += flesh_lane(block[8], l);
  }
}

/* Adds the six blocks between nodes 1, 2, 3 (11 12 13 22 23 33) and, by the zero row sum, the four of
 * node 0. `slots` are those of all tets. */
static inline void scatter_blocks(const tets *t, const flesh_real pair[6][9], const int *slots,
                                  double *values)
{
  const int *slot = slots + 10 * (size_t)t->first;
  flesh_real k0[3][9], k00[9];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      int c = 3 * i + j, s = 3 * j + i;
      /* K_0b = -(K_1b + K_2b + K_3b). */
      k0[0][c] = -(pair[0][c] + pair[1][s] + pair[2][s]);
      k0[1][c] = -(pair[1][c] + pair[3][c] + pair[4][s]);
      k0[2][c] = -(pair[2][c] + pair[4][c] + pair[5][c]);
    }
  /* K_00 = -(K_01 + K_02 + K_03), symmetric: the mean of both orders. */
  for (int i = 0; i < 3; i++)
    for (int j = i; j < 3; j++) {
      int c = 3 * i + j, s = 3 * j + i;
      k00[c] = k00[s] =
          -0.5 * ((k0[0][c] + k0[1][c] + k0[2][c]) + (k0[0][s] + k0[1][s] + k0[2][s]));
    }
  add_block(k00, slot, t->used, values);
  for (int p = 0; p < 3; p++) add_block(k0[p], slot + 1 + p, t->used, values);
  for (int p = 0; p < 6; p++) add_block(pair[p], slot + 4 + p, t->used, values);
}

/* Adds a batch's sums lane by lane. */
INLINE void add_sums(flesh_real value, flesh_real size, double *sums)
{
  for (int l = 0; sums && l < FLESH_LANES; l++) {
    sums[0] += flesh_lane(value, l);
    sums[1] += flesh_lane(size, l);
  }
}

#endif
