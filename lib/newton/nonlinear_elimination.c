/* nonlinear_elimination.c: where few nodes carry the residual after a step, these are solved for alone (Lanzkron, Rose
 * & Wilkes 1996), and the whole goes on from there. */
#include "newton/accelerators.h"

static int propose(flesh_accelerators *self, const flesh_accepted_step *step)
{
  flesh_equations *equations = self->equations;
  double *r = equations->evaluation.residual.r;
  if (!self->services.solve_subdomain || !step->unpredicted) return 0;
  flesh_step_to(equations, step->u, 1, step->p, self->trial);
  if (flesh_equations_residual(equations, self->trial, r) || !flesh_is_local(equations, r)) return 0;
  if (self->services.solve_subdomain(self->services.data, self->trial, r, self->proposal)) return 0;
  for (int d = 0; d < equations->n; d++) self->proposal[d] += step->p[d];
  return 1;
}

const flesh_accelerator flesh_nonlinear_elimination = {"nonlinear-elimination", propose, NULL};
