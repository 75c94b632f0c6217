/* steps.c: a step in time: in pieces between events, each in parts whose lengths are given or chosen by errors. */
#include <float.h>
#include <math.h>

#include "base/error.h"
#include "parallel/body_figures.h"
#include "time/attempt.h"
#include "time/start.h"

double flesh_rounding_of_time(double t, double h)
{
  return fmax(1e-9 * h, 8 * DBL_EPSILON * fmax(fabs(t), fabs(t + h)));
}

void flesh_integrator_record_failure(flesh_integrator *self, const flesh_stage *stage, double h, int halvings,
                                     int status, const flesh_solve_stats *stats)
{
  flesh_failure *f = &self->recovery.failure;
  *f = (flesh_failure){.status = status, .t = stage->t, .h = h, .halvings = halvings,
                       .residual = stats->residual_last, .target = stats->residual_target,
                       .volume_gap = self->multipliers.left,
                       .load = self->memory.method == FLESH_METHOD_STATIC ? stage->load : 0};
  f->worst_tet = flesh_body_worst_tet(self->recovery.mesh, self->evaluation->team, self->evaluation->x, &f->worst_J,
                                      f->worst_position);
  const flesh_known_residual *residual = &self->evaluation->residual;
  f->worst_node = residual->known ? flesh_evaluation_worst_node(self->evaluation, 1, residual->r, NULL) : -1;
}

/* Whether backward Euler takes the part of which the method's own try has failed. A stage within the step balances what
 * is met on the way, but the line through it ends as far behind an obstacle as the nodes were before it. Halves help only
 * once one step resolves how the barrier turns a node around; meanwhile nodes bounce between ends that lie ever deeper in
 * the barrier, and gain energy. Backward Euler's end is its stage, and it damps. Its local error is of the second order,
 * and impacts are few: the order of the whole is kept, as by one such step at a start. Where errors choose steps, that
 * before an impact may be so long that it would take the rebound away, so that shorter ones are tried first. Backward
 * Euler also takes over where the energy grows and some halvings have not helped, as a method without damping then feeds
 * the motion. */
static int needs_euler(const flesh_integrator *self, const flesh_cutbacks *cutbacks)
{
  enum { HALVINGS = 3 };
  const int most = self->recovery.max_cutbacks < HALVINGS ? self->recovery.max_cutbacks : HALVINGS;
  const int lasts = self->control.on ? flesh_error_control_keeps_gaining(&self->control) : cutbacks->depth >= most;
  const int short_enough = !self->control.on || self->control.failed >= HALVINGS;
  return (self->part.blocked && short_enough) || (self->control.refusal == FLESH_REFUSED_BY_ENERGY && lasts);
}

/* Whether the acceleration at the start would by itself take a node farther than an edge within the first step: bodies
 * begin within reach of a stiff barrier, or a load at a point is not balanced. What follows is not resolved, and methods
 * that go on from the acceleration are led far astray by it, while one step of backward Euler damps what it makes and
 * keeps the order of the whole (Rannacher 1984, "Finite element solution of diffusion problems with irregular data"). A
 * large max_energy_gain allows such steps: its caller wants the plain method. */
static int begins_violently(const flesh_integrator *self, double h)
{
  const flesh_evaluation *evaluation = self->evaluation;
  if (!self->row->acceleration || self->memory.known || self->control.on) return 0;
  const double *a = self->memory.vectors[0];
  double most = 0;
  for (int i = 0; i < evaluation->n; i += 3)
    most = fmax(most, a[i] * a[i] + a[i + 1] * a[i + 1] + a[i + 2] * a[i + 2]);
  const double edge = flesh_body_mean_edge(flesh_system_mesh(evaluation->system), evaluation->team);
  return flesh_team_any(evaluation->team, h * h / 2 * sqrt(most) > edge * fmax(1, self->watch.limit));
}

/* Whether backward Euler takes the step, because the body is tangled and its acceleration is not the way out. Where errors
 * choose steps this holds for bodies that have begun in a tangle alone: their way out is no motion that could have an error,
 * so that its steps are as long as they may be. Two more steps damp the velocities that it leaves, as in begins_violently. */
static int is_tangled(flesh_integrator *self, const flesh_state *state)
{
  if (!self->row->stages) return 0;
  return self->control.on ? self->memory.easy < 0 : flesh_recovery_is_tangled(&self->recovery, state->x);
}

/* Returns the row that takes the next step. If errors choose steps, the first step is the stand-in's: in methods that
 * damp little, an acceleration that jumps at the start would swing on, unresolved (Rannacher 1984). */
static const flesh_method_row *acting_row(const flesh_integrator *self)
{
  const int stands_in = self->row->stand_in && (self->control.first || self->control.stands_in);
  return stands_in ? self->row->stand_in : self->row;
}

/* Takes a part of a piece. */
static int take_part(flesh_integrator *self, flesh_state *state, const flesh_piece *piece, const flesh_cutbacks *cutbacks,
                     flesh_solve_stats *stats)
{
  const flesh_span *part = &cutbacks->part;
  self->control.refusal = FLESH_REFUSED_BY_NOTHING;
  if (self->internals.restart && self->second) {
    const flesh_piece rest = {part->begin, piece->end, piece->event};
    const int restarted = flesh_integrator_start(self, state, &rest, part->h, stats);
    if (restarted) return restarted;
  }
  const int damps = is_tangled(self, state) || begins_violently(self, cutbacks->part.h);
  const flesh_method_row *row = damps ? &flesh_method_backward_euler : acting_row(self);
  int status = flesh_integrator_attempt(self, row, state, piece, cutbacks, stats);
  stats->damped_steps += self->control.on && status == FLESH_OK && (damps || self->control.stands_in);
  if (damps || !needs_euler(self, cutbacks)) return status;
  const int blocked = self->part.blocked;
  self->control.refusal = FLESH_REFUSED_BY_NOTHING;
  status = flesh_integrator_attempt(self, &flesh_method_backward_euler, state, piece, cutbacks, stats);
  if (blocked) stats->impact_steps += status == FLESH_OK;
  else stats->damped_steps += status == FLESH_OK;
  return status;
}

int flesh_integrator_pass(flesh_integrator *self, const flesh_state *state, flesh_step_place *place)
{
  int status = FLESH_OK;
  if (self->tape) {
    flesh_evaluation_remember(self->evaluation, state);
    status = self->tape->pass(self->tape->data, place);
  }
  place->at_begin = 0;
  return status;
}

/* Steps through a piece of length h, or the rest of it, halving or quartering parts that fail. */
static int walk(flesh_integrator *self, flesh_state *state, flesh_step_place *place, double h, flesh_solve_stats *stats)
{
  flesh_cutbacks *cutbacks = &place->cutbacks;
  int status, more;
  if (!place->in_piece) *cutbacks = flesh_cutbacks_of((flesh_span){state->t, place->piece.end, h});
  place->in_piece = 1;
  do {
    status = take_part(self, state, &place->piece, cutbacks, stats);
    const int gains = status > 0 && self->control.refusal == FLESH_REFUSED_BY_ENERGY;
    stats->rejected += gains;
    stats->convergence_failures += status > 0 && !gains;
    /* A solve takes hundreds of iterations before it is known not to converge, so its part is quartered. */
    const int halvings = status == FLESH_NOT_CONVERGED && !gains ? 2 : 1;
    more = flesh_cutbacks_next(cutbacks, halvings, self->recovery.max_cutbacks, status);
    if (more && !status && (status = flesh_integrator_pass(self, state, place))) return status;
  } while (more);
  return status;
}

/* Tells the observer of a step of h that has led to the state. */
static int show(const flesh_integrator *self, const flesh_state *state, const flesh_error_control *control, double h,
                const flesh_solve_stats *stats)
{
  const flesh_internal_step step = {.t = state->t, .h = h, .order = stats->order, .rejected = control->rejected,
                                    .convergence_failures = control->failed, .state = state};
  return flesh_adaptive_options_show(&control->options, self->evaluation->team, &step);
}

/* Returns how far steps may lead within a piece. First steps, and those that resolve the motion, may pass its end. */
static double reach(const flesh_integrator *self, const flesh_piece *piece)
{
  const int resolves = self->memory.easy > 0 || (self->memory.easy == 0 && self->control.first);
  if (!self->ahead.from.x || self->tape || !resolves) return piece->end;
  return fmax(piece->end, fmin(piece->event, self->ahead.limit));
}

/* Takes one part of a piece, as long as its error allows; *refused: it was not accepted, for the reason in the control. */
static int take_controlled(flesh_integrator *self, flesh_state *state, const flesh_piece *piece,
                           flesh_solve_stats *stats)
{
  flesh_error_control *control = &self->control;
  const flesh_method_row *row = acting_row(self);
  const double until = reach(self, piece), left = until - state->t, known = self->memory.known ? self->memory.h : INFINITY;
  if (self->memory.easy < 0 && !control->failed) control->h = left;
  double h = fmin(flesh_error_control_propose(control, left), row->growth > 0 ? row->growth * known : INFINITY);
  const double rounding = flesh_rounding_of_time(state->t, h), to_end = piece->end - state->t; /* at most `left` */
  const double end = left - h < rounding ? until : fabs(to_end - h) < rounding ? piece->end : state->t + h;
  if (end == until || end == piece->end) h = end - state->t; /* no step of the size of rounding remains */
  const flesh_cutbacks only = {.part = {state->t, end, h}};
  const flesh_method_row *aimed = control->stands_in ? row : self->row; /* the second step must not be far longer */
  const int order = aimed->order ? aimed->order(&self->memory) : flesh_method_order(self->memory.method);
  const int stages = row->stages ? row->stages(&self->memory) : 1;
  flesh_error_control_aim(control, order, state, h);
  self->watch.floor = flesh_error_control_least_energy(control, row->swings);
  if (until > piece->end) flesh_ahead_remember(&self->ahead, state);
  int status = take_part(self, state, piece, &only, stats);
  if (status < 0) return status;
  if (status > 0 && !control->refusal) control->refusal = FLESH_REFUSED_BY_SOLVE;
  stats->convergence_failures += control->refusal == FLESH_REFUSED_BY_SOLVE;
  stats->rejected += control->refusal && control->refusal != FLESH_REFUSED_BY_SOLVE;
  if (!status) status = show(self, state, control, h, stats);
  if (status < 0) return status;
  const int swings = acting_row(self)->swings;
  flesh_error_control_learn(control, h);
  if (swings && flesh_error_control_misleads(control)) control->stands_in = 1;
  const int then = row->stages ? row->stages(&self->memory) : 1;
  if (then != stages) flesh_error_control_change(control, then > stages);
  return status;
}

/* Steps through a piece, or the rest of it, by steps that its error chooses. */
static int walk_by_error(flesh_integrator *self, flesh_state *state, flesh_step_place *place, flesh_solve_stats *stats)
{
  const flesh_error_control *control = &self->control;
  const flesh_piece *piece = &place->piece;
  const double shortest = flesh_rounding_of_time(piece->begin, 1e-2 * (piece->end - piece->begin));
  int status = FLESH_OK;
  place->in_piece = 1;
  while (state->t < piece->end && status >= 0) {
    if (place->tries++ >= control->options.max_steps) {
      const flesh_stage reached = {.t = state->t};
      flesh_integrator_record_failure(self, &reached, control->h, 0, FLESH_ERR_INTEGRATOR, stats);
      return flesh_fail(FLESH_ERR_INTEGRATOR, "at t = %.9g s: max_steps = %d internal steps did not lead to %.9g s",
                        state->t, control->options.max_steps, piece->end);
    }
    status = take_controlled(self, state, piece, stats);
    if (status > 0 && control->h < shortest) return status;
    if (!status && state->t < piece->end) status = flesh_integrator_pass(self, state, place);
  }
  return status < 0 ? status : FLESH_OK;
}

/* Finds the piece that begins at the state, in a step to `end`; returns its length. */
static double find_piece(const flesh_integrator *self, const flesh_state *state, flesh_step_place *place, double end,
                         double tolerance)
{
  flesh_piece *next = &place->piece;
  *next = (flesh_piece){.begin = state->t, .end = end};
  next->event = flesh_system_next_event(self->evaluation->system, state->t);
  while (next->event <= state->t + tolerance) {
    next->begin = next->event;
    next->event = flesh_system_next_event(self->evaluation->system, next->event);
  }
  if (next->event < end - tolerance) next->end = next->event;
  return state->t == place->begin && next->end == end ? place->h : next->end - state->t;
}

/* Begins the method with the piece, whose length is *h. */
static int begin_piece(flesh_integrator *self, flesh_state *state, flesh_step_place *place, double end, double tolerance,
                       double *h, flesh_solve_stats *stats)
{
  int is_projected = 0;
  int status = flesh_integrator_start(self, state, &place->piece, *h, stats);
  if (!status) status = flesh_integrator_project_velocity(self, state, &place->piece, *h, &is_projected, stats);
  if (status || !is_projected) return status;
  *h = find_piece(self, state, place, end, tolerance);
  return flesh_integrator_start(self, state, &place->piece, *h, stats);
}

/* Takes the state through a piece, or the rest of it. */
static int take_piece(flesh_integrator *self, flesh_state *state, flesh_step_place *place, double end, double tolerance,
                      flesh_solve_stats *stats)
{
  const double t = state->t;
  double length = 0;
  int status = FLESH_OK;
  if (!place->in_piece) {
    length = find_piece(self, state, place, end, tolerance);
    flesh_evaluation_remember(self->evaluation, state);
    status = flesh_integrator_pass(self, state, place);
    if (!status && !self->memory.known) status = begin_piece(self, state, place, end, tolerance, &length, stats);
  }
  if (!status) status = self->control.on ? walk_by_error(self, state, place, stats) : walk(self, state, place, length, stats);
  if (status && state->t == t) flesh_evaluation_restore(self->evaluation, state); /* the start has moved nothing */
  if (status || place->piece.event <= state->t + tolerance) self->memory.known = 0;
  place->in_piece = 0;
  return status;
}

/* Events so near to a state [s] count as being at it. A brief piece would close the gaps that incompressible tets may
 * have, at a speed that grows with its briefness. */
static double near_events(const flesh_integrator *self, double begin, double h)
{
  static const double brief = 1e-3; /* of the step; so that a third of a second may have four digits */
  const double step = self->control.on && self->control.h > 0 ? fmin(h, self->control.h) : h;
  return fmax(flesh_rounding_of_time(begin, h), self->multipliers.count ? brief * step : 0);
}

int flesh_integrator_step_in_time(flesh_integrator *self, flesh_state *state, flesh_step_place *place,
                                  flesh_solve_stats *stats)
{
  const double begin = place->begin, end = begin + place->h;
  int status = FLESH_OK;
  if (!flesh_energy_watch_knows(&self->watch)) flesh_energy_watch_jump(&self->watch, begin, state);
  if (!self->second) {
    place->piece = (flesh_piece){begin, end, INFINITY};
    if (place->at_begin) status = flesh_integrator_pass(self, state, place);
    return status ? status : walk(self, state, place, place->h, stats);
  }
  const double tolerance = near_events(self, begin, place->h);
  if (place->at_begin && self->memory.serial != self->evaluation->serial)
    self->memory.known = self->last_stage.known = 0;
  while (!status && state->t < end) status = take_piece(self, state, place, end, tolerance, stats);
  self->memory.serial = self->evaluation->serial;
  return status;
}
