/* steps.c: a step in time: in pieces between events, each from a first iterate that goes on as before, each judged at
 * its end. */
#include <math.h>
#include <string.h>

#include "newton/mechanisms.h"
#include "time/integrator.h"
#include "system/feasible_step.h"
#include "time/step_energy.h"

/* A piece of time without events inside; those at its ends (within rounding of the state's time) are distinguished so
 * that the piece sees what holds between them. */
typedef struct piece {
  double begin; /* the first time that belongs to it */
  double end;   /* of the piece */
  double event; /* the next event after `begin`; at `end`, later, or INFINITY */
} piece;

/* The last moment before the event. */
static double before(double t, double event) { return t < event ? t : nextafter(event, -INFINITY); }

/* Starts the method anew: applies jumps of constrained dofs, or of their velocities, as the limit of a short step;
 * finds the acceleration for methods that go on from it. */
static int start_piece(flesh_integrator *self, flesh_state *state, const piece *piece,
                       flesh_solve_stats *stats)
{
  flesh_method_memory *memory = &self->memory;
  double *a = self->row->acceleration ? memory->vectors[0] : memory->a0;
  flesh_prescribed_set(&self->prescribed, piece->begin, before(piece->end, piece->event), state->x);
  flesh_prescribed_begin(&self->prescribed, memory->v0, a);
  int status = flesh_nonlinear_apply_constraint_jump(self->nonlinear, piece->begin, self->prescribed.x[0], memory->v0,
                                       state->x, state->v, stats);
  if (status || !self->row->acceleration) return status;
  return flesh_nonlinear_acceleration(self->nonlinear, state, piece->begin, a, stats);
}

/* The method begins at the state, where it knows nothing of it: at a start, after an event, a caller's change, or where
 * something broke. */
static int begin_anew(flesh_integrator *self, flesh_state *state, const piece *piece, double h, flesh_solve_stats *stats)
{
  flesh_extrapolation_forget(&self->first.extrapolation);
  int status = start_piece(self, state, piece, stats);
  if (status > 0)
    flesh_integrator_record_failure(self, &(flesh_stage){.t = piece->begin}, h, 0, status, stats);
  if (status) return status;
  self->internals.restart = 0;
  flesh_evaluation_changed(self->evaluation);
  flesh_energy_watch_jump(&self->watch, piece->begin, state);
  if (!self->row->acceleration) return FLESH_OK;
  return flesh_step_energy_begin(&self->watch, &self->prescribed, state, piece->begin, h, self->memory.vectors[0],
                                 self->first.extrapolated);
}

/* Data of find_end, a flesh_stage_end's, which finds the positions at the end of a part. */
typedef struct part_end {
  const flesh_integrator *self;
  const flesh_state *state;
} part_end;

static void find_end(void *data, const double *u, double *x)
{
  const part_end *end = data;
  const flesh_integrator *self = end->self;
  const int second = flesh_method_order(self->method) > 1;
  for (int d = 0; d < self->evaluation->n; d++)
    x[d] = second && self->prescribed.fixed[d] ? self->prescribed.x[FLESH_PRESCRIBED_POINTS - 1][d]
                                               : end->state->x[d] + u[d];
}

/* The state that the stage leads to at t_end, the moment before an event if there is one, must be one that can be
 * reached and, where it is not the stage itself, have an energy. *blocked: it is not the stage, and an obstacle that the
 * stage keeps out of bars the way to it. */
static int check_end(flesh_integrator *self, const flesh_stage *stage, const flesh_state *state,
                     double t_end, flesh_solve_stats *stats, int *blocked)
{
  const flesh_system *system = self->evaluation->system;
  if (stage->shift.x == 1 && flesh_nonlinear_is_clear(self->nonlinear)) return FLESH_OK;
  find_end(&(part_end){self, state}, flesh_nonlinear_unknowns(self->nonlinear), self->start);
  if (stage->shift.x == 1)
    return flesh_system_tunnelled(system, state->t, state->x, t_end, self->start) ? FLESH_UNDEFINED : FLESH_OK;
  *blocked = flesh_system_max_feasible_step(system, self->evaluation->environment.proximity, stage->internal,
                                            state->t, state->x, t_end, self->start) < 1;
  if (*blocked) return FLESH_UNDEFINED;
  return flesh_nonlinear_defined(self->nonlinear, t_end, self->start, state->v, self->energies, stats);
}

/* Whether a solve met nothing but a potential that is all but quadratic: then the next one will, and a first iterate
 * that goes on as before helps. Where bodies are tangled or collide it may lead astray. */
static int was_easy(const flesh_solve_stats *before, const flesh_solve_stats *after)
{
  return after->newton - before->newton <= 8 && after->projections == before->projections &&
         after->backtracks == before->backtracks;
}

/* First iterates for a step of h to stage->t: straight on, and as rigid bodies where some are free. */
static void make_guesses(flesh_integrator *self, const flesh_method_row *row, const flesh_state *state,
                         const flesh_stage *stage, double h, const double *guesses[3])
{
  const flesh_evaluation *evaluation = self->evaluation;
  flesh_first_iterates *first = &self->first;
  const int nearest = row == &flesh_method_backward_euler;
  const int holds = flesh_team_any(evaluation->team, flesh_system_holds(evaluation->system, stage->t));
  int count = 0;
  if (flesh_uses(&self->options, FLESH_TECHNIQUE_EXTRAPOLATION) &&
      flesh_extrapolation_guess(&first->extrapolation, evaluation->serial, state->t, h, first->extrapolated)) {
    flesh_nonlinear_go_on(self->nonlinear);
    guesses[count++] = first->extrapolated;
  }
  uint8_t *constrained = first->parts.constrained; /* of several parts */
  if (holds && constrained) flesh_system_fixed(evaluation->system, stage->t, constrained);
  if (flesh_uses(&self->options, FLESH_TECHNIQUE_RIGID_GUESS) && !(holds && !constrained) &&
      flesh_rigid_guess(&first->parts, holds ? constrained : NULL, state, h, nearest, first->rigid))
    guesses[count++] = first->rigid;
  guesses[count] = NULL;
}

/* The stage of a part of a piece, by `row`: constrained dofs follow the prescribed motion with its own velocity where
 * the method is of order 2, and as a step of backward Euler takes them where that stands in for it. */
static void make_stage(flesh_integrator *self, const flesh_method_row *row, const flesh_state *state,
                       const piece *piece, const flesh_span *part, flesh_stage *stage)
{
  flesh_method_memory *memory = &self->memory;
  const flesh_state *lagged = flesh_integrator_stage(self, state);
  const int second = flesh_method_order(self->method) > 1;
  self->trying = *part;
  row->stage(memory, state, part->end, part->h, stage);
  stage->t = before(stage->t, piece->event);
  stage->x_lag = lagged->x;
  stage->v_lag = lagged->v;
  stage->t_lag = lagged->t;
  stage->x_from = state->x;
  stage->t_from = state->t;
  stage->internal = state->internal;
  stage->frozen_at_solution = second && row == self->row;
  if (!second) return;
  flesh_prescribed_set(&self->prescribed, fmax(state->t, piece->begin), before(part->end, piece->event), state->x);
  if (row == self->row) flesh_prescribed_stage(&self->prescribed, stage, memory->v0, memory->a0);
}

/* Finds the end of the last solve of the stage. */
static void find_stage(const flesh_integrator *self, const flesh_stage *stage, double *x, double *v)
{
  const double *u = flesh_nonlinear_unknowns(self->nonlinear);
  for (int d = 0; d < self->evaluation->n; d++) {
    x[d] = stage->x0[d] + stage->shift.x * u[d];
    v[d] = (stage->v0 ? stage->v0[d] : 0) + stage->shift.v * u[d];
  }
}

/* Takes the state, and what is remembered, to the end of the part that the stage has led to. */
static void finish_part(flesh_integrator *self, const flesh_method_row *row, const flesh_stage *stage,
                        const flesh_span *part, flesh_state *state, flesh_solve_stats *stats)
{
  flesh_method_memory *memory = &self->memory;
  const double *u = flesh_nonlinear_unknowns(self->nonlinear);
  const int second = flesh_method_order(self->method) > 1, own = row == self->row;
  self->last_stage.known = stage->shift.x != 1;
  self->last_stage.at.t = stage->t;
  if (self->last_stage.known) find_stage(self, stage, self->last_stage.at.x, self->last_stage.at.v);
  row->finish(memory, u, part->h, state);
  flesh_evaluation_changed(self->evaluation);
  for (int d = 0; d < self->evaluation->n && !own && self->row->acceleration; d++)
    memory->vectors[0][d] = stage->a0[d] + stage->shift.a * u[d];
  state->t = part->end;
  stats->steps++;
  stats->order = second && own ? 2 : 1;
  stats->h_last = part->h;
  if (!second) return;
  flesh_prescribed_finish(&self->prescribed, state->x, state->v);
  memory->known = own || self->row->acceleration || !self->row->vectors;
  memory->h = part->h;
}

/* Whether a solve goes through softer materials first. What has no energy at the start fails as it is. */
static int begins_softer(flesh_integrator *self, const flesh_state *state)
{
  return flesh_uses(&self->options, FLESH_TECHNIQUE_SOFTENED_STEPS) &&
         flesh_recovery_is_tangled(&self->recovery, state->x) && self->watch.known &&
         self->options.line_search == FLESH_LINE_SEARCH_POTENTIAL;
}

/* Solves a stage again that has been solved, with what is lagged as the last solve has left it, until that changes
 * nothing or lag_iterations is reached. */
static int follow_lag(flesh_integrator *self, flesh_stage *stage, const flesh_state *state, const flesh_stage_end *end,
                      flesh_solve_stats *stats)
{
  const double *guesses[] = {self->lag.u, NULL}, target = stats->residual_target;
  for (int k = 1; k < self->lag.iterations; k++) {
    const int before_solve = stats->newton;
    memcpy(self->lag.u, flesh_nonlinear_unknowns(self->nonlinear), (size_t)self->evaluation->n * sizeof *self->lag.u);
    find_stage(self, stage, self->lag.x, self->lag.v);
    stage->x_lag = stage->x_from = self->lag.x;
    stage->v_lag = self->lag.v;
    stage->t_lag = stage->t_from = stage->t;
    flesh_nonlinear_set_target(self->nonlinear, target);
    const int status = flesh_multipliers_solve(&self->multipliers, stage, state, end, guesses, 0, stats);
    flesh_nonlinear_set_target(self->nonlinear, 0);
    if (status || stats->newton == before_solve) return status;
  }
  return FLESH_OK;
}

/* Updates the internal variables of a part that has been accepted, and what touches. Where that changes forces, what was
 * known of the motion is not that of the one to come. */
static int update_internals(flesh_integrator *self, flesh_state *state)
{
  int changed, touches_others = 0;
  int status = flesh_internals_update(&self->internals, &self->watch, state, &changed);
  if (!status) status = flesh_integrator_arrive(self, state, &touches_others);
  if (!changed && !touches_others) return status;
  flesh_evaluation_forces_changed(self->evaluation);
  flesh_extrapolation_forget(&self->first.extrapolation);
  self->memory.known = 0;
  self->internals.restart = 1;
  return status;
}

/* One try of a part of a piece by `row`: the method's own, or backward Euler in its stead. */
static int attempt(flesh_integrator *self, const flesh_method_row *row, flesh_state *state, const piece *piece,
                   const flesh_cutbacks *cutbacks, flesh_solve_stats *stats, int *blocked)
{
  const flesh_span *part = &cutbacks->part;
  const int depth = cutbacks->depth;
  const int second = flesh_method_order(self->method) > 1 && row == self->row;
  const flesh_solve_stats before_solve = *stats;
  const double *guesses[3];
  flesh_stage stage;
  make_stage(self, row, state, piece, part, &stage);
  make_guesses(self, row, state, &stage, part->h, guesses);
  const flesh_stage_end ends = {&(part_end){self, state}, find_end};
  const double from = fmax(state->t, piece->begin), to = before(part->end, piece->event);
  int status = begins_softer(self, state)
                   ? flesh_continuation_step(&self->continuation, &stage, state, &ends, guesses, stats)
                   : flesh_multipliers_solve(&self->multipliers, &stage, state, &ends, guesses, 0, stats);
  if (!status) status = check_end(self, &stage, state, to, stats, blocked);
  if (!status && self->lag.u) {
    status = follow_lag(self, &stage, state, &ends, stats);
    if (!status) status = check_end(self, &stage, state, to, stats, blocked);
  }
  if (status) flesh_integrator_record_failure(self, &stage, part->h, depth, status, stats);
  if (status) return status;
  const flesh_step_energy energy = {&self->watch, self->nonlinear, &stage, {self->start, self->first.extrapolated},
                                    second, from, to, self->energies};
  status = flesh_step_energy_count(&energy, state);
  if (status) return status;
  status = flesh_multipliers_accept(&self->multipliers, &stage, state);
  if (status) return status;
  finish_part(self, row, &stage, part, state, stats);
  if (self->first.extrapolation.n)
    flesh_extrapolation_remember(&self->first.extrapolation, flesh_nonlinear_unknowns(self->nonlinear),
                                 self->evaluation->serial, state->t, part->h, was_easy(&before_solve, stats));
  status = flesh_step_energy_judge(&energy, state, stats);
  if (status == FLESH_ERR_ENERGY) flesh_integrator_record_failure(self, &stage, part->h, depth, status, stats);
  return status ? status : update_internals(self, state);
}

/* Takes a part of a piece. A stage within the step balances what is met on the way, but the line through it ends as far
 * behind an obstacle as the nodes were before it. Halves help only once one step resolves how the barrier turns a node
 * around; meanwhile nodes bounce between ends that lie ever deeper in the barrier, and gain energy. Backward Euler's
 * end is its stage, and it damps. Its local error is of the second order, and impacts are few: the order of the whole
 * is kept, as by one such step at a start. */
static int take_part(flesh_integrator *self, flesh_state *state, const piece *piece, const flesh_cutbacks *cutbacks,
                     flesh_solve_stats *stats)
{
  const flesh_span *part = &cutbacks->part;
  int blocked = 0;
  if (self->internals.restart && flesh_method_order(self->method) > 1) {
    const struct piece rest = {part->begin, piece->end, piece->event};
    const int restarted = begin_anew(self, state, &rest, part->h, stats);
    if (restarted) return restarted;
  }
  int status = attempt(self, self->row, state, piece, cutbacks, stats, &blocked);
  if (!blocked) return status;
  status = attempt(self, &flesh_method_backward_euler, state, piece, cutbacks, stats, &blocked);
  stats->impact_steps += status == FLESH_OK;
  return status;
}

/* Steps through a piece of length h, halving what fails. */
static int walk(flesh_integrator *self, flesh_state *state, const piece *piece, double h, flesh_solve_stats *stats)
{
  flesh_cutbacks cutbacks = flesh_cutbacks_of((flesh_span){state->t, piece->end, h});
  int status;
  do {
    status = take_part(self, state, piece, &cutbacks, stats);
    stats->convergence_failures += status > 0;
  } while (flesh_cutbacks_next(&cutbacks, self->recovery.max_cutbacks, status));
  return status;
}

int flesh_integrator_step_in_time(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  const double begin = state->t, end = begin + h;
  if (!flesh_energy_watch_knows(&self->watch)) flesh_energy_watch_jump(&self->watch, begin, state);
  if (flesh_method_order(self->method) < 2)
    return walk(self, state, &(piece){begin, end, INFINITY}, h, stats);
  const double tolerance = flesh_rounding_of_time(begin, h);
  if (self->memory.serial != self->evaluation->serial) self->memory.known = self->last_stage.known = 0;
  int status = FLESH_OK;
  while (!status && state->t < end) {
    piece next = {.begin = state->t, .end = end};
    next.event = flesh_system_next_event(self->evaluation->system, state->t);
    while (next.event <= state->t + tolerance) {
      next.begin = next.event;
      next.event = flesh_system_next_event(self->evaluation->system, next.event);
    }
    if (next.event < end - tolerance) next.end = next.event;
    double length = state->t == begin && next.end == end ? h : next.end - state->t, t = state->t;
    flesh_evaluation_remember(self->evaluation, state);
    if (!self->memory.known) status = begin_anew(self, state, &next, length, stats);
    if (!status) status = walk(self, state, &next, length, stats);
    if (status && state->t == t) flesh_evaluation_restore(self->evaluation, state); /* the start has moved nothing */
    if (status || next.event <= state->t + tolerance) self->memory.known = 0;
  }
  self->memory.serial = self->evaluation->serial;
  return status;
}
