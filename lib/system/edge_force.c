/* edge_force.c: elastic forces on nodes that are displaced at random. */
#include "system/edge_force.h"

#include <math.h>
#include <string.h>

#include "math/xorshift.h"
#include "mesh/inspect.h"
#include "system/one_effect.h"
#include "system/ranks.h"

/* Nodes are displaced by this part of an edge. */
static const double part = 1e-6;

/* Every node `distance` away from X, in one of eight directions. */
static void displace(const flesh_team *team, int n, const double *X, double distance, double *x)
{
  uint32_t random = flesh_xorshift_first;
  for (int d = 0; d < n; d++) x[d] = X[d] + distance * (flesh_xorshift(&random) >> 31 ? 1 : -1);
  flesh_team_share(team, x);
}

flesh_edge_force flesh_system_edge_force(const flesh_system *system, double *work)
{
  const flesh_team *team = flesh_system_team(system);
  const flesh_mesh *mesh = flesh_system_mesh(system);
  const int n = flesh_system_unknowns(system), own = flesh_team_own(team, n / 3);
  const double *X = flesh_mesh_positions(mesh);
  double *x = work, *after = x + n, *before = after + n, *zeros = before + n, sums[3] = {0}, most = 0;
  flesh_edge_force force = {.edge = flesh_mesh_mean_edge(mesh, team), .stressed = 1};
  memset(zeros, 0, (size_t)n * sizeof *zeros);
  const unsigned elastic = FLESH_ROLE_BIT(FLESH_ROLE_ELASTICITY);
  flesh_point point = flesh_point_at(0, X, zeros, zeros);
  if (flesh_system_roles_residual(system, elastic, &point, before)) return force;
  displace(team, n, X, part * force.edge, x);
  point.x = x;
  if (flesh_system_roles_residual(system, elastic, &point, after)) return force;
  for (int i = 0; i < 3 * own; i += 3) {
    double square = 0;
    for (int d = i; d < i + 3; d++) {
      sums[0] += fabs(after[d] - before[d]);
      square += (after[d] - before[d]) * (after[d] - before[d]);
      most = fmax(most, fabs(before[d]));
    }
    if (square > 0) sums[1] += 1 / sqrt(square), sums[2]++;
  }
  flesh_team_sum(team, 3, sums);
  flesh_team_largest(team, 1, &most);
  force.mean = sums[0] / (3 * flesh_team_all(team, n / 3)) / part;
  force.softest = sums[2] > 0 ? sums[2] / sums[1] / part : 0;
  force.stressed = most > 1e-6 * force.mean;
  return force;
}
