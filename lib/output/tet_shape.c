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

/* The change of the weights along the edge from corner 0 to corner c + 1. */
static void weights_along(int size, const double L[4], int c, double change[10])
{
  double D[4] = {-1, 0, 0, 0};
  D[c + 1] = 1;
  if (size == 4) memcpy(change, D, sizeof D);
  else flesh_tet10_shape_along(L, D, change);
}

double flesh_tet_gradient(const flesh_mesh *mesh, int tet, const double L[4], const double *x, double F[9])
{
  const double *X = flesh_mesh_positions(mesh);
  double now[9] = {0}, rest[9] = {0}, inverse[9], change[10];
  int nodes[10];
  const int size = flesh_mesh_tet_nodes(mesh, tet, nodes);
  for (int c = 0; c < 3; c++) {
    weights_along(size, L, c, change);
    /* From node 0, as the changes add up to 0. */
    for (int a = 1; a < size; a++)
      for (int d = 0; d < 3; d++) {
        now[3 * d + c] += change[a] * (x[3 * (size_t)nodes[a] + (size_t)d] - x[3 * (size_t)nodes[0] + (size_t)d]);
        rest[3 * d + c] += change[a] * (X[3 * (size_t)nodes[a] + (size_t)d] - X[3 * (size_t)nodes[0] + (size_t)d]);
      }
  }
  const double volume = flesh_mat3_inverse(rest, inverse) / 6;
  flesh_mat3_multiply(now, inverse, F);
  return fabs(volume);
}
