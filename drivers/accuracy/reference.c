/* reference.c: makes the reference from two different methods, each refined until its results no longer change, and measures
 * how far they differ; keeps the reference, and the cases that turn out to be needed on the way.
 *
 * Fixed steps are halved and extrapolated (Richardson; Hairer, Norsett and Wanner, Solving ODEs I, II.9): each column of the
 * tableau removes one more power of the step. */
#include <math.h>
#include <stddef.h>
#include <unistd.h>

#include "accuracy/accuracy.h"
#include "base/confine.h"
#include "base/clock.h"
#include "base/error.h"
#include "base/text.h"
#include "cli/json_memory.h"
#include "run/provenance.h"
#include "study/study.h"

enum { COLUMNS = 3, LEVELS = 14 };

/* Integrates a source once, at a level of refinement. */
static int run_level(const flesh_accuracy_plan *plan, const flesh_accuracy_source *source, int level, double max_seconds,
                     flesh_accuracy_track *track, flesh_accuracy_row *row, flesh_accuracy_cost *cost)
{
  *row = (flesh_accuracy_row){.method = flesh_accuracy_method_find(source->method), .tight = 1};
  int adaptive = flesh_accuracy_methods[row->method].adaptive;
  /* Fixed steps begin with a quarter of the interval between the times, or of the longest of --steps if that is
   * shorter; each level halves them. */
  row->step.value = adaptive ? plan->grid.interval : fmin(plan->grid.interval, plan->grid.longest) / ldexp(4, level);
  snprintf(row->step.text, sizeof row->step.text, "%.17g", row->step.value);
  if (adaptive) snprintf(row->tolerance.text, sizeof row->tolerance.text, "1e-%d", 5 + level);
  flesh_scene *scene = NULL;
  int status = flesh_accuracy_read(plan, row, &scene);
  if (!status) status = flesh_accuracy_integrate_into(scene, &plan->grid, max_seconds, &plan->grid, track, cost);
  flesh_scene_destroy(&scene);
  return status;
}

/* Memory for the tableau: two rows, of which levels use one in turn, and the best state so far. */
typedef struct room {
  flesh_accuracy_track rows[2][COLUMNS], best;
} room;

static int open_room(const flesh_accuracy_plan *plan, int columns, room *r)
{
  const int unknowns = 3 * plan->measure.nodes;
  int status = flesh_accuracy_track_open(plan->grid.count, unknowns, &r->best);
  for (int k = 0; k < 2 * columns && !status; k++)
    status = flesh_accuracy_track_open(plan->grid.count, unknowns, &r->rows[k % 2][k / 2]);
  return status;
}

/* Computes the columns of a level from the level before it. Returns that with the least change from there, if the change is
 * less than the estimate, which it becomes; else -1. */
static int fill_row(const flesh_accuracy_plan *plan, const flesh_accuracy_source *source, int level, int columns, room *r,
                    double *estimate)
{
  flesh_accuracy_track *finer = r->rows[level % 2], *coarser = r->rows[1 - level % 2];
  int best = -1;
  for (int c = 0; c < columns && c <= level; c++) {
    const int power = source->first + (c - 1) * source->stride;
    if (c) flesh_accuracy_extrapolate(&finer[c - 1], &coarser[c - 1], 1 / (ldexp(1, power) - 1), &finer[c]);
    if (c == level) continue; /* nothing to compare with yet */
    double change = flesh_accuracy_apart(&plan->measure, &finer[c], &coarser[c]);
    if (change < *estimate) *estimate = change, best = c;
  }
  if (best >= 0) flesh_accuracy_track_copy(&finer[best], &r->best);
  return best;
}

/* Refines until the change is below the target or increases again (rounding), or until the time is spent. */
static int refine(const flesh_accuracy_plan *plan, const flesh_accuracy_source *source, room *r, flesh_accuracy_figures *result)
{
  double started = flesh_wall_seconds(), last = 0;
  /* The target is a thousandth of the smallest error that is asked for. */
  double finest = fmin(plan->tolerances[plan->tolerance_count - 1].value, 1e-3);
  double target = 1e-3 * finest * plan->reference.scale.length;
  const int columns = source->stride ? COLUMNS : 1;
  int worse = 0, status = FLESH_OK;
  result->estimate = INFINITY;
  for (int level = 0; level < LEVELS && worse < 2 && !(result->estimate < target); level++) {
    double left = plan->reference_seconds - (flesh_wall_seconds() - started);
    if (level >= 2 && (left <= 0 || (columns > 1 && 1.5 * last > left))) break;
    flesh_accuracy_row row;
    flesh_accuracy_cost cost;
    /* An estimate needs two levels, whose time is not limited by reference_seconds. */
    double most = level < 2 ? plan->max_seconds : left + plan->reference_seconds;
    status = run_level(plan, source, level, most, &r->rows[level % 2][0], &row, &cost);
    if (status) break;
    last = cost.wall_s;
    const int best = fill_row(plan, source, level, columns, r, &result->estimate);
    worse = level && best < 0 ? worse + 1 : 0;
    if (best < 0) continue;
    snprintf(result->message, sizeof result->message, "%s, ", source->method);
    if (source->stride) flesh_text_add(result->message, sizeof result->message, "step %.3g s", row.step.value);
    else
      flesh_text_add(result->message, sizeof result->message, "tolerance %s, %d steps", row.tolerance.text, cost.counts.steps);
    if (best) flesh_text_add(result->message, sizeof result->message, " extrapolated %d times", best);
  }
  /* If a level fails, the results of earlier levels stay valid. */
  if (status && status != FLESH_ERR_INTERRUPTED && isfinite(result->estimate)) status = FLESH_OK;
  result->took_s = flesh_wall_seconds() - started;
  return status;
}

static int finish(const flesh_accuracy_plan *plan, int number, room *r)
{
  flesh_scene *scene = NULL;
  int status = flesh_overrides_read(&plan->options.overrides, plan->scene, &scene);
  if (!status) status = flesh_accuracy_track_evaluate(flesh_scene_system(scene), &r->best);
  if (!status) status = flesh_accuracy_track_write(flesh_accuracy_states_path(plan, number), &r->best);
  flesh_scene_destroy(&scene);
  return status;
}

int flesh_accuracy_make_source(const flesh_accuracy_plan *plan, int number)
{
  const flesh_accuracy_source *source = &flesh_accuracy_sources[number - flesh_accuracy_slot(plan, FLESH_ACCURACY_SOURCE)];
  flesh_accuracy_figures *f = &plan->rows[number].figures;
  room r = {0};
  int status = open_room(plan, source->stride ? COLUMNS : 1, &r);
  if (!status) status = refine(plan, source, &r, f);
  if (!status && !isfinite(f->estimate))
    status = flesh_fail(FLESH_ERR_BUDGET, "%g s do not suffice for two levels of refinement; --reference-seconds gives more",
                        plan->max_seconds);
  if (!status) status = finish(plan, number, &r);
  for (int k = 0; k < 2 * COLUMNS; k++) flesh_accuracy_track_close(&r.rows[k % 2][k / 2]);
  flesh_accuracy_track_close(&r.best);
  return status;
}

/* Finds the first two sources that reached the end; returns how many there are. */
static int find_sources(const flesh_accuracy_plan *plan, int numbers[2])
{
  const int first = flesh_accuracy_slot(plan, FLESH_ACCURACY_SOURCE);
  int have = 0;
  for (int k = first; k < first + FLESH_ACCURACY_SOURCES && have < 2; k++)
    if (plan->rows[k].done && !plan->rows[k].figures.status) numbers[have++] = k;
  return have;
}

int flesh_accuracy_settle(flesh_accuracy_plan *plan, flesh_accuracy_figures *f)
{
  flesh_accuracy_track tracks[2] = {0};
  flesh_accuracy_reference *about = &plan->reference;
  int numbers[2], status = FLESH_OK;
  flesh_scene *scene = NULL;
  find_sources(plan, numbers);
  for (int k = 0; k < 2 && !status; k++)
    status = flesh_accuracy_track_read(flesh_accuracy_states_path(plan, numbers[k]), &tracks[k]);
  const flesh_accuracy_figures *made[2] = {&plan->rows[numbers[0]].figures, &plan->rows[numbers[1]].figures};
  const int first = made[1]->estimate < made[0]->estimate;
  if (!status) status = flesh_overrides_read(&plan->options.overrides, plan->scene, &scene);
  if (!status) {
    flesh_accuracy_errors doubt = {0};
    flesh_accuracy_measure_scale(&plan->measure, flesh_scene_mesh(scene), &tracks[first], &about->scale);
    flesh_accuracy_compare(&plan->measure, &about->scale, &tracks[!first], &tracks[first], &about->uncertainty);
    about->apart = about->uncertainty.position_rms;
    about->change = made[first]->estimate;
    status = flesh_accuracy_track_doubt(flesh_scene_system(scene), &plan->measure, &about->scale, &tracks[first], &doubt);
    about->between = doubt.position_rms;
    flesh_accuracy_widen(about->change, &doubt, &about->uncertainty);
    about->times = plan->grid.count, about->start = plan->grid.start, about->end = plan->grid.end;
    f->took_s = made[0]->took_s + made[1]->took_s;
    snprintf(f->message, sizeof f->message, "%.150s; against %.150s", made[first]->message, made[!first]->message);
    const char *path = flesh_accuracy_states_path(plan, flesh_accuracy_slot(plan, FLESH_ACCURACY_REFERENCE));
    if (!status) status = flesh_accuracy_track_write(path, &tracks[first]); /* the sources' files go after its row is written */
  }
  flesh_scene_destroy(&scene);
  flesh_accuracy_track_close(&tracks[0]);
  flesh_accuracy_track_close(&tracks[1]);
  return status;
}

#define OF_REFERENCE(kind, name, member) {name, FLESH_FIELD_##kind, offsetof(flesh_accuracy_reference, member)}
const flesh_study_field flesh_accuracy_reference_fields[] = {
    OF_REFERENCE(DOUBLE, "apart", apart), OF_REFERENCE(DOUBLE, "change", change), OF_REFERENCE(DOUBLE, "between", between),
    OF_REFERENCE(DOUBLE, "uncertainty_position_rms", uncertainty.position_rms),
    OF_REFERENCE(DOUBLE, "uncertainty_position_max", uncertainty.position_max),
    OF_REFERENCE(DOUBLE, "uncertainty_tip", uncertainty.tip), OF_REFERENCE(DOUBLE, "uncertainty_volume", uncertainty.volume),
    OF_REFERENCE(DOUBLE, "uncertainty_energy", uncertainty.energy), OF_REFERENCE(DOUBLE, "length", scale.length),
    OF_REFERENCE(DOUBLE, "motion", scale.motion), OF_REFERENCE(INT, "tip_node", scale.tip),
    OF_REFERENCE(INT, "tip_axis", scale.tip_axis), OF_REFERENCE(DOUBLE, "tip_motion", scale.tip_motion),
    OF_REFERENCE(DOUBLE, "kinetic_energy", scale.energy), OF_REFERENCE(DOUBLE, "period", scale.period),
    OF_REFERENCE(INT, "times", times), OF_REFERENCE(DOUBLE, "start_t", start), OF_REFERENCE(DOUBLE, "end_t", end), {0}};

/* Writes accuracy.json. */
int flesh_accuracy_keep(const flesh_accuracy_plan *plan, const char *words)
{
  json_t *reference = flesh_fields_json(flesh_accuracy_reference_fields, &plan->reference);
  json_object_set_new(reference, "made_by", flesh_json_text(words));
  return flesh_json_write(flesh_path("%s/accuracy.json", plan->options.out),
                          json_pack("{so* so* so*}", "scene_path", flesh_json_text(plan->scene), "program",
                                    flesh_provenance_program(plan->options.argc, plan->options.argv), "reference", reference));
}

int flesh_accuracy_load(flesh_accuracy_plan *plan)
{
  const char *path = flesh_path("%s/accuracy.json", plan->options.out);
  json_t *root = json_load_file(path, 0, NULL);
  const int lacks = flesh_fields_read(flesh_accuracy_reference_fields, json_object_get(root, "reference"), &plan->reference);
  json_decref(root);
  return lacks ? flesh_fail(FLESH_ERR_FILE, "%s: its reference is incomplete", path) : FLESH_OK;
}

int flesh_accuracy_known(flesh_accuracy_plan *plan, int number)
{
  flesh_accuracy_row *row = &plan->rows[number];
  row->done = 0;
  int status = flesh_study_store_want(&plan->store, &plan->study, number);
  if (!status) status = flesh_study_store_load(&plan->store, &plan->study);
  const char *path = flesh_accuracy_states_path(plan, number);
  const int lacks = row->done && !row->figures.status && *path && row->needs_states && flesh_path_access(path, R_OK);
  if (status || !lacks) return status;
  row->done = 0;
  return flesh_study_store_redo(&plan->store, "1", number);
}

int flesh_accuracy_do(flesh_accuracy_plan *plan, int number)
{
  flesh_accuracy_row *row = &plan->rows[number];
  flesh_study study = plan->study;
  const int status = flesh_accuracy_known(plan, number);
  if (status || row->done) return status;
  if (row->group == FLESH_ACCURACY_SOURCE) study.max_seconds = 2 * (plan->max_seconds + plan->reference_seconds) + 2;
  plan->store.first = number, plan->store.end = number + 1;
  return flesh_study_run(&study, &plan->store, &plan->options);
}

static void show(const char *words)
{
  if (!isatty(STDERR_FILENO)) return;
  fprintf(stderr, "\r\033[K%s", words);
  fflush(stderr);
}

/* Makes sources one after the other until two have reached the end. */
static int make_sources(flesh_accuracy_plan *plan)
{
  const int first = flesh_accuracy_slot(plan, FLESH_ACCURACY_SOURCE);
  char why[600] = "", words[160];
  int have = 0, numbers[2];
  for (int k = first; k < first + FLESH_ACCURACY_SOURCES && have < 2; k++) {
    const flesh_accuracy_row *row = &plan->rows[k];
    snprintf(words, sizeof words, "reference: %s, about %.0f s", flesh_accuracy_sources[k - first].method,
             plan->reference_seconds);
    show(words);
    const int status = flesh_accuracy_do(plan, k);
    show("");
    if (status) return status;
    have = find_sources(plan, numbers);
    if (row->figures.status)
      flesh_text_add(why, sizeof why, "%s%s: %.120s", *why ? "; " : "", flesh_accuracy_sources[k - first].method,
                     row->figures.message);
  }
  return have == 2 ? FLESH_OK
                   : flesh_fail(FLESH_ERR_SOLVE, "no reference: two methods must reach the end of %s, and %s did (%s)",
                                plan->scene, have ? "only one" : "none", why);
}

int flesh_accuracy_make_reference(flesh_accuracy_plan *plan)
{
  const int number = flesh_accuracy_slot(plan, FLESH_ACCURACY_REFERENCE);
  const flesh_accuracy_row *row = &plan->rows[number];
  int status = flesh_accuracy_known(plan, number);
  if (!status && !row->done) status = make_sources(plan);
  if (!status) status = flesh_accuracy_do(plan, number);
  if (!status && row->figures.status) status = flesh_fail(row->figures.status, "no reference: %s", row->figures.message);
  for (int k = 0; k < FLESH_ACCURACY_SOURCES && !status; k++)
    flesh_path_unlink(flesh_accuracy_states_path(plan, flesh_accuracy_slot(plan, FLESH_ACCURACY_SOURCE) + k));
  return status;
}
