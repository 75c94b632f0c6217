/* accelerators.c: asks every accelerator in turn, and takes what lowers the potential; and the first of them, which solves
 * for few nodes that carry the residual alone (Lanzkron, Rose & Wilkes 1996). */
#include "newton/newton.h"

#include <math.h>

#include "system/one_effect.h"

/* Whether dofs on which contact acts carry most of the residual r at u. There the step has not predicted the barrier.
 * Elimination has a quadratic model of contact, which does not predict the barrier either. */
static int contact_carries(flesh_equations *equations, const double *u, const double *r)
{
  if (!flesh_system_has_role(equations->system, FLESH_ROLE_CONTACT)) return 0;
  const flesh_point point = flesh_equations_point(equations, u);
  double *contact = equations->scratch; /* then r where contact touches */
  const int failed = flesh_system_roles_residual(equations->system, FLESH_ROLE_BIT(FLESH_ROLE_CONTACT), &point, contact);
  for (int d = 0; d < equations->n; d++) contact[d] = failed || contact[d] != 0 ? r[d] : 0;
  return flesh_norm(equations->threads, equations->n, contact) > M_SQRT1_2 * flesh_norm(equations->threads, equations->n, r);
}

/* Nonlinear elimination's proposal: the few nodes that carry the residual after the step are solved for alone. */
static int propose_elimination(flesh_newton *self, const flesh_step *step)
{
  flesh_equations *equations = &self->equations;
  double *r = equations->evaluation.residual.r;
  if (!self->reserve || !step->unpredicted) return 0;
  flesh_step_to(equations, step->u, 1, step->p, equations->trial);
  if (flesh_equations_residual(equations, equations->trial, r) || !flesh_is_local(equations, r)) return 0;
  if (contact_carries(equations, equations->trial, r)) return 0;
  if (flesh_subdomain_solve(self, equations->trial, r, equations->proposal)) return 0;
  for (int d = 0; d < equations->n; d++) equations->proposal[d] += step->p[d];
  return 1;
}

int flesh_newton_take_proposal(flesh_newton *self, flesh_step *step)
{
  flesh_equations *equations = &self->equations;
  double lower, ignored;
  flesh_step_to(equations, step->u, 1, equations->proposal, equations->trial);
  if (flesh_equations_max_feasible_step(equations, step->u, equations->trial) < 1) return 0;
  if (flesh_equations_evaluate(equations, equations->trial, &lower, &ignored) || !(lower < step->value)) return 0;
  step->value = lower;
  step->cut = 1;
  flesh_copy(equations->threads, equations->n, equations->proposal, step->p);
  return 1;
}

void flesh_newton_accelerate(flesh_newton *self, flesh_step *step)
{
  if (propose_elimination(self, step)) flesh_newton_take_proposal(self, step);
  flesh_watchdog_run(self, step);
}
