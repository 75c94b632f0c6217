/* shape.h: the shape functions of the ten-node tet, nodes in VTK's order. */
#ifndef FLESH_MESH_SHAPE_H
#define FLESH_MESH_SHAPE_H

#include "mesh/edges.h"

/* Computes the shape functions at barycentric L: L_i (2 L_i - 1) at corners, 4 L_i L_j on edges. */
static inline void flesh_tet10_shape(const double L[4], double N[10])
{
  for (int i = 0; i < 4; i++) N[i] = L[i] * (2 * L[i] - 1);
  for (int k = 0; k < 6; k++) N[4 + k] = 4 * L[flesh_edge_corners[k][0]] * L[flesh_edge_corners[k][1]];
}

/* Computes their derivative at L along the direction D, whose sum is 0. */
static inline void flesh_tet10_shape_along(const double L[4], const double D[4], double N[10])
{
  for (int i = 0; i < 4; i++) N[i] = D[i] * (4 * L[i] - 1);
  for (int k = 0; k < 6; k++) {
    const int i = flesh_edge_corners[k][0], j = flesh_edge_corners[k][1];
    N[4 + k] = 4 * (L[i] * D[j] + L[j] * D[i]);
  }
}

/* Computes the weights of the ten nodes at L, also outside the tet. There the map is continued linearly from the point
 * at which the negative coordinates of L are cut off: this is exact if the map is affine, and does not bend away
 * otherwise. */
static inline void flesh_tet10_weights(const double L[4], double N[10])
{
  double cut[4], D[4], sum = 0, along[10];
  for (int i = 0; i < 4; i++) sum += cut[i] = L[i] > 0 ? L[i] : 0;
  for (int i = 0; i < 4; i++) {
    if (sum > 1) cut[i] /= sum;
    D[i] = L[i] - cut[i];
  }
  flesh_tet10_shape(cut, N);
  if (!(sum > 1)) return;
  flesh_tet10_shape_along(cut, D, along);
  for (int a = 0; a < 10; a++) N[a] += along[a];
}

#endif
