/* run.c: a comparison as a study: its rows are the cases, one at a time on each rank, each in a process of its own; then its
 * tables, words and pictures. */
#include <math.h>
#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "accuracy/accuracy.h"
#include "base/confine.h"
#include "base/error.h"
#include "base/file.h"
#include "base/folder.h"
#include "cli/interrupt.h"
#include "cli/json_memory.h"
#include "study/embedded.h"
#include "study/fields.h"

#define AT(member) offsetof(flesh_accuracy_figures, member)
const flesh_study_field flesh_accuracy_fields[] = {
    {"status_code", FLESH_FIELD_INT, AT(status)},
    {"steps", FLESH_FIELD_LONG, AT(steps)},
    {"rejected", FLESH_FIELD_LONG, AT(rejected)},
    {"residual_evaluations", FLESH_FIELD_LONG, AT(residuals)},
    {"hessian_assemblies", FLESH_FIELD_LONG, AT(assemblies)},
    {"newton", FLESH_FIELD_LONG, AT(newton)},
    {"linear_iterations", FLESH_FIELD_LONG, AT(linear)},
    {"cpu_s", FLESH_FIELD_DOUBLE, AT(cpu_s)},
    {"wall_s_median", FLESH_FIELD_DOUBLE, AT(wall_s_median)},
    {"wall_s_min", FLESH_FIELD_DOUBLE, AT(wall_s_min)},
    {"error_position_rms", FLESH_FIELD_DOUBLE, AT(errors.position_rms)},
    {"error_position_max", FLESH_FIELD_DOUBLE, AT(errors.position_max)},
    {"error_tip", FLESH_FIELD_DOUBLE, AT(errors.tip)},
    {"error_volume", FLESH_FIELD_DOUBLE, AT(errors.volume)},
    {"energy_drift", FLESH_FIELD_DOUBLE, AT(errors.energy)},
    {"energy_gain", FLESH_FIELD_DOUBLE, AT(gain)},
    {"below_reference", FLESH_FIELD_INT, AT(below)},
    {"difference", FLESH_FIELD_DOUBLE, AT(difference)},
    {0}};
/* In the order of the values of make_case. */
static const flesh_study_column columns[] = {{.name = "price", .key = "group"},
                                             {.name = "method", .key = "--methods"},
                                             {.name = "setting", .key = "--steps, --tolerances"},
                                             {.name = "finer_sha256", .key = "--finer"}};
enum { COLUMNS = sizeof columns / sizeof *columns };

static const flesh_accuracy_plan *plan_of(const void *data) { return ((const flesh_accuracy_work *)data)->plan; }

static int make_case(const void *data, int number, flesh_study_case *made)
{
  const flesh_accuracy_plan *plan = plan_of(data);
  const flesh_accuracy_row *row = &plan->rows[number];
  const int finer = row->group == FLESH_ACCURACY_MESH;
  const char *const values[COLUMNS] = {flesh_accuracy_group_names[row->group], flesh_accuracy_methods[row->method].name,
                                       row->setting, finer ? plan->finer_fingerprint : ""};
  *made = (flesh_study_case){.scene = finer ? plan->finer : plan->scene};
  memcpy(made->values, values, sizeof values);
  return FLESH_OK;
}

/* SQL knows this of a run beside its row. */
static json_t *facts_of(const void *data, int number)
{
  const flesh_accuracy_plan *plan = plan_of(data);
  const flesh_accuracy_row *row = &plan->rows[number];
  const flesh_accuracy_method *method = &flesh_accuracy_methods[row->method];
  char steps[1500];
  flesh_accuracy_steps_path(plan, row, steps, sizeof steps);
  const int has_steps = *steps && !flesh_path_access(steps, R_OK);
  flesh_accuracy_steps_path(NULL, row, steps, sizeof steps);
  char *command = flesh_accuracy_command(plan, row);
  json_t *facts = json_pack("{ss ss ss sb si ss si ss ss sb so}", "method", method->name, "setting", row->setting, "price",
                            flesh_accuracy_group_names[row->group], "adaptive", method->adaptive, "max_order",
                            method->max_order, "colour", method->colour, "mark", method->mark, "step", row->step.text,
                            "steps_file", has_steps ? steps : "", "other_body",
                            row->group == FLESH_ACCURACY_MASS && strcmp(row->extra, plan->mass), "command",
                            flesh_json_text(command ? command : ""));
  if (!isnan(row->value)) json_object_set_new(facts, "value", json_real(row->value));
  if (*row->tolerance.text) json_object_set_new(facts, "tolerance", json_real(row->tolerance.value));
  if (!number) json_object_set_new(facts, "reference", flesh_accuracy_reference_json(plan));
  free(command);
  return facts;
}

static const char *status_word(const flesh_accuracy_figures *f)
{
  switch (f->status) {
  case FLESH_OK:
    return f->below ? "below reference" : "complete";
  case FLESH_ERR_INTERRUPTED:
    return "interrupted";
  case FLESH_ERR_BUDGET:
    return "out of budget";
  case FLESH_NONFINITE:
  case FLESH_ERR_NONFINITE:
    return "non-finite";
  case FLESH_ERR_ARGUMENT:
    return "refused";
  default:
    return "failed";
  }
}

static json_t *do_case(const void *data, int number, const char *folder)
{
  (void)folder;
  flesh_accuracy_row row = plan_of(data)->rows[number];
  flesh_accuracy_do_row(data, number, &row.figures);
  return flesh_fields_record(status_word(&row.figures), flesh_exit_code(row.figures.status), row.figures.message,
                             flesh_fields_json(flesh_accuracy_fields, &row.figures));
}

static int take(void *data, int number, const json_t *record)
{
  const flesh_accuracy_plan *plan = data;
  flesh_accuracy_row *row = &plan->rows[number];
  flesh_accuracy_figures *f = &row->figures;
  const int status = flesh_fields_take(flesh_accuracy_fields, "accuracy.db", record, f, f->message, &f->crashed_by);
  if (status) return status;
  if (f->crashed_by) f->status = FLESH_ERR_SOLVE;
  /* A run that could not write its file says nothing of its method. */
  if (f->status == FLESH_ERR_FILE) return flesh_fail(FLESH_ERR_FILE, "%s", f->message);
  row->done = 1;
  return FLESH_OK;
}

static void title(const void *data, int number, char *text, size_t size)
{
  const flesh_accuracy_row *row = &((const flesh_accuracy_plan *)data)->rows[number];
  snprintf(text, size, "%s, %s", flesh_accuracy_methods[row->method].name, row->setting);
}

flesh_study flesh_accuracy_study(const flesh_accuracy_work *given, flesh_accuracy_plan *plan)
{
  const int repeats = plan->repeat ? plan->repeat : 3; /* those of a long run */
  const double grace = 2;
  flesh_accuracy_make_fingerprint(plan);
  return (flesh_study){.name = "accuracy",
                       .command = "run",
                       .fingerprint = plan->study_fingerprint,
                       .different = "its scene, times of comparison or build were others; leave out --resume to begin anew",
                       .column_count = COLUMNS,
                       .columns = columns,
                       .case_count = plan->row_count,
                       .max_seconds = plan->max_seconds > 0 ? plan->max_seconds * repeats + grace : 0,
                       .budget = plan->max_seconds * repeats,
                       .again = "status IN ('crashed', 'out of budget') OR exit_code = 3",
                       .data = given,
                       .make = make_case,
                       .fields = flesh_accuracy_fields,
                       .facts = facts_of,
                       .results = {flesh_embedded_text(flesh_own_files, "accuracy")},
                       .work = do_case,
                       .take = take,
                       .title = title,
                       .taker = plan};
}

/* Whether a row from `first` to before `end` is not done. */
static int is_open(const flesh_accuracy_plan *plan, int first, int end)
{
  for (; first < end; first++)
    if (!plan->rows[first].done) return 1;
  return 0;
}

/* The other prices, from row `first` on; that they cannot be measured is told, and is no failure. */
static int run_prices(flesh_accuracy_plan *plan, const flesh_study *study, flesh_study_store *store,
                      const flesh_accuracy_work *given, flesh_accuracy_track *tight)
{
  if (!is_open(plan, store->first, store->end)) return FLESH_OK;
  const int made = flesh_accuracy_make_tight(plan, given->reference, tight);
  if (made == FLESH_ERR_INTERRUPTED || flesh_interrupt_signal()) return FLESH_ERR_INTERRUPTED;
  if (made == FLESH_ERR_FILE) return made;
  if (!made) return flesh_study_run(study, store, &plan->options);
  fprintf(stderr, "flesh accuracy: %s\n", flesh_error_text());
  return FLESH_OK;
}

static int run_all(flesh_accuracy_plan *plan, flesh_study_store *store, const flesh_accuracy_track *reference)
{
  char path[1400], words[1024];
  flesh_accuracy_track tight = {0};
  const flesh_accuracy_work given = {plan, reference, &tight};
  const flesh_study study = flesh_accuracy_study(&given, plan);
  int work_rows = 0, done = 0;
  while (work_rows < plan->row_count && plan->rows[work_rows].group == FLESH_ACCURACY_WORK) work_rows++;
  store->end = work_rows;
  int status = flesh_study_run(&study, store, &plan->options);
  store->first = work_rows, store->end = plan->row_count;
  if (!status) status = run_prices(plan, &study, store, &given, &tight);
  snprintf(words, sizeof words, "%s", flesh_error_text());
  flesh_accuracy_tight_path(plan, path);
  flesh_path_unlink(path);
  flesh_accuracy_track_close(&tight);
  for (int k = 0; k < plan->row_count; k++) done += plan->rows[k].done;
  if (status == FLESH_ERR_INTERRUPTED || (!status && flesh_interrupt_signal()))
    return flesh_fail(FLESH_ERR_INTERRUPTED, "interrupted after %d of %d runs; --resume goes on with the others", done,
                      plan->row_count);
  return status ? flesh_fail(status, "%s", words) : FLESH_OK;
}

/* The rows, in the database that is open. */
static int run_rows(flesh_accuracy_plan *plan, flesh_study_store *store)
{
  flesh_accuracy_track reference = {0};
  int had = 0;
  for (int k = 0; k < plan->row_count; k++) had += plan->rows[k].done;
  printf("%d runs", plan->row_count);
  if (had) printf(", %d of them done before", had);
  printf(", compared at every step of theirs\n");
  fflush(stdout);
  int status = flesh_accuracy_make_reference(plan, &reference);
  if (!status) status = flesh_accuracy_keep(plan);
  if (!status) status = run_all(plan, store, &reference);
  flesh_accuracy_track_close(&reference);
  return status;
}

int flesh_accuracy_run(flesh_accuracy_plan *plan)
{
  char path[1400];
  flesh_study_store store = {.lock = -1};
  const flesh_accuracy_work given = {plan, NULL, NULL};
  snprintf(path, sizeof path, "%.1300s/steps", plan->out);
  int status = flesh_folder_make(path);
  if (!status) status = flesh_accuracy_load(plan);
  if (status) return status;
  const flesh_study study = flesh_accuracy_study(&given, plan);
  status = flesh_study_store_open(&study, &plan->options, &store);
  if (!status) status = flesh_study_store_load(&store, &study);
  const int opened = !status;
  if (!status) status = run_rows(plan, &store);
  /* Without a reference there is nothing to tell. */
  if (opened && (!status || *plan->reference.first)) status = flesh_study_conclude(&study, &store, plan->out, status);
  flesh_study_store_close(&store);
  return status;
}
