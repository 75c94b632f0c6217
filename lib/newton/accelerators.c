/* accelerators.c: asks every accelerator in turn, and takes what lowers the potential. */
#include "newton/accelerators.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"

static const flesh_accelerator *const table[] = {&flesh_nonlinear_elimination, &flesh_watchdog};

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
  free(self->proposal);
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

/* Whether u + the proposal can be reached and lies lower than `value`, which is then its potential. */
static int is_lower(flesh_accelerators *self, const double *u, double *value)
{
  double lower, ignored;
  flesh_step_to(self->equations, u, 1, self->proposal, self->trial);
  if (flesh_equations_max_feasible_step(self->equations, u, self->trial) < 1) return 0;
  if (flesh_equations_evaluate(self->equations, self->trial, &lower, &ignored) || !(lower < *value)) return 0;
  *value = lower;
  return 1;
}

void flesh_accelerators_run(flesh_accelerators *self, flesh_accepted_step step, double *p)
{
  for (size_t k = 0; k < sizeof table / sizeof table[0]; k++) {
    if (!table[k]->propose(self, &step)) continue;
    const int taken = is_lower(self, step.u, &step.value);
    if (taken) {
      flesh_copy(self->equations->threads, self->equations->n, self->proposal, p);
      step.cut = 1;
    }
    if (table[k]->notify) table[k]->notify(self, taken);
  }
}
