/* pressure_field.h: how much the pressures of neighbouring tets differ: a measure of checkerboard patterns. */
#ifndef FLESH_TEST_PRESSURE_FIELD_H
#define FLESH_TEST_PRESSURE_FIELD_H

#include <math.h>
#include <stdlib.h>

#include "tet_integrals.h"

/* Returns the mean over tet t of J = det(dx/dX), minus 1, at the element's own points, four or one, which are exact to
 * degree 2. */
static inline double mean_dilation(const flesh_mesh *mesh, const double *x, int t)
{
  static const int ends[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  const double *X = flesh_mesh_positions(mesh);
  double volume[2] = {0, 0};
  int node[10];
  const int count = test_tet_nodes(mesh, t, node);
  const int points = count == 4 ? 1 : 4;
  for (int q = 0; q < points; q++) {
    const double far = points == 1 ? 0.25 : 0.1381966011250105, near = 1 - 3 * far, w = 1. / points;
    double L[4], slope[10][3];
    for (int a = 0; a < 4; a++) L[a] = a == q ? near : far;
    /* Derivatives by L[1], L[2], L[3], with L[0] = 1 - L[1] - L[2] - L[3]. */
    for (int a = 0; a < count; a++)
      for (int c = 0; c < 3; c++) {
        const double by[4] = {-1, c == 0, c == 1, c == 2};
        if (a < 4) {
          slope[a][c] = by[a] * (count == 4 ? 1 : 4 * L[a] - 1);
        } else {
          const int i = ends[a - 4][0], j = ends[a - 4][1];
          slope[a][c] = 4 * (by[i] * L[j] + L[i] * by[j]);
        }
      }
    for (int k = 0; k < 2; k++) {
      const double *at = k ? x : X;
      double G[3][3] = {{0}};
      for (int a = 0; a < count; a++)
        for (int p = 0; p < 9; p++) G[p / 3][p % 3] += at[3 * node[a] + p / 3] * slope[a][p % 3];
      volume[k] += w * (G[0][0] * (G[1][1] * G[2][2] - G[1][2] * G[2][1]) -
                        G[0][1] * (G[1][0] * G[2][2] - G[1][2] * G[2][0]) +
                        G[0][2] * (G[1][0] * G[2][1] - G[1][1] * G[2][0]));
    }
  }
  return volume[1] / volume[0] - 1;
}

/* Returns the difference of the pressures of neighbouring tets, in shear moduli. With p the means of lambda (J - 1)
 * over the tets, q their averages over the tets at a corner, weighted by volume, and s the mean of q over a tet's
 * corners, it is the root mean square of p - s over the body, over mu. For smooth pressures p - s is of the order of
 * the size of the tets. For a checkerboard s is near 0, so p - s is nearly p and does not fall under refinement. */
static inline double pressure_noise(const flesh_mesh *mesh, const double *x, double lambda, double mu)
{
  const int tets = flesh_mesh_tet_count(mesh), nodes = flesh_mesh_node_count(mesh);
  const double *V = flesh_mesh_tet_volumes(mesh);
  const int *corner = flesh_mesh_tets(mesh);
  double *p = malloc((size_t)tets * sizeof *p), *q = calloc((size_t)nodes, sizeof *q);
  double *share = calloc((size_t)nodes, sizeof *share), all = 0, noise = 0;
  for (int t = 0; t < tets; t++) {
    p[t] = lambda * mean_dilation(mesh, x, t);
    all += V[t];
    for (int a = 0; a < 4; a++) {
      q[corner[4 * t + a]] += V[t] * p[t];
      share[corner[4 * t + a]] += V[t];
    }
  }
  for (int t = 0; t < tets; t++) {
    double s = 0;
    for (int a = 0; a < 4; a++) s += q[corner[4 * t + a]] / share[corner[4 * t + a]] / 4;
    noise += V[t] * (p[t] - s) * (p[t] - s);
  }
  free(p);
  free(q);
  free(share);
  return sqrt(noise / all) / mu;
}

#endif
