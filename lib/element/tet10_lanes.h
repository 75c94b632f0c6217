/* tet10_lanes.h: FLESH_LANES ten-node tets side by side for kernels: at a quadrature point each is a four-node tet of
 * virtual corners, whose forces and blocks are distributed to the ten nodes.
 *
 * With the barycentric coordinates L_k of the point, the corners x_i and the nodes on edges x_ik,
 *
 *   F = sum over i of y_i g_i^T,   y_i = (4 L_i - 1) x_i + 4 sum over k != i of L_k x_ik,
 *
 * as grad N_i = (4 L_i - 1) g_i and grad N_ik = 4 (L_k g_i + L_i g_k). For a straight tet the g_i are the gradients of
 * its corners' linear shape functions, the same at every point; for a curved tet those of the four-node tet whose
 * corners are the virtual corners Y_i of the mesh's positions.
 *
 * The points are the four of degree 2 (Hammer, Marlowe & Stroud 1956) with L_q = a at point q and b elsewhere. A node
 * thus has the same weight in a virtual corner at all points except one, at which its weight is larger by 4 (a - b):
 *
 *   y_i at q = [(4 b - 1) x_i + 4 b sum over k of x_ik] + 4 (a - b) x_iq,   x_ii = x_i. */
#ifndef FLESH_ELEMENT_TET10_LANES_H
#define FLESH_ELEMENT_TET10_LANES_H

#define ELEMENT_NODES 10

#include "element/tet_lanes.h"
#include "mesh/tet10.h"

enum { POINTS = FLESH_TET10_POINTS };

/* Weights: 4 (a - b) at a node's own point, and 4 b - 1 and 4 b of corners and nodes on edges at all points. */
static const double own_weight = 4 * (FLESH_TET10_NEAR - FLESH_TET10_FAR), corner_weight = 4 * FLESH_TET10_FAR - 1,
                    edge_weight = 4 * FLESH_TET10_FAR;

/* Index in a tet of x_ik. */
static const unsigned char node_of[4][4] = {{0, 4, 5, 6}, {4, 1, 7, 8}, {5, 7, 2, 9}, {6, 8, 9, 3}};

/* Loads the shape of the batch's tets at a point, with the point's share of the volume. */
INLINE void load_point(const flesh_batches *batches, int index, int q, tets *t)
{
  if (q == 0) load_tets(batches, index, t);
  const int each = batches->shapes_per_tet;
  t->shape = (const flesh_real_at *)(batches->shapes + ((size_t)index * (size_t)each + (size_t)(each > 1 ? q : 0)) *
                                                           10 * FLESH_LANES);
  t->volume = flesh_abs(t->shape[9]) * (1. / POINTS);
}

/* Vectors at a batch's nodes relative to x_0, and for each corner the part of the virtual corner that is the same at
 * all points. */
typedef struct ten {
  flesh_real node[10][3], common[4][3];
} ten;

INLINE void load_ten(const tets *t, const double *x, ten *all)
{
  const double *place[10][FLESH_LANES];
  FLESH_UNROLL(10)
  for (int a = 0; a < 10; a++)
    FLESH_UNROLL(8)
    for (int l = 0; l < FLESH_LANES; l++) place[a][l] = x + t->node[10 * l + a];
  for (int i = 0; i < 3; i++) all->node[0][i] = flesh_all(0);
  FLESH_UNROLL(9)
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

/* Computes the edges of virtual corners d[a-1] = y_a - y_0 at point q. */
INLINE void virtual_edges(const ten *all, int q, flesh_real d[3][3])
{
  for (int a = 1; a < 4; a++)
    for (int i = 0; i < 3; i++)
      d[a - 1][i] = all->common[a][i] - all->common[0][i] +
                    own_weight * (all->node[node_of[a][q]][i] - all->node[node_of[0][q]][i]);
}

/* Computes the gradient at point q. */
INLINE void gradient_at(const tets *t, const ten *all, int q, flesh_real d[3][3], flesh_real F[9])
{
  virtual_edges(all, q, d);
  gradient_of_edges(t, d, F);
}

/* Forces on virtual corners summed over the points, and the forces on the ten nodes. */
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

#endif
