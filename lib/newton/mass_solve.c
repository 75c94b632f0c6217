/* mass_solve.c: solves with the mass matrix at the start of a motion: for accelerations that balance all effects, and for
 * jumps of the free dofs due to jumps of the constrained ones. */
#include <string.h>

#include "linear/block_matrix.h"
#include "newton/stage.h"

/* Assembles M, without constraints, into K; drops the caches. */
static int assemble_mass(flesh_newton *self, double t, const double *x, const double *v)
{
  flesh_newton_overwritten(self);
  return flesh_equations_assemble_mass(&self->equations, t, x, v);
}

/* Solves M y = right on the free dofs, K being M; right and y are 0 on the others. */
static int solve_mass(flesh_newton *self, const double *right, double *y)
{
  const int n = self->equations.n;
  double norm = flesh_norm(self->threads, n, right);
  if (!(norm < 1e300)) return FLESH_NONFINITE;
  if (norm == 0) {
    memset(y, 0, (size_t)n * sizeof *y);
    return FLESH_OK;
  }
  flesh_equations_constrain_matrix(&self->equations);
  int status = flesh_matrix_policy_refresh(&self->policy);
  if (status) return status;
  const flesh_direction *direction = &self->direction;
  if (direction->direct) return flesh_direct_solve(direction->direct, right, y);
  flesh_pcg_result result;
  const flesh_pcg_request solve = {.A = self->equations.K, .preconditioner = direction->preconditioner, .b = right,
                                   .tolerance = 1e-13 * norm, .max_iterations = self->options.max_linear};
  status = direction->linear->pcg(direction->pcg, &solve, y, &result);
  self->stats.linear += result.iterations;
  return status;
}

static int find_acceleration(flesh_newton *self, const flesh_state *state, double t, double *a)
{
  flesh_equations *equations = &self->equations;
  flesh_evaluation *e = &equations->evaluation;
  flesh_constrained *constrained = &equations->constrained;
  const int n = equations->n;
  double *r = equations->work[0], *correction = equations->trial;
  flesh_equations_find_constrained(equations, t, NULL);
  for (int d = 0; d < n; d++) e->a[d] = a[d] = constrained->is[d] ? a[d] : 0;
  int status = assemble_mass(self, t, state->x, state->v);
  if (status) return status;
  flesh_point point = flesh_evaluation_point(e, t, e->x, e->v, e->a);
  point.multipliers = state->multipliers;
  point.internal = state->internal;
  self->stats.residuals++;
  e->environment.starts = 1;
  status = flesh_system_residual(e->system, &point, r);
  e->environment.starts = 0;
  if (status) return status;
  for (int d = 0; d < n; d++) r[d] = constrained->is[d] ? 0 : -r[d];
  status = solve_mass(self, r, correction);
  for (int d = 0; d < n && !status; d++)
    if (!constrained->is[d]) a[d] = correction[d];
  return status;
}

int flesh_newton_acceleration(flesh_newton *self, const flesh_state *state, double t, double *a, flesh_solve_stats *stats)
{
  memset(&self->stats, 0, sizeof self->stats);
  const int status = find_acceleration(self, state, t, a);
  flesh_stage_count(self, stats);
  return status;
}

/* Applies the jump of the constrained dofs to positions or velocities y. */
static int apply_jump(flesh_newton *self, double t, const double *prescribed, double *y)
{
  flesh_equations *equations = &self->equations;
  flesh_constrained *constrained = &equations->constrained;
  const int n = equations->n;
  double *jump = equations->trial, *right = equations->work[0];
  for (int d = 0; d < n; d++) jump[d] = constrained->is[d] ? prescribed[d] - y[d] : 0;
  if (flesh_largest(equations->threads, n, jump) == 0) return FLESH_OK;
  int status = assemble_mass(self, t, equations->evaluation.x, equations->evaluation.v);
  if (status) return status;
  flesh_block_multiply_of_team(equations->team, equations->K, jump, right);
  for (int d = 0; d < n; d++) {
    right[d] = constrained->is[d] ? 0 : -right[d];
    if (constrained->is[d]) y[d] = prescribed[d];
  }
  status = solve_mass(self, right, jump);
  for (int d = 0; d < n && !status; d++)
    if (!constrained->is[d]) y[d] += jump[d];
  return status;
}

int flesh_newton_apply_constraint_jump(flesh_newton *self, double t, const double *x_prescribed,
                                       const double *v_prescribed, double *x, double *v, flesh_solve_stats *stats)
{
  flesh_equations *equations = &self->equations;
  flesh_evaluation *e = &equations->evaluation;
  const size_t bytes = (size_t)equations->n * sizeof *x;
  flesh_equations_find_constrained(equations, t, NULL);
  memcpy(e->x, x, bytes);
  memcpy(e->v, v, bytes);
  memset(e->a, 0, bytes);
  memset(&self->stats, 0, sizeof self->stats);
  int status = apply_jump(self, t, x_prescribed, x);
  if (!status) status = apply_jump(self, t, v_prescribed, v);
  flesh_stage_count(self, stats);
  return status;
}
