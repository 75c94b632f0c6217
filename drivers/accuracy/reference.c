/* reference.c: the reference: two different methods, each refined until it changes no
 * more, and how far they differ.
 *
 * Fixed steps are halved and extrapolated (Richardson; Hairer, Norsett and Wanner, Solving ODEs I,
 * II.9): the columns of the tableau remove one power of the step each. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "accuracy/accuracy.h"
#include "base/confine.h"
#include "base/clock.h"
#include "base/error.h"
#include "base/text.h"
#include "pool/pool.h"

/* A way to a reference: the powers of the step in its error are first, first + stride, ... */
typedef struct source {
  const char *method;
  int first, stride;
} source;

/* The first two that reach the end make the reference. */
static const source sources[] = {{"ida5", 0, 0},
                                 {"midpoint", 2, 2},
                                 {"newmark", 2, 2},
                                 {"bdf2", 2, 1},
                                 {"backward-euler", 1, 1}};
enum { SOURCES = sizeof sources / sizeof sources[0], COLUMNS = 3, LEVELS = 14 };

/* The result of a source's process, beside its states. */
typedef struct made {
  int status, crashed_by;
  double estimate, seconds; /* position rms [m] by its own last change */
  char words[120], message[400];
} made;

typedef struct task {
  const flesh_accuracy_plan *plan;
  const source *way;
  const char *path; /* of the states */
} task;

/* to = finer + (finer - coarser) / (2^power - 1), for positions and velocities; `to` may be either.
 */
static void extrapolate(const flesh_accuracy_track *finer, const flesh_accuracy_track *coarser,
                        int power, flesh_accuracy_track *to)
{
  double factor = 1 / (ldexp(1, power) - 1);
  size_t size = (size_t)to->times * (size_t)to->unknowns;
  for (int k = 0; k < to->times; k++) to->t[k] = finer->t[k];
  for (size_t d = 0; d < size; d++) {
    to->x[d] = finer->x[d] + factor * (finer->x[d] - coarser->x[d]);
    to->v[d] = finer->v[d] + factor * (finer->v[d] - coarser->v[d]);
  }
}

/* One integration of the source at a level. */
static int run_level(const task *given, int level, double max_seconds, flesh_accuracy_track *track,
                     flesh_accuracy_row *row, flesh_accuracy_cost *cost)
{
  const flesh_accuracy_plan *plan = given->plan;
  *row = (flesh_accuracy_row){.method = flesh_accuracy_method_find(given->way->method), .tight = 1};
  int adaptive = flesh_accuracy_methods[row->method].adaptive;
  /* Fixed steps begin with a quarter of the interval between the times, or of the longest of --steps. */
  row->step.value = adaptive ? plan->grid.interval : fmin(plan->grid.interval, plan->grid.longest) / ldexp(4, level);
  snprintf(row->step.text, sizeof row->step.text, "%.17g", row->step.value);
  if (adaptive) snprintf(row->tolerance.text, sizeof row->tolerance.text, "1e-%d", 5 + level);
  flesh_scene *scene = NULL;
  flesh_accuracy_keeper keeper = {&plan->grid, track, 0};
  const flesh_accuracy_watch watch = {flesh_accuracy_keep_state, &keeper, 0};
  int status = flesh_accuracy_read(plan, row, &scene);
  if (!status) status = flesh_accuracy_integrate(scene, &plan->grid, max_seconds, NULL, &watch, cost);
  flesh_scene_destroy(&scene);
  return status;
}

/* Room for the tableau: a row, the row before it, and the best state so far. */
typedef struct room {
  flesh_accuracy_track row[COLUMNS], before[COLUMNS], best;
} room;

static int open_room(const flesh_accuracy_plan *plan, int columns, room *r)
{
  int unknowns = 3 * plan->measure.nodes, status = FLESH_OK;
  for (int c = 0; c < columns && !status; c++) {
    status = flesh_accuracy_track_open(plan->grid.count, unknowns, &r->row[c]);
    if (!status) status = flesh_accuracy_track_open(plan->grid.count, unknowns, &r->before[c]);
  }
  if (!status) status = flesh_accuracy_track_open(plan->grid.count, unknowns, &r->best);
  return status;
}

static void close_room(room *r)
{
  for (int c = 0; c < COLUMNS; c++) {
    flesh_accuracy_track_close(&r->row[c]);
    flesh_accuracy_track_close(&r->before[c]);
  }
  flesh_accuracy_track_close(&r->best);
}

/* Refines until the change is below the target, grows again (rounding) or the time is spent. */
static int refine(const task *given, room *r, made *result)
{
  const flesh_accuracy_plan *plan = given->plan;
  const source *way = given->way;
  double started = flesh_wall_seconds(), last = 0;
  /* A thousandth of the smallest error that is asked for. */
  double finest = fmin(plan->tolerances[plan->tolerance_count - 1].value, 1e-3);
  double target = 1e-3 * finest * plan->reference.scale.length;
  int columns = way->stride ? COLUMNS : 1, worse = 0, status = FLESH_OK;
  result->estimate = INFINITY;
  for (int level = 0; level < LEVELS && worse < 2; level++) {
    double left = plan->reference_seconds - (flesh_wall_seconds() - started);
    if (level >= 2 && (left <= 0 || (columns > 1 && 1.5 * last > left))) break;
    flesh_accuracy_row row;
    flesh_accuracy_cost cost;
    /* Two levels are needed for an estimate: they take what they take. */
    double most = level < 2 ? plan->max_seconds : left + plan->reference_seconds;
    status = run_level(given, level, most, &r->row[0], &row, &cost);
    if (status) break;
    last = cost.wall_s;
    int best = -1;
    for (int c = 0; c < columns && c <= level; c++) {
      if (c)
        extrapolate(&r->row[c - 1], &r->before[c - 1], way->first + (c - 1) * way->stride,
                    &r->row[c]);
      if (c == level) continue; /* nothing to compare with yet */
      double change = flesh_accuracy_apart(&plan->measure, &r->row[c], &r->before[c]);
      if (change < result->estimate) result->estimate = change, best = c;
    }
    if (best >= 0) {
      flesh_accuracy_track_copy(&r->row[best], &r->best);
      if (way->stride && !best)
        snprintf(result->words, sizeof result->words, "%s, step %.3g s", way->method,
                 row.step.value);
      else if (way->stride)
        snprintf(result->words, sizeof result->words, "%s, step %.3g s extrapolated %d times",
                 way->method, row.step.value, best);
      else
        snprintf(result->words, sizeof result->words, "%s, tolerance %s, %ld steps", way->method,
                 row.tolerance.text, cost.steps);
    }
    worse = level && best < 0 ? worse + 1 : 0;
    if (result->estimate < target) break;
    for (int c = 0; c < columns && c <= level; c++) {
      flesh_accuracy_track swap = r->before[c];
      r->before[c] = r->row[c];
      r->row[c] = swap;
    }
  }
  /* A level that failed does not undo the ones before it. */
  if (status && status != FLESH_ERR_INTERRUPTED && isfinite(result->estimate)) status = FLESH_OK;
  result->seconds = flesh_wall_seconds() - started;
  return status;
}

static int finish(const task *given, room *r, int status)
{
  const flesh_accuracy_plan *plan = given->plan;
  flesh_scene *scene = NULL;
  if (!status)
    status = flesh_accuracy_read_as_it_stands(plan, plan->scene, &scene);
  if (!status) status = flesh_accuracy_track_evaluate(flesh_scene_system(scene), &r->best);
  if (!status) status = flesh_accuracy_track_write(given->path, &r->best);
  flesh_scene_destroy(&scene);
  return status;
}

static void work(const void *data, void *result)
{
  const task *given = data;
  made *m = result;
  room r = {0};
  int status = open_room(given->plan, given->way->stride ? COLUMNS : 1, &r);
  if (!status) status = refine(given, &r, m);
  if (!status && !isfinite(m->estimate))
    status = flesh_fail(FLESH_ERR_BUDGET, "%g s do not suffice for two levels of refinement; --reference-seconds gives more",
                        given->plan->max_seconds);
  status = finish(given, &r, status);
  m->status = status;
  if (status) snprintf(m->message, sizeof m->message, "%.399s", flesh_error_text());
  close_room(&r);
}

static void show(const char *words)
{
  if (!isatty(STDERR_FILENO)) return;
  fprintf(stderr, "\r\033[K%s", words);
  fflush(stderr);
}

/* Compares with the first and measures the second against it. */
static int settle(flesh_accuracy_plan *plan, const char *paths[2], made results[2],
                  flesh_accuracy_track *reference)
{
  flesh_accuracy_track tracks[2] = {0};
  flesh_accuracy_reference *about = &plan->reference;
  char kept[1400];
  int first = results[1].estimate < results[0].estimate;
  int status = flesh_accuracy_track_read(paths[0], &tracks[0]);
  if (!status) status = flesh_accuracy_track_read(paths[1], &tracks[1]);
  flesh_scene *scene = NULL;
  if (!status)
    status = flesh_accuracy_read_as_it_stands(plan, plan->scene, &scene);
  if (!status) {
    flesh_accuracy_measure_scale(&plan->measure, flesh_scene_mesh(scene), &tracks[first], &about->scale);
    flesh_accuracy_compare(&plan->measure, &about->scale, &tracks[!first], &tracks[first],
                           &about->uncertainty);
    about->apart = about->uncertainty.position_rms;
    about->change = results[first].estimate;
    flesh_accuracy_errors doubt = {0};
    status = flesh_accuracy_track_doubt(flesh_scene_system(scene), &plan->measure, &about->scale, &tracks[first],
                                        &doubt);
    about->between = doubt.position_rms;
    flesh_accuracy_widen(results[first].estimate, &doubt, &about->uncertainty);
    snprintf(about->first, sizeof about->first, "%s", results[first].words);
    snprintf(about->second, sizeof about->second, "%s", results[!first].words);
    about->seconds = results[0].seconds + results[1].seconds;
    snprintf(kept, sizeof kept, "%s/reference.states", plan->out);
    if (!status && flesh_path_rename(paths[first], kept))
      status = flesh_fail(FLESH_ERR_FILE, "%s cannot be written", kept);
    flesh_path_unlink(paths[!first]);
    *reference = tracks[first];
    tracks[first] = (flesh_accuracy_track){0};
  }
  flesh_scene_destroy(&scene);
  flesh_accuracy_track_close(&tracks[0]);
  flesh_accuracy_track_close(&tracks[1]);
  return status;
}

static int make(flesh_accuracy_plan *plan, flesh_accuracy_track *reference)
{
  char paths[2][1400], why[600] = "";
  made results[2];
  int have = 0;
  snprintf(paths[0], sizeof paths[0], "%s/reference_first.states", plan->out);
  snprintf(paths[1], sizeof paths[1], "%s/reference_second.states", plan->out);
  for (int s = 0; s < SOURCES && have < 2; s++) {
    char words[160];
    const task given = {plan, &sources[s], paths[have]};
    made *result = &results[have];
    *result = (made){.status = FLESH_ERR_SOLVE, .estimate = INFINITY};
    snprintf(words, sizeof words, "reference: %s, about %.0f s", sources[s].method,
             plan->reference_seconds);
    show(words);
    const flesh_pool_task alone = {work, &given, sizeof *result, 2 * (plan->max_seconds + plan->reference_seconds),
                                   "the reference was made"};
    int crashed_by = 0, status = flesh_pool_do(plan->options.ranks, &alone, result, &crashed_by);
    show("");
    if (status) return status;
    result->crashed_by = crashed_by;
    if (result->status == FLESH_ERR_FILE) return flesh_fail(FLESH_ERR_FILE, "no reference: %s", result->message);
    if (!result->status && !result->crashed_by) {
      have++;
      continue;
    }
    flesh_text_add(why, sizeof why, "%s%s: %.120s", *why ? "; " : "", sources[s].method,
                   result->crashed_by ? "its process died" : result->message);
  }
  if (have < 2)
    return flesh_fail(FLESH_ERR_SOLVE,
                      "no reference: two methods must reach the end of %s, and %s did (%s)",
                      plan->scene, have ? "only one" : "none", why);
  const char *both[2] = {paths[0], paths[1]};
  return settle(plan, both, results, reference);
}

static void remove_halves(const flesh_accuracy_plan *plan)
{
  char path[1400];
  snprintf(path, sizeof path, "%s/reference_first.states", plan->out);
  flesh_path_unlink(path);
  snprintf(path, sizeof path, "%s/reference_second.states", plan->out);
  flesh_path_unlink(path);
}

int flesh_accuracy_make_reference(flesh_accuracy_plan *plan, flesh_accuracy_track *reference)
{
  char path[1400];
  snprintf(path, sizeof path, "%s/reference.states", plan->out);
  if (*plan->reference.first) return flesh_accuracy_track_read(path, reference);
  int status = make(plan, reference);
  if (status) remove_halves(plan);
  return status;
}
