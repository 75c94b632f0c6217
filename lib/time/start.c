/* start.c: begins a method at a state of which it knows nothing. */
#include "time/start.h"

#include <math.h>
#include <string.h>

#include "time/attempt.h"
#include "time/step_energy.h"

/* Adds the state times `sign` to the jumps that the tape keeps. */
static void add_jump(const flesh_integrator *self, const flesh_state *state, double sign)
{
  const int n = self->tape ? self->evaluation->n : 0;
  for (int d = 0; d < n; d++) self->tape->jump[d] += sign * state->x[d], self->tape->jump[n + d] += sign * state->v[d];
}

/* Starts the method anew: applies jumps of constrained dofs, or of their velocities, as the limit of a short step;
 * finds the acceleration for methods that continue from it. */
static int start_piece(flesh_integrator *self, flesh_state *state, const flesh_piece *piece,
                       flesh_solve_stats *stats)
{
  flesh_method_memory *memory = &self->memory;
  double *a = self->row->acceleration ? memory->vectors[0] : memory->a0;
  const double seen = self->control.on ? 1e-2 : 1; /* of the piece; errors make its steps short */
  const double least = self->control.on ? 1e-2 * self->control.period : 0; /* in shorter steps rounding hides the acceleration */
  const double until = flesh_before(fmax(piece->end, piece->begin + least), piece->event);
  const double end = piece->begin + seen * (until - piece->begin);
  if (self->tape) self->tape->seen = end;
  flesh_prescribed_set(&self->prescribed, piece->begin, end, state->x);
  flesh_prescribed_begin(&self->prescribed, memory->v0, a);
  memory->before = memory->easy = 0;
  if (self->control.on && self->row->stages && flesh_recovery_is_inverted(&self->recovery, state->x) > 1)
    memory->easy = -FLESH_TANGLED_STEPS;
  add_jump(self, state, -1);
  int status = flesh_newton_apply_constraint_jump(self->nonlinear->newton, piece->begin, self->prescribed.x[0], memory->v0,
                                       state->x, state->v, stats);
  add_jump(self, state, 1);
  if (status || !self->row->acceleration) return status;
  return flesh_newton_acceleration(self->nonlinear->newton, state, piece->begin, a, stats);
}

/* The part of zero length with which methods begin that remember the acceleration, if multipliers hold constraints. Its
 * first stage moves the free dofs to where the constraints hold, by the least displacement in the norm of mass, as of a
 * short step at rest: forces by a velocity that does not follow the displacement have no potential. Its second stage, a
 * step of backward Euler by h, has the acceleration and the pressures with which they continue to hold; an acceleration
 * from the present pressures may have nothing to do with them. */
enum { ACCELERATION = 0, MOVED = 1 };
static const double start_part = 1e-2; /* of the step: an acceleration's error is of that order */

static int start_stages(const flesh_method_memory *memory)
{
  (void)memory;
  return 2;
}

static void start_stage(const flesh_method_memory *memory, const flesh_state *state, double t_end, double h, flesh_stage *stage)
{
  const double rate = 1 / h;
  const int moved = memory->at == 1;
  for (int d = 0; d < memory->n; d++) memory->a0[d] = moved ? -rate * state->v[d] : 0;
  *stage = (flesh_stage){.t = moved ? t_end : state->t, .load = 1, .prescribed_fraction = 1,
                         .shift = {.x = 1, .v = moved ? rate : 0, .a = rate * rate},
                         .x0 = moved ? memory->vectors[MOVED] : state->x, .a0 = memory->a0};
}

static void start_keep(flesh_method_memory *memory, const flesh_stage *stage, const double *u)
{
  for (int d = 0; d < memory->n && memory->at == 0; d++) memory->vectors[MOVED][d] = stage->x0[d] + u[d];
}

static void start_position(const flesh_method_memory *memory, double *x)
{
  memcpy(x, memory->vectors[MOVED], (size_t)memory->n * sizeof *x);
}

static void start_velocity(const flesh_method_memory *memory, const flesh_state *state, const double *u, double h, double *v)
{
  (void)u, (void)h;
  memcpy(v, state->v, (size_t)memory->n * sizeof *v);
}

static const flesh_method_row start_row = {.stages = start_stages, .stage = start_stage, .keep = start_keep,
                                           .position = start_position, .velocity = start_velocity};

/* Solves a stage of the start, lagging the positions x [n]. */
static int solve_start(flesh_integrator *self, flesh_state *state, const flesh_piece *piece, double h, flesh_solve_stats *stats)
{
  flesh_method_memory *memory = &self->memory;
  flesh_stage stage;
  start_stage(memory, state, piece->begin + h, h, &stage);
  stage.t = fmax(stage.t, piece->begin);
  stage.x_lag = stage.x_from = stage.x0;
  stage.v_lag = state->v;
  stage.t_lag = stage.t_from = state->t;
  stage.internal = state->internal;
  /* The start of bodies in free flight: from 0, a residual of their momentum over h would be left in the acceleration. */
  double *flight = self->room[0];
  const double *const guesses[] = {memory->at ? flight : NULL, NULL};
  for (int d = 0; d < memory->n; d++) flight[d] = h * state->v[d];
  int status = flesh_multipliers_solve(&self->multipliers, &stage, state, NULL, guesses, 0, stats);
  const double *u = self->nonlinear->u;
  if (!status && self->tape) status = self->tape->solved(self->tape->data, &stage, memory->at, u);
  if (!status) status = flesh_multipliers_accept(&self->multipliers, &stage, state);
  if (!status) start_keep(memory, &stage, u);
  return status;
}

/* Takes the state through the start. A status > 0 leaves it where it is. */
static int start_with_multipliers(flesh_integrator *self, flesh_state *state, const flesh_piece *piece, double h,
                                  flesh_solve_stats *stats)
{
  const double g = start_part * flesh_error_control_brief(&self->control, h), rate = 1 / g;
  const double *u = self->nonlinear->u;
  flesh_method_memory *memory = &self->memory;
  flesh_tape *tape = self->tape;
  const flesh_taken_part taken = {.row = &start_row, .second = 1, .acceleration = 1, .starts = 1, .memory = memory, .from = state,
                                  .lagged = state, .begin = piece->begin, .end = piece->begin + g, .h = g,
                                  .seen = tape ? tape->seen : 0};
  int status = FLESH_OK;
  /* The second stage closes the gaps that the first one leaves: its acceleration is off by these over g^2. */
  self->multipliers.allowed = start_part * start_part * self->multipliers.tolerance;
  if (tape) tape->try_part(tape->data);
  for (memory->at = 0; memory->at < 2 && !status; memory->at++) status = solve_start(self, state, piece, g, stats);
  memory->at = 0;
  if (!status && tape) status = tape->taken(tape->data, &taken);
  for (int d = 0; d < memory->n && !status; d++) {
    if (self->prescribed.fixed[d]) continue;
    memory->vectors[ACCELERATION][d] = rate * (rate * u[d] - state->v[d]);
    state->x[d] = memory->vectors[MOVED][d];
  }
  return status < 0 ? status : FLESH_OK;
}

int flesh_integrator_start(flesh_integrator *self, flesh_state *state, const flesh_piece *piece, double h,
                           flesh_solve_stats *stats)
{
  flesh_extrapolation_forget(&self->first.extrapolation);
  if (self->tape) self->tape->anew = 1;
  int status = start_piece(self, state, piece, stats);
  if (!status && self->multipliers.count && self->row->acceleration)
    status = start_with_multipliers(self, state, piece, h, stats);
  if (status > 0)
    flesh_integrator_record_failure(self, &(flesh_stage){.t = piece->begin}, h, 0, status, stats);
  if (status) return status;
  self->internals.restart = 0;
  flesh_evaluation_changed(self->evaluation);
  flesh_energy_watch_jump(&self->watch, piece->begin, state);
  if (self->control.on)
    flesh_error_control_start(&self->control, state, self->row->acceleration ? self->memory.vectors[0] : NULL);
  if (!self->row->acceleration) return FLESH_OK;
  return flesh_step_energy_begin(&self->watch, &self->prescribed, state, piece->begin, h, self->memory.vectors[0],
                                 self->room[0]);
}

int flesh_integrator_project_velocity(flesh_integrator *self, flesh_state *state, const flesh_piece *piece, double h,
                                      int *taken, flesh_solve_stats *stats)
{
  const double g = start_part * flesh_error_control_brief(&self->control, h);
  const double allowed = fmax(start_part * self->multipliers.tolerance, 1e-12); /* more than rounding leaves */
  const flesh_cutbacks only = {.part = {state->t, state->t + g, g}};
  double gap = 0;
  *taken = 0;
  if (!self->multipliers.count || self->row->stages) return FLESH_OK;
  int status = flesh_multipliers_gap(&self->multipliers, state->x, &gap);
  if (status || gap > allowed) return status;
  self->part.gap = start_part * allowed; /* the velocity is off by gaps over g */
  status = flesh_integrator_attempt(self, &flesh_method_backward_euler, state, piece, &only, stats);
  self->part.gap = 0;
  *taken = status == FLESH_OK;
  return status < 0 ? status : FLESH_OK;
}
