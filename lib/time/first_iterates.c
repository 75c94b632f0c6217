/* first_iterates.c: proposes where the solve of a stage may begin, other than at the last state, and remembers the solves
 * from which that follows. */
#include "newton/mechanisms.h"
#include "time/attempt.h"

/* Finds first iterates of a method that has its own, the better one last: the solve that begins there needs no second
 * evaluation. The stages of a step have the same matrix but for its place, as have those of the step before, unless the
 * method begins. */
static void make_own_guesses(flesh_integrator *self, const flesh_method_row *row, const flesh_stage *stage, double h,
                             const double *guesses[3])
{
  int count = 0;
  if (self->memory.at > 0 || self->memory.before < 0) self->nonlinear->newton->policy.stage_continues = 1;
  for (int which = 1; which >= 0; which--)
    if (row->guess(&self->memory, stage, h, which, self->room[which])) guesses[count++] = self->room[which];
  guesses[count] = NULL;
}

void flesh_integrator_guess(flesh_integrator *self, const flesh_method_row *row, const flesh_state *state,
                            const flesh_stage *stage, double h, const double *guesses[3])
{
  const flesh_evaluation *evaluation = self->evaluation;
  flesh_first_iterates *first = &self->first;
  if (row->guess && (row->stages || self->control.on)) {
    make_own_guesses(self, row, stage, h, guesses);
    return;
  }
  const int nearest = row == &flesh_method_backward_euler;
  const int holds = flesh_team_any(evaluation->team, flesh_system_holds(evaluation->system, stage->t));
  int count = 0;
  if (flesh_uses(&self->options, FLESH_TECHNIQUE_EXTRAPOLATION) &&
      flesh_extrapolation_guess(&first->extrapolation, evaluation->serial, state->t, h, self->room[0])) {
    self->nonlinear->newton->policy.stage_continues = 1;
    guesses[count++] = self->room[0];
  }
  uint8_t *constrained = first->parts.constrained; /* of several parts */
  if (holds && constrained) flesh_system_fixed(evaluation->system, stage->t, constrained);
  if (flesh_uses(&self->options, FLESH_TECHNIQUE_RIGID_GUESS) && !(holds && !constrained) &&
      flesh_rigid_guess(&first->parts, holds ? constrained : NULL, state, h, nearest, self->room[1]))
    guesses[count++] = self->room[1];
  guesses[count] = NULL;
}

/* Returns whether solves took at most so many iterations in an almost quadratic potential. The next solve will then,
 * too, and an extrapolated first iterate helps; where bodies are tangled or collide, extrapolation may lead astray. */
static int were_easy(int most, const flesh_solve_stats *before, const flesh_solve_stats *after)
{
  return after->newton - before->newton <= most && after->projections == before->projections &&
         after->backtracks == before->backtracks;
}

/* Counts the steps in a row that were easy to solve or lead out of a tangle, including the one of so many stages that
 * has led to x. Steps with one iteration a stage resolve the motion, even if tets are inverted. */
static void count_easy(flesh_integrator *self, int stages, const flesh_solve_stats *before, const flesh_solve_stats *after,
                       const double *x)
{
  const int one = after->newton - before->newton <= stages, easy = were_easy(5 * stages, before, after);
  int *count = &self->memory.easy, most = FLESH_EASY_STEPS - flesh_error_control_flies(&self->control);
  if (*count < 0) *count = flesh_recovery_is_tangled(&self->recovery, x) ? -FLESH_TANGLED_STEPS : *count + 1;
  else if (!one && (!easy || flesh_recovery_is_inverted(&self->recovery, x))) *count = 0;
  else *count = *count < most ? *count + 1 : most;
}

void flesh_integrator_remember_solves(flesh_integrator *self, int stages, double h, const flesh_state *state,
                                      const flesh_solve_stats *before, const flesh_solve_stats *after)
{
  if (stages) count_easy(self, stages, before, after, state->x);
  if (self->first.extrapolation.n)
    flesh_extrapolation_remember(&self->first.extrapolation, self->nonlinear->u, self->evaluation->serial, state->t, h,
                                 were_easy(8, before, after));
}
