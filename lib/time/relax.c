/* relax.c: through softer materials to the true ones: in a step of a tangled body, and where one has come to rest. */
#include <string.h>

#include "time/integrator.h"

/* A flesh_stage_end's data: what unknowns lead from. */
typedef struct solution {
  int n;
  const double *x;
} solution;

static void find_end(void *data, const double *u, double *x)
{
  const solution *from = data;
  for (int d = 0; d < from->n; d++) x[d] = from->x[d] + u[d];
}

/* Statics, or a long step of backward Euler from rest, of which time knows nothing. Pressures of incompressible tets
 * belong to the true materials alone. */
static int solve(flesh_integrator *self, flesh_state *state, double h, int softened, const uint8_t *held,
                 flesh_solve_stats *stats)
{
  const double rate = h > 0 ? 1 / h : 0;
  flesh_stage stage = {.t = state->t, .load = 1, .prescribed_fraction = 1,
                       .shift = {.x = 1, .v = rate, .a = rate * rate},
                       .x0 = state->x, .x_lag = state->x, .t_lag = state->t, .softened = softened, .held = held,
                       .internal = state->internal};
  int status;
  if (softened) {
    status = flesh_nonlinear_solve(self->nonlinear, &stage, NULL, 0, stats);
  } else {
    const flesh_stage_end end = {&(solution){self->evaluation->n, state->x}, find_end};
    status = flesh_multipliers_solve(&self->multipliers, self->nonlinear, &stage, state, &end, NULL, 0, stats);
    if (!status) status = flesh_multipliers_accept(&self->multipliers, self->nonlinear, &stage, state);
  }
  const double *u = flesh_nonlinear_unknowns(self->nonlinear);
  for (int d = 0; d < self->evaluation->n && !status; d++) state->x[d] += u[d];
  return status;
}

/* Steps until the body is still, or the last; each longer, as parts may be far softer than the body on average. */
static int settle(flesh_integrator *self, flesh_state *state, double h, int softened, const uint8_t *held,
                  flesh_solve_stats *stats)
{
  enum { STEPS = 10 };
  for (int k = 0; k < STEPS; k++, h *= 4) {
    int status = solve(self, state, h, softened, held, stats);
    if (status || h == 0) return status;
    if (flesh_untangler_is_still(self->recovery.untangler, flesh_nonlinear_unknowns(self->nonlinear))) return FLESH_OK;
  }
  return FLESH_OK;
}

/* In statics it is the equilibrium at hand that is wanted, without its tangle, not another one: all that is far from the
 * tangle is held while materials are soft. */
int flesh_integrator_relax(flesh_integrator *self, flesh_state *state, flesh_solve_stats *stats)
{
  flesh_untangler *untangler = self->recovery.untangler;
  const int is_static = self->method == FLESH_METHOD_STATIC;
  const double h = is_static ? 0 : flesh_untangler_long_step(untangler);
  const uint8_t *held = is_static ? flesh_untangler_held(untangler) : NULL;
  flesh_untangler_begin(untangler, state);
  int status = settle(self, state, h, 1, held, stats);
  if (!status) status = settle(self, state, h, 0, NULL, stats);
  const int kept = flesh_untangler_judge(untangler, state, status == FLESH_OK, stats);
  if (kept) flesh_evaluation_changed(self->evaluation);
  else flesh_multipliers_forget(&self->multipliers);
  if (kept) return 1;
  return status < 0 ? status : FLESH_OK;
}

int flesh_integrator_solve_through_softer(flesh_integrator *self, flesh_stage *stage, const flesh_state *state,
                                          const flesh_stage_end *end, const double *const *guesses,
                                          flesh_solve_stats *stats)
{
  const double *candidates[4] = {NULL}, *last[] = {self->start, NULL};
  flesh_stage soft = *stage;
  soft.multipliers = NULL;
  soft.penalty = 0;
  for (soft.softened = 1; soft.softened <= self->softenings; soft.softened++) {
    const int status = flesh_nonlinear_solve(self->nonlinear, &soft, soft.softened > 1 ? last : NULL, 0, stats);
    if (status < 0) return status;
    /* A first iterate of the next, wherever it has ended. */
    memcpy(self->start, flesh_nonlinear_unknowns(self->nonlinear), sizeof *self->start * (size_t)self->evaluation->n);
  }
  int count = 0;
  while (guesses[count]) candidates[count] = guesses[count], count++;
  candidates[count] = self->start;
  const int status =
      flesh_multipliers_solve(&self->multipliers, self->nonlinear, stage, state, end, candidates, 0, stats);
  /* A solve that began at one of the guesses would only fail again. */
  int known = flesh_nonlinear_began_at(self->nonlinear, NULL);
  for (int k = 0; guesses[k]; k++) known |= flesh_nonlinear_began_at(self->nonlinear, guesses[k]);
  if (status != FLESH_NOT_CONVERGED || known) return status;
  return flesh_multipliers_solve(&self->multipliers, self->nonlinear, stage, state, end, guesses, 0, stats);
}
