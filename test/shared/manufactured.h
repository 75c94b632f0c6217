/* manufactured.h: a large smooth motion of the unit cube, and the body force and tractions under which a body of form S
 * is in equilibrium in it, from exact derivatives (jet.h).
 *
 * The motion is X + swell w(X) followed by three shears, each along one axis by a function of the other two
 * coordinates, which preserve every volume. So J is 1 if swell is 0, and lambda (J-1) is of the order of mu if swell is
 * about mu/lambda. */
#ifndef FLESH_TEST_MANUFACTURED_H
#define FLESH_TEST_MANUFACTURED_H

#include <stdlib.h>

#include "body.h"
#include "jet.h"
#include "tet_integrals.h"
#include "test.h"

typedef struct manufactured {
  double shear, swell;
} manufactured;

/* Shears along axis c by shear sin(k y_i + ..) sin(.. y_j + ..). */
static inline void manufactured_shear(double shear, int c, double k, double phase, jet y[3])
{
  const jet wave = jet_product(jet_sine(k, y[(c + 1) % 3], phase), jet_sine(k - 0.4, y[(c + 2) % 3], 0.7 - phase));
  y[c] = jet_sum(1, y[c], shear, wave);
}

/* Computes the position of X with its derivatives. */
static inline void manufactured_place(const manufactured *m, const double X[3], jet y[3])
{
  jet Z[3];
  for (int c = 0; c < 3; c++) Z[c] = jet_coordinate(X, c);
  for (int c = 0; c < 3; c++)
    y[c] = jet_sum(1, Z[c], m->swell, jet_product(jet_sine(2.1, Z[c], 0.3 + c), jet_sine(1.4, Z[(c + 1) % 3], 0.9)));
  manufactured_shear(m->shear, 0, 2.6, 0.2, y);
  manufactured_shear(m->shear, 1, 2.2, 0.5, y);
  manufactured_shear(m->shear, 2, 2.9, -0.1, y);
}

/* Computes the stress P and the body force -div P of form S. With C = cof F, whose divergence is 0 (Piola), and I =
 * F:F, div P = mu (1 - 1/(I+1)) lap x + mu/(I+1)^2 F grad I + lambda C grad J; grad J = C:dF. Returns J. */
static inline double manufactured_stress(const flesh_material *material, const jet y[3], double P[3][3],
                                         double force[3])
{
  double C[3][3], I = 0, J = 0, grad_I[3] = {0}, grad_J[3] = {0};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      const double *f = y[(i + 1) % 3].first, *g = y[(i + 2) % 3].first;
      C[i][j] = f[(j + 1) % 3] * g[(j + 2) % 3] - f[(j + 2) % 3] * g[(j + 1) % 3];
      I += y[i].first[j] * y[i].first[j];
      J += C[i][j] * y[i].first[j] / 3;
    }
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      for (int k = 0; k < 3; k++) {
        grad_I[k] += 2 * y[i].first[j] * y[i].second[j][k];
        grad_J[k] += C[i][j] * y[i].second[j][k];
      }
  const double mu = material->mu, lambda = material->lambda, q = 1 / (I + 1);
  for (int i = 0; i < 3; i++) {
    force[i] = 0;
    for (int j = 0; j < 3; j++) {
      P[i][j] = mu * (1 - q) * y[i].first[j] + lambda * (J - material->alpha) * C[i][j];
      force[i] -= mu * (1 - q) * y[i].second[j][j] + mu * q * q * y[i].first[j] * grad_I[j] +
                  lambda * C[i][j] * grad_J[j];
    }
  }
  return J;
}

/* Adds to the nodal forces `load` those of `force` at L with weight w. */
static inline void manufactured_add(const flesh_mesh *mesh, int t, const double L[4], double w, const double force[3],
                                    double *load)
{
  int node[10];
  double N[10];
  const int count = test_tet_nodes(mesh, t, node);
  test_shape(count, L, N);
  for (int a = 0; a < count; a++)
    for (int i = 0; i < 3; i++) load[3 * node[a] + i] += w * N[a] * force[i];
}

/* Adds the tractions P (1,0,0) on a face of tet t that lies in X = 1. */
static inline void manufactured_tractions(const manufactured *m, const flesh_material *material, const flesh_mesh *mesh,
                                          int t, double *load)
{
  const double *positions = flesh_mesh_positions(mesh);
  const int *node = flesh_mesh_tets(mesh) + 4 * t;
  for (int across = 0; across < 4; across++) {
    const double *A = positions + 3 * node[(across + 1) % 4], *B = positions + 3 * node[(across + 2) % 4];
    const double *D = positions + 3 * node[(across + 3) % 4];
    if (fmin(A[0], fmin(B[0], D[0])) < 1) continue;
    const double area = fabs((B[1] - A[1]) * (D[2] - A[2]) - (B[2] - A[2]) * (D[1] - A[1])) / 2;
    for (int q = 0; q < TEST_FACE_POINTS; q++) {
      double L[4], X[3], P[3][3], force[3];
      jet y[3];
      const double w = area * test_face_point(q, across, L);
      test_tet_place(positions, node, L, X);
      manufactured_place(m, X, y);
      manufactured_stress(material, y, P, force);
      manufactured_add(mesh, t, L, w, (double[]){P[0][0], P[1][0], P[2][0]}, load);
    }
  }
}

/* Computes the nodal forces [3*nodes] that do the work of the body force, and of the tractions on X = 1. */
static inline void manufactured_load(const manufactured *m, const flesh_material *material, const flesh_mesh *mesh,
                                     double *load)
{
  memset(load, 0, 3 * (size_t)flesh_mesh_node_count(mesh) * sizeof *load);
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++) {
    for (int q = 0; q < TEST_TET_POINTS; q++) {
      double L[4], X[3], P[3][3], force[3];
      jet y[3];
      const double w = flesh_mesh_tet_volumes(mesh)[t] * test_tet_point(q, L);
      test_tet_place(flesh_mesh_positions(mesh), flesh_mesh_tets(mesh) + 4 * t, L, X);
      manufactured_place(m, X, y);
      manufactured_stress(material, y, P, force);
      manufactured_add(mesh, t, L, w, force, load);
    }
    manufactured_tractions(m, material, mesh, t, load);
  }
}

/* Returns the root mean square distance from the motion, over the cube, m. */
static inline double manufactured_distance(const manufactured *m, const flesh_mesh *mesh, const double *x)
{
  double sum = 0;
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++) {
    int node[10];
    const int count = test_tet_nodes(mesh, t, node);
    for (int q = 0; q < TEST_TET_POINTS; q++) {
      double L[4], N[10], X[3];
      jet y[3];
      const double w = flesh_mesh_tet_volumes(mesh)[t] * test_tet_point(q, L);
      test_tet_place(flesh_mesh_positions(mesh), node, L, X);
      manufactured_place(m, X, y);
      test_shape(count, L, N);
      for (int c = 0; c < 3; c++) {
        double off = -y[c].value;
        for (int a = 0; a < count; a++) off += N[a] * x[3 * node[a] + c];
        sum += w * off * off;
      }
    }
  }
  return sqrt(sum);
}

#endif
