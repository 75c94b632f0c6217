/* tet10_lanes.h: FLESH_LANES ten-node tets side by side for kernels: at a point of quadrature each is a four-node tet of
 * virtual corners, whose forces and blocks go back to the ten nodes.
 *
 * With L_k the barycentric coordinates of the point, x_i the corners and x_ik the nodes on edges,
 *
 *   F = sum over i of y_i g_i^T,   y_i = (4 L_i - 1) x_i + 4 sum over k != i of L_k x_ik,
 *
 * as grad N_i = (4 L_i - 1) g_i and grad N_ik = 4 (L_k g_i + L_i g_k). Of a straight tet the g_i are the gradients of
 * its corners' linear shape functions, the same at every point; of a curved one those of the four-node tet whose
 * corners are the virtual corners Y_i of the mesh's positions.
 *
 * Points are the four of degree 2 (Hammer, Marlowe & Stroud 1956) with L_q = a at point q and b elsewhere, so that a
 * node weighs at a virtual corner the same at all points, but for one at which it weighs 4 (a - b) more:
 *
 *   y_i at q = [(4 b - 1) x_i + 4 b sum over k of x_ik] + 4 (a - b) x_iq,   x_ii = x_i. */
#ifndef FLESH_ELEMENT_TET10_LANES_H
#define FLESH_ELEMENT_TET10_LANES_H

#define ELEMENT_NODES 10

#include "element/tet10.h"
#include "element/tet_lanes.h"

enum { POINTS = FLESH_TET10_POINTS };

/* 4 (a - b), and what corners and nodes on edges weigh everywhere: 4 b - 1, 4 b. */
static const double own_weight = 4 * (FLESH_TET10_NEAR - FLESH_TET10_FAR), corner_weight = 4 * FLESH_TET10_FAR - 1,
                    edge_weight = 4 * FLESH_TET10_FAR;

/* The number in a tet of x_ik. */
static const unsigned char node_of[4][4] = {{0, 4, 5, 6}, {4, 1, 7, 8}, {5, 7, 2, 9}, {6, 8, 9, 3}};

/* The shape of the batch's tets at a point, with the share of the volume that is the point's. */
INLINE void load_point(const flesh_batches *batches, int index, int q, tets *t)
{
  if (q == 0) load_tets(batches, index, t);
  const int each = batches->shapes_per_tet;
  t->shape = (const flesh_real_at *)(batches->shapes + ((size_t)index * (size_t)each + (size_t)(each > 1 ? q : 0)) *
                                                           10 * FLESH_LANES);
  t->volume = flesh_abs(t->shape[9]) * (1. / POINTS);
}

/* Vectors of a batch's nodes from x_0, and of each corner what all points have in common. */
typedef struct ten {
  flesh_real node[10][3], common[4][3];
} ten;

INLINE void load_ten(const tets *t, const double *x, ten *all)
{
  const double *place[10][FLESH_LANES];
#pragma GCC unroll 10
  for (int a = 0; a < 10; a++)
#pragma GCC unroll 8
    for (int l = 0; l < FLESH_LANES; l++) place[a][l] = x + t->node[10 * l + a];
  for (int i = 0; i < 3; i++) all->node[0][i] = flesh_all(0);
#pragma GCC unroll 9
  for (int a = 1; a < 10; a++) {
    flesh_real edge[4];
    flesh_load_from(place[0], place[a], edge);
    for (int i = 0; i < 3; i++) all->node[a][i] = edge[i];
  }
  for (int a = 0; a < 4; a++)
    for (int i = 0; i < 3; i++) {
      flesh_real sum = flesh_all(0);
      for (int k = 0; k < 4; k++)
        if (k != a) sum += all->node[node_of[a][k]][i];
      all->common[a][i] = corner_weight * all->node[a][i] + edge_weight * sum;
    }
}

/* Edges of virtual corners d[a-1] = y_a - y_0 at point q. */
INLINE void virtual_edges(const ten *all, int q, flesh_real d[3][3])
{
  for (int a = 1; a < 4; a++)
    for (int i = 0; i < 3; i++)
      d[a - 1][i] = all->common[a][i] - all->common[0][i] +
                    own_weight * (all->node[node_of[a][q]][i] - all->node[node_of[0][q]][i]);
}

/* The gradient at point q. */
INLINE void gradient_at(const tets *t, const ten *all, int q, flesh_real d[3][3], flesh_real F[9])
{
  virtual_edges(all, q, d);
  gradient_of_edges(t, d, F);
}

/* Forces on virtual corners, summed over the points, and what the ten nodes get of them. */
typedef struct ten_forces {
  flesh_real common[4][3], node[10][3];
} ten_forces;

INLINE void open_forces(ten_forces *to)
{
  for (int a = 0; a < 10; a++)
    for (int i = 0; i < 3; i++) {
      if (a < 4) to->common[a][i] = flesh_all(0);
      to->node[a][i] = flesh_all(0);
    }
}

INLINE void add_virtual_forces(flesh_real f[4][3], int q, ten_forces *to)
{
  for (int a = 0; a < 4; a++)
    for (int i = 0; i < 3; i++) {
      to->common[a][i] += f[a][i];
      to->node[node_of[a][q]][i] += own_weight * f[a][i];
    }
}

INLINE void close_forces(ten_forces *to)
{
  for (int a = 0; a < 4; a++)
    for (int i = 0; i < 3; i++) {
      to->node[a][i] += corner_weight * to->common[a][i];
      for (int k = a + 1; k < 4; k++) to->node[node_of[a][k]][i] += edge_weight * (to->common[a][i] + to->common[k][i]);
    }
}

/* Blocks between virtual corners: of the pairs 01 02 03 12 13 23, then of the corners with themselves; of each point,
 * and their sums. */
enum { VIRTUAL_PAIRS = 6, VIRTUAL_BLOCKS = 10 };
typedef struct virtual_blocks {
  flesh_real point[POINTS][VIRTUAL_BLOCKS][9], sum[VIRTUAL_BLOCKS][9];
} virtual_blocks;

/* The number of virtual corners' block; where i > j it is that of j and i, transposed. */
static const unsigned char block_of[4][4] = {{6, 0, 1, 2}, {0, 7, 3, 4}, {1, 3, 8, 5}, {2, 4, 5, 9}};

/* As of true_blocks; `to` is virtual_blocks.point[q]. */
INLINE void keep_block(const tets *t, const flesh_real block[9], int pair, void *to)
{
  (void)t;
  for (int c = 0; c < 9; c++) ((flesh_real(*)[9])to)[pair][c] = block[c];
}

/* Those of corners with themselves from the others: equal vectors at all corners have no forces. */
static COMPILED_ONCE void close_blocks(virtual_blocks *of)
{
  for (int k = 0; k < VIRTUAL_BLOCKS; k++)
    for (int c = 0; c < 9; c++) of->sum[k][c] = flesh_all(0);
  for (int q = 0; q < POINTS; q++) {
    flesh_real(*K)[9] = of->point[q];
    for (int a = 0; a < 4; a++) {
      flesh_real own[9];
      for (int c = 0; c < 9; c++) own[c] = flesh_all(0);
      for (int k = 0; k < 4; k++)
        for (int c = 0; k != a && c < 9; c++) own[c] -= K[block_of[a][k]][k > a ? c : 3 * (c % 3) + c / 3];
      for (int c = 0; c < 9; c++) K[VIRTUAL_PAIRS + a][c] = own[c];
    }
    for (int k = 0; k < VIRTUAL_BLOCKS; k++)
      for (int c = 0; c < 9; c++) of->sum[k][c] += K[k][c];
  }
}

INLINE void add_times(double factor, const flesh_real block[9], int transposed, flesh_real K[9])
{
  if (transposed)
    for (int c = 0; c < 9; c++) K[c] += factor * block[3 * (c % 3) + c / 3];
  else
    for (int c = 0; c < 9; c++) K[c] += factor * block[c];
}

/* What a node has to do with virtual corners: itself where it is a corner, else the two ends of its edge. Each
 * corner's `partner` is the point at which the node weighs more there. */
typedef struct ten_support {
  int count;
  double weight; /* at all points */
  unsigned char corner[2], partner[2];
} ten_support;

static const ten_support support_of[10] = {
    {1, 4 * FLESH_TET10_FAR - 1, {0}, {0}}, {1, 4 * FLESH_TET10_FAR - 1, {1}, {1}},
    {1, 4 * FLESH_TET10_FAR - 1, {2}, {2}}, {1, 4 * FLESH_TET10_FAR - 1, {3}, {3}},
    {2, 4 * FLESH_TET10_FAR, {0, 1}, {1, 0}}, {2, 4 * FLESH_TET10_FAR, {0, 2}, {2, 0}},
    {2, 4 * FLESH_TET10_FAR, {0, 3}, {3, 0}}, {2, 4 * FLESH_TET10_FAR, {1, 2}, {2, 1}},
    {2, 4 * FLESH_TET10_FAR, {1, 3}, {3, 1}}, {2, 4 * FLESH_TET10_FAR, {2, 3}, {3, 2}}};

/* K += the block of nodes a and b: with w_a and w_b what they weigh at virtual corners i and j at all points, and o
 * more at points k and l,   w_a w_b sum_ij + w_a o K_ij at l + w_b o K_ij at k + [k = l] o^2 K_ij at k. */
INLINE void block_of_nodes(const virtual_blocks *of, const ten_support *a, const ten_support *b, flesh_real K[9])
{
#pragma GCC unroll 2
  for (int m = 0; m < a->count; m++)
#pragma GCC unroll 2
    for (int n = 0; n < b->count; n++) {
      const int i = a->corner[m], k = a->partner[m], j = b->corner[n], l = b->partner[n];
      const int block = block_of[i][j], transposed = i > j;
      double at_k = b->weight * own_weight;
      add_times(a->weight * b->weight, of->sum[block], transposed, K);
      if (k == l) at_k += a->weight * own_weight + own_weight * own_weight;
      else add_times(a->weight * own_weight, of->point[l][block], transposed, K);
      add_times(at_k, of->point[k][block], transposed, K);
    }
}

/* Adds the blocks of all pairs of different nodes to those of the tile, and scale times a_i a_j^T of a vector of each
 * node where `a` is not NULL. */
INLINE void add_blocks(const tets *t, const virtual_blocks *of, flesh_real scale, flesh_real (*a)[3], tile_blocks *to)
{
#pragma GCC unroll 10
  for (int m = 0, pair = 0; m < 10; m++)
#pragma GCC unroll 10
    for (int n = m + 1; n < 10; n++, pair++) {
      flesh_real K[9];
      for (int c = 0; c < 9; c++) K[c] = a ? scale * a[m][c / 3] * a[n][c % 3] : flesh_all(0);
      block_of_nodes(of, &support_of[m], &support_of[n], K);
      add_block(t, K, pair, to);
    }
}

#endif
