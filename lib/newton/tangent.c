/* tangent.c: linear systems with the derivative of the residual itself, of which sensitivities are made: exact, of one
 * matrix for many right-hand sides, where an iteration is content with approximations. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "linear/block_matrix.h"
#include "newton/newton.h"

/* After an old preconditioner has failed, so many matrices get new ones: contact then changes from step to step. */
enum { REFRESHES = 8 };

/* The share of a right-hand side that factors may leave: sensitivities are asked for to 1e-6. */
static const double rounding = 1e-8;

/* Factors K by KLU with pivots, which an indefinite K needs. */
static int factor_with_pivots(flesh_newton *self)
{
  flesh_tangent *tangent = &self->tangent;
  const flesh_equations *equations = &self->equations;
  if (equations->team && equations->team->ranks > 1)
    return flesh_fail(FLESH_ERR_SOLVE, "conjugate gradients do not solve for the sensitivities, as the tangent is indefinite "
                                       "or too uneven; a single process can factor it");
  if (tangent->patterns != equations->patterns) flesh_direct_destroy(&tangent->pivots);
  int status = tangent->pivots ? FLESH_OK : flesh_direct_create(FLESH_LINEAR_KLU, equations->K, &tangent->pivots);
  tangent->patterns = equations->patterns;
  if (!status && tangent->most > 0 && flesh_direct_operations(tangent->pivots) > tangent->most)
    return flesh_fail(FLESH_ERR_SOLVE, "to factor the tangent takes %.2g operations", flesh_direct_operations(tangent->pivots));
  if (!status) status = flesh_direct_factor(tangent->pivots, equations->K);
  if (status > 0) return flesh_fail(FLESH_ERR_SOLVE, "the tangent is singular, so that there are no sensitivities: the state is "
                                                     "a bifurcation, or a part of the body moves freely");
  tangent->has_pivots = !status;
  return status;
}

int flesh_newton_factor_tangent(flesh_newton *self, const double *u)
{
  flesh_environment *environment = &self->equations.evaluation.environment;
  self->tangent.known = self->tangent.has_pivots = 0;
  const int before = environment->tangents;
  environment->tangents = 1;
  environment->slips_to_rest = 0;
  int status = flesh_direction_assemble(&self->direction, u, FLESH_FILTER_NONE);
  environment->tangents = before;
  flesh_matrix_policy_assembled(&self->policy);
  const double *usual = self->direction.iterations_per_decade; /* 0 of a new preconditioner */
  const int anew = self->tangent.refreshes > 0;
  if (!status) status = anew ? flesh_matrix_policy_refresh(&self->policy) : flesh_matrix_policy_prepare(&self->policy);
  self->tangent.refreshes -= anew;
  self->tangent.kept = usual[0] + usual[1] > 0;
  flesh_matrix_policy_overwritten(&self->policy);
  if (status == FLESH_NOT_POSITIVE) status = factor_with_pivots(self);
  self->tangent.known = !status;
  return status;
}

/* The 2-norm of b - K p. Overwrites the equations' scratch. */
static double residual_of(flesh_newton *self, const double *b, const double *p)
{
  const flesh_equations *equations = &self->equations;
  double *r = equations->scratch;
  flesh_block_multiply_of_team(equations->team, equations->K, p, r);
  for (int d = 0; d < equations->n; d++) r[d] = b[d] - r[d];
  return flesh_norm(self->threads, equations->n, r);
}

/* Refined, as KLU's pivots are those of an earlier matrix. What stiff parts leave by rounding, up to `most`, is no reason to
 * refuse. */
static int solve_with_pivots(flesh_newton *self, const double *b, double tolerance, double most, double *p)
{
  const flesh_equations *equations = &self->equations;
  const int n = equations->n;
  double *r = equations->scratch, *correction = r + n, left = INFINITY;
  memset(p, 0, (size_t)n * sizeof *p);
  memcpy(r, b, (size_t)n * sizeof *r);
  for (int k = 0; k < 3 && !(left <= tolerance); k++) {
    const int status = flesh_direct_solve(self->tangent.pivots, r, correction);
    if (status) return status;
    for (int d = 0; d < n; d++) p[d] += correction[d];
    left = residual_of(self, b, p);
  }
  if (left <= most) return FLESH_OK;
  return flesh_fail(FLESH_ERR_SOLVE, "the tangent is too nearly singular for its sensitivities: of a right-hand side, %.2g of "
                                     "%.2g is left", left, flesh_norm(self->threads, n, b));
}

/* Beyond so many iterations a kept preconditioner costs more than a new one. */
static int most_iterations(const flesh_newton *self, double tolerance)
{
  enum { NEW_ONE = 12 };
  const double *usual = self->direction.iterations_per_decade;
  const double expected = NEW_ONE + fmax(usual[0], usual[1]) * -log10(tolerance);
  return self->tangent.kept && expected < self->options.max_linear ? (int)expected : self->options.max_linear;
}

int flesh_newton_solve_tangent(flesh_newton *self, double *b, double tolerance, double *p)
{
  const flesh_equations *equations = &self->equations;
  const flesh_constrained *constrained = &equations->constrained;
  flesh_direction_kind kind;
  for (int k = 0; k < constrained->count; k++) b[constrained->dofs[k]] = 0;
  const double norm = flesh_norm(self->threads, equations->n, b);
  if (!(norm < INFINITY)) return FLESH_NONFINITE;
  if (norm == 0) {
    memset(p, 0, (size_t)equations->n * sizeof *p);
    return FLESH_OK;
  }
  flesh_direction_request request = {.tolerance = tolerance * norm, .max_iterations = most_iterations(self, tolerance),
                                     .stop = flesh_newton_asked_to_stop, .stop_data = self};
  int status = flesh_newton_asked_to_stop(self) ? self->iterations.stopped : FLESH_NOT_POSITIVE;
  if (status == FLESH_NOT_POSITIVE && !self->tangent.has_pivots)
    status = flesh_direction_solve(&self->direction, &request, b, p, &kind);
  if (status == FLESH_NOT_CONVERGED && self->tangent.kept && !(status = flesh_matrix_policy_refresh(&self->policy))) {
    self->tangent.kept = 0;
    self->tangent.refreshes = REFRESHES;
    request.max_iterations = self->options.max_linear;
    status = flesh_direction_solve(&self->direction, &request, b, p, &kind);
  }
  if (!status && self->direction.direct && !(residual_of(self, b, p) <= tolerance * norm)) status = FLESH_NOT_CONVERGED;
  if (status != FLESH_NOT_POSITIVE && status != FLESH_NOT_CONVERGED) return status;
  if (!self->tangent.has_pivots) status = factor_with_pivots(self);
  else status = FLESH_OK;
  return status ? status : solve_with_pivots(self, b, tolerance * norm, fmax(tolerance, rounding) * norm, p);
}
