/* run.c: runs the rows one at a time, each in a process of its own, and judges them. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "accuracy/accuracy.h"
#include "accuracy/judge.h"
#include "base/error.h"
#include "shared/interrupt.h"
#include "shared/process.h"

typedef struct task {
  const flesh_accuracy_plan *plan;
  const flesh_accuracy_track *reference, *tight; /* tight: NULL for the methods' work */
  const flesh_accuracy_row *row;
  const flesh_accuracy_grid *keep; /* the run solved tightly: the times that are kept of it, and its errors are not */
} task;

static int by_value(const void *a, const void *b)
{
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* Runs it again and again: without --repeat short runs more often than long ones. */
static int enough(const flesh_accuracy_plan *plan, int count, double spent)
{
  if (plan->repeat) return count >= plan->repeat;
  if (spent > 10) return 1;
  return count >= (plan->quick ? 1 : 3) && (spent > 0.2 || count >= 20);
}

static int run_repeats(const task *given, const flesh_scene *scene, const flesh_accuracy_watch *watch,
                       flesh_accuracy_figures *f)
{
  enum { MOST = 100 };
  const flesh_accuracy_plan *plan = given->plan;
  double walls[MOST], cpus[MOST], spent = 0;
  int count = 0;
  char steps[1500];
  flesh_accuracy_steps_path(plan, given->row, steps, sizeof steps);
  for (; count < MOST && !enough(plan, count, spent); count++) {
    flesh_accuracy_cost cost;
    /* The first is watched, the others have only their times. */
    int status = flesh_accuracy_integrate(scene, &plan->grid, plan->max_seconds, count || !*steps ? NULL : steps,
                                          count ? NULL : watch, &cost);
    if (!count) {
      f->steps = cost.steps, f->rejected = cost.rejected, f->residuals = cost.residuals;
      f->assemblies = cost.assemblies, f->newton = cost.newton, f->linear = cost.linear;
      f->cpu_s = cost.cpu_s, f->wall_s_median = f->wall_s_min = cost.wall_s;
    }
    if (status) return status;
    walls[count] = cost.wall_s;
    cpus[count] = cost.cpu_s;
    spent += cost.wall_s;
  }
  qsort(walls, (size_t)count, sizeof *walls, by_value);
  qsort(cpus, (size_t)count, sizeof *cpus, by_value);
  f->cpu_s = cpus[0];
  f->wall_s_min = walls[0];
  f->wall_s_median = (walls[(count - 1) / 2] + walls[count / 2]) / 2;
  return FLESH_OK;
}

/* What the reference cannot show is not reported. */
static double above(double error, double uncertainty)
{
  return fabs(error) > uncertainty ? error : isnan(error) ? error : NAN;
}

static void judge(const flesh_accuracy_plan *plan, const flesh_accuracy_judge *judged, flesh_accuracy_figures *f)
{
  const flesh_accuracy_errors *u = &plan->reference.uncertainty, *e = &judged->errors;
  if (judged->finer_tip >= 0) {
    f->errors.tip = e->tip;
    f->errors.volume = e->volume;
    return;
  }
  f->below = e->position_rms <= u->position_rms;
  f->errors = (flesh_accuracy_errors){above(e->position_rms, u->position_rms), above(e->position_max, u->position_max),
                                      above(e->tip, u->tip), above(e->volume, u->volume), above(e->energy, u->energy)};
  if (judged->tight) f->difference = judged->difference.position_rms;
}

static void work(const void *data, void *result)
{
  const task *given = data;
  const flesh_accuracy_plan *plan = given->plan;
  flesh_accuracy_figures *f = result;
  flesh_scene *scene = NULL;
  flesh_accuracy_judge judged = {0};
  const flesh_accuracy_watch watch = {flesh_accuracy_judge_see, &judged, 1};
  int status = flesh_accuracy_read(plan, given->row, &scene);
  if (!status)
    status = flesh_accuracy_judge_open(plan, given->reference, given->tight, scene,
                                       given->row->group == FLESH_ACCURACY_MESH, &judged);
  if (!status) status = run_repeats(given, scene, &watch, f);
  if (!status) judge(plan, &judged, f);
  f->status = status;
  if (status) snprintf(f->message, sizeof f->message, "%.399s", flesh_error_text());
  flesh_accuracy_judge_close(&judged);
  flesh_scene_destroy(&scene);
}

static void tight_path(const flesh_accuracy_plan *plan, char path[1400])
{
  snprintf(path, 1400, "%s/tight.states", plan->out);
}

/* The run that is kept instead of judged. */
static void work_tight(const void *data, void *result)
{
  const task *given = data;
  const flesh_accuracy_plan *plan = given->plan;
  flesh_accuracy_figures *f = result;
  char path[1400];
  flesh_scene *scene = NULL;
  flesh_accuracy_cost cost;
  flesh_accuracy_track track = {0};
  flesh_accuracy_keeper keeper = {given->keep, &track, 0};
  const flesh_accuracy_watch watch = {flesh_accuracy_keep_state, &keeper, 0};
  int status = flesh_accuracy_read(plan, given->row, &scene);
  if (!status) status = flesh_accuracy_track_open(given->keep->count, 3 * plan->measure.nodes, &track);
  if (!status) status = flesh_accuracy_integrate(scene, &plan->grid, plan->max_seconds, NULL, &watch, &cost);
  tight_path(plan, path);
  if (!status) status = flesh_accuracy_track_write(path, &track);
  f->status = status;
  if (status) snprintf(f->message, sizeof f->message, "%.399s", flesh_error_text());
  flesh_accuracy_track_close(&track);
  flesh_scene_destroy(&scene);
}

/* Seconds a row will take, from those that ran: of its method, by its step or tolerance. */
static double predicted_time(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row)
{
  double guess = NAN, sum = 0;
  int count = 0;
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_accuracy_row *other = &plan->rows[k];
    if (!other->done || isnan(other->figures.wall_s_min)) continue;
    double took = other->figures.wall_s_min;
    sum += took, count++;
    int adaptive = flesh_accuracy_methods[row->method].adaptive;
    if (flesh_accuracy_methods[other->method].adaptive != adaptive) continue;
    if (adaptive && other->method != row->method) continue;
    if (adaptive) guess = took * cbrt(other->tolerance.value / row->tolerance.value);
    else guess = took * other->step.value / row->step.value;
  }
  return isnan(guess) && count ? sum / count : guess;
}

static void show_progress(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row)
{
  if (!isatty(STDERR_FILENO)) return;
  int done = 0;
  double left = 0;
  for (int k = 0; k < plan->row_count; k++) {
    done += plan->rows[k].done;
    if (plan->rows[k].done) continue;
    double once = predicted_time(plan, &plan->rows[k]);
    int times = plan->repeat ? plan->repeat : plan->quick || once > 10 ? 1 : once > 5 ? 2 : 3;
    left += times * once;
  }
  fprintf(stderr, "\r\033[K%d of %d  %s, %s", done, plan->row_count,
          flesh_accuracy_methods[row->method].name, row->setting);
  if (left > 0) fprintf(stderr, "  about %.0f s left", ceil(left));
  fflush(stderr);
}

static int run_row(const task *given, flesh_accuracy_row *row)
{
  const flesh_accuracy_plan *plan = given->plan;
  int repeats = plan->repeat ? plan->repeat : 3; /* those of a long run */
  flesh_process process;
  flesh_accuracy_figures *f = &row->figures;
  int status = flesh_process_start(given->keep ? work_tight : work, given, f, sizeof *f, &process);
  if (status) return status;
  f->crashed_by = flesh_process_wait(&process, plan->max_seconds * repeats, f, sizeof *f);
  if (flesh_interrupt_signal()) return FLESH_ERR_INTERRUPTED; /* half a run is no row */
  if (f->crashed_by) f->status = FLESH_ERR_SOLVE;
  /* A run that could not write its file says nothing of its method. */
  if (f->status == FLESH_ERR_FILE) return flesh_fail(FLESH_ERR_FILE, "%s", f->message);
  row->done = 1;
  return FLESH_OK;
}

/* The representative run solved tightly, which the other prices are measured against. */
static int make_tight(const flesh_accuracy_plan *plan, const flesh_accuracy_track *reference,
                      flesh_accuracy_track *tight)
{
  char path[1400];
  flesh_accuracy_row row = {.method = plan->representative,
                            .step = plan->representative_step,
                            .setting = "solved tightly",
                            .tight = 1};
  /* At every step where there is room for all. */
  flesh_accuracy_grid keep = plan->grid;
  double steps = ceil((keep.end - keep.start) / row.step.value - 1e-6);
  keep.longest = row.step.value;
  keep.interval = row.step.value * ceil(steps / (flesh_accuracy_room(3 * plan->measure.nodes) - 1));
  keep.count = (int)ceil((keep.end - keep.start) / keep.interval - 1e-6) + 1;
  const task given = {plan, reference, NULL, &row, &keep};
  tight_path(plan, path);
  show_progress(plan, &row);
  int status = run_row(&given, &row);
  if (status) return status;
  if (row.figures.status)
    return flesh_fail(row.figures.status, "the other prices are not measured: %s",
                      row.figures.message);
  status = flesh_accuracy_track_read(path, tight);
  unlink(path);
  return status;
}

int flesh_accuracy_run(flesh_accuracy_plan *plan, const flesh_accuracy_track *reference)
{
  flesh_accuracy_track tight = {0};
  int status = FLESH_OK, skip = 0;
  for (int k = 0; k < plan->row_count && !status && !skip; k++) {
    flesh_accuracy_row *row = &plan->rows[k];
    if (row->done) continue;
    if (row->group != FLESH_ACCURACY_WORK && !tight.x) {
      int made = make_tight(plan, reference, &tight);
      if (made == FLESH_ERR_INTERRUPTED || flesh_interrupt_signal()) status = FLESH_ERR_INTERRUPTED;
      else if (made == FLESH_ERR_FILE) status = made;
      else if (made) {
        fprintf(stderr, "flesh accuracy: %s\n", flesh_error_text());
        skip = 1;
      }
      if (made) break;
    }
    show_progress(plan, row);
    const task given = {plan, reference, row->group == FLESH_ACCURACY_WORK ? NULL : &tight, row,
                        NULL};
    status = run_row(&given, row);
    if (!status) status = flesh_accuracy_keep(plan);
  }
  if (isatty(STDERR_FILENO)) fputs("\r\033[K", stderr);
  flesh_accuracy_track_close(&tight);
  int done = 0;
  for (int k = 0; k < plan->row_count; k++) done += plan->rows[k].done;
  if (status == FLESH_ERR_INTERRUPTED || (!status && flesh_interrupt_signal()))
    return flesh_fail(FLESH_ERR_INTERRUPTED,
                      "interrupted after %d of %d runs; --resume goes on with the others", done,
                      plan->row_count);
  return status;
}
