/* run.c: takes steps from a state to an end, and calls the observers. */
#include "flesh/observer.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "mesh/mesh.h"
#include "parallel/body_figures.h"
#include "system/feasible_step.h"
#include "system/rank_numbers.h"
#include "system/ranks.h"
#include "system/state.h"
#include "time/integrator.h"

/* Data that records point to; nothing is allocated after the start. */
typedef struct watch {
  const flesh_system *system;
  const flesh_mesh *mesh;
  const flesh_team *team; /* NULL: none */
  const flesh_run_options *options;
  double *zeros; /* [3*n] accelerations: 0, as energies do not depend on them */
  double *J_mean, *J_min; /* [tets] */
  double *energies, *rest_energies;
  double *reports; /* [effects*FLESH_RANK_SUMS], with a team */
  double rest_volume;
  const flesh_environment *environment; /* the run's, borrowed */
} watch;

static void watch_close(watch *w)
{
  free(w->zeros);
  free(w->J_mean);
  free(w->J_min);
  free(w->energies);
  free(w->rest_energies);
  free(w->reports);
}

/* Finds elastic energies and the volume at rest. */
static int find_rest(watch *w)
{
  const double *rest = flesh_mesh_positions(w->mesh);
  w->rest_volume = flesh_mesh_volume(w->mesh, rest);
  const flesh_point point = flesh_point_at(0, rest, w->zeros, w->zeros);
  for (int e = 0; e < flesh_system_effect_count(w->system); e++) {
    const flesh_effect *effect = flesh_system_effect(w->system, e);
    /* Only elasticity's formula has an arbitrary constant. */
    if (!effect->operations->energy || effect->operations->role != FLESH_ROLE_ELASTICITY) continue;
    int status = effect->operations->energy(effect, &point, &w->rest_energies[e]);
    if (status < 0) return status;
  }
  return FLESH_OK;
}

static int watch_open(watch *w)
{
  size_t effects = (size_t)flesh_system_effect_count(w->system);
  w->zeros = calloc((size_t)flesh_system_unknowns(w->system), sizeof(double));
  w->J_mean = malloc(sizeof(double) * (size_t)flesh_mesh_tet_count(w->mesh));
  w->J_min = malloc(sizeof(double) * (size_t)flesh_mesh_tet_count(w->mesh));
  w->energies = calloc(effects + 1, sizeof(double));
  w->rest_energies = calloc(effects + 1, sizeof(double));
  if (w->team) w->reports = calloc(effects * FLESH_RANK_SUMS + 1, sizeof(double));
  int status = w->zeros && w->J_mean && w->J_min && w->energies && w->rest_energies && (w->reports || !w->team)
                   ? find_rest(w)
                   : flesh_fail(FLESH_ERR_MEMORY, "run: out of memory");
  if (!status) w->rest_energies[effects] = w->rest_volume; /* summed over ranks with the energies */
  status = flesh_team_sum_agreed(w->team, status, (int)effects + 1, w->rest_energies);
  if (!status) w->rest_volume = w->rest_energies[effects];
  return status;
}

/* Finds the shape of the body, over all ranks: volume, inverted tets, the smallest J and its bound. */
static void look_at_shape(watch *w, const flesh_state *state, flesh_step_record *record)
{
  flesh_mesh_measures m;
  flesh_body_measure(w->mesh, w->team, state->x, w->J_mean, w->J_min, &m);
  record->volume = m.volume;
  record->inverted = m.inverted;
  record->J_min = m.J_min;
  record->J_min_tet = m.J_min_tet;
  record->J_bound = m.J_bound;
}

/* Returns the point at `at`, with the multipliers and internal variables of the step's end. */
static flesh_point point_of(const watch *w, const flesh_state *at, const flesh_state *end)
{
  flesh_point point = flesh_point_at(at->t, at->x, at->v, w->zeros);
  point.multipliers = end->multipliers;
  point.internal = end->internal;
  point.environment = w->environment;
  return point;
}

/* Collects the effects' reports of all ranks for histories. */
static void find_reports(const watch *w, const flesh_step_record *record)
{
  const flesh_state *at[2] = {record->state, record->stage};
  flesh_point points[2];
  for (int k = 0; k < 2; k++) points[k] = point_of(w, at[k], record->state);
  flesh_rank_numbers_report(w->system, &points[0], &points[1], w->reports);
}

static int call_observers(watch *w, const flesh_integrator *integrator, int step, int last, double h,
                          const flesh_state *given, const flesh_solve_stats *stats)
{
  if (!w->options->observer_count) return FLESH_OK;
  flesh_state state;
  int status = flesh_integrator_view(integrator, given, &state);
  if (status) return status;
  flesh_step_record record = {.step = step,
                              .last = last,
                              .h = h,
                              .system = w->system,
                              .state = &state,
                              .stage = step ? flesh_integrator_stage(integrator, &state) : &state,
                              .stats = stats,
                              .energies = w->energies,
                              .rest_energies = w->rest_energies,
                              .rest_volume = w->rest_volume,
                              .tet_J_mean = w->J_mean,
                              .tet_J_min = w->J_min,
                              .proximity = w->environment->proximity,
                              .reports = w->reports};
  const flesh_point point = point_of(w, &state, &state);
  int effects = flesh_system_effect_count(w->system);
  const double *known = flesh_integrator_energies(integrator, &state);
  if (known) memcpy(w->energies, known, (size_t)effects * sizeof *known);
  else status = flesh_system_energies(w->system, &point, w->energies);
  if (status < 0) return status;
  /* A state may be accepted where an energy has no value (a start with J <= 0): the record then has none. */
  if (status > 0)
    for (int e = 0; e < effects; e++) w->energies[e] = NAN;
  look_at_shape(w, &state, &record);
  if (w->reports) find_reports(w, &record);
  status = FLESH_OK;
  for (int o = 0; o < w->options->observer_count && status >= 0; o++) {
    const flesh_observer *observer = &w->options->observers[o];
    status = flesh_team_agree(w->team, observer->observe(observer->data, &record));
  }
  return status < 0 ? status : FLESH_OK;
}

static int ask(const watch *w)
{
  const flesh_run_options *options = w->options;
  return flesh_ask_together(w->team, options->stop, options->stop_data);
}

/* Names the cause if a step failed because a prescribed node would have to enter an obstacle. Free nodes are pushed out
 * first, so they are no cause. */
static int explain(watch *w, const flesh_integrator *integrator, const flesh_state *state, double target, int status)
{
  double *x = integrator->part.x; /* memory of the step that failed, not needed any more */
  if (!flesh_system_limits_step(w->system)) return status;
  memcpy(x, state->x, sizeof *x * (size_t)flesh_system_unknowns(w->system));
  flesh_system_push_out(w->system, state->t, state->x, target, x);
  flesh_system_prescribe(w->system, target, x);
  if (flesh_system_check_with(w->system, state->internal, target, x))
    status = flesh_fail_within(FLESH_ERR_SOLVE, "the step from t = %g s to %g s failed: ", state->t, target);
  return status;
}

/* Takes the steps after the first *steps, counted from `start`. Observers see the start as step 0 if it is `fresh`. */
static int run_steps(watch *w, flesh_integrator *integrator, int fresh, double start, flesh_state *state, int *steps)
{
  const flesh_run_options *options = w->options;
  const int single = flesh_run_is_single(w->system, flesh_integrator_method(integrator));
  double end = options->end;
  int done = single ? *steps > 0 : state->t >= end, status = FLESH_OK;
  flesh_solve_stats stats = {0};
  if (fresh) status = call_observers(w, integrator, 0, done, 0, state, &stats);
  if (!status) status = ask(w);
  for (int step = *steps + 1; !status && !done; step++) {
    /* Times are start + k h, so that rounding does not add up; a step that ends within a thousandth of h of the end
     * ends there. */
    double target = single ? end : start + step * options->h, h = options->h;
    done = target > end - 1e-3 * options->h;
    if (done) target = end;
    if (single || fabs(target - state->t - h) > 1e-9 * h) h = target - state->t;
    stats = (flesh_solve_stats){0};
    status = flesh_integrator_step(integrator, state, h, &stats);
    if (status > 0 || status == FLESH_ERR_SOLVE || status == FLESH_ERR_INTEGRATOR)
      status = explain(w, integrator, state, target, status);
    if (status && options->unfinished) *options->unfinished = stats;
    if (status > 0)
      status = flesh_fail(FLESH_ERR_SOLVE, "the step from t = %g s failed: %s", state->t,
                          flesh_status_text(status));
    if (status) break;
    state->t = target;
    *steps = step;
    if ((status = flesh_evaluation_check_state(integrator->evaluation, state))) return status;
    int stop = done ? FLESH_OK : ask(w);
    status = call_observers(w, integrator, step, done || stop, h, state, &stats);
    if (!status) status = stop;
  }
  return status;
}

int flesh_run_is_single(const flesh_system *system, flesh_method method)
{
  return method == FLESH_METHOD_STATIC && !flesh_system_moves(system);
}

int flesh_run_check_times(int single, double h, double end, int step, double begin, double t)
{
  if (!(h > 0) || !isfinite(h)) return flesh_fail(FLESH_ERR_ARGUMENT, "the step is %g s; it must be positive", h);
  if (!isfinite(end) || end < t)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the end is %g s; it must be finite and not before the start at %g s", end, t);
  if (!single && (end - begin) / h >= INT_MAX)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%g s in steps of %g s are %.3g steps; at most %d can be taken", end - begin, h,
                      (end - begin) / h, INT_MAX - 1);
  if (step < 0 || !(begin <= t) || (begin == t ? step > single : step == 0))
    return flesh_fail(FLESH_ERR_ARGUMENT, "step %d since %g s cannot have led to %g s", step, begin, t);
  return FLESH_OK;
}

static int check_observers(const flesh_run_options *options)
{
  if (options->observer_count < 0 || (options->observer_count && !options->observers))
    return flesh_fail(FLESH_ERR_ARGUMENT, "observer_count is %d; observers must be an array of as many", options->observer_count);
  for (int k = 0; k < options->observer_count; k++)
    if (!options->observers[k].observe) return flesh_fail(FLESH_ERR_ARGUMENT, "observers[%d].observe is NULL", k);
  return FLESH_OK;
}

/* The place where a run's steps begin: its start, or the end of steps that were taken before. */
typedef struct origin {
  int fresh, step; /* 1: observers see the start as step 0; number of steps taken before */
  double begin;    /* s, start of the first step of all */
} origin;

static int run(const flesh_system *system, flesh_integrator *integrator, const flesh_run_options *options, origin from,
               flesh_state *state, int *steps)
{
  int taken = 0;
  if (!steps) steps = &taken;
  *steps = 0;
  if (options->unfinished) *options->unfinished = (flesh_solve_stats){0};
  if (integrator->evaluation->system != system)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the integrator is made for another system");
  int status = check_observers(options);
  const int single = flesh_run_is_single(system, flesh_integrator_method(integrator));
  if (!status) status = flesh_run_check_times(single, options->h, options->end, from.step, from.begin, state->t);
  if (!status) status = flesh_evaluation_check_state(integrator->evaluation, state);
  if (status) return status;
  *steps = from.step;
  watch w = {.system = system, .mesh = flesh_system_mesh(system), .team = flesh_system_team(system),
             .options = options, .environment = &integrator->evaluation->environment};
  if (options->observer_count) status = watch_open(&w);
  const flesh_stop before = integrator->nonlinear->newton->stop;
  integrator->ahead.limit = options->end;
  if (options->stop) flesh_integrator_set_stop(integrator, options->stop, options->stop_data);
  if (!status) status = flesh_system_check_with(system, state->internal, state->t, state->x);
  if (!status) status = flesh_integrator_begin(integrator, state);
  if (!status) status = run_steps(&w, integrator, from.fresh, from.begin, state, steps);
  flesh_integrator_set_stop(integrator, before.stop, before.data);
  integrator->ahead.limit = -INFINITY;
  watch_close(&w);
  return status;
}

int flesh_run(const flesh_system *system, flesh_integrator *integrator,
              const flesh_run_options *options, flesh_state *state, int *steps)
{
  FLESH_NEED({system, "system"}, {integrator, "integrator"}, {options, "options"});
  FLESH_NEED_STATE(state);
  return run(system, integrator, options, (origin){1, 0, state->t}, state, steps);
}

int flesh_run_resume(const flesh_system *system, flesh_integrator *integrator, const flesh_run_options *options,
                     int step, double begin, flesh_state *state, int *steps)
{
  FLESH_NEED({system, "system"}, {integrator, "integrator"}, {options, "options"});
  FLESH_NEED_STATE(state);
  return run(system, integrator, options, (origin){0, step, begin}, state, steps);
}
