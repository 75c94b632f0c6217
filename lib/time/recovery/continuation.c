/* continuation.c: goes from softened materials to the true ones, level by level, in a step of a tangled body and for a
 * tangle at rest. */
#include "time/recovery/continuation.h"

#include <string.h>

#include "system/ranks.h"
#include "system/softened.h"

/* Poisson's ratios of the levels: each but the first resists changes of volume a tenth as much as the next. */
static const double ratios[FLESH_SOFTENINGS] = {0, 0.49, 0.499};
/* Softening is worth a solve where the lambda/mu of the body's stiffest material is larger by this factor. */
static const double worth = 5;

static double stiffness_ratio(double poisson) { return 2 * poisson / (1 - 2 * poisson); }

int flesh_continuation_create(flesh_nonlinear *nonlinear, flesh_multipliers *multipliers, double *start,
                              flesh_continuation *self)
{
  const flesh_system *system = nonlinear->newton->equations.evaluation.system;
  const double stiffest = flesh_system_stiffness_ratio(system);
  int status = FLESH_OK;
  *self = (flesh_continuation){.nonlinear = nonlinear, .multipliers = multipliers, .system = system, .start = start,
                               .n = flesh_system_unknowns(system), .count = 1};
  while (self->count < FLESH_SOFTENINGS && stiffest > worth * stiffness_ratio(ratios[self->count])) self->count++;
  for (int k = 0; k < self->count && !status; k++)
    status = flesh_system_soften(system, stiffness_ratio(ratios[k]), &self->softened[k]);
  return status;
}

void flesh_continuation_clear(flesh_continuation *self)
{
  for (int k = 0; k < FLESH_SOFTENINGS; k++) flesh_softened_destroy(&self->softened[k]);
}

/* Solves a stage with the softened materials of this level. Pressures of incompressible tets belong to the true
 * materials alone. */
static int solve_softened(const flesh_continuation *self, int level, const flesh_stage *stage, const double *const *guesses,
                          flesh_solve_stats *stats)
{
  flesh_stage soft = *stage;
  soft.multipliers = NULL;
  soft.penalty = 0;
  flesh_equations *equations = &self->nonlinear->newton->equations;
  equations->system = self->softened[level];
  const int status = flesh_nonlinear_solve(self->nonlinear, &soft, guesses, 0, stats);
  equations->system = self->system;
  return status;
}

int flesh_continuation_step(const flesh_continuation *self, flesh_stage *stage, const flesh_state *state,
                            const flesh_stage_end *end, const double *const *guesses, int *led, flesh_solve_stats *stats)
{
  const double *candidates[4] = {NULL}, *last[] = {self->start, NULL};
  for (int level = 0; level < self->count; level++) {
    const int status = solve_softened(self, level, stage, level ? last : NULL, stats);
    if (status < 0) return status;
    /* The next solve begins where this one has ended, converged or not. */
    memcpy(self->start, self->nonlinear->u, sizeof *self->start * (size_t)self->n);
  }
  int count = 0;
  while (guesses[count]) candidates[count] = guesses[count], count++;
  candidates[count] = self->start;
  const int status = flesh_multipliers_solve(self->multipliers, stage, state, end, candidates, 0, stats);
  const double *began = self->nonlinear->newton->iterations.began;
  /* A solve that began at one of the guesses would only fail again. */
  int known = began == NULL;
  for (int k = 0; guesses[k]; k++) known |= began == guesses[k];
  *led = !known;
  if (status != FLESH_NOT_CONVERGED || known) return status;
  return flesh_multipliers_solve(self->multipliers, stage, state, end, guesses, 0, stats);
}

/* Moves the state to the equilibrium of the materials of this level; the level after the last softened one has the true
 * ones. In motion it takes long steps of backward Euler from rest, at a fixed time, until the body is still; each step
 * is longer, as parts may be far softer than the body on average. Statics wants the equilibrium at hand without its
 * tangle, not another one: all that is far from the tangle is held while materials are soft. */
static int settle(const flesh_continuation *self, const flesh_untangler *untangler, int is_static, int level,
                  flesh_state *state, flesh_solve_stats *stats)
{
  enum { STEPS = 10 };
  const int softened = level < self->count;
  const double *u = self->nonlinear->u;
  double h = is_static ? 0 : flesh_untangler_long_step(untangler);
  for (int k = 0; k < STEPS; k++, h *= 4) {
    const double rate = h > 0 ? 1 / h : 0;
    flesh_stage stage = {.t = state->t, .load = 1, .prescribed_fraction = 1,
                         .shift = {.x = 1, .v = rate, .a = rate * rate}, .x0 = state->x, .x_lag = state->x,
                         .t_lag = state->t, .held = is_static && softened ? flesh_untangler_held(untangler) : NULL,
                         .internal = state->internal};
    int status = softened ? solve_softened(self, level, &stage, NULL, stats)
                          : flesh_multipliers_solve(self->multipliers, &stage, state, NULL, NULL, 0, stats);
    if (!status && !softened) status = flesh_multipliers_accept(self->multipliers, &stage, state);
    if (status) return status;
    for (int d = 0; d < self->n; d++) state->x[d] += u[d];
    if (h == 0 || flesh_untangler_is_still(untangler, u)) return FLESH_OK;
  }
  return FLESH_OK;
}

int flesh_continuation_rest(const flesh_continuation *self, flesh_untangler *untangler, int is_static, flesh_state *state,
                            flesh_solve_stats *stats)
{
  flesh_untangler_begin(untangler, state);
  int status = FLESH_OK;
  for (int level = 0; level <= self->count && !status; level++)
    status = settle(self, untangler, is_static, level, state, stats);
  const int kept = flesh_untangler_judge(untangler, state, status == FLESH_OK, stats);
  if (kept) flesh_evaluation_changed(&self->nonlinear->newton->equations.evaluation);
  else flesh_multipliers_forget(self->multipliers);
  return kept ? 1 : status < 0 ? status : FLESH_OK;
}
