/* row.c: runs a row in this process and judges it step by step; runs the tightly solved run, by which other prices are
 * judged. */
#include "accuracy/accuracy.h"

#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <string.h>

/* Data of an observer that compares the states that it sees with the reference at times where that is known. */
typedef struct judge_of_run {
  const flesh_accuracy_plan *plan;
  const flesh_accuracy_track *reference;
  const flesh_accuracy_track *tight; /* NULL for rows of the methods' work */
  const flesh_system *system;        /* system of the run's scene */
  flesh_scene *scene;                /* the scene of the reference, as it stands */
  flesh_accuracy_errors errors;      /* largest errors so far, against the reference */
  flesh_accuracy_errors difference;  /* against `tight` */
  flesh_accuracy_track now, then;    /* one state each: of the run and of the reference */
} judge_of_run;

static int judge_open(const flesh_accuracy_plan *plan, const flesh_accuracy_track *reference,
                      const flesh_accuracy_track *tight, const flesh_scene *scene, judge_of_run *judge)
{
  const flesh_system *system = flesh_scene_system(scene);
  *judge = (judge_of_run){.plan = plan, .reference = reference, .tight = tight, .system = system};
  int status = flesh_overrides_read(&plan->options.overrides, plan->scene, &judge->scene);
  if (!status) status = flesh_accuracy_track_open(1, flesh_system_unknowns(system), &judge->now);
  return status ? status : flesh_accuracy_track_open(1, reference->unknowns, &judge->then);
}

static int compare(judge_of_run *j, const flesh_accuracy_track *with, flesh_accuracy_errors *errors)
{
  const flesh_accuracy_plan *plan = j->plan;
  *j->then.t = *j->now.t;
  if (!flesh_accuracy_track_at(with, &plan->measure, *j->now.t, j->then.x, j->then.v)) return FLESH_OK;
  int status = flesh_accuracy_track_evaluate(flesh_scene_system(j->scene), &j->then);
  if (!status) flesh_accuracy_compare_times(&plan->measure, &plan->reference.scale, &j->now, 0, &j->then, 0, errors);
  return status;
}

static int judge_see(void *data, const flesh_state *state)
{
  judge_of_run *j = data;
  size_t size = sizeof(double) * (size_t)j->now.unknowns;
  *j->now.t = state->t;
  memcpy(j->now.x, state->x, size);
  memcpy(j->now.v, state->v, size);
  int status = flesh_accuracy_track_evaluate(j->system, &j->now);
  if (!status) status = compare(j, j->reference, &j->errors);
  if (!status && j->tight) status = compare(j, j->tight, &j->difference);
  return status;
}

/* Returns whether the run was repeated often enough; without --repeat short runs are repeated more often than long
 * ones. */
static int enough(const flesh_accuracy_plan *plan, int count, double spent)
{
  if (plan->repeat) return count >= plan->repeat;
  if (spent > 10) return 1;
  return count >= (plan->quick ? 1 : 3) && (spent > 0.2 || count >= 20);
}

static int run_repeats(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row, const flesh_scene *scene,
                       const flesh_accuracy_watch *watch, flesh_accuracy_figures *f)
{
  enum { MOST = 100 };
  double walls[MOST], cpus[MOST], spent = 0;
  int count = 0;
  for (; count < MOST && !enough(plan, count, spent); count++) {
    const char *steps = flesh_accuracy_steps_path(plan, row);
    flesh_accuracy_cost cost;
    /* The first run is observed; of the others only the time is used. */
    int status = flesh_accuracy_integrate(scene, &plan->grid, plan->max_seconds, count || !*steps ? NULL : steps,
                                          count ? NULL : watch, &cost);
    if (!count) f->cost = cost, f->wall_s_median = f->wall_s_min = cost.wall_s;
    if (status) return status;
    walls[count] = cost.wall_s;
    cpus[count] = cost.cpu_s;
    spent += cost.wall_s;
  }
  f->cost.cpu_s = gsl_stats_min(cpus, 1, (size_t)count);
  f->wall_s_min = gsl_stats_min(walls, 1, (size_t)count);
  f->wall_s_median = gsl_stats_median(walls, 1, (size_t)count);
  return FLESH_OK;
}

/* Returns the error, or NaN if it is below the uncertainty of the reference. */
static double above(double error, double uncertainty)
{
  return fabs(error) > uncertainty ? error : isnan(error) ? error : NAN;
}

static void judge(const flesh_accuracy_plan *plan, const judge_of_run *judged, flesh_accuracy_figures *f)
{
  const flesh_accuracy_errors *u = &plan->reference.uncertainty, *e = &judged->errors;
  f->below = e->position_rms <= u->position_rms;
  f->errors = (flesh_accuracy_errors){above(e->position_rms, u->position_rms), above(e->position_max, u->position_max),
                                      above(e->tip, u->tip), above(e->volume, u->volume), above(e->energy, u->energy)};
  if (judged->tight) f->difference = judged->difference.position_rms;
}

/* Returns the times at which the tight run is kept: every step, if there is room for all. */
static flesh_accuracy_grid tight_times(const flesh_accuracy_plan *plan)
{
  flesh_accuracy_grid keep = plan->grid;
  const double step = plan->representative_step.value, steps = ceil((keep.end - keep.start) / step - 1e-6);
  keep.longest = step;
  keep.interval = step * ceil(steps / (flesh_accuracy_room(3 * plan->measure.nodes) - 1));
  keep.count = (int)ceil((keep.end - keep.start) / keep.interval - 1e-6) + 1;
  return keep;
}

int flesh_accuracy_run_tight(const flesh_accuracy_plan *plan, int number)
{
  flesh_scene *scene = NULL;
  flesh_accuracy_cost cost;
  flesh_accuracy_track track = {0};
  const flesh_accuracy_grid keep = tight_times(plan);
  int status = flesh_accuracy_read(plan, &plan->rows[number], &scene);
  if (!status) status = flesh_accuracy_track_open(keep.count, 3 * plan->measure.nodes, &track);
  if (!status) status = flesh_accuracy_integrate_into(scene, &plan->grid, plan->max_seconds, &keep, &track, &cost);
  if (!status) status = flesh_accuracy_track_write(flesh_accuracy_states_path(plan, number), &track);
  flesh_accuracy_track_close(&track);
  flesh_scene_destroy(&scene);
  return status;
}

static int read_track(const flesh_accuracy_plan *plan, flesh_accuracy_group group, flesh_accuracy_track *track)
{
  return flesh_accuracy_track_read(flesh_accuracy_states_path(plan, flesh_accuracy_slot(plan, group)), track);
}

static int run_and_judge(const flesh_accuracy_plan *plan, const flesh_accuracy_track *reference,
                         const flesh_accuracy_track *tight, const flesh_accuracy_row *row, flesh_accuracy_figures *f)
{
  flesh_scene *scene = NULL;
  judge_of_run judged = {0};
  const flesh_accuracy_watch watch = {judge_see, &judged, 1};
  int status = flesh_accuracy_read(plan, row, &scene);
  if (!status) status = judge_open(plan, reference, tight, scene, &judged);
  if (!status) status = run_repeats(plan, row, scene, &watch, f);
  if (!status) judge(plan, &judged, f);
  flesh_accuracy_track_close(&judged.now);
  flesh_accuracy_track_close(&judged.then);
  flesh_scene_destroy(&judged.scene);
  flesh_scene_destroy(&scene);
  return status;
}

int flesh_accuracy_do_row(flesh_accuracy_plan *plan, int number)
{
  flesh_accuracy_row *row = &plan->rows[number];
  const int is_price = row->group != FLESH_ACCURACY_WORK;
  flesh_accuracy_track reference = {0}, tight = {0};
  int status = plan->reference.times ? FLESH_OK : flesh_accuracy_load(plan); /* on a rank other than the first */
  if (!status) status = read_track(plan, FLESH_ACCURACY_REFERENCE, &reference);
  if (!status && is_price) status = read_track(plan, FLESH_ACCURACY_TIGHT, &tight);
  if (!status) status = run_and_judge(plan, &reference, is_price ? &tight : NULL, row, &row->figures);
  flesh_accuracy_track_close(&reference);
  flesh_accuracy_track_close(&tight);
  return status;
}
