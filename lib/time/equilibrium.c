/* equilibrium.c: the static method: the full load, or increments of it, until what follows the shape stands still and
 * nothing is tangled. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/parallel_vector.h"
#include "time/integrator.h"

/* Takes in that the stage has been solved, which is about to lead the state to it. */
static int tell(const flesh_integrator *self, const flesh_state *state, const flesh_stage *stage, double h)
{
  const flesh_tape *tape = self->tape;
  const flesh_taken_part taken = {.row = self->row, .own = 1, .memory = &self->memory, .from = state, .lagged = state,
                                  .begin = state->t, .end = stage->t, .h = h};
  tape->try_part(tape->data);
  const int status = tape->solved(tape->data, stage, 0, self->nonlinear->u);
  return status ? status : tape->taken(tape->data, &taken);
}

static int solve(flesh_integrator *self, flesh_state *state, flesh_stage *stage, double h, int halvings, int extensions,
                 flesh_solve_stats *stats)
{
  self->part.span = (flesh_span){stage->t_lag, stage->t, h};
  stage->internal = state->internal;
  int status = flesh_multipliers_solve(&self->multipliers, stage, state, NULL, NULL, extensions, stats);
  if (!status) status = flesh_multipliers_accept(&self->multipliers, stage, state);
  if (!status && self->tape) status = tell(self, state, stage, h);
  if (status) flesh_integrator_record_failure(self, stage, h, halvings, status, stats);
  return status;
}

/* Returns whether nothing touches the state or x, or is near enough to: else a surface may lie between the two. */
static int is_far(flesh_integrator *self, const flesh_state *state, const double *x)
{
  flesh_clearance *clearance = &self->evaluation->clearance;
  if (!flesh_system_has_role(self->evaluation->system, FLESH_ROLE_CONTACT)) return 1;
  flesh_clearance_begin(clearance, state->t, state->x, state->t, x, state->x);
  return !flesh_team_any(self->evaluation->team, !clearance->begins_far || !(clearance->least_left > 0));
}

/* Takes the state from the last solve's end to equilibrium by the whole derivative, if nothing is near on the way; else
 * leaves it. Not with a tape, which differentiates solves that each depend on the last one alone. */
static int improve(flesh_integrator *self, flesh_state *state, flesh_solve_stats *stats)
{
  double *x = self->room[0];
  const size_t bytes = (size_t)self->evaluation->n * sizeof *x;
  if (self->tape || !is_far(self, state, state->x)) return FLESH_OK;
  memcpy(x, state->x, bytes);
  double size = 0; /* of the body, m */
  for (int p = 0; p < self->first.parts.count; p++) size = fmax(size, self->first.parts.extent[p]);
  flesh_team_largest(self->evaluation->team, 1, &size);
  self->followers.step = 1e-4 * size;
  const int status = flesh_followers_improve(&self->followers, stats->residual_target / 2, state, stats);
  if (status || !is_far(self, state, x)) memcpy(state->x, x, bytes);
  return status;
}

enum {
  PATIENCE = 4,                            /* solves in which the change of what follows the shape must halve */
  STILL_CHANGES = FLESH_NOT_POSITIVE + 1 /* status of `follow`: it has not halved */
};

/* Repeats a solve that has succeeded, lagging the state that the last one led to, until nothing changes: the state is
 * then its own lagged one. `target` [N] is that of the residuals; 0: each solve's own. */
static int follow(flesh_integrator *self, flesh_state *state, double h, double target, flesh_solve_stats *stats)
{
  flesh_stage stage;
  double least = INFINITY;
  for (int left = PATIENCE; left > 0; left--) {
    int status = self->followers.mixing.n ? improve(self, state, stats) : FLESH_OK;
    const int before = stats->newton;
    if (status < 0) return status;
    if (status && !self->followers.contracts) return STILL_CHANGES;
    self->row->stage(&self->memory, state, state->t, h, &stage);
    self->nonlinear->newton->goal.target = target;
    status = solve(self, state, &stage, h, 0, 0, stats);
    self->nonlinear->newton->goal.target = 0;
    if (status || stats->newton == before) return status;
    const double *u = self->nonlinear->u;
    const double change = flesh_norm(self->evaluation->threads, self->evaluation->n, u);
    flesh_method_finish(self->row, &self->memory, u, h, state);
    if (change < least / 2) least = change, left = PATIENCE + 1;
  }
  return STILL_CHANGES;
}

/* Solves for equilibrium at increment->to, from where increment->from has led, in a step of h that began at `begin`. A
 * status > 0 has changed nothing. */
static int take_increment(flesh_integrator *self, flesh_state *state, const flesh_load_increment *increment, double begin,
                          double h, flesh_solve_stats *stats)
{
  flesh_stage stage;
  self->row->stage(&self->memory, state, state->t + h, h, &stage);
  stage.load = increment->to;
  stage.x_lag = state->x;
  stage.t_lag = increment->from > 0 ? stage.t : begin; /* obstacles and targets move to their end at once */
  stage.prescribed_fraction = increment->fraction;
  int status = solve(self, state, &stage, h, increment->depth, 0, stats);
  if (status) return status;
  flesh_method_finish(self->row, &self->memory, self->nonlinear->u, h, state);
  if (increment->to >= 1) state->t = stage.t;
  return FLESH_OK;
}

/* Ends a solve that has failed (status > 0) with a sentence if a part of the load has moved a piece that touches
 * others, but that no pin or joint holds, by a quarter of its size, and nothing prescribed moves: it slides, rolls
 * or falls on, with a smaller load as well. After breaks, where h is 0, check_held reports that. FLESH_ERR_SOLVE. */
static int check_stays(flesh_integrator *self, const flesh_state *state, double load, int status)
{
  const flesh_rigid_parts *parts = &self->first.parts;
  const double *u = self->nonlinear->u;
  double *reached = self->room[0];
  const int *dofs;
  int count;
  const flesh_system *system = self->evaluation->system;
  if (flesh_system_moves(system) || flesh_system_has_role(system, FLESH_ROLE_OTHER) ||
      !flesh_system_has_role(system, FLESH_ROLE_CONTACT))
    return status;
  flesh_nonlinear_reactions(self->nonlinear, &dofs, &count);
  for (int d = 0; d < self->evaluation->n; d++) reached[d] = state->x[d] + u[d];
  for (int p = 0, held = 0; p < parts->count; p++, held = 0) {
    double from[3], to[3];
    for (int k = 0; k < count; k++) held |= parts->part[dofs[k] / 3] == p;
    flesh_rigid_parts_extent(parts, p, state->x, from);
    flesh_rigid_parts_extent(parts, p, reached, to);
    const double far = hypot(hypot(to[0] - from[0], to[1] - from[1]), to[2] - from[2]);
    if (flesh_team_any(self->evaluation->team, held) || !(far > 0.5 * parts->extent[p])) continue;
    return flesh_fail(FLESH_ERR_SOLVE,
                      "no equilibrium at t = %g s: with %g of the load the part around (%.3g, %.3g, %.3g) m, which no pin holds, "
                      "went %.3g m without coming to rest; in statics friction holds nothing, except against obstacles that move",
                      self->part.span.end, load, from[0], from[1], from[2], far);
  }
  return status;
}

/* Halvings of an increment that are worth it: a load that stretches a body without bound is found to 1/32. */
static int finest(const flesh_integrator *self)
{
  const int most = self->recovery.max_cutbacks;
  return self->nonlinear->newton->iterations.ran_away && most > 5 ? 5 : most;
}

/* Ends the increments of `loads` with that status. The last solve has tried `increment`. */
static int end_increments(const flesh_integrator *self, const char *loads, const flesh_load_increment *increment, int status)
{
  const int ran_away = self->nonlinear->newton->iterations.ran_away;
  const char *how = ran_away == FLESH_RUNS_FREE
                        ? "move the body on and on, as nothing holds it or stops it"
                        : "stretch the body without bound, as pressure beyond the largest that it bears does";
  if (status <= 0 || !ran_away) return status;
  return flesh_fail(FLESH_ERR_SOLVE, "no equilibrium at t = %g s: %.3g of the %s would %s; with %.3g there is one",
                    self->part.span.end, increment->to, loads, how, increment->from);
}

/* Raises the load from 0 to 1. */
static int raise_load(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  const double begin = state->t;
  flesh_load_increment increment = flesh_load_increment_first();
  int status;
  do {
    status = take_increment(self, state, &increment, begin, h, stats);
    if (status > 0 && h > 0) status = check_stays(self, state, increment.to, status);
  } while (flesh_load_increment_next(&increment, finest(self), status));
  return end_increments(self, "load", &increment, status);
}

/* Solves for equilibrium at t+h with the full load at once. A status > 0 has changed nothing. */
static int solve_whole(flesh_integrator *self, flesh_state *state, double h, int extensions, flesh_solve_stats *stats)
{
  flesh_stage stage;
  self->row->stage(&self->memory, state, state->t + h, h, &stage);
  stage.x_lag = state->x;
  stage.t_lag = state->t;
  const int status = solve(self, state, &stage, h, 0, extensions, stats);
  if (status) return status;
  flesh_method_finish(self->row, &self->memory, self->nonlinear->u, h, state);
  state->t = stage.t;
  memset(state->v, 0, (size_t)self->evaluation->n * sizeof *state->v);
  return FLESH_OK;
}

/* Solves for equilibrium at t+h: with the full load first, then in increments, along which prescribed dofs move. */
static int solve_static(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  /* From a far start the full load may need many iterations, each of which leads nearer. */
  int status = solve_whole(self, state, h, self->options.max_cutbacks, stats);
  if (status > 0) {
    memcpy(self->part.x, state->x, (size_t)self->evaluation->n * sizeof *self->part.x);
    status = raise_load(self, state, h, stats);
    /* Nobody asked for the equilibrium of a part of the load. */
    if (status) memcpy(state->x, self->part.x, (size_t)self->evaluation->n * sizeof *self->part.x);
    else memset(state->v, 0, (size_t)self->evaluation->n * sizeof *state->v);
  }
  return status;
}

static void load_followers(flesh_integrator *self, double fraction)
{
  self->evaluation->environment.unloaded = 1 - fraction;
  flesh_evaluation_forces_changed(self->evaluation);
}

/* Reports that there is no equilibrium with this fraction of the loads that follow the shape. Returns a status that is
 * no longer recoverable. */
static int fail_to_follow(const flesh_integrator *self, double fraction, int status)
{
  if (status != STILL_CHANGES)
    return flesh_fail_within(flesh_recovery_fail(&self->recovery),
                             "no equilibrium with %.3g of the loads that follow the surface: ", fraction);
  return flesh_fail(FLESH_ERR_SOLVE, "no equilibrium at t = %g s: none is found with %.3g of the loads that follow the surface; "
                                     "more pins or a smaller load may help", self->part.span.end, fraction);
}

/* Solves for equilibrium at t+h with a lagged state that is its own: loads that follow the shape are raised after all
 * others, by increments each of which ends with such a state. */
static int raise_followers(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  const size_t bytes = (size_t)self->evaluation->n * sizeof *state->x;
  flesh_load_increment increment = flesh_load_increment_first();
  double fraction = 0;
  load_followers(self, 0);
  int status = solve_static(self, state, h, stats);
  if (!status) do {
    memcpy(self->part.x, state->x, bytes);
    load_followers(self, fraction = increment.to);
    status = follow(self, state, h, 0, stats);
    if (status) memcpy(state->x, self->part.x, bytes);
  } while (flesh_load_increment_next(&increment, finest(self), status));
  if (fraction > 0) status = end_increments(self, "loads that follow the surface", &increment, status);
  load_followers(self, 1);
  return status > 0 && fraction > 0 ? fail_to_follow(self, fraction, status) : status;
}

static void return_to_start(flesh_integrator *self, flesh_state *state)
{
  state->t = self->evaluation->returned.t;
  flesh_evaluation_restore(self->evaluation, state);
}

/* Repeats a solve that has succeeded, with the normal forces behind friction that it has led to, where obstacles that
 * rub move. If these do not settle, they stay those of the last solve. */
static int follow_friction(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  const flesh_system *system = self->evaluation->system;
  if (!flesh_system_has_role(system, FLESH_ROLE_CONTACT) || !flesh_system_moves(system)) return FLESH_OK;
  const int status = follow(self, state, h, stats->residual_target, stats);
  return status < 0 ? status : FLESH_OK;
}

/* Solves for equilibrium at t+h with a lagged state that is its own, where effects want that. Solves that a tape has
 * recorded are not taken back. */
static int balance(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  if (!flesh_system_has_follower_loads(self->evaluation->system)) {
    const int status = solve_static(self, state, h, stats);
    return status ? status : follow_friction(self, state, h, stats);
  }
  flesh_evaluation_remember(self->evaluation, state);
  int status = self->tape ? solve_static(self, state, h, stats) : solve_whole(self, state, h, 0, stats);
  if (!status && (status = follow(self, state, h, 0, stats)) > 0 && self->tape) status = fail_to_follow(self, 1, status);
  if (status > 0 && !self->tape) {
    return_to_start(self, state);
    status = raise_followers(self, state, h, stats);
  }
  if (status) return_to_start(self, state);
  return status;
}

/* Checks that no piece is far away: a piece that nothing holds has no equilibrium under a load, and its solve ends far
 * away, where round-off hides the load. A body that something holds moves no farther than its size. FLESH_ERR_SOLVE,
 * with the first node that is ten times as far from where the step began. */
static int check_held(const flesh_internals *internals, const flesh_state *state)
{
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, size = 0;
  for (int d = 0; d < internals->n; d++) {
    low[d % 3] = fmin(low[d % 3], internals->x[d]);
    high[d % 3] = fmax(high[d % 3], internals->x[d]);
  }
  for (int c = 0; c < 3; c++) size = fmax(size, high[c] - low[c]);
  for (int d = 0; d < internals->n; d++) {
    const double far = fabs(state->x[d] - internals->x[d]);
    if (far <= 10 * size) continue;
    return flesh_fail(FLESH_ERR_SOLVE, "no equilibrium at t = %g s after something broke: node %d would be %.3g m away, as "
                                       "nothing holds its part of the body", state->t, d / 3, far);
  }
  return FLESH_OK;
}

/* Solves for equilibrium at t+h; if that changes internal variables, solves again until it does not. */
static int settle(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  enum { REPETITIONS = 1000 };
  flesh_internals *internals = &self->internals;
  if (!internals->count) return balance(self, state, h, stats);
  flesh_internals_remember(internals, state);
  int changed = 0, status = balance(self, state, h, stats);
  for (int k = 0; !status; k++) {
    status = flesh_internals_update(internals, &self->watch, state, -1, &changed);
    if (status || !changed) break;
    if (k == REPETITIONS)
      status = flesh_fail(FLESH_ERR_SOLVE, "something still broke in the last of %d equilibria at t = %g s; smaller steps "
                                           "may help", REPETITIONS, state->t);
    flesh_evaluation_forces_changed(self->evaluation);
    if (status) break;
    if ((status = balance(self, state, 0, stats)) > 0) status = flesh_recovery_fail(&self->recovery);
    if (status == FLESH_ERR_SOLVE) status = flesh_fail_within(status, "after something broke: ");
    if (!status) status = check_held(internals, state);
  }
  if (status) flesh_internals_give_back(internals, state);
  return status;
}

/* Solves for equilibrium at t+h; if surfaces that ignored each other have come apart there, and touch from now on, solves
 * again. */
static int come_apart(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  enum { REPETITIONS = 100 };
  int changed = 1, status = settle(self, state, h, stats);
  for (int k = 0; !status && k < REPETITIONS; k++) {
    status = flesh_integrator_arrive(self, state, &changed);
    if (status < 0 || !changed) return status;
    flesh_evaluation_forces_changed(self->evaluation);
    status = settle(self, state, 0, stats);
  }
  return status;
}

/* Solves for equilibrium at t+h; one that is a tangle is untangled and solved again. */
static int find_equilibrium(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  flesh_untangler *untangler = self->recovery.untangler;
  self->evaluation->environment.past = h;
  int status = come_apart(self, state, h, stats);
  if (status || !untangler) return status;
  status = flesh_untangler_after_step(untangler, state, 0);
  if (status == 1 && self->tape) self->tape->untangled = 1;
  if (status == 1) status = flesh_continuation_rest(&self->continuation, untangler, 1, state, stats);
  if (status == 1 && flesh_system_has_follower_loads(self->evaluation->system)) status = balance(self, state, 0, stats);
  return status < 0 ? status : FLESH_OK;
}

int flesh_integrator_find_equilibrium(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  flesh_cutbacks times = flesh_cutbacks_of((flesh_span){state->t, state->t + h, h});
  int status, goes_on;
  do {
    status = find_equilibrium(self, state, times.part.h, stats);
    if (!status) state->t = times.part.end;
    /* An obstacle that moves far at once may push a surface against others that bar its way. */
    goes_on = !status || (status == FLESH_UNDEFINED && !self->tape && flesh_system_moves(self->evaluation->system));
  } while (goes_on && flesh_cutbacks_next(&times, 1, self->recovery.max_cutbacks, status));
  return status;
}

int flesh_integrator_find_at_load(flesh_integrator *self, flesh_state *state, const flesh_load_increment *increment, double h,
                                  flesh_solve_stats *stats)
{
  load_followers(self, increment->to);
  const int status = take_increment(self, state, increment, state->t, h, stats);
  load_followers(self, 1);
  return status;
}
