/* volume.c: volumes and Jacobians of a mesh with its nodes at any positions. */
#include "mesh/mesh.h"

#include <math.h>

#include "mesh/bernstein.h"
#include "mesh/tet10.h"

/* Never inlined: compilers contract the products of each copy differently, and at rest the volume must equal that of
 * the mesh to the last bit. */
__attribute__((noinline)) double flesh_tet_volume(const double *x, const int nodes[4])
{
  const double *o = x + 3 * (size_t)nodes[0];
  double e[3][3];
  for (int i = 0; i < 3; i++)
    for (int d = 0; d < 3; d++) e[i][d] = x[3 * (size_t)nodes[i + 1] + d] - o[d];
  return (e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) +
          e[0][1] * (e[1][2] * e[2][0] - e[1][0] * e[2][2]) +
          e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0])) /
         6;
}

static double signed_volume(const flesh_mesh *mesh, const double *x, int t)
{
  double c[FLESH_CUBIC];
  const int *nodes = mesh->tet_nodes + 4 * (size_t)t;
  if (!flesh_mesh_is_quadratic(mesh, t)) return flesh_tet_volume(x, nodes);
  flesh_tet10_jacobian(x, nodes, mesh->edge_nodes + 6 * (size_t)t, c);
  return flesh_cubic_integral(c);
}

/* For a tet of ten nodes, the bound is below the least J by at most a hundredth of the largest |J|. */
double flesh_mesh_tet_jacobian_bound(const flesh_mesh *mesh, const double *x, int t)
{
  double c[FLESH_CUBIC];
  const int *nodes = mesh->tet_nodes + 4 * (size_t)t;
  if (!flesh_mesh_is_quadratic(mesh, t)) return flesh_tet_volume(x, nodes) / mesh->volumes[t];
  flesh_tet10_jacobian(x, nodes, mesh->edge_nodes + 6 * (size_t)t, c);
  return flesh_cubic_least(c, mesh->jacobians + FLESH_CUBIC * (size_t)t, 0.01).low;
}

/* Returns whether the value is smaller; NaN counts as smallest. */
static int is_smaller(double value, double smallest)
{
  return value < smallest || (isnan(value) && !isnan(smallest));
}

double flesh_mesh_jacobian_bounds(const flesh_mesh *mesh, const double *x, double *J, int *worst, int *unsure)
{
  double smallest = INFINITY;
  int at = 0, count = 0;
  for (int t = 0; t < mesh->tets; t++) {
    const double bound = flesh_mesh_tet_jacobian_bound(mesh, x, t);
    if (J) J[t] = bound;
    count += !(bound > 0);
    if (is_smaller(bound, smallest)) smallest = bound, at = t;
  }
  if (worst) *worst = at;
  if (unsure) *unsure = count;
  return smallest;
}

typedef double point_weights[FLESH_TET10_POINTS][FLESH_CUBIC];

/* Returns the least J at the tet's points; *mean: the mean of J over them, weighted by their volumes at rest. */
static double least_at_points(const double c[FLESH_CUBIC], const double C[FLESH_CUBIC], const point_weights weights,
                              double *mean)
{
  double least = INFINITY, now = 0, rest = 0;
  for (int q = 0; q < FLESH_TET10_POINTS; q++) {
    const double here = flesh_cubic_sum(c, weights[q]), at_rest = flesh_cubic_sum(C, weights[q]);
    if (is_smaller(here / at_rest, least)) least = here / at_rest;
    now += here, rest += at_rest;
  }
  *mean = now / rest;
  return least;
}

static void find_weights(point_weights weights)
{
  for (int q = 0; q < FLESH_TET10_POINTS; q++) {
    double L[4];
    for (int a = 0; a < 4; a++) L[a] = a == q ? FLESH_TET10_NEAR : FLESH_TET10_FAR;
    flesh_cubic_weights(L, weights[q]);
  }
}

/* Adds with compensation (Neumaier), as the drift of volume is measured down to rounding. */
static void add_volume(double volume, double *sum, double *lost)
{
  const double next = *sum + volume;
  *lost += fabs(*sum) >= fabs(volume) ? (*sum - next) + volume : (volume - next) + *sum;
  *sum = next;
}

void flesh_mesh_measure(const flesh_mesh *mesh, const double *x, int with_bound, double *mean, double *least,
                        flesh_mesh_measures *measures)
{
  point_weights weights;
  double sum = 0, lost = 0;
  *measures = (flesh_mesh_measures){.J_min = INFINITY, .J_bound = INFINITY};
  if (mesh->edge_nodes) find_weights(weights);
  for (int t = 0; t < mesh->tets; t++) {
    const int *nodes = mesh->tet_nodes + 4 * (size_t)t;
    double volume, J_mean, J, bound;
    if (!flesh_mesh_is_quadratic(mesh, t)) {
      volume = flesh_tet_volume(x, nodes);
      J_mean = J = bound = volume / mesh->volumes[t];
    } else {
      double c[FLESH_CUBIC];
      const double *C = mesh->jacobians + FLESH_CUBIC * (size_t)t;
      flesh_tet10_jacobian(x, nodes, mesh->edge_nodes + 6 * (size_t)t, c);
      volume = flesh_cubic_integral(c);
      J = least_at_points(c, C, weights, &J_mean);
      bound = with_bound ? flesh_cubic_least(c, C, 0.01).low : J;
    }
    add_volume(volume, &sum, &lost);
    if (mean) mean[t] = J_mean;
    if (least) least[t] = J;
    measures->inverted += !(J > 0);
    if (is_smaller(J, measures->J_min)) measures->J_min = J, measures->J_min_tet = t;
    if (is_smaller(bound, measures->J_bound)) measures->J_bound = bound;
  }
  measures->volume = sum + lost;
}

double flesh_mesh_volume(const flesh_mesh *mesh, const double *x)
{
  double sum = 0, lost = 0;
  for (int t = 0; t < mesh->tets; t++) add_volume(signed_volume(mesh, x, t), &sum, &lost);
  return sum + lost;
}

double flesh_mesh_jacobians(const flesh_mesh *mesh, const double *x, double *J, int *worst, int *inverted)
{
  flesh_mesh_measures measures;
  flesh_mesh_measure(mesh, x, 0, NULL, J, &measures);
  if (worst) *worst = measures.J_min_tet;
  if (inverted) *inverted = measures.inverted;
  return measures.J_min;
}

void flesh_mesh_mean_jacobians(const flesh_mesh *mesh, const double *x, double *J)
{
  flesh_mesh_measures measures;
  flesh_mesh_measure(mesh, x, 0, J, NULL, &measures);
}
