/* attempt.c: one try of a part of a step: solves its stages, each from a first iterate that continues the motion, and
 * decides whether the end is accepted. */
#include "time/attempt.h"

#include <math.h>
#include <string.h>

#include "base/parallel_vector.h"
#include "newton/mechanisms.h"
#include "system/feasible_step.h"
#include "system/one_effect.h"
#include "time/step_energy.h"

/* Data of find_end (a flesh_stage_end), which finds the positions at the end of a part. */
typedef struct part_end {
  const flesh_integrator *self;
  const flesh_state *state;
} part_end;

static void find_end(void *data, const double *u, double *x)
{
  const part_end *end = data;
  const flesh_integrator *self = end->self;
  const int second = self->second;
  for (int d = 0; d < self->evaluation->n; d++)
    x[d] = second && self->prescribed.fixed[d] ? self->prescribed.x[FLESH_PRESCRIBED_POINTS - 1][d] : end->state->x[d] + u[d];
}

/* Returns FLESH_UNDEFINED if the body must have passed through something on its way from the state to self->part.x at
 * t_to. */
static int tunnelled(const flesh_integrator *self, const flesh_stage *stage, const flesh_state *state, double t_to)
{
  const flesh_evaluation *e = self->evaluation;
  return flesh_system_tunnelled(e->system, e->environment.proximity, stage->internal, state->t, state->x, t_to, self->part.x)
             ? FLESH_UNDEFINED
             : FLESH_OK;
}

/* Checks the state that the stage leads to at t_end (the moment before an event if there is one): it must be reachable
 * and, if it is not the stage itself, have an energy. *blocked: it is not the stage, and an obstacle that the stage
 * keeps out of bars the way to it. */
static int check_end(flesh_integrator *self, const flesh_stage *stage, const flesh_state *state,
                     double t_end, flesh_solve_stats *stats, int *blocked)
{
  const flesh_system *system = self->evaluation->system;
  if (stage->shift.x == 1 && flesh_nonlinear_is_clear(self->nonlinear)) return FLESH_OK;
  find_end(&(part_end){self, state}, self->nonlinear->u, self->part.x);
  if (stage->shift.x == 1) return tunnelled(self, stage, state, t_end);
  *blocked = flesh_system_max_feasible_step(system, self->evaluation->environment.proximity, stage->internal,
                                            state->t, state->x, t_end, self->part.x) < 1;
  if (*blocked) return FLESH_UNDEFINED;
  return flesh_nonlinear_defined(self->nonlinear, t_end, self->part.x, state->v, self->part.energies, stats);
}

/* Returns whether the row is the method's own or the stand-in of its kind: backward Euler, where it takes a step, is
 * neither. */
static int is_own(const flesh_integrator *self, const flesh_method_row *row)
{
  return row == self->row || row == self->row->stand_in;
}

/* Makes the stage of a part of a piece, by `row`. Constrained dofs follow the prescribed motion with its own velocity
 * if the method is of order 2, and move as in a step of backward Euler if that stands in for it. */
static void make_stage(flesh_integrator *self, const flesh_method_row *row, const flesh_state *state,
                       const flesh_piece *piece, const flesh_span *part, flesh_stage *stage)
{
  flesh_method_memory *memory = &self->memory;
  const flesh_state *lagged = memory->at > 0 ? &self->last_stage.at : flesh_integrator_stage(self, state);
  const int second = self->second;
  self->part.span = *part;
  row->stage(memory, state, part->end, part->h, stage);
  stage->t = flesh_before(stage->t, piece->event);
  stage->x_lag = lagged->x;
  stage->v_lag = lagged->v;
  stage->t_lag = lagged->t;
  stage->x_from = state->x;
  stage->t_from = state->t;
  stage->internal = state->internal;
  stage->frozen_at_solution = second && is_own(self, row);
  if (!second) return;
  if (memory->at == 0)
    flesh_prescribed_set(&self->prescribed, fmax(state->t, piece->begin), flesh_before(part->end, piece->event), state->x);
  if (is_own(self, row)) flesh_prescribed_stage(&self->prescribed, stage, memory->v0, memory->a0);
}

/* Finds the end of the last solve of the stage. */
static void find_stage(const flesh_integrator *self, const flesh_stage *stage, double *x, double *v)
{
  const double *u = self->nonlinear->u;
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
  const double *u = self->nonlinear->u;
  const int second = self->second, own = is_own(self, row);
  self->last_stage.known = stage->shift.x != 1;
  self->last_stage.at.t = stage->t;
  if (self->last_stage.known) find_stage(self, stage, self->last_stage.at.x, self->last_stage.at.v);
  flesh_method_finish(row, memory, u, part->h, state);
  flesh_evaluation_changed(self->evaluation);
  for (int d = 0; d < self->evaluation->n && !own && self->row->acceleration; d++)
    memory->vectors[0][d] = stage->a0[d] + stage->shift.a * u[d];
  if (!own) memory->before = 0;
  state->t = part->end;
  stats->steps++;
  stats->order = !own || !second ? 1 : row->order ? row->order(memory) : flesh_method_order(self->memory.method);
  stats->h_last = part->h;
  if (!second) return;
  flesh_prescribed_finish(&self->prescribed, state->x, state->v);
  memory->known = own || self->row->acceleration || !self->row->vectors;
  memory->h = part->h;
}

/* Returns whether a solve goes through softer materials first. A state without an energy is left to fail. */
static int begins_softer(flesh_integrator *self, const flesh_state *state)
{
  return flesh_uses(&self->options, FLESH_TECHNIQUE_SOFTENED_STEPS) &&
         flesh_recovery_softens(&self->recovery, state->x) && self->watch.known &&
         self->options.line_search == FLESH_LINE_SEARCH_POTENTIAL;
}

/* Earlier stages must be reachable, too: otherwise the stages that follow are solved in vain. */
static int check_stage(flesh_integrator *self, const flesh_stage *stage, const flesh_state *state)
{
  if (flesh_nonlinear_is_clear(self->nonlinear)) return FLESH_OK;
  find_stage(self, stage, self->part.x, self->room[1]);
  return tunnelled(self, stage, state, stage->t);
}

/* Takes in that the stage has been solved. */
static int tell_solved(const flesh_integrator *self, const flesh_stage *stage)
{
  return self->tape ? self->tape->solved(self->tape->data, stage, self->memory.at, self->nonlinear->u) : FLESH_OK;
}

/* Takes in that the part is about to be finished. */
static int tell_taken(const flesh_integrator *self, const flesh_method_row *row, const flesh_span *part, double begin,
                      double end, const flesh_state *state)
{
  flesh_tape *tape = self->tape;
  if (!tape) return FLESH_OK;
  const flesh_taken_part taken = {.row = row, .own = is_own(self, row), .second = self->second,
                                  .acceleration = self->row->acceleration, .anew = tape->anew, .memory = &self->memory,
                                  .from = state, .lagged = flesh_integrator_stage(self, state), .begin = begin, .end = end,
                                  .h = part->h, .seen = tape->seen};
  tape->anew = 0;
  return tape->taken(tape->data, &taken);
}

/* Finds the forces of contact [n], N, at the solved stage, with the lagged quantities of its solve. */
static int find_contact(flesh_integrator *self, double *forces)
{
  const flesh_point point = flesh_nonlinear_point(self->nonlinear);
  return flesh_system_roles_residual(self->evaluation->system, FLESH_ROLE_BIT(FLESH_ROLE_CONTACT), &point, forces);
}

/* Finds whether friction at the solved stage is off by more than `allowed`, N; if that is 0, by more than a fraction of
 * the contact forces (a few hundredths of friction if its coefficient is small). */
static int check_friction(flesh_integrator *self, double allowed, int *off)
{
  static const double little = 0.01;
  const flesh_evaluation *evaluation = self->evaluation;
  double *own = self->room[1], *lagged = self->part.x;
  flesh_point point = flesh_nonlinear_point(self->nonlinear);
  *off = flesh_team_any(evaluation->team, !flesh_nonlinear_is_clear(self->nonlinear));
  if (!*off) return FLESH_OK;
  point.lagged = (flesh_lagged){point.t, point.x, point.v};
  int status = find_contact(self, lagged);
  if (!status) status = flesh_system_roles_residual(evaluation->system, FLESH_ROLE_BIT(FLESH_ROLE_CONTACT), &point, own);
  if (status) return status;
  const double forces = flesh_norm(evaluation->threads, evaluation->n, own);
  for (int d = 0; d < evaluation->n; d++) lagged[d] -= own[d];
  *off = flesh_equations_norm(&self->nonlinear->newton->equations, lagged) > (allowed > 0 ? allowed : little * forces);
  return FLESH_OK;
}

/* Solves a solved stage again, with what is lagged as the last solve left it, until nothing changes or there have been
 * `iterations` solves; up to `most` while friction is off. Friction is off by more than `allowed`, N, if errors choose
 * steps; elsewhere that is 0. There `most` is that of fixed steps for stiff free parts, whose impacts steps do not
 * resolve. Follower loads hardly change the matrix, which is kept if contact is impossible: a checkpoint holds no near
 * pairs. */
static int follow_lag(flesh_integrator *self, flesh_stage *stage, const flesh_state *state, const flesh_stage_end *end,
                      double allowed, flesh_solve_stats *stats)
{
  const double *guesses[] = {self->lag.u, NULL}, target = stats->residual_target;
  const int iterations = allowed > 0 ? self->lag.controlled : self->lag.iterations;
  const int most = allowed > 0 && self->control.weights.flies == 0 ? self->lag.most_controlled : self->lag.most;
  int off = 1;
  for (int k = 1; k < most; k++) {
    const int before_solve = stats->newton;
    int status = k < iterations ? FLESH_OK : check_friction(self, allowed, &off);
    if (status || !off) return status;
    memcpy(self->lag.u, self->nonlinear->u, (size_t)self->evaluation->n * sizeof *self->lag.u);
    find_stage(self, stage, self->lag.x, self->lag.v);
    stage->x_lag = stage->x_from = self->lag.x, stage->v_lag = self->lag.v;
    stage->t_lag = stage->t_from = stage->t;
    if (!flesh_system_limits_step(self->evaluation->system)) self->nonlinear->newton->policy.stage_continues = 1;
    self->nonlinear->newton->goal.target = target;
    status = flesh_multipliers_solve(&self->multipliers, stage, state, end, guesses, 0, stats);
    self->nonlinear->newton->goal.target = 0;
    if (!status) status = tell_solved(self, stage);
    if (status || stats->newton == before_solve) return status;
  }
  return FLESH_OK;
}

/* Returns the tolerance of the errors that choose steps; 0: none do. */
static double tolerance_of_errors(const flesh_integrator *self)
{
  return self->control.on ? self->control.options.tolerance : 0;
}

/* Updates the internal variables of an accepted part, and what touches. If that changes forces, what is known of the
 * past motion does not apply to the motion to come. */
static int update_internals(flesh_integrator *self, flesh_state *state)
{
  int changed, touches_others = 0;
  const double tolerance = self->control.on || self->second ? tolerance_of_errors(self) : -1;
  int status = flesh_internals_update(&self->internals, &self->watch, state, tolerance, &changed);
  if (!status) status = flesh_integrator_arrive(self, state, &touches_others);
  if (!changed && !touches_others) return status;
  flesh_evaluation_forces_changed(self->evaluation);
  flesh_extrapolation_forget(&self->first.extrapolation);
  self->memory.known = 0;
  self->internals.restart = 1;
  return status;
}

/* A try of a part of a piece. */
typedef struct trial {
  const flesh_method_row *row; /* the method's own row, or the one that stands in for it */
  const flesh_piece *piece;
  const flesh_span *part;
  double from, to; /* s; span of the part, short of events at its ends */
} trial;

/* Returns whether the step's length is that which its error chooses. */
static int is_controlled(const flesh_integrator *self, const trial *trial)
{
  return self->control.on && trial->row->error != NULL;
}

/* Returns by how much constraints may be violated at the stage; 0: as the options say. If errors choose steps, a
 * stand-in leaves no larger gaps than the method's own stages, which would close them at once. */
static double gap_of(const flesh_integrator *self, const flesh_method_row *row, const flesh_stage *stage, int controlled)
{
  if (!self->control.on || self->part.gap > 0) return self->part.gap;
  const double gap = flesh_error_control_gap(&self->control, &stage->shift, row->swings);
  return controlled ? gap : fmin(gap, self->multipliers.tolerance);
}

/* Makes and solves the stage memory->at. The constraints of multipliers hold at the end of the step for the last stage,
 * and at the other stages themselves, which continue from the pressures of the stage before. */
static int solve_stage(flesh_integrator *self, const trial *trial, const flesh_state *state, int last,
                       flesh_stage *stage, flesh_solve_stats *stats)
{
  const double *guesses[3];
  flesh_state from = *state;
  make_stage(self, trial->row, state, trial->piece, trial->part, stage);
  flesh_integrator_guess(self, trial->row, state, stage, trial->part->h, guesses);
  if (self->memory.at > 0 && self->multipliers.count) from.multipliers = self->multipliers.trial;
  const flesh_stage_end ends = {&(part_end){self, state}, find_end}, *end = last ? &ends : NULL;
  const int controlled = is_controlled(self, trial);
  /* Steps that resolve the motion continue from where they are; softer materials would first lead away. */
  if (self->memory.at == 0) self->part.softer = !(controlled && !self->control.failed) && begins_softer(self, state);
  self->multipliers.allowed = gap_of(self, trial->row, stage, controlled);
  if (controlled && !self->part.softer) flesh_error_control_set_target(&self->control, &stage->shift);
  int led = 0;
  int status = self->part.softer ? flesh_continuation_step(&self->continuation, stage, &from, end, guesses, &led, stats)
                   : flesh_multipliers_solve(&self->multipliers, stage, &from, end, guesses, 0, stats);
  self->nonlinear->newton->goal.target = 0;
  if (led || status > 0) self->recovery.in_vain = 0;
  if (!status) status = tell_solved(self, stage);
  if (!status)
    status = last ? check_end(self, stage, state, trial->to, stats, &self->part.blocked) : check_stage(self, stage, state);
  if (!status && (controlled ? self->lag.most_controlled : self->lag.most) > 1) {
    const double allowed = controlled ? stats->residual_target * flesh_error_control_slip(&self->control) : 0;
    status = follow_lag(self, stage, &from, end, allowed, stats);
    if (!status && last) status = check_end(self, stage, state, trial->to, stats, &self->part.blocked);
  }
  flesh_nonlinear_set_weights(self->nonlinear, NULL);
  return status;
}

/* Passes the forces of contact at the solved stage to the error control, as no filtered estimate sees their errors. */
static int add_contact(flesh_integrator *self, const trial *trial)
{
  if (!is_controlled(self, trial) || !flesh_system_has_role(self->evaluation->system, FLESH_ROLE_CONTACT) ||
      !flesh_team_any(self->evaluation->team, !flesh_nonlinear_is_clear(self->nonlinear)))
    return FLESH_OK;
  const int status = find_contact(self, self->room[1]);
  if (!status) flesh_error_control_touch(&self->control, self->room[1]);
  return status;
}

/* Solves the stages of a step in turn; the last one is left in *stage. */
static int solve_stages(flesh_integrator *self, const trial *trial, const flesh_state *state, flesh_stage *stage,
                        flesh_step_energy *energy, flesh_solve_stats *stats)
{
  const flesh_method_row *row = trial->row;
  flesh_method_memory *memory = &self->memory;
  const flesh_point start = flesh_energy_watch_point(&self->watch, trial->from, state, NULL);
  int status = FLESH_OK, count = row->stages ? row->stages(memory) : 1;
  flesh_error_control_clear_contact(&self->control);
  for (int k = 0; k < count && !status; k++) {
    memory->at = k;
    status = solve_stage(self, trial, state, k == count - 1, stage, stats);
    if (!status) status = add_contact(self, trial);
    if (status || !row->stages) continue;
    const flesh_point point = flesh_nonlinear_point(self->nonlinear);
    if (is_controlled(self, trial) && !self->tape)
      status = flesh_momenta_keep(&self->control.momenta, row, memory, &start, &point, trial->part->h);
    row->keep(memory, stage, self->nonlinear->u);
    if (!status) status = flesh_step_energy_add(energy, row->weight(memory, k + 1), row->weight(memory, 0));
    if (k == count - 1) continue; /* the next stage lags the forces of this one */
    find_stage(self, stage, self->last_stage.at.x, self->last_stage.at.v);
    self->last_stage.at.t = stage->t;
  }
  memory->at = 0;
  return status;
}

/* Finds the end of the step that has been solved, in part.x and room[1]. */
static flesh_state end_of(flesh_integrator *self, const trial *trial, const flesh_state *state)
{
  const double *u = self->nonlinear->u;
  flesh_state end = *state;
  find_end(&(part_end){self, state}, u, self->part.x);
  trial->row->velocity(&self->memory, state, u, trial->part->h, self->room[1]);
  end.t = trial->part->end;
  end.x = self->part.x;
  end.v = self->room[1];
  if (self->second && is_own(self, trial->row)) flesh_prescribed_finish(&self->prescribed, end.x, end.v);
  if (self->multipliers.count) end.multipliers = self->multipliers.trial;
  return end;
}

/* Returns whether the change of internal variables is known in time. */
static int judge_change(flesh_integrator *self, const trial *trial, const flesh_state *state, const flesh_stage *stage,
                        flesh_solve_stats *stats)
{
  int changed;
  const flesh_state end = end_of(self, trial, state);
  const int status = flesh_internals_foresee(&self->internals, &self->watch, &end, tolerance_of_errors(self), &changed);
  if (status || !changed) return status;
  const flesh_point point = flesh_energy_watch_point(&self->watch, end.t, &end, NULL);
  self->control.refusal = flesh_error_control_judge_change(&self->control, self->prescribed.fixed, &point, self->internals.next,
                                                           trial->part->h, &stage->shift, stats);
  return FLESH_OK;
}

/* Returns whether the error of the step that has been solved is small enough. */
static int judge_error(flesh_integrator *self, const trial *trial, const flesh_state *state, const flesh_stage *stage,
                       flesh_solve_stats *stats)
{
  flesh_error_control *control = &self->control;
  control->error = NAN;
  if (!is_controlled(self, trial)) return FLESH_OK;
  if (!trial->row->error(&self->memory, state, self->nonlinear->u, trial->part->h, control->e)) return FLESH_OK;
  const double *momentum = trial->row->momentum ? trial->row->momentum(&self->memory, trial->part->h, self->room[1]) : NULL;
  control->refusal = flesh_error_control_judge(control, self->prescribed.fixed, momentum, trial->part->h, &stage->shift, stats);
  const int status = control->refusal || !self->internals.count ? FLESH_OK : judge_change(self, trial, state, stage, stats);
  return status ? status : control->refusal ? FLESH_NOT_CONVERGED : FLESH_OK;
}

/* Counts the work of the step that has been solved, and takes in its end. A step that gains energy is refused, as if
 * nothing had been counted. */
static int count_energy(flesh_integrator *self, const trial *trial, const flesh_state *state, const flesh_step_energy *energy)
{
  const flesh_energy_watch before = self->watch;
  const size_t bytes = (size_t)before.effects * sizeof *before.energies;
  const double tolerance = is_controlled(self, trial) ? self->control.options.tolerance : 0;
  memcpy(self->part.energies_before, before.energies, bytes);
  int status = flesh_step_energy_count(energy, state);
  if (status) return status;
  const flesh_state end = end_of(self, trial, state);
  status = flesh_step_energy_record(energy, state, &end);
  if (!status && self->second && !energy->second) {
    flesh_prescribed_finish(&self->prescribed, end.x, end.v);
    status = flesh_energy_watch_kick(&self->watch, &end);
  }
  if (status || !energy->second || !flesh_energy_watch_refuses(&self->watch, &before, tolerance)) return status;
  self->watch = before;
  memcpy(before.energies, self->part.energies_before, bytes);
  self->control.refusal = FLESH_REFUSED_BY_ENERGY;
  return FLESH_NOT_CONVERGED;
}

int flesh_integrator_attempt(flesh_integrator *self, const flesh_method_row *row, flesh_state *state, const flesh_piece *piece,
                   const flesh_cutbacks *cutbacks, flesh_solve_stats *stats)
{
  const flesh_span *part = &cutbacks->part;
  const trial trial = {row, piece, part, fmax(state->t, piece->begin), flesh_before(part->end, piece->event)};
  const int depth = cutbacks->depth, second = self->second && is_own(self, row);
  const flesh_solve_stats before_solve = *stats;
  flesh_stage stage = {.t = state->t};
  flesh_step_energy energy = {.watch = &self->watch, .nonlinear = self->nonlinear, .stage = &stage,
                              .scratch = {self->part.x, self->room[0]}, .second = second,
                              .from = trial.from, .to = trial.to, .energies = self->part.energies};
  self->part.blocked = 0;
  self->evaluation->environment.within_step = part->end < piece->end;
  if (self->tape) self->tape->try_part(self->tape->data);
  int status = solve_stages(self, &trial, state, &stage, &energy, stats);
  if (!status) status = judge_error(self, &trial, state, &stage, stats);
  if (!status) status = count_energy(self, &trial, state, &energy);
  if (status > 0) {
    flesh_integrator_record_failure(self, &stage, part->h, depth, status, stats);
    if (self->memory.easy > 0) self->memory.easy = 0;
  }
  if (!status) status = flesh_multipliers_accept(&self->multipliers, &stage, state);
  if (!status) status = tell_taken(self, row, part, trial.from, trial.to, state);
  if (status) return status;
  finish_part(self, row, &stage, part, state, stats);
  const int counts = row->stages || is_controlled(self, &trial) || self->memory.easy < 0;
  flesh_integrator_remember_solves(self, counts ? (energy.stages ? energy.stages : 1) : 0, part->h, state, &before_solve, stats);
  self->watch.serial = self->evaluation->serial; /* it was met */
  status = flesh_step_energy_judge(&energy, state, stats);
  if (status == FLESH_ERR_ENERGY) flesh_integrator_record_failure(self, &stage, part->h, depth, status, stats);
  return status ? status : update_internals(self, state);
}
