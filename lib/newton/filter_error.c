/* filter_error.c: estimates of local errors through (M + g^2 K)^-1 M: what a stage would leave of them. */
#include "newton/newton.h"

enum { MOST_ITERATIONS = 300 };
static const double depth = 0.1; /* of the solve, over the right-hand side: an estimate needs no more */

int flesh_newton_filter_error(flesh_newton *self, const double *u, const double *b, double *p)
{
  flesh_direction *direction = &self->direction;
  const flesh_shift *now = &self->equations.stage.shift, *then = &self->policy.prepared_for;
  const double norm = flesh_norm(self->threads, self->equations.n, b);
  const flesh_direction_request request = {.tolerance = depth * norm, .max_iterations = MOST_ITERATIONS};
  const int serves = self->policy.age >= 0 && now->x == then->x && now->v == then->v && now->a == then->a;
  flesh_direction_kind kind;
  int status = FLESH_OK;
  if (!(norm > 0)) return FLESH_NOT_CONVERGED;
  if (!serves) {
    status = flesh_newton_matrix(self, u, NULL);
    if (!status) status = flesh_newton_prepare(self, 1);
  }
  if (!status) status = flesh_direction_solve(direction, &request, b, p, &kind);
  if (status == FLESH_NOT_POSITIVE) {
    status = flesh_direction_assemble(direction, u, FLESH_FILTER_ABSOLUTE);
    flesh_matrix_policy_overwritten(&self->policy);
    self->tangent.known = 0;
    if (!status) status = flesh_direction_factor(direction, 0);
    if (!status) status = flesh_direction_solve(direction, &request, b, p, &kind);
  }
  return status;
}
