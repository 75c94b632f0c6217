/* tet_lanes.h: FLESH_LANES tets side by side for kernels: from the nodes' vectors to the gradients in
 * the tets, and back from forces and blocks to the nodes and their pairs.
 *
 * With x_a the tet's nodes and g_a the gradients of its shape functions, F = sum x_a g_a^T; a first
 * Piola-Kirchhoff stress P gives node a volume * P g_a. */
#ifndef FLESH_EFFECT_TET_LANES_H
#define FLESH_EFFECT_TET_LANES_H

#include <stddef.h>
#include <string.h>

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

/* A batch's tets. Their shapes are read where they are: copied, most would be stored once more. */
typedef struct tets {
  const int *node; /* of its first tet */
  int first, used, material;
  const flesh_real_at *shape; /* [10]: g_1, g_2, g_3, volume with a sign */
  flesh_real volume;
} tets;

INLINE void load_tets(const flesh_batches *batches, int index, tets *t)
{
  const double *shapes = batches->shapes + (size_t)index * 10 * FLESH_LANES;
  if (index + AHEAD < batches->count)
    for (int k = 0; k < 10 * FLESH_LANES; k += 8) /* a line of 64 bytes each */
      __builtin_prefetch(shapes + (size_t)AHEAD * 10 * FLESH_LANES + k, 0, 0);
  t->shape = (const flesh_real_at *)shapes;
  t->material = batches->material[index];
  t->first = batches->first[index];
  t->used = batches->first[index + 1] - t->first;
  t->node = batches->nodes + 4 * (size_t)t->first;
  t->volume = flesh_abs(t->shape[9]);
}

/* g_a for a = 1, 2, 3. */
INLINE void shape_gradient(const tets *t, int a, flesh_real g[3])
{
  for (int j = 0; j < 3; j++) g[j] = t->shape[3 * (a - 1) + j];
}

/* F = sum over nodes of x_a g_a^T, the deformation gradient of positions, its rate of velocities, and the edges
 * d[a-1] = x_a - x_0 that it is made of. */
INLINE void gradient_of(const tets *t, const double *x, flesh_real d[3][3], flesh_real F[9])
{
  int repeated[4 * FLESH_LANES];
  const int *node = t->node;
  if (t->used < FLESH_LANES) { /* the lanes not used see the last tet */
    for (int l = 0; l < 4 * FLESH_LANES; l++)
      repeated[l] = node[l < 4 * t->used ? l : 4 * t->used - 4 + l % 4];
    node = repeated;
  }
  /* Four numbers are loaded at once, of which a tet's first node, never the mesh's last, has one behind its three, and
   * the others, never the mesh's first, one before. */
  flesh_real x_0[4], x_a[4];
  const double *place[FLESH_LANES];
#pragma GCC unroll 8
  for (int l = 0; l < FLESH_LANES; l++) place[l] = x + 3 * (size_t)node[4 * l];
  flesh_load_four(place, x_0);
#pragma GCC unroll 3
  for (int a = 1; a < 4; a++) {
#pragma GCC unroll 8
    for (int l = 0; l < FLESH_LANES; l++) place[l] = x + 3 * (size_t)node[4 * l + a] - 1;
    flesh_load_four(place, x_a);
    for (int i = 0; i < 3; i++) d[a - 1][i] = x_a[1 + i] - x_0[i];
  }
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      F[3 * i + j] = d[0][i] * t->shape[j] + d[1][i] * t->shape[3 + j] + d[2][i] * t->shape[6 + j];
}

/* Row i of the forces on the nodes, by row i of volume * P. */
INLINE void force_row(const tets *t, int i, const flesh_real P[3], flesh_real f[4][3])
{
  for (int a = 1; a < 4; a++) {
    flesh_real g[3];
    shape_gradient(t, a, g);
    f[a][i] = flesh_vec3_dot(P, g);
  }
  f[0][i] = -(f[1][i] + f[2][i] + f[3][i]);
}

/* Adds a lane's forces to its nodes, x and y together. */
INLINE void add_forces(const tets *t, int lane, double xy[4][2][FLESH_LANES], double z[4][FLESH_LANES], double *r)
{
  for (int a = 0; a < 4; a++) {
    double *place = r + 3 * (size_t)t->node[4 * lane + a];
    *(flesh_two_at *)place += *(const flesh_two_at *)(xy[a][lane & 1] + (lane & ~1));
    place[2] += z[a][lane];
  }
}

/* Adds every lane's forces f [4 nodes][3]. */
static inline void scatter_forces(const tets *t, flesh_real f[4][3], double *r)
{
  double xy[4][2][FLESH_LANES], z[4][FLESH_LANES];
  for (int a = 0; a < 4; a++) {
    flesh_exchange(1, &f[a][0], &f[a][1]);
    *(flesh_real_at *)xy[a][0] = f[a][0]; /* x and y of the even lanes */
    *(flesh_real_at *)xy[a][1] = f[a][1];
    *(flesh_real_at *)z[a] = f[a][2];
  }
  if (t->used == FLESH_LANES) {
#pragma GCC unroll 8
    for (int l = 0; l < FLESH_LANES; l++) add_forces(t, l, xy, z, r);
  } else {
    for (int l = 0; l < t->used; l++) add_forces(t, l, xy, z, r);
  }
}

/* Where a matrix is beyond the caches (that of MANY tets), the blocks of the tets this far ahead are asked for. */
enum { TETS_AHEAD = 16, MANY = 80000 };

INLINE int is_far(const flesh_batches *batches) { return batches->first[batches->count] >= MANY; }

/* Where a batch's blocks are added: pair p of lane l at values + 9 * slot[10 * l + p]. A batch with lanes that are not
 * used has a place of its own at first, so that the others need not ask which are. */
typedef struct blocks {
  const int *slot, *ahead; /* of the batch, and of the one that is asked for meanwhile */
  double *values, *matrix;
  double own[FLESH_LANES * 90];
  int own_slot[FLESH_LANES * 10];
} blocks;

/* Before a batch's blocks are added, and after. */
INLINE void open_blocks(const flesh_batches *batches, const tets *t, const int *slots, double *values, blocks *to)
{
  to->slot = to->ahead = slots + 10 * (size_t)t->first;
  to->values = to->matrix = values;
  if (t->first + TETS_AHEAD + FLESH_LANES <= batches->first[batches->count]) to->ahead += 10 * TETS_AHEAD;
  if (t->used == FLESH_LANES) return;
  for (int k = 0; k < 10 * FLESH_LANES; k++) to->own_slot[k] = k;
  memset(to->own, 0, sizeof to->own);
  to->slot = to->own_slot;
  to->values = to->own;
}

INLINE void close_blocks(const tets *t, const int *slots, const blocks *to)
{
  if (t->used == FLESH_LANES) return;
  const int *slot = slots + 10 * (size_t)t->first;
  for (int k = 0; k < 10 * t->used; k++)
    for (int c = 0; c < 9; c++) to->matrix[9 * (size_t)slot[k] + c] += to->own[9 * k + c];
}

/* Adds every lane's block `pair` to its place. `far`: is_far(batches). */
INLINE void add_block(const flesh_real block[9], int pair, int far, const blocks *to)
{
  flesh_real by_tet[8 / FLESH_LANES][FLESH_LANES];
  for (int part = 0; part < 8 / FLESH_LANES; part++) {
    for (int c = 0; c < FLESH_LANES; c++) by_tet[part][c] = block[part * FLESH_LANES + c];
    flesh_transpose(by_tet[part]);
  }
#pragma GCC unroll 8
  for (int l = 0; l < FLESH_LANES; l++) {
    double *place = to->values + 9 * (size_t)to->slot[10 * l + pair];
    for (int part = 0; part < 8 / FLESH_LANES; part++)
      *(flesh_real_at *)(place + part * FLESH_LANES) += by_tet[part][l];
    place[8] += flesh_lane(block[8], l);
  }
  if (!far) return;
#pragma GCC unroll 8
  for (int l = 0; l < FLESH_LANES; l++) { /* a few at a time, as memory takes them */
    const double *place = to->matrix + 9 * (size_t)to->ahead[10 * l + pair];
    __builtin_prefetch(place, 1);
    __builtin_prefetch(place + 8, 1); /* the other line that it may lie in */
  }
}

/* Adds the six blocks between nodes 1, 2, 3 (11 12 13 22 23 33) and, by the zero row sum, the four of
 * node 0. `slots` are those of all tets. */
static inline void scatter_blocks(const flesh_batches *batches, const tets *t, const flesh_real pair[6][9],
                                  const int *slots, double *values)
{
  const int far = is_far(batches);
  flesh_real k0[3][9], k00[9];
  blocks to;
  open_blocks(batches, t, slots, values, &to);
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
  add_block(k00, 0, far, &to);
  for (int p = 0; p < 3; p++) add_block(k0[p], 1 + p, far, &to);
  for (int p = 0; p < 6; p++) add_block(pair[p], 4 + p, far, &to);
  close_blocks(t, slots, &to);
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
