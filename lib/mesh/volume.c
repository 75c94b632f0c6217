/* volume.c: volumes and Jacobians of a mesh whose nodes stand anywhere. */
#include "mesh/mesh.h"

#include <math.h>

#include "mesh/bernstein.h"

/* Never inlined: compilers contract the products of each copy in their own way, and at rest the
 * volume must be that of the mesh to the last bit. */
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

double flesh_mesh_volume(const flesh_mesh *mesh, const double *x)
{
  /* Compensated (Neumaier): drift of volume is measured down to rounding. */
  double sum = 0, lost = 0;
  for (int t = 0; t < mesh->tets; t++) {
    double volume = signed_volume(mesh, x, t), next = sum + volume;
    lost += fabs(sum) >= fabs(volume) ? (sum - next) + volume : (volume - next) + sum;
    sum = next;
  }
  return sum + lost;
}

/* Of ten nodes the least value in the tet, to a hundredth of its largest, from below. */
double flesh_mesh_tet_jacobian(const flesh_mesh *mesh, const double *x, int t)
{
  double c[FLESH_CUBIC];
  const int *nodes = mesh->tet_nodes + 4 * (size_t)t;
  if (!flesh_mesh_is_quadratic(mesh, t)) return flesh_tet_volume(x, nodes) / mesh->volumes[t];
  flesh_tet10_jacobian(x, nodes, mesh->edge_nodes + 6 * (size_t)t, c);
  return flesh_cubic_least(c, mesh->jacobians + FLESH_CUBIC * (size_t)t, 0.01).low;
}

double flesh_mesh_jacobians(const flesh_mesh *mesh, const double *x, double *J, int *worst,
                            int *inverted)
{
  double smallest = INFINITY;
  int at = 0, count = 0;
  for (int t = 0; t < mesh->tets; t++) {
    double ratio = flesh_mesh_tet_jacobian(mesh, x, t);
    if (J) J[t] = ratio;
    count += !(ratio > 0);
    /* The first NaN is the smallest and stays it. */
    if (ratio < smallest || (isnan(ratio) && !isnan(smallest))) smallest = ratio, at = t;
  }
  if (worst) *worst = at;
  if (inverted) *inverted = count;
  return smallest;
}
