/* filter_error.c: filters estimates of local errors by (M + g^2 K)^-1 M, as the solve of a stage would damp them. */
#include "newton/newton.h"

#include <string.h>

#include "system/one_effect.h"
#include "system/velocity_scale.h"

enum { MOST_ITERATIONS = 300 };
static const double relative_tolerance = 0.1; /* of the solve; an estimate needs no more */

/* Computes b [n], the contribution of the multipliers' penalty to K p at u, as a difference of residuals. */
static int find_penalty_force(flesh_newton *self, const double *u, const double *p, double *b)
{
  static const double relative_norm = 1e-6; /* norm of the displacement, relative to the body's length */
  flesh_equations *equations = &self->equations;
  const int n = equations->n, *fixed = equations->constrained.dofs;
  double *x = equations->scratch, *r = x + n;
  const double scale = relative_norm * flesh_system_length_scale(equations->system) / flesh_norm(self->threads, n, p);
  const flesh_point point = flesh_equations_point(equations, u);
  int status = FLESH_OK;
  memset(b, 0, (size_t)n * sizeof *b);
  for (int d = 0; d < n; d++) x[d] = point.x[d] + scale * equations->stage.shift.x * p[d];
  for (int k = 0; k < 4 && !status; k++) {
    const int moved = k & 1, without = k & 2;
    flesh_point at = point;
    if (moved) at.x = x;
    if (without) at.penalty = 1e-12; /* practically none; 0 would mean 1 */
    status = flesh_system_roles_residual(equations->system, FLESH_ROLE_BIT(FLESH_ROLE_ELASTICITY), &at, r);
    const double weight = (moved && !without) || (!moved && without) ? 1 / scale : -1 / scale;
    for (int d = 0; d < n && !status; d++) b[d] += weight * r[d];
  }
  for (int k = 0; k < equations->constrained.count; k++) b[fixed[k]] = 0;
  return status;
}

/* Prepares the matrix of the last stage for use. */
static int prepare(flesh_newton *self, const double *u)
{
  const flesh_shift *now = &self->equations.stage.shift, *then = &self->policy.prepared_for;
  const int serves = self->policy.age >= 0 && now->x == then->x && now->v == then->v && now->a == then->a;
  const int status = serves ? FLESH_OK : flesh_newton_matrix(self, u, NULL);
  return serves || status ? status : flesh_newton_prepare(self, 1);
}

static int keep_volumes(flesh_newton *self, const double *u, double *p)
{
  const int n = self->equations.n;
  double *b = self->equations.scratch + 2 * (size_t)n, *q = b + n;
  flesh_direction_kind kind;
  if (!(self->equations.stage.penalty > 0)) return FLESH_OK;
  int status = prepare(self, u);
  if (!status) status = flesh_team_agree(self->equations.team, find_penalty_force(self, u, p, b));
  const flesh_direction_request request = {.tolerance = relative_tolerance * flesh_norm(self->threads, n, b),
                                           .max_iterations = MOST_ITERATIONS};
  memset(q, 0, (size_t)n * sizeof *q);
  if (!status && request.tolerance > 0) status = flesh_direction_solve(&self->direction, &request, b, q, &kind);
  for (int d = 0; d < n && !status; d++) p[d] -= q[d];
  return status;
}

static int filter(flesh_newton *self, const double *u, const double *b, double *p)
{
  flesh_direction *direction = &self->direction;
  const double norm = flesh_norm(self->threads, self->equations.n, b);
  const flesh_direction_request request = {.tolerance = relative_tolerance * norm, .max_iterations = MOST_ITERATIONS};
  flesh_direction_kind kind;
  if (!(norm > 0)) return FLESH_NOT_CONVERGED;
  int status = prepare(self, u);
  if (!status) status = flesh_direction_solve(direction, &request, b, p, &kind);
  if (status == FLESH_NOT_POSITIVE) {
    status = flesh_direction_assemble(direction, u, FLESH_FILTER_ABSOLUTE);
    flesh_matrix_policy_overwritten(&self->policy);
    self->tangent.known = 0;
    if (!status) status = flesh_direction_factor(direction, 0);
    if (!status) status = flesh_direction_solve(direction, &request, b, p, &kind);
  }
  return status ? status : keep_volumes(self, u, p);
}

/* Adds the counts since `before` to *stats, and restores the stage's own, by which the next stage is judged. */
static void add_since(flesh_newton *self, const flesh_solve_stats *before, flesh_solve_stats *stats)
{
  stats->linear += self->stats.linear - before->linear;
  stats->linear_single += self->stats.linear_single - before->linear_single;
  stats->assemblies += self->stats.assemblies - before->assemblies;
  self->stats = *before;
}

int flesh_newton_filter_error(flesh_newton *self, const double *u, const double *b, double *p, flesh_solve_stats *stats)
{
  const flesh_solve_stats before = self->stats;
  const int status = filter(self, u, b, p);
  add_since(self, &before, stats);
  return status;
}

int flesh_newton_keep_volumes(flesh_newton *self, const double *u, double *p, flesh_solve_stats *stats)
{
  const flesh_solve_stats before = self->stats;
  const int status = keep_volumes(self, u, p);
  add_since(self, &before, stats);
  return status;
}
