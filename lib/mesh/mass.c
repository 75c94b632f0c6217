/* mass.c: lumped and consistent mass of linear and quadratic tets. */
#include <math.h>
#include <string.h>

#include "mesh/bernstein.h"
#include "mesh/pieces.h"
#include "mesh/shape.h"

/* Adds weight * J N_a N_b at the point L. */
static void add_point(const double c[FLESH_CUBIC], const double L[4], double weight, double M[10][10])
{
  double N[10], of_cubic[FLESH_CUBIC];
  flesh_tet10_shape(L, N);
  flesh_cubic_weights(L, of_cubic);
  weight *= flesh_cubic_sum(c, of_cubic);
  for (int a = 0; a < 10; a++)
    for (int b = 0; b <= a; b++) M[a][b] += weight * N[a] * N[b];
}

/* Integrates N_a N_b J, of degree 4 + 3, by the rule of Grundmann & Moeller (1978) that is exact for degree 7, with 35
 * points. */
static void curved_mass(const double c[FLESH_CUBIC], double M[10][10])
{
  enum { S = 3, DEGREE = 2 * S + 1 };
  for (int i = 0; i <= S; i++) {
    const double points = DEGREE + 3 - 2 * i;
    const double weight =
        (i % 2 ? -1 : 1) * pow(points, DEGREE) / (1 << (2 * S)) / tgamma(i + 1) / tgamma(DEGREE + 4 - i);
    for (int a = 0; a <= S - i; a++)
      for (int b = 0; a + b <= S - i; b++)
        for (int d = 0; a + b + d <= S - i; d++) {
          const double L[4] = {(2 * a + 1) / points, (2 * b + 1) / points, (2 * d + 1) / points,
                               (2 * (S - i - a - b - d) + 1) / points};
          add_point(c, L, weight, M);
        }
  }
}

/* Computes the mass matrix of a straight tet: V/420 times integers (Zienkiewicz & Taylor). */
static void straight_mass(double volume, double M[10][10])
{
  for (int a = 0; a < 10; a++)
    for (int b = 0; b <= a; b++) {
      int value;
      if (a < 4) value = a == b ? 6 : 1;
      else {
        const int *p = flesh_edge_corners[a - 4], *q = flesh_edge_corners[b < 4 ? 0 : b - 4];
        if (b < 4) value = p[0] == b || p[1] == b ? -4 : -6;
        else if (a == b) value = 32;
        else value = p[0] == q[0] || p[0] == q[1] || p[1] == q[0] || p[1] == q[1] ? 16 : 8;
      }
      M[a][b] = volume / 420 * value;
    }
}

void flesh_tet10_mass(const flesh_mesh *mesh, int tet, double M[10][10])
{
  memset(M, 0, 100 * sizeof M[0][0]);
  if (mesh->curved[tet]) curved_mass(mesh->jacobians + FLESH_CUBIC * (size_t)tet, M);
  else straight_mass(mesh->volumes[tet], M);
  for (int a = 0; a < 10; a++)
    for (int b = 0; b < a; b++) M[b][a] = M[a][b];
}

/* Lumps by the diagonal, scaled to the tet's mass (Hinton, Rock & Zienkiewicz 1976); row sums would be negative at the
 * corners. */
static void lump_quadratic(const flesh_mesh *mesh, const double *density, int t, double *mass)
{
  double M[10][10], trace = 0;
  int n[10];
  flesh_tet10_mass(mesh, t, M);
  flesh_mesh_tet_nodes(mesh, t, n);
  for (int a = 0; a < 10; a++) trace += M[a][a];
  for (int a = 0; a < 10; a++) mass[n[a]] += density[t] * mesh->volumes[t] * (M[a][a] / trace);
}

void flesh_mesh_lumped_mass(const flesh_mesh *mesh, const double *density, double *mass)
{
  memset(mass, 0, (size_t)mesh->nodes * sizeof *mass);
  for (int t = 0; t < mesh->tets; t++) {
    if (flesh_mesh_is_quadratic(mesh, t)) lump_quadratic(mesh, density, t, mass);
    for (int i = 0; i < 4 && !flesh_mesh_is_quadratic(mesh, t); i++)
      mass[mesh->tet_nodes[4 * (size_t)t + i]] += density[t] * mesh->volumes[t] / 4;
  }
}

static void quadratic_mass_times(const flesh_mesh *mesh, const double *density, int t, const double *x, double *y)
{
  double M[10][10];
  int n[10];
  flesh_tet10_mass(mesh, t, M);
  flesh_mesh_tet_nodes(mesh, t, n);
  for (int a = 0; a < 10; a++)
    for (int b = 0; b < 10; b++)
      for (int d = 0; d < 3; d++) y[3 * (size_t)n[a] + d] += density[t] * M[a][b] * x[3 * (size_t)n[b] + d];
}

void flesh_mesh_consistent_mass_times(const flesh_mesh *mesh, const double *density,
                                      const double *x, double *y)
{
  memset(y, 0, 3 * (size_t)mesh->nodes * sizeof *y);
  for (int t = 0; t < mesh->tets; t++) {
    if (flesh_mesh_is_quadratic(mesh, t)) {
      quadratic_mass_times(mesh, density, t, x, y);
      continue;
    }
    const int *n = mesh->tet_nodes + 4 * (size_t)t;
    double m = density[t] * mesh->volumes[t] / 20;
    for (int d = 0; d < 3; d++) {
      double sum = 0;
      for (int i = 0; i < 4; i++) sum += x[3 * (size_t)n[i] + d];
      for (int i = 0; i < 4; i++) y[3 * (size_t)n[i] + d] += m * (sum + x[3 * (size_t)n[i] + d]);
    }
  }
}
