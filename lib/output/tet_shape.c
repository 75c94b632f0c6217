/* tet_shape.c: positions and deformation gradients at points of tets of four and ten nodes. */
#include "output/tet_shape.h"

#include <math.h>
#include <string.h>

#include "math/mat3.h"
#include "mesh/pieces.h"
#include "mesh/shape.h"

int flesh_tet_weights(const flesh_mesh *mesh, int tet, const double L[4], int nodes[10], double weights[10])
{
  const int size = flesh_mesh_tet_nodes(mesh, tet, nodes);
  if (size == 4) memcpy(weights, L, 4 * sizeof *weights);
  else flesh_tet10_weights(L, weights);
  return size;
}

/* Computes the derivative of the weights along the edge from corner 0 to corner c + 1. */
static void weights_along(int size, const double L[4], int c, double change[10])
{
  double D[4] = {-1, 0, 0, 0};
  D[c + 1] = 1;
  if (size == 4) memcpy(change, D, sizeof D);
  else flesh_tet10_shape_along(L, D, change);
}

/* Computes D, the derivatives of x [3*n] along the tet's edges from corner 0. */
static void gradient_along(const flesh_mesh *mesh, int tet, const double L[4], const double *x, double D[9])
{
  double change[10];
  int nodes[10];
  const int size = flesh_mesh_tet_nodes(mesh, tet, nodes);
  memset(D, 0, 9 * sizeof *D);
  for (int c = 0; c < 3; c++) {
    weights_along(size, L, c, change);
    /* Differences from node 0 suffice, as the changes add up to 0. */
    for (int a = 1; a < size; a++)
      for (int d = 0; d < 3; d++)
        D[3 * d + c] += change[a] * (x[3 * (size_t)nodes[a] + (size_t)d] - x[3 * (size_t)nodes[0] + (size_t)d]);
  }
}

double flesh_tet_gradient(const flesh_mesh *mesh, int tet, const double L[4], const double *x, double F[9])
{
  double now[9], rest[9], inverse[9];
  gradient_along(mesh, tet, L, x, now);
  gradient_along(mesh, tet, L, flesh_mesh_positions(mesh), rest);
  const double volume = flesh_mat3_inverse(rest, inverse) / 6;
  flesh_mat3_multiply(now, inverse, F);
  return fabs(volume);
}

void flesh_tet_gradient_back(const flesh_mesh *mesh, int tet, const double L[4], const double by_F[9], double *by_x)
{
  double rest[9], inverse[9], by_now[9], change[10];
  int nodes[10];
  const int size = flesh_mesh_tet_nodes(mesh, tet, nodes);
  gradient_along(mesh, tet, L, flesh_mesh_positions(mesh), rest);
  flesh_mat3_inverse(rest, inverse);
  flesh_mat3_multiply_transposed(by_F, inverse, by_now);
  for (int c = 0; c < 3; c++) {
    weights_along(size, L, c, change);
    for (int k = 0; k < 3 * size; k++)
      by_x[3 * (size_t)nodes[k / 3] + (size_t)(k % 3)] += change[k / 3] * by_now[3 * (k % 3) + c];
  }
}
