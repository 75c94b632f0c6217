/* steps.c: a step in time: in pieces between events, each from a first iterate that goes on as before, each judged at
 * its end. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "time/integrator.h"
#include "time/step_energy.h"

/* A piece of time without events inside; those at its ends (within rounding of the state's time) are told apart so
 * that the piece sees what holds between them. */
typedef struct piece {
  double begin; /* the first time that belongs to it */
  double end;   /* of the piece */
  double event; /* the next event after `begin`; at `end`, later, or INFINITY */
} piece;

/* What the walk through a piece hands to its attempts. */
typedef struct piece_walk {
  flesh_integrator *self;
  flesh_state *state;
  const piece *piece;
  flesh_solve_stats *stats;
} piece_walk;

/* The last moment before the event. */
static double before(double t, double event) { return t < event ? t : nextafter(event, -INFINITY); }

/* Where the method starts anew, constrained dofs may have jumped, or their velocities: what a short step would make of
 * that; and the acceleration, for methods that go on from it. */
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
  return flesh_nonlinear_acceleration(self->nonlinear, piece->begin, state->x, state->v, a, stats);
}

/* The state that the stage leads to must be one that can be reached and, where it is not the stage itself, have an
 * energy. */
static int check_end(flesh_integrator *self, const flesh_stage *stage, const flesh_state *state,
                     double t_end, flesh_solve_stats *stats)
{
  if (stage->shift.x == 1 && !flesh_system_limits_step(self->system)) return FLESH_OK;
  const double *u = flesh_nonlinear_unknowns(self->nonlinear);
  const int second = flesh_method_order(self->method) > 1;
  for (int d = 0; d < self->n; d++)
    self->start[d] = second && self->prescribed.fixed[d]
                         ? self->prescribed.x[FLESH_PRESCRIBED_POINTS - 1][d]
                         : state->x[d] + u[d];
  if (flesh_system_tunnelled(self->system, state->t, state->x, t_end, self->start)) return FLESH_UNDEFINED;
  if (stage->shift.x == 1) return FLESH_OK;
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
static void make_guesses(flesh_integrator *self, const flesh_state *state, const flesh_stage *stage, double h,
                         const double *guesses[3])
{
  const int holds = flesh_system_holds(self->system, stage->t), nearest = self->row == &flesh_method_backward_euler;
  int count = 0;
  if (flesh_extrapolation_guess(&self->extrapolation, state, h, self->guess)) {
    flesh_nonlinear_go_on(self->nonlinear);
    guesses[count++] = self->guess;
  }
  if (holds && self->held) flesh_system_fixed(self->system, stage->t, self->held);
  if (!(holds && !self->held) &&
      flesh_rigid_guess(&self->parts, holds ? self->held : NULL, state, h, nearest, self->rigid))
    guesses[count++] = self->rigid;
  guesses[count] = NULL;
}

/* One try of a part of a piece. */
static int attempt(flesh_integrator *self, flesh_state *state, const piece *piece, const flesh_span *part, int depth,
                   flesh_solve_stats *stats)
{
  const double t_end = part->end, h = part->h;
  flesh_method_memory *memory = &self->memory;
  const int second = flesh_method_order(self->method) > 1;
  flesh_stage stage;
  self->trying.t = state->t;
  self->trying.h = h;
  self->row->stage(memory, state, t_end, h, &stage);
  stage.t = before(stage.t, piece->event);
  stage.x_lag = state->x;
  stage.v_lag = state->v;
  stage.t_lag = state->t;
  stage.frozen_at_solution = second;
  if (second) {
    flesh_prescribed_set(&self->prescribed, fmax(state->t, piece->begin), before(t_end, piece->event),
                         state->x);
    flesh_prescribed_stage(&self->prescribed, &stage, memory->v0, memory->a0);
  }
  const flesh_solve_stats before_solve = *stats;
  const double *guesses[3];
  make_guesses(self, state, &stage, h, guesses);
  int status = flesh_nonlinear_solve(self->nonlinear, &stage, guesses, 0, stats);
  if (!status) status = check_end(self, &stage, state, t_end, stats);
  if (status) {
    flesh_integrator_record_failure(self, &stage, h, depth, status, stats);
    return status;
  }
  const double from = fmax(state->t, piece->begin), to = before(t_end, piece->event);
  const flesh_step_energy energy = {&self->watch, self->nonlinear, &stage, {memory->v0, memory->a0},
                                    second, from, to, self->energies};
  status = flesh_step_energy_count(&energy, state);
  if (status) return status;
  self->row->finish(memory, flesh_nonlinear_unknowns(self->nonlinear), h, state);
  state->t = t_end;
  stats->steps++;
  stats->order = second ? 2 : 1;
  stats->h_last = h;
  if (second) {
    flesh_prescribed_finish(&self->prescribed, state->x, state->v);
    memory->known = 1;
    memory->h = h;
  }
  if (self->extrapolation.n)
    flesh_extrapolation_remember(&self->extrapolation, flesh_nonlinear_unknowns(self->nonlinear), state, h,
                                 was_easy(&before_solve, stats));
  status = flesh_step_energy_judge(&energy, state, stats);
  if (status == FLESH_ERR_ENERGY) flesh_integrator_record_failure(self, &stage, h, depth, status, stats);
  return status;
}

/* Of flesh_recovery_step. */
static int attempt_part(void *data, const flesh_span *part, int depth)
{
  const piece_walk *walk = data;
  return attempt(walk->self, walk->state, walk->piece, part, depth, walk->stats);
}

/* Steps through a piece of length h, halving what fails. */
static int walk(flesh_integrator *self, flesh_state *state, const piece *piece, double h, flesh_solve_stats *stats)
{
  piece_walk walk = {self, state, piece, stats};
  return flesh_recovery_step(&self->recovery, &(flesh_span){state->t, piece->end, h}, attempt_part, &walk, stats);
}

static int same_state(const flesh_state *a, const flesh_state *b, int n, double tolerance)
{
  return fabs(a->t - b->t) <= tolerance && !memcmp(a->x, b->x, (size_t)n * sizeof *a->x) &&
         !memcmp(a->v, b->v, (size_t)n * sizeof *a->v);
}

int flesh_integrator_step_in_time(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  const double begin = state->t, end = begin + h;
  if (!flesh_energy_watch_knows(&self->watch, state)) flesh_energy_watch_jump(&self->watch, begin, state);
  if (flesh_method_order(self->method) < 2)
    return walk(self, state, &(piece){begin, end, INFINITY}, h, stats);
  /* Times closer than this are the same: grids of steps and times of events carry rounding. */
  const double tolerance = fmax(1e-9 * h, 8 * DBL_EPSILON * fmax(fabs(begin), fabs(end)));
  if (!same_state(state, &self->returned, self->n, tolerance)) self->memory.known = 0;
  int status = FLESH_OK;
  while (!status && state->t < end) {
    piece next = {.begin = state->t, .end = end};
    next.event = flesh_system_next_event(self->system, state->t);
    while (next.event <= state->t + tolerance) {
      next.begin = next.event;
      next.event = flesh_system_next_event(self->system, next.event);
    }
    if (next.event < end - tolerance) next.end = next.event;
    double length = state->t == begin && next.end == end ? h : next.end - state->t, t = state->t;
    flesh_integrator_remember(self, state);
    if (!self->memory.known) {
      flesh_extrapolation_forget(&self->extrapolation);
      status = start_piece(self, state, &next, stats);
    }
    if (status > 0)
      flesh_integrator_record_failure(self, &(flesh_stage){.t = next.begin}, length, 0, status, stats);
    if (!status && !self->memory.known) {
      flesh_energy_watch_jump(&self->watch, next.begin, state);
      if (self->row->acceleration)
        status = flesh_step_energy_begin(&self->watch, &self->prescribed, state, next.begin, length,
                                         self->memory.vectors[0], self->guess);
    }
    if (!status) status = walk(self, state, &next, length, stats);
    if (status && state->t == t) flesh_integrator_give_back(self, state); /* the start has moved nothing */
    if (status || next.event <= state->t + tolerance) self->memory.known = 0;
  }
  flesh_integrator_remember(self, state);
  return status;
}
