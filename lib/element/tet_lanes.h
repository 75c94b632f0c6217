/* tet_lanes.h: FLESH_LANES tets side by side for kernels: computes gradients in the tets from the vectors of a tile's
 * nodes, and adds forces and blocks to the tile's nodes and their pairs.
 *
 * With the tet's nodes x_a and the gradients g_a of its shape functions, F = sum x_a g_a^T; a first Piola-Kirchhoff
 * stress P gives node a volume * P g_a. */
#ifndef FLESH_ELEMENT_TET_LANES_H
#define FLESH_ELEMENT_TET_LANES_H

#include <stddef.h>

#include "base/isa.h"
#include "base/unroll.h"
#include "element/tile.h"
#include "math/mat3.h"

/* Forbids variants of a function: if all callers use the same fused products and sums, the bits do not depend on what a
 * caller asks for. */
#ifdef __clang__
#define COMPILED_ONCE __attribute__((noinline))
#else
#define COMPILED_ONCE __attribute__((noinline, noclone))
#endif

extern const flesh_tet_kernel FLESH_OF_ISA(flesh_elastic), FLESH_OF_ISA(flesh_stiffness),
    FLESH_OF_ISA(flesh_viscous), FLESH_OF_ISA(flesh_elastic10), FLESH_OF_ISA(flesh_elastic10_mean),
    FLESH_OF_ISA(flesh_stiffness10), FLESH_OF_ISA(flesh_viscous10), FLESH_OF_ISA(flesh_gaps10_mean),
    FLESH_OF_ISA(flesh_fibre4), FLESH_OF_ISA(flesh_fibre10);

/* Number of batches by which shapes are prefetched. As they are read once per pass, they must not displace other data
 * from the caches. */
#define AHEAD 4

/* A batch's tets. Their shapes are read in place, as most of a copy would be stored again. */
typedef struct tets {
  const uint16_t *node, *pair; /* of the first lane */
  int material;
  const flesh_real_at *shape; /* [10]: g_1, g_2, g_3, signed volume */
  flesh_real volume;
} tets;

INLINE void load_tets(const flesh_batches *batches, int index, tets *t)
{
  const double *shapes = batches->shapes + (size_t)index * 10 * FLESH_LANES;
  if (index + AHEAD < batches->count)
    for (int k = 0; k < 10 * FLESH_LANES; k += 8) /* cache lines of 64 bytes */
      __builtin_prefetch(shapes + (size_t)AHEAD * 10 * FLESH_LANES + k, 0, 0);
  t->shape = (const flesh_real_at *)shapes;
  t->material = batches->material[index];
  t->node = batches->tiles.nodes + (size_t)index * ELEMENT_NODES * FLESH_LANES;
  t->pair = batches->tiles.pairs + (size_t)index * ELEMENT_PAIRS * FLESH_LANES;
  t->volume = flesh_abs(t->shape[9]);
}

/* Gives g_a for a = 1, 2, 3. */
INLINE void shape_gradient(const tets *t, int a, flesh_real g[3])
{
  for (int j = 0; j < 3; j++) g[j] = t->shape[3 * (a - 1) + j];
}

/* Computes F from the edges d[a-1] = x_a - x_0. */
INLINE void gradient_of_edges(const tets *t, flesh_real d[3][3], flesh_real F[9])
{
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      F[3 * i + j] = d[0][i] * t->shape[j] + d[1][i] * t->shape[3 + j] + d[2][i] * t->shape[6 + j];
}

/* Computes the edges from a tile's positions. */
INLINE void edges_of(const tets *t, const double *x, flesh_real d[3][3])
{
  const double *place[4][FLESH_LANES];
  FLESH_UNROLL(4)
  for (int a = 0; a < 4; a++)
    FLESH_UNROLL(8)
    for (int l = 0; l < FLESH_LANES; l++) place[a][l] = x + t->node[ELEMENT_NODES * l + a];
  FLESH_UNROLL(3)
  for (int a = 1; a < 4; a++) {
    flesh_real edge[4];
    flesh_load_from(place[0], place[a], edge);
    for (int i = 0; i < 3; i++) d[a - 1][i] = edge[i];
  }
}

/* Computes F = sum over nodes of x_a g_a^T and the edges used for it: the deformation gradient from a tile's positions,
 * or its rate from velocities. */
INLINE void gradient_of(const tets *t, const double *x, flesh_real d[3][3], flesh_real F[9])
{
  edges_of(t, x, d);
  gradient_of_edges(t, d, F);
}

/* Vectors of a tile; those that are not needed are not set. */
typedef struct nearby {
  tile_vector x, v, x_frozen, v_frozen;
} nearby;

INLINE void gather(const flesh_tiles *tiles, int tile, const flesh_tet_point *at, nearby *tile_of)
{
  if (at->x) tile_gather(tiles, tile, at->x, tile_of->x);
  if (at->v) tile_gather(tiles, tile, at->v, tile_of->v);
  if (at->x_frozen) tile_gather(tiles, tile, at->x_frozen, tile_of->x_frozen);
  if (at->x_frozen && at->v_frozen) tile_gather(tiles, tile, at->v_frozen, tile_of->v_frozen);
}

/* Computes row i of the forces on the nodes from row i of volume * P. */
INLINE void force_row(const tets *t, int i, const flesh_real P[3], flesh_real f[4][3])
{
  for (int a = 1; a < 4; a++) {
    flesh_real g[3];
    shape_gradient(t, a, g);
    f[a][i] = flesh_vec3_dot(P, g);
  }
  f[0][i] = -(f[1][i] + f[2][i] + f[3][i]);
}

/* Adds the forces f [nodes][3] of every lane to those of its tile. */
INLINE void scatter_forces(const tets *t, flesh_real f[ELEMENT_NODES][3], double *r)
{
  FLESH_UNROLL(10)
  for (int a = 0; a < ELEMENT_NODES; a++) {
    flesh_real v[4] = {f[a][0], f[a][1], f[a][2], flesh_all(0)};
    double *place[FLESH_LANES];
    FLESH_UNROLL(8)
    for (int l = 0; l < FLESH_LANES; l++) place[l] = r + t->node[ELEMENT_NODES * l + a];
    flesh_add_four(place, v);
  }
}

/* Takes the block of a pair of different nodes: adds it to the tile or keeps it. */
typedef void take_block(const tets *t, const flesh_real block[9], int pair, void *to);

/* Adds every lane's block of a pair of different nodes (01 02 03 ... 12 13 ...) to those of its tile. */
INLINE void add_block(const tets *t, const flesh_real block[9], int pair, void *to)
{
  tile_blocks *own = to;
  flesh_real by_tet[8 / FLESH_LANES][FLESH_LANES];
  for (int part = 0; part < 8 / FLESH_LANES; part++) {
    for (int c = 0; c < FLESH_LANES; c++) by_tet[part][c] = block[part * FLESH_LANES + c];
    flesh_transpose(by_tet[part]);
  }
  FLESH_UNROLL(8)
  for (int l = 0; l < FLESH_LANES; l++) {
    const size_t place = t->pair[ELEMENT_PAIRS * l + pair];
    for (int part = 0; part < 8 / FLESH_LANES; part++)
      *(flesh_real_at *)(own->eight + place + part * FLESH_LANES) += by_tet[part][l];
    *(double *)((char *)own->ninth + place) += flesh_lane(block[8], l);
  }
}

/* Functions that add a batch's forces, unless NULL, and with_sums its energy and the size of the energy's terms; and
 * that add its blocks. */
typedef int add_forces(const flesh_batches *batches, int index, const flesh_tet_point *at, const nearby *near,
                       double *forces, int with_sums, flesh_real sums[2]);
typedef int add_matrix(const flesh_batches *batches, int index, const flesh_tet_point *at, const nearby *near,
                       tile_blocks *to);

INLINE int tile_residual(const flesh_batches *batches, int tile, const flesh_tet_point *at, add_forces *add, double *r,
                         double *sums)
{
  const flesh_tiles *tiles = &batches->tiles;
  flesh_real own[2] = {flesh_all(0), flesh_all(0)};
  nearby near;
  tile_vector forces;
  gather(tiles, tile, at, &near);
  if (r) tile_clear(tiles, tile, forces);
  for (int k = tiles->batch[tile]; k < tiles->batch[tile + 1]; k++) {
    int status = add(batches, k, at, &near, r ? forces : NULL, sums != NULL, own);
    if (status) return status;
  }
  if (r) tile_add(tiles, tile, forces, r);
  for (int l = 0; sums && l < FLESH_LANES; l++)
    for (int k = 0; k < 2; k++) sums[k] += flesh_lane(own[k], l);
  return FLESH_OK;
}

INLINE int tile_hessian(const flesh_batches *batches, int tile, const flesh_tet_point *at, add_matrix *add,
                        const int *slots, double *values)
{
  const flesh_tiles *tiles = &batches->tiles;
  nearby near;
  tile_blocks own;
  if (at->x) gather(tiles, tile, at, &near);
  tile_open(tiles, tile, &own);
  for (int k = tiles->batch[tile]; k < tiles->batch[tile + 1]; k++) {
    int status = add(batches, k, at, &near, &own);
    if (status) return status;
    tile_expect(tiles, tile, k, slots, values);
  }
  tile_close(tiles, tile, &own, at->assign, slots, values);
  return FLESH_OK;
}

/* Defines a kernel of this name from the function for a batch. */
#define RESIDUAL_KERNEL(name, add)                                                                            \
  static COMPILED_ONCE int name(const flesh_batches *batches, int tile, const flesh_tet_point *at, double *r, \
                                double *sums)                                                                 \
  {                                                                                                           \
    return tile_residual(batches, tile, at, add, r, sums);                                                    \
  }
#define HESSIAN_KERNEL(name, add)                                                                           \
  static int name(const flesh_batches *batches, int tile, const flesh_tet_point *at, const int *slots,      \
                  double *values)                                                                           \
  {                                                                                                         \
    return tile_hessian(batches, tile, at, add, slots, values);                                             \
  }

#endif
