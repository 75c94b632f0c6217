/* run.c: runs a case of the battery; observes its incremental potential, costs, recovery and frames; judges the
 * outcome. */
#include <gsl/gsl_statistics_double.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/confine.h"
#include "base/error.h"
#include "base/memory.h"
#include "cli/overrides.h"
#include "hardcases/hardcases.h"
#include "mesh/mesh.h"
#include "run/runner.h"

/* The observer of a run. */
typedef struct watch_of_run {
  const flesh_mesh *rest; /* shape to which the body should return, borrowed; NULL: none */
  const char *folder;     /* folder for the frames of pictures */
  double early;           /* time of the second frame; INFINITY once that is kept */
  flesh_hardcases_figures *figures;
  /* Private members. */
  int unknowns;
  double clock;
  flesh_state last;       /* the previous step */
  double *point;          /* [3*unknowns] x, v, a; allocated behind the arrays of `last` */
  int count, room, hard;  /* number of steps; number of those in the first phase */
  struct {
    int newton;
    double seconds;
  } * cost;
} watch_of_run;

/* Computes the incremental potential of the step of length h from the last state to x, and the sum of the sizes of its
 * terms. Backward Euler: v = u/h, a = (v - v_n)/h; h = 0: statics. */
static int potential(watch_of_run *w, const flesh_step_record *record, double h,
                     const double *x, double *phi, double *magnitude)
{
  double *v = w->point + w->unknowns, *a = v + w->unknowns;
  for (int d = 0; d < w->unknowns; d++) {
    v[d] = h > 0 ? (x[d] - w->last.x[d]) / h : 0;
    a[d] = h > 0 ? (v[d] - w->last.v[d]) / h : 0;
  }
  flesh_point point = flesh_point_at(record->state->t, x, v, a);
  point.lagged = (flesh_lagged){w->last.t, w->last.x, w->last.v};
  const flesh_shift shift = {.x = 1, .v = h > 0 ? 1 / h : 0, .a = h > 0 ? 1 / (h * h) : 0};
  *phi = *magnitude = 0;
  return flesh_system_potential(record->system, &point, &shift, phi, magnitude);
}

/* Checks whether the step's end has a higher potential than its start with the constrained nodes moved. Skips halved
 * steps, which have several potentials, and steps with untangling, whose end is not that of the solve. */
static void check_potential(watch_of_run *w, const flesh_step_record *record)
{
  double first, last, size, other;
  if (record->stats->solves != 1 || record->stats->untanglings) return;
  double h = flesh_system_has_role(record->system, FLESH_ROLE_INERTIA) ? record->h : 0;
  memcpy(w->point, w->last.x, sizeof(double) * (size_t)w->unknowns);
  flesh_system_prescribe(record->system, record->state->t, w->point);
  if (potential(w, record, h, w->point, &first, &other) ||
      potential(w, record, h, record->state->x, &last, &size))
    return;
  size = fmax(size, other);
  double rise = size > 0 ? (last - first) / size : 0;
  w->figures->rises_checked++;
  w->figures->rises += rise > 1e-12;
  w->figures->worst_rise = fmax(w->figures->worst_rise, rise);
}

static void keep_frame(const watch_of_run *w, const flesh_step_record *record,
                       const char *name)
{
  flesh_state_write(flesh_path("%s/%s", w->folder, name), w->unknowns / 3, record->state); /* a missing picture is no failure */
}

/* Returns whether the body is at rest in its shape. */
static int is_back(const flesh_hardcases_figures *f)
{
  return f->distance < FLESH_HARDCASES_TOLERANCE && f->volume_error < FLESH_HARDCASES_TOLERANCE && !f->inverted_end;
}

static int watch_observe(void *data, const flesh_step_record *record)
{
  watch_of_run *w = data;
  flesh_hardcases_figures *f = w->figures;
  const flesh_solve_stats *stats = record->stats;
  double now = flesh_cpu_seconds();
  if (record->step > 0) {
    if (!flesh_grow(&w->cost, sizeof *w->cost, w->count, &w->room)) return flesh_no_memory();
    w->cost[w->count].newton = stats->newton;
    w->cost[w->count++].seconds = now - w->clock;
    f->steps++;
    f->simulated_s += record->h;
#define ADD(member, of_step, key) f->counts.member += stats->of_step;
    FLESH_FIGURES_COUNT_LIST(ADD)
    /* In a motion n failed solves have n + 1 successful ones; in statics each untangling is followed by a new solve. */
    f->retried += flesh_system_has_role(record->system, FLESH_ROLE_INERTIA)
                      ? (stats->solves - 1) / 2
                      : stats->solves - 1 - stats->untanglings;
    f->rises += stats->potential_rises; /* of iterates, including those of halved steps */
    check_potential(w, record);
    if (f->steps == 1) keep_frame(w, record, "frame_first.txt");
    if (record->state->t >= w->early) keep_frame(w, record, "frame_early.txt"), w->early = INFINITY;
  }
  for (int d = 0; d < w->unknowns; d++)
    if (!isfinite(record->state->x[d]) || !isfinite(record->state->v[d])) f->finite = 0;
  f->max_inverted = record->inverted > f->max_inverted ? record->inverted : f->max_inverted;
  f->inverted_end = record->inverted;
  if (w->rest) {
    f->distance = flesh_mesh_distance_from_rest(w->rest, record->state->x);
    double volume = flesh_mesh_volume(w->rest, flesh_mesh_positions(w->rest));
    f->volume_error = fabs(flesh_mesh_volume(w->rest, record->state->x) / volume - 1);
    if (!is_back(f)) f->recovered_at = NAN;
    else if (isnan(f->recovered_at)) f->recovered_at = record->state->t;
  }
  memcpy(w->last.x, record->state->x, sizeof(double) * (size_t)w->unknowns);
  memcpy(w->last.v, record->state->v, sizeof(double) * (size_t)w->unknowns);
  w->last.t = record->state->t;
  w->clock = flesh_cpu_seconds(); /* the cost of observing does not count for the next step */
  return FLESH_OK;
}

static double worst_over_median(int count, double *values)
{
  if (count < 3) return NAN;
  const size_t n = (size_t)count;
  const double worst = gsl_stats_max(values, 1, n), median = gsl_stats_select(values, 1, n, n / 2);
  return median > 0 ? worst / median : NAN;
}

static void watch_finish(watch_of_run *w)
{
  const int count = w->hard;
  double *values = malloc(sizeof *values * (size_t)(count + 1));
  if (!values) return;
  for (int k = 0; k < count; k++) values[k] = w->cost[k].newton;
  w->figures->newton_ratio = worst_over_median(count, values);
  for (int k = 0; k < count; k++) values[k] = w->cost[k].seconds;
  w->figures->time_ratio = worst_over_median(count, values);
  free(values);
}

/* Runs a phase in folder/out; returns its status. */
static int run_phase(const flesh_hardcases_plan *plan, const flesh_scene *scene, const char *folder,
                     const char *name, watch_of_run *watch)
{
  char out[1400], path[1500];
  flesh_figures figures = {0};
  flesh_outcome outcome = {0};
  flesh_hardcases_figures *f = watch->figures;
  snprintf(out, sizeof out, "%s/%s", folder, name);
  snprintf(path, sizeof path, "%s/scene.yaml", folder);
  const flesh_observer watching = {watch_observe, watch};
  const flesh_runner_options options = {.out = out,
                                        .scene_path = path,
                                        .max_seconds = plan->max_seconds,
                                        .no_frames = 1,
                                        .quiet = 1,
                                        .observer_count = 1,
                                        .observers = &watching};
  flesh_runner_run(scene, &options, &figures, &outcome);
  f->status = outcome.has_failure ? outcome.failure.status : outcome.status;
  f->exit_code = outcome.exit_code;
  f->stressed_rest = figures.stressed_rest;
  if (figures.longest_step.ratio > f->longest.ratio || !isfinite(f->longest.ratio)) f->longest = figures.longest_step;
  snprintf(f->message, sizeof f->message, "%.399s", outcome.message);
  f->wall_s += isfinite(figures.wall_s) ? figures.wall_s : 0;
  f->cpu_s += isfinite(figures.cpu_s) ? figures.cpu_s : 0;
  flesh_figures_close(&figures);
  return outcome.status;
}

/* Finds the shape to which the body should return: the rest shape of the phase in which it recovers. NULL: none. */
static int find_rest(const flesh_hardcases_plan *plan, const char *folder, flesh_mesh **rest)
{
  flesh_scene *last = NULL;
  flesh_overrides overrides;
  flesh_overrides_copy(&overrides, &plan->options.overrides.texts);
  flesh_overrides_add(&overrides, "start", "null"); /* the start state is not written yet */
  const char *file = flesh_path("%s/release.yaml", folder);
  if (flesh_path_access(file, F_OK)) file = flesh_path("%s/scene.yaml", folder);
  const int status = flesh_overrides_read(&overrides, file, &last);
  if (!status) flesh_hardcases_rest_shape(last, flesh_scene_times(last)->end, rest);
  flesh_scene_destroy(&last);
  flesh_overrides_close(&overrides);
  return status;
}

static void refuse(flesh_hardcases_figures *f, int status)
{
  f->status = status;
  f->exit_code = flesh_exit_code(status);
  snprintf(f->message, sizeof f->message, "%.399s", flesh_error_text());
}

/* Finds the rest shape, and prepares to observe the first phase. */
static int watch_begin(const flesh_hardcases_plan *plan, const flesh_scene *scene, watch_of_run *w, flesh_mesh **rest)
{
  const int status = find_rest(plan, w->folder, rest);
  if (status) return status;
  w->unknowns = flesh_system_unknowns(flesh_scene_system(scene));
  w->last.x = calloc(5 * (size_t)w->unknowns, sizeof(double));
  if (!w->last.x) return flesh_no_memory();
  w->last.v = w->last.x + w->unknowns;
  w->point = w->last.v + w->unknowns;
  w->rest = *rest;
  w->early = 0.1 * flesh_scene_times(scene)->end;
  w->figures->tets = flesh_mesh_tet_count(flesh_scene_mesh(scene));
  w->figures->finite = 1;
  return FLESH_OK;
}

void flesh_hardcases_run_one(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run,
                             flesh_hardcases_figures *f)
{
  static const char *const files[] = {"scene.yaml", "release.yaml"}, *const folders[] = {"out", "release"};
  char path[1300];
  flesh_scene *scenes[2] = {NULL}, *last = NULL;
  flesh_mesh *rest = NULL;
  watch_of_run watch = {.folder = path, .figures = f};
  *f = (flesh_hardcases_figures){.status = FLESH_ERR_INTERRUPTED, .exit_code = 130, .rank = -1, .distance = NAN,
                                 .volume_error = NAN, .recovered_at = NAN, .newton_ratio = NAN, .time_ratio = NAN,
                                 .longest = {.t = NAN, .ratio = NAN}, .gradient = NAN, .smallest_eigenvalue = NAN};
  snprintf(path, sizeof path, "%s/%s", plan->options.out, flesh_hardcases_run_folder(run));
  int status = flesh_hardcases_write_scene(plan, run, path);
  if (status) refuse(f, status);
  for (int phase = 0; phase < 2 && !status; phase++) {
    const char *file = flesh_path("%s/%s", path, files[phase]);
    if (phase && flesh_path_access(file, F_OK)) break;
    status = flesh_overrides_read(&plan->options.overrides, file, &scenes[phase]);
    /* With the overrides in it, the file alone gives the same run. */
    if (!status && plan->options.overrides.texts.count) status = flesh_scene_write(scenes[phase], file);
    if (!status && !phase) status = watch_begin(plan, scenes[phase], &watch, &rest);
    if (status) refuse(f, status);
    else status = run_phase(plan, last = scenes[phase], path, folders[phase], &watch);
    if (!phase) watch.hard = watch.count;
  }
  watch_finish(&watch);
  if (!status) f->rank = flesh_hardcases_rank(flesh_scene_mesh(last), watch.last.x);
  if (!status && !is_back(f) && f->finite && !plan->filters) /* runs of --filters may end anywhere */
    flesh_hardcases_judge_end(last, flesh_scene_times(last)->end, watch.last.x, rest, f);
  free(watch.last.x);
  free(watch.cost);
  flesh_mesh_destroy(&rest);
  for (int phase = 0; phase < 2; phase++) flesh_scene_destroy(&scenes[phase]);
}

flesh_hardcases_outcome flesh_hardcases_judge(const flesh_hardcases_case *hardcase, const flesh_hardcases_figures *f)
{
  switch (f->status) {
  case FLESH_OK: break;
  case FLESH_ERR_BUDGET: return FLESH_HARDCASES_BUDGET;
  case FLESH_NONFINITE:
  case FLESH_ERR_NONFINITE: return FLESH_HARDCASES_NONFINITE;
  case FLESH_ERR_INTERRUPTED: return FLESH_HARDCASES_NOT_RUN;
  default: return FLESH_HARDCASES_STOPPED;
  }
  if (!f->finite) return FLESH_HARDCASES_NONFINITE;
  if (f->counts.unconverged || f->rises) return FLESH_HARDCASES_UNCONVERGED;
  const int kept = hardcase->expects == FLESH_HARDCASES_KEPT_EQUILIBRIUM;
  if (kept && f->rank < 2 && f->end != FLESH_HARDCASES_END_MOVING) return FLESH_HARDCASES_EQUILIBRIUM;
  if (!is_back(f)) return f->stressed_rest > 0 ? FLESH_HARDCASES_AT_REST : FLESH_HARDCASES_NOT_RECOVERED;
  return f->counts.untanglings ? FLESH_HARDCASES_UNTANGLED : FLESH_HARDCASES_RECOVERED;
}
