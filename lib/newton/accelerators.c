/* accelerators.c: asks every accelerator in turn, and takes what lowers the potential; and the first of them, which solves
 * for few nodes that carry the residual alone (Lanzkron, Rose & Wilkes 1996). */
#include "newton/accelerators.h"

#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "system/one_effect.h"

int flesh_accelerators_init(flesh_equations *equations, const flesh_solver_options *options, flesh_solve_stats *stats,
                            const flesh_accelerator_services *services, flesh_accelerators *self)
{
  size_t apart;
  *self = (flesh_accelerators){.equations = equations, .options = options, .stats = stats, .services = *services};
  self->proposal = flesh_huge_pages_vectors(4, (size_t)equations->n, &apart);
  if (!self->proposal) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", equations->n);
  self->trial = self->proposal + apart;
  self->work = self->proposal + 2 * apart;
  return FLESH_OK;
}

void flesh_accelerators_clear(flesh_accelerators *self)
{
  flesh_free(self->proposal);
  memset(self, 0, sizeof *self);
}

size_t flesh_accelerators_memory(const flesh_accelerators *self)
{
  return 4 * (size_t)self->equations->n * sizeof(double);
}

void flesh_accelerators_begin_stage(flesh_accelerators *self)
{
  memset(&self->watchdog, 0, sizeof self->watchdog);
  self->watchdog.next_pause = 1;
}

/* Whether dofs on which contact acts carry most of the residual r at u. Its barrier is what the step has not predicted
 * there, and elimination would not either, for which contact is a quadratic model. */
static int contact_carries(flesh_equations *equations, const double *u, const double *r)
{
  const flesh_point point = flesh_equations_point(equations, u);
  double *contact = equations->scratch, squares[2] = {0}; /* of all of r, of what contact touches */
  if (flesh_system_roles_residual(equations->system, FLESH_ROLE_BIT(FLESH_ROLE_CONTACT), &point, contact)) return 1;
  for (int d = 0; d < equations->evaluation.own; d++) {
    squares[0] += r[d] * r[d];
    squares[1] += contact[d] != 0 ? r[d] * r[d] : 0;
  }
  flesh_team_sum(equations->team, 2, squares);
  return squares[1] > squares[0] / 2;
}

/* Nonlinear elimination's proposal: the few nodes that carry the residual after the step are solved for alone. */
static int propose_elimination(flesh_accelerators *self, const flesh_accepted_step *step)
{
  flesh_equations *equations = self->equations;
  double *r = equations->evaluation.residual.r;
  if (!self->services.solve_subdomain || !step->unpredicted) return 0;
  flesh_step_to(equations, step->u, 1, step->p, self->trial);
  if (flesh_equations_residual(equations, self->trial, r) || !flesh_is_local(equations, r)) return 0;
  if (contact_carries(equations, self->trial, r)) return 0;
  if (self->services.solve_subdomain(self->services.data, self->trial, r, self->proposal)) return 0;
  for (int d = 0; d < equations->n; d++) self->proposal[d] += step->p[d];
  return 1;
}

/* Takes the proposal for the step p where it can be reached and lies lower. Whether it does. */
static int take(flesh_accelerators *self, flesh_accepted_step *step, double *p)
{
  double lower, ignored;
  flesh_step_to(self->equations, step->u, 1, self->proposal, self->trial);
  if (flesh_equations_max_feasible_step(self->equations, step->u, self->trial) < 1) return 0;
  if (flesh_equations_evaluate(self->equations, self->trial, &lower, &ignored) || !(lower < step->value)) return 0;
  step->value = lower;
  step->cut = 1;
  flesh_copy(self->equations->threads, self->equations->n, self->proposal, p);
  return 1;
}

void flesh_accelerators_run(flesh_accelerators *self, flesh_accepted_step step, double *p)
{
  if (propose_elimination(self, &step)) take(self, &step, p);
  if (flesh_watchdog_propose(self, &step)) flesh_watchdog_learn(self, take(self, &step, p));
}
