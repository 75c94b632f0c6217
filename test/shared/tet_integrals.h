/* tet_integrals.h: integrals over straight tets and flat faces, exact for polynomials of degree 7, and shape functions
 * of four and ten nodes, written independently of the library. */
#ifndef FLESH_TEST_TET_INTEGRALS_H
#define FLESH_TEST_TET_INTEGRALS_H

#include "flesh/mesh.h"

enum { TEST_GAUSS = 5, TEST_TET_POINTS = TEST_GAUSS * TEST_GAUSS * TEST_GAUSS,
       TEST_FACE_POINTS = TEST_GAUSS * TEST_GAUSS };

/* Gauss-Legendre points on [0,1]. */
static const double test_gauss_at[TEST_GAUSS] = {0.046910077030668004, 0.23076534494715845, 0.5, 0.76923465505284155,
                                                 0.95308992296933200};
static const double test_gauss_weight[TEST_GAUSS] = {0.11846344252809454, 0.23931433524968324, 0.28444444444444444,
                                                     0.23931433524968324, 0.11846344252809454};

/* Computes point q of the rule for a tet: its barycentric coordinates L [4]. Returns its weight in the volume. The rule
 * is that of a cube collapsed to a corner and an edge. */
static inline double test_tet_point(int q, double L[4])
{
  const int i = q % TEST_GAUSS, j = q / TEST_GAUSS % TEST_GAUSS, k = q / TEST_GAUSS / TEST_GAUSS;
  const double a = test_gauss_at[i], b = test_gauss_at[j], c = test_gauss_at[k];
  L[1] = a;
  L[2] = b * (1 - a);
  L[3] = c * (1 - a) * (1 - b);
  L[0] = (1 - a) * (1 - b) * (1 - c);
  return 6 * test_gauss_weight[i] * test_gauss_weight[j] * test_gauss_weight[k] * (1 - a) * (1 - a) * (1 - b);
}

/* Computes point q of the rule for the face opposite corner `across`. Returns its weight in the area. */
static inline double test_face_point(int q, int across, double L[4])
{
  const int i = q % TEST_GAUSS, j = q / TEST_GAUSS;
  const double a = test_gauss_at[i], b = test_gauss_at[j];
  L[across] = 0;
  L[(across + 1) % 4] = a;
  L[(across + 2) % 4] = b * (1 - a);
  L[(across + 3) % 4] = (1 - a) * (1 - b);
  return 2 * test_gauss_weight[i] * test_gauss_weight[j] * (1 - a);
}

/* Copies the nodes [4 or 10] of tet t. Returns their number. */
static inline int test_tet_nodes(const flesh_mesh *mesh, int t, int node[10])
{
  for (int a = 0; a < 4; a++) node[a] = flesh_mesh_tets(mesh)[4 * t + a];
  if (flesh_mesh_order(mesh) == 1) return 4;
  for (int a = 0; a < 6; a++) node[4 + a] = flesh_mesh_tet_edges(mesh)[6 * t + a];
  return 10;
}

/* Computes the shape functions of `count` nodes at L, with edges 01, 12, 02, 03, 13, 23. */
static inline void test_shape(int count, const double L[4], double N[10])
{
  static const int ends[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  for (int a = 0; a < 4; a++) N[a] = count == 4 ? L[a] : L[a] * (2 * L[a] - 1);
  for (int a = 4; a < count; a++) N[a] = 4 * L[ends[a - 4][0]] * L[ends[a - 4][1]];
}

/* Computes the position at L in a straight tet with its corners at `positions`. */
static inline void test_tet_place(const double *positions, const int node[4], const double L[4], double X[3])
{
  for (int c = 0; c < 3; c++) {
    X[c] = 0;
    for (int a = 0; a < 4; a++) X[c] += L[a] * positions[3 * node[a] + c];
  }
}

#endif
