/* integrator.c: creates, configures and destroys an integrator, and chooses how it takes a step. */
#include "system/state.h"
#include "time/integrator.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "effect/effect.h"
#include "system/ranks.h"

static const double max_energy_gain = 0.5;
static const double doubt_of_work = 0.5; /* of the tolerance; test_energy.c */

/* Allocates `count` vectors in one block; NULL if there is no memory. */
static double *make_vectors(const flesh_integrator *self, size_t count, double ***vectors)
{
  size_t stride;
  double *all = flesh_huge_pages_vectors(count, (size_t)self->evaluation->n, &stride);
  for (size_t k = 0; all && k < count; k++) *vectors[k] = all + k * stride;
  return all;
}

static int fail_memory(const flesh_integrator *self)
{
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", self->evaluation->n);
}

/* Sets how often a stage is solved. Each repeated solve regains an order that lagged loads cost; impacts, in which the
 * normal forces behind friction change within a step, take more. */
static flesh_lag choose_lag(const flesh_integrator *self, int order, int second)
{
  enum { AT_IMPACTS = 4 };
  const flesh_system *system = self->evaluation->system;
  const int asked = self->options.lag_iterations, needed = second ? order > 2 ? order : 2 : 1;
  const int follows = flesh_system_has_follower_loads(system) && asked < needed;
  const int controlled = follows ? needed : asked > 1 ? asked : 1;
  if (asked != 0 || !second || !flesh_system_has_role(system, FLESH_ROLE_CONTACT))
    return (flesh_lag){.iterations = controlled, .most = controlled, .controlled = controlled, .most_controlled = controlled};
  return (flesh_lag){.iterations = controlled < 2 ? 2 : controlled, .most = AT_IMPACTS, .controlled = controlled,
                     .most_controlled = controlled < 2 ? 2 : controlled};
}

/* Allocates what a row needs, which may differ from the row before; without memory everything stays as it was. */
static int take_row(flesh_integrator *self, const flesh_method_row *row)
{
  const flesh_system *system = self->evaluation->system;
  const int order = flesh_method_order(self->memory.method), second = order > 1 || row->acceleration;
  double **vectors[5 + FLESH_METHOD_VECTORS], *all = NULL;
  flesh_last_stage last = {0};
  flesh_lag lag = choose_lag(self, order, second);
  size_t count = 0;
  int status = second && !self->prescribed.n ? flesh_prescribed_create(system, &self->prescribed) : FLESH_OK;
  if (status) return status;
  for (int k = 0; k < row->vectors; k++) vectors[count++] = &self->memory.vectors[k];
  if (second) {
    vectors[count++] = &last.at.x;
    vectors[count++] = &last.at.v;
  }
  if (lag.most > 1) {
    vectors[count++] = &lag.x;
    vectors[count++] = &lag.v;
    vectors[count++] = &lag.u;
  }
  if (count > 0 && !(all = make_vectors(self, count, vectors))) return fail_memory(self);
  free(self->memory.room);
  self->memory.room = all;
  self->last_stage = last;
  self->lag = lag;
  self->row = row;
  self->second = second;
  return FLESH_OK;
}

static int create_memory(flesh_integrator *self)
{
  const flesh_system *system = self->evaluation->system;
  const size_t effects = (size_t)flesh_system_effect_count(system) + 1;
  flesh_first_iterates *first = &self->first;
  flesh_method_memory *memory = &self->memory;
  double **vectors[] = {&memory->v0, &memory->a0, &self->part.x, &self->room[0], &self->room[1]};
  memory->n = self->evaluation->n;
  flesh_method_options_default(&memory->options);
  self->costs.effects = calloc(effects, sizeof *self->costs.effects);
  self->part.energies = calloc(2 * effects, sizeof *self->part.energies);
  if (!make_vectors(self, sizeof vectors / sizeof vectors[0], vectors) || !self->costs.effects || !self->part.energies)
    return fail_memory(self);
  self->part.energies_before = self->part.energies + effects;
  int status = flesh_evaluation_keep_state(self->evaluation);
  if (!status) status = take_row(self, self->row);
  if (!status && self->row->stage && !self->row->stages)
    status = flesh_extrapolation_create(self->evaluation->n, self->evaluation->own, self->evaluation->threads,
                                        &first->extrapolation);
  const int follows = memory->method == FLESH_METHOD_STATIC && flesh_system_has_follower_loads(system);
  if (!status) status = flesh_followers_create(self->nonlinear->newton, follows, &self->followers);
  if (!status) status = flesh_energy_watch_create(self->evaluation, &self->watch);
  if (!status) status = flesh_internals_create(system, &self->internals);
  if (!status) status = flesh_recovery_create(self->evaluation, &self->first.parts, &self->options, &self->recovery);
  return status ? status : flesh_multipliers_create(system, self->nonlinear, &self->options, &self->multipliers);
}

/* Makes what ranks make together, once each has made its own. */
static int create_together(flesh_integrator *self)
{
  int status = flesh_multipliers_create_collective(&self->multipliers);
  if (status) return status;
  status = flesh_recovery_create_collective(&self->recovery);
  const int softens =
      flesh_continuation_create(self->nonlinear, &self->multipliers, self->part.x, &self->continuation);
  if (!status) status = softens;
  if (self->memory.method == FLESH_METHOD_IDA)
    status = flesh_ida_steps_create_after(status, self->evaluation, &self->options, &self->watch, &self->ida);
  self->watch.limit = max_energy_gain;
  self->evaluation->environment.costs = &self->costs;
  if (self->ida) self->ida->problem->evaluation.environment.costs = &self->costs;
  return flesh_team_agree(self->evaluation->team, status);
}

int flesh_integrator_create(const flesh_system *system, flesh_method method,
                            const flesh_solver_options *options, flesh_integrator **integrator)
{
  FLESH_NEED({integrator, "integrator"});
  *integrator = NULL;
  FLESH_NEED({system, "system"}, {options, "options"});
  const flesh_method_row *row = flesh_method_find(method);
  if (!row) return flesh_fail(FLESH_ERR_ARGUMENT, "there is no integration method %d", (int)method);
  flesh_nonlinear *nonlinear;
  int status = flesh_nonlinear_create(system, options, &nonlinear);
  if (status) return status;
  flesh_integrator *self = calloc(1, sizeof *self);
  if (self) {
    self->memory.method = method;
    self->row = row;
    self->options = *options;
    self->nonlinear = nonlinear;
    self->evaluation = &nonlinear->newton->equations.evaluation;
    status = create_memory(self);
  } else {
    flesh_nonlinear_destroy(&nonlinear);
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for an integrator");
  }
  flesh_rigid_parts parts;
  status = flesh_rigid_parts_create(system, status, &parts);
  if (self) self->first.parts = parts;
  if (!status) status = create_together(self);
  if (status) flesh_integrator_destroy(&self);
  *integrator = self;
  return status;
}

flesh_costs *flesh_integrator_costs(flesh_integrator *integrator) { return &integrator->costs; }

void flesh_integrator_destroy(flesh_integrator **integrator)
{
  if (!integrator || !*integrator) return;
  if ((*integrator)->tape) (*integrator)->tape->gone((*integrator)->tape->data);
  flesh_continuation_clear(&(*integrator)->continuation);
  flesh_nonlinear_destroy(&(*integrator)->nonlinear);
  flesh_recovery_clear(&(*integrator)->recovery);
  flesh_ida_steps_destroy(&(*integrator)->ida);
  flesh_prescribed_clear(&(*integrator)->prescribed);
  free((*integrator)->memory.v0); /* frees all others of that block, too */
  free((*integrator)->memory.room);
  flesh_followers_clear(&(*integrator)->followers);
  free((*integrator)->costs.effects);
  free((*integrator)->part.energies);
  flesh_rigid_parts_clear(&(*integrator)->first.parts);
  flesh_extrapolation_clear(&(*integrator)->first.extrapolation);
  flesh_energy_watch_clear(&(*integrator)->watch);
  flesh_multipliers_clear(&(*integrator)->multipliers);
  flesh_internals_clear(&(*integrator)->internals);
  flesh_error_control_clear(&(*integrator)->control);
  flesh_ahead_clear(&(*integrator)->ahead);
  free(*integrator);
  *integrator = NULL;
}

/* Takes other options: the method begins anew, at the caller's state. */
static void start_over(flesh_integrator *self)
{
  if (self->ahead.shown) flesh_evaluation_changed(self->evaluation);
  self->ahead.shown = 0;
  self->memory.known = 0;
}

int flesh_integrator_set_method_options(flesh_integrator *integrator,
                                        const flesh_method_options *options)
{
  FLESH_NEED({integrator, "integrator"}, {options, "options"});
  int status = flesh_method_options_check(options);
  if (status) return status;
  integrator->memory.options = *options;
  start_over(integrator);
  return FLESH_OK;
}

flesh_method flesh_integrator_method(const flesh_integrator *integrator) { return integrator->memory.method; }

flesh_progress flesh_integrator_progress(const flesh_integrator *self)
{
  const flesh_newton *newton = self->nonlinear->newton;
  flesh_progress progress = {0};
  if (self->ida) flesh_ida_steps_progress(self->ida, &progress);
  else
    progress = (flesh_progress){.t = self->part.span.begin, .h = self->part.span.h, .newton = newton->stats.newton,
                                .linear = newton->stats.linear, .residual = newton->policy.previous_norm,
                                .target = newton->policy.target};
  return progress;
}

const flesh_failure *flesh_integrator_failure(const flesh_integrator *integrator) { return &integrator->recovery.failure; }

void *flesh_integrator_kinsol(const flesh_integrator *integrator) { return integrator->nonlinear->kinsol; }

void *flesh_integrator_ida(const flesh_integrator *integrator)
{
  return integrator->ida ? integrator->ida->ida : NULL;
}

int flesh_integrator_set_adaptive(flesh_integrator *integrator, const flesh_adaptive_options *options)
{
  FLESH_NEED({integrator, "integrator"}, {options, "options"});
  if (integrator->ida) return flesh_ida_steps_set_options(integrator->ida, options);
  int status = flesh_adaptive_options_check(options);
  if (status) return status;
  const flesh_method_row *own = flesh_method_find(integrator->memory.method),
                         *controlled = flesh_method_controlled(integrator->memory.method);
  if (options->control && !controlled)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the error of %s is not estimated, so that a tolerance cannot choose its steps",
                      flesh_method_name(integrator->memory.method));
  const flesh_method_row *row = options->control ? controlled : own;
  status = row == integrator->row ? FLESH_OK : take_row(integrator, row);
  if (!status)
    status = flesh_error_control_set(options, integrator->evaluation->system, &integrator->first.parts, integrator->nonlinear,
                                     &integrator->control);
  start_over(integrator);
  flesh_ahead_clear(&integrator->ahead);
  const int limited = flesh_team_any(integrator->evaluation->team, flesh_ahead_is_limited(integrator->evaluation->system));
  if (!status && options->control && !limited)
    status = flesh_ahead_create(&integrator->control, integrator->prescribed.fixed,
                                row->acceleration ? integrator->memory.vectors[0] : NULL, &integrator->ahead);
  status = flesh_team_agree(integrator->evaluation->team, status);
  if (!status) flesh_error_control_measure(&integrator->control);
  integrator->memory.held = flesh_team_any(integrator->evaluation->team, options->control && integrator->multipliers.count);
  integrator->watch.floor = 0;
  integrator->watch.doubt = options->control && !status ? doubt_of_work * options->tolerance : 0;
  return status;
}

void flesh_integrator_set_stop(flesh_integrator *integrator, int (*stop)(void *data), void *data)
{
  integrator->nonlinear->newton->stop = (flesh_stop){stop, data};
  if (integrator->ida) integrator->ida->stop = (flesh_stop){stop, data};
}

const char *flesh_integrator_warning(const flesh_integrator *integrator)
{
  return integrator->watch.warning[0] ? integrator->watch.warning : NULL;
}

const flesh_energy_balance *flesh_integrator_energy_balance(const flesh_integrator *integrator)
{
  return &integrator->watch.balance;
}

int flesh_integrator_set_max_energy_gain(flesh_integrator *integrator, double gain)
{
  FLESH_NEED({integrator, "integrator"});
  if (!(gain > 0)) return flesh_fail(FLESH_ERR_ARGUMENT, "max_energy_gain is %g; it must be positive", gain);
  integrator->watch.limit = gain;
  return FLESH_OK;
}

flesh_separation flesh_integrator_separation(const flesh_integrator *integrator)
{
  const flesh_system *system = integrator->evaluation->system;
  flesh_separation separation = {.t_apart = NAN};
  for (int e = 0; e < flesh_system_effect_count(system); e++) {
    const flesh_effect_private *can = flesh_effect_private_of(flesh_system_effect(system, e));
    const void *near = flesh_proximity_of(integrator->evaluation->environment.proximity, e);
    if (near && can->separation) can->separation(near, &separation);
  }
  return separation;
}

/* Returns the status of flesh_proximity_follow; a recoverable one becomes FLESH_ERR_NONFINITE, as the step is not tried
 * again. */
static int end_of_following(int status, const flesh_state *state)
{
  return status <= 0 ? status : flesh_fail(FLESH_ERR_NONFINITE, "the state at t = %g s is not finite", state->t);
}

int flesh_integrator_begin(flesh_integrator *self, const flesh_state *state)
{
  int changed;
  return end_of_following(
      flesh_proximity_follow(self->evaluation->environment.proximity, 0, state->t, state->x, &changed), state);
}

int flesh_integrator_arrive(flesh_integrator *self, const flesh_state *state, int *changed)
{
  const int status = flesh_proximity_follow(self->evaluation->environment.proximity, 1, state->t, state->x, changed);
  if (!status && *changed) flesh_energy_watch_jump(&self->watch, state->t, state);
  return end_of_following(status, state);
}

int flesh_integrator_view(const flesh_integrator *self, const flesh_state *state, flesh_state *view)
{
  const int status = flesh_multipliers_view(&self->multipliers, state, view);
  return status ? status : flesh_internals_view(&self->internals, view);
}

const double *flesh_integrator_energies(const flesh_integrator *integrator, const flesh_state *state)
{
  const flesh_energy_watch *watch = &integrator->watch;
  flesh_state view;
  const int known = watch->t == state->t && flesh_energy_watch_knows(watch) && !flesh_integrator_view(integrator, state, &view);
  return known && flesh_evaluation_is_at(integrator->evaluation, &view, 0) ? watch->energies : NULL;
}

const flesh_state *flesh_integrator_stage(const flesh_integrator *self, const flesh_state *state)
{
  return self->last_stage.known && !self->ahead.shown ? &self->last_stage.at : state;
}

static int step_by_ida(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  int status = flesh_ida_steps_step(self->ida, state, h, stats);
  if (status == FLESH_ERR_INTEGRATOR || status == FLESH_ERR_ENERGY)
    self->recovery.failure = self->ida->failure;
  return status;
}

/* Looks for a tangle at the end of a step, and untangles it. The energy set free does not count as the motion's. */
static int untangle(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  int status = flesh_untangler_after_step(self->recovery.untangler, state, h);
  if (status == 1) status = flesh_continuation_rest(&self->continuation, self->recovery.untangler, 0, state, stats);
  if (status == 1) {
    if (self->tape) self->tape->untangled = 1;
    self->last_stage.known = 0;
    flesh_energy_watch_jump(&self->watch, state->t, state);
  }
  return status < 0 ? status : FLESH_OK;
}

/* Takes the rest of a step from a place on, from a state that has the multipliers and internal variables that the
 * system needs. */
static int take_step(flesh_integrator *self, flesh_state *state, flesh_step_place *place, flesh_solve_stats *stats)
{
  const double h = place->h;
  int status;
  flesh_untangler *untangler = self->recovery.untangler;
  if (untangler && place->at_begin) flesh_untangler_before_step(untangler, state);
  self->watch.step = h;
  if (self->ida) status = step_by_ida(self, state, h, stats);
  else if (self->memory.method == FLESH_METHOD_STATIC) {
    status = flesh_integrator_pass(self, state, place);
    if (!status) status = flesh_integrator_find_equilibrium(self, state, h, stats);
  } else status = flesh_integrator_step_in_time(self, state, place, stats);
  if (!status && untangler && self->memory.method != FLESH_METHOD_STATIC) status = untangle(self, state, h, stats);
  if (!status) status = flesh_ahead_show(&self->ahead, place->begin + h, self->part.x, state, stats);
  if (status == FLESH_ERR_INTEGRATOR || status > 0) flesh_energy_watch_last(&self->watch, state);
  if (status <= 0 || self->ida) return status;
  return flesh_recovery_fail(&self->recovery);
}

static int step_alone(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  flesh_state view;
  if (!(h >= 0 && h < INFINITY) || (h == 0 && self->memory.method != FLESH_METHOD_STATIC))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the step is %g s; it must be positive and finite", h);
  if (!(state->t + h < INFINITY && (h == 0 || state->t + h > state->t)))
    return flesh_fail(FLESH_ERR_ARGUMENT, "a step of %g s from t = %g s ends at %g s; it must end later, and at a finite time",
                      h, state->t, state->t + h);
  int status = flesh_integrator_view(self, state, &view);
  if (status) return status;
  const double rounding = flesh_rounding_of_time(view.t, h);
  const int moved = !flesh_evaluation_is_at(self->evaluation, &view, rounding) || (self->ahead.shown && self->tape);
  if (moved) status = flesh_evaluation_check_state(self->evaluation, &view);
  if (!status) status = flesh_integrator_begin(self, state);
  if (status) return status;
  if (moved) {
    if (self->tape && (status = self->tape->moved(self->tape->data))) return status;
    flesh_evaluation_changed(self->evaluation);
    /* A failure is described by the positions evaluated last, even if none have been. */
    memcpy(self->evaluation->x, view.x, (size_t)self->evaluation->n * sizeof *view.x);
    flesh_multipliers_forget(&self->multipliers);
    self->ahead.shown = 0;
  }
  const double begin = view.t;
  int shown;
  status = flesh_ahead_go_on(&self->ahead, begin + h, rounding, self->part.x, &view, &shown, stats);
  if (!status && !shown) {
    flesh_step_place place = {.begin = view.t, .h = view.t > begin ? begin + h - view.t : h, .at_begin = 1};
    status = take_step(self, &view, &place, stats);
  }
  flesh_evaluation_remember(self->evaluation, &view);
  state->t = view.t;
  return flesh_team_agree(self->evaluation->team, status); /* all ranks have the same values, and get one sentence */
}

int flesh_integrator_step(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  FLESH_NEED({self, "integrator"});
  FLESH_NEED_STATE(state);
  if (atomic_exchange(&self->steps, 1))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the integrator is making a step, for another thread or around this call; each "
                                          "thread needs an integrator of its own");
  flesh_solve_stats ignored = {0};
  if (!stats) stats = &ignored;
  const int solves = stats->solves, status = step_alone(self, state, h, stats);
  if (stats->solves > solves) {
    self->residual_last = stats->residual_last;
    self->residual_target = stats->residual_target;
  }
  stats->residual_last = self->residual_last; /* also of a state within a step that was taken before */
  stats->residual_target = self->residual_target;
  atomic_store(&self->steps, 0);
  return status;
}

int flesh_integrator_resume(flesh_integrator *self, const flesh_step_place *place, flesh_state *state)
{
  flesh_solve_stats ignored = {0};
  flesh_step_place rest = *place;
  const int status = take_step(self, state, &rest, &ignored);
  flesh_evaluation_remember(self->evaluation, state);
  return status;
}

void flesh_integrator_forget(flesh_integrator *self)
{
  flesh_nonlinear_forget(self->nonlinear);
  flesh_extrapolation_forget(&self->first.extrapolation);
}
