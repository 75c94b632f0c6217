/* edge_force.c: forces on randomly displaced nodes. */
#include "system/edge_force.h"

#include <math.h>
#include <string.h>

#include "base/parallel_vector.h"
#include "math/xorshift.h"
#include "parallel/body_figures.h"
#include "system/one_effect.h"
#include "system/ranks.h"

/* Displacement of nodes relative to an edge. */
static const double part = 1e-6;

/* Displaces every node by `distance` from X, in one of eight directions. */
static void displace(const flesh_team *team, int n, const double *X, double distance, double *x)
{
  uint32_t random = flesh_xorshift_first;
  for (int d = 0; d < n; d++) x[d] = X[d] + distance * (flesh_xorshift(&random) >> 31 ? 1 : -1);
  flesh_team_update_ghosts(team, x);
}

/* Adds up in r [n] the forces at the point of effects of those roles, as far as they have a value. *undefined: one has
 * none. */
static int forces_at(const flesh_system *system, unsigned roles, const flesh_point *point, double *one, double *r,
                     int *undefined)
{
  const int n = flesh_system_unknowns(system);
  memset(r, 0, (size_t)n * sizeof *r);
  for (int k = 0; k < flesh_system_effect_count(system); k++) {
    if (!(roles & FLESH_ROLE_BIT(flesh_system_effect(system, k)->operations->role))) continue;
    const int status = flesh_system_effect_residual(system, k, point, one);
    if (status < 0) return status;
    if (status) *undefined = 1;
    for (int d = 0; d < n && !status; d++) r[d] += one[d];
  }
  return FLESH_OK;
}

int flesh_system_edge_force(const flesh_evaluation *evaluation, unsigned roles, const flesh_point *rest, double *work,
                            flesh_edge_force *force)
{
  const flesh_system *system = evaluation->system;
  const flesh_team *team = evaluation->team;
  const flesh_mesh *mesh = flesh_system_mesh(system);
  const int n = flesh_system_unknowns(system);
  double *x = work, *after = x + n, *before = after + n, *one = before + n, sums[3] = {0};
  int undefined = 0;
  *force = (flesh_edge_force){.edge = flesh_body_mean_edge(mesh, team), .stressed = 1};
  flesh_point point = *rest;
  int status = forces_at(system, roles, &point, one, before, &undefined);
  displace(team, n, rest->x, part * force->edge, x);
  point.x = x;
  if (!status) status = forces_at(system, roles, &point, one, after, &undefined);
  if (status) return status;
  for (int i = 0; i < n; i += 3) { /* ghosts have no forces */
    double square = 0;
    for (int d = i; d < i + 3; d++) {
      sums[0] += fabs(after[d] - before[d]);
      square += (after[d] - before[d]) * (after[d] - before[d]);
    }
    if (square > 0) sums[1] += 1 / sqrt(square), sums[2]++;
  }
  flesh_team_sum(team, 3, sums);
  force->mean = sums[0] / evaluation->all / part;
  force->softest = sums[2] > 0 ? sums[2] / sums[1] / part : 0;
  force->stressed = undefined || flesh_largest(evaluation->threads, n, before) > 1e-6 * force->mean;
  return FLESH_OK;
}
