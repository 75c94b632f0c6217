/* study.c: runs a comparison as a study. Its cases are the parts of the reference, the runs (one at a time on each
 * rank), and the runs on other meshes, each in a process of its own; SQL makes the results from them. */
#include <math.h>
#include <stddef.h>
#include <string.h>
#include <unistd.h>

#include "accuracy/accuracy.h"
#include "base/confine.h"
#include "base/error.h"
#include "base/folder.h"
#include "cli/interrupt.h"
#include "study/embedded.h"
#include "study/study.h"

#define FIGURE(kind, name, member) {name, FLESH_FIELD_##kind, offsetof(flesh_accuracy_figures, member)}
static const flesh_study_field fields[] = {
    FIGURE(INT, "status_code", status), FIGURE(INT, "steps", cost.counts.steps), FIGURE(INT, "rejected", cost.rejected),
    FIGURE(INT, "residual_evaluations", cost.counts.residuals), FIGURE(INT, "hessian_assemblies", cost.counts.assemblies),
    FIGURE(INT, "newton", cost.counts.newton), FIGURE(INT, "linear_iterations", cost.counts.linear),
    FIGURE(DOUBLE, "cpu_s", cost.cpu_s),
    FIGURE(DOUBLE, "wall_s_median", wall_s_median), FIGURE(DOUBLE, "wall_s_min", wall_s_min),
    FIGURE(DOUBLE, "error_position_rms", errors.position_rms), FIGURE(DOUBLE, "error_position_max", errors.position_max),
    FIGURE(DOUBLE, "error_tip", errors.tip), FIGURE(DOUBLE, "error_volume", errors.volume),
    FIGURE(DOUBLE, "energy_drift", errors.energy), FIGURE(DOUBLE, "energy_gain", cost.gain),
    FIGURE(INT, "below_reference", below), FIGURE(DOUBLE, "difference", difference), FIGURE(DOUBLE, "estimate", estimate),
    FIGURE(DOUBLE, "took_s", took_s), FIGURE(INT, "tet_count", tets), FIGURE(INT, "node_count", nodes),
    FIGURE(DOUBLE, "largest_poisson", poisson), {0}};
/* Columns, in the order of the values in make_case. */
static const flesh_study_column columns[] = {{.name = "price", .key = "group"},
                                             {.name = "method", .key = "--methods"},
                                             {.name = "setting", .key = "--steps, --tolerances"},
                                             {.name = "scene_sha256", .key = "--coarser", .is_digest = 1},
                                             {0}};

static json_t *names(const void *data)
{
  (void)data;
  json_t *all = flesh_fields_names(fields), *others = flesh_fields_names(flesh_accuracy_reference_fields);
  json_array_extend(all, others);
  json_decref(others);
  return all;
}

static int make_case(const void *data, int number, flesh_study_case *made)
{
  const flesh_accuracy_plan *plan = data;
  const flesh_accuracy_row *row = &plan->rows[number];
  *made = (flesh_study_case){.scene = flesh_accuracy_scene_of(plan, row),
                             .values = {flesh_accuracy_group_names[row->group], flesh_accuracy_method_name(row), row->setting,
                                        row->inputs ? row->inputs : ""}};
  if (number < plan->run_count) flesh_accuracy_override(plan, row, &made->overrides);
  return FLESH_OK;
}

/* Returns what the SQL knows about a run, or a run on a mesh, beside its row. */
static json_t *facts_of(const void *data, int number)
{
  const flesh_accuracy_plan *plan = data;
  const flesh_accuracy_row *row = &plan->rows[number];
  if (number >= plan->run_count)
    return row->group >= FLESH_ACCURACY_RESOLUTION && *row->setting ? flesh_accuracy_mesh_facts(plan, row) : NULL;
  const flesh_accuracy_method *method = &flesh_accuracy_methods[row->method];
  const char *steps = flesh_accuracy_steps_path(plan, row);
  const int has_steps = *steps && !flesh_path_access(steps, R_OK);
  json_t *facts = json_pack("{ss ss ss sb si ss si ss ss sb sb}", "method", method->name, "setting", row->setting, "price",
                            flesh_accuracy_group_names[row->group], "adaptive", method->adaptive, "max_order",
                            method->max_order, "colour", method->colour, "mark", method->mark, "step", row->step.text,
                            "steps_file", has_steps ? flesh_accuracy_steps_path(NULL, row) : "", "other_body",
                            row->group == FLESH_ACCURACY_MASS && strcmp(row->extra, plan->mass), "own",
                            row->group == FLESH_ACCURACY_WORK && row->method == plan->representative &&
                                row->step.value == plan->representative_step.value);
  if (!isnan(row->value)) json_object_set_new(facts, "value", json_real(row->value));
  if (*row->tolerance.text) json_object_set_new(facts, "tolerance", json_real(row->tolerance.value));
  return facts;
}

/* Runs the case in this process; its message is that of an error, or what was made. */
static json_t *do_case(const void *data, int number, const char *folder)
{
  (void)folder;
  flesh_accuracy_plan plan = *(const flesh_accuracy_plan *)data;
  flesh_accuracy_row *row = &plan.rows[number];
  flesh_accuracy_figures *f = &row->figures;
  json_t *rows = json_array();
  int status;
  *f->message = 0;
  switch (row->group) {
  case FLESH_ACCURACY_REFERENCE:
    status = flesh_accuracy_settle(&plan, f);
    if (!status) status = flesh_accuracy_keep(&plan, f->message);
    break;
  case FLESH_ACCURACY_SOURCE:
    status = flesh_accuracy_make_source(&plan, number);
    break;
  case FLESH_ACCURACY_TIGHT:
    status = flesh_accuracy_run_tight(&plan, number);
    break;
  case FLESH_ACCURACY_RESOLUTION:
  case FLESH_ACCURACY_TIMING:
    status = flesh_accuracy_run_mesh(&plan, number);
    break;
  case FLESH_ACCURACY_LIMITS:
    status = flesh_accuracy_find_limits(&plan, rows);
    break;
  default:
    status = flesh_accuracy_do_row(&plan, number);
  }
  f->status = status;
  if (status) snprintf(f->message, sizeof f->message, "%.399s", flesh_error_text());
  json_t *figures = flesh_fields_json(fields, f);
  if (row->group == FLESH_ACCURACY_REFERENCE)
    json_object_update_new(figures, flesh_fields_json(flesh_accuracy_reference_fields, &plan.reference));
  const char *word = !status && f->below ? "below reference" : flesh_fields_status(status, "failed");
  json_t *record = flesh_fields_record(word, flesh_exit_code(status), f->message, figures);
  json_object_set_new(record, "rows", rows);
  return record;
}

static int take(void *data, int number, const json_t *record)
{
  flesh_accuracy_plan *plan = data;
  flesh_accuracy_row *row = &plan->rows[number];
  flesh_accuracy_figures *f = &row->figures;
  int crashed_by = 0, status = flesh_fields_take(fields, "accuracy.db", record, f, f->message, &crashed_by);
  if (!status && row->group == FLESH_ACCURACY_REFERENCE && !crashed_by)
    flesh_fields_read(flesh_accuracy_reference_fields, json_object_get(json_object_get(record, "result"), "figures"),
                      &plan->reference);
  if (status) return status;
  if (crashed_by) f->status = FLESH_ERR_SOLVE;
  /* A run that could not write its file says nothing about its method. */
  if (f->status == FLESH_ERR_FILE) return flesh_fail(FLESH_ERR_FILE, "%s", f->message);
  row->done = 1;
  return FLESH_OK;
}

flesh_study flesh_accuracy_study(flesh_accuracy_plan *plan)
{
  const int repeats = plan->repeat ? plan->repeat : 3; /* number for a long run */
  const double grace = 2;
  return (flesh_study){.name = "accuracy",
                       .fingerprint = plan->fingerprint,
                       .different = "its scene or --set values, the longest of --steps or the build of flesh, whose times would "
                                    "not compare, were others; leave out --resume to begin anew",
                       .columns = columns,
                       .case_count = plan->run_count,
                       .max_seconds = plan->max_seconds > 0 ? plan->max_seconds * repeats + grace : 0,
                       .budget = plan->max_seconds * repeats,
                       .facts = facts_of,
                       .results = {flesh_own_text("runs"),
                                   flesh_own_text("accuracy")},
                       .again = "status IN ('crashed', 'out of budget') OR exit_code = 3",
                       .data = plan,
                       .make = make_case,
                       .figures = names,
                       .work = do_case,
                       .take = take};
}

static int count_done(const flesh_accuracy_plan *plan)
{
  int done = 0;
  for (int k = 0; k < plan->run_count; k++) done += plan->rows[k].done;
  return done;
}

/* Runs the other prices, from row `first` on. If they cannot be measured, that is printed, and is no failure. */
static int run_prices(flesh_accuracy_plan *plan, int first)
{
  const int tight = flesh_accuracy_slot(plan, FLESH_ACCURACY_TIGHT);
  int open = 0;
  for (int k = first; k < plan->run_count; k++) open |= !plan->rows[k].done;
  if (!open) return FLESH_OK;
  int status = flesh_accuracy_do(plan, tight);
  const flesh_accuracy_figures *f = &plan->rows[tight].figures;
  if (status) return status;
  if (f->status) {
    fprintf(stderr, "flesh accuracy: the costs of other settings are not measured: %s\n", f->message);
    return FLESH_OK;
  }
  plan->store.first = first, plan->store.end = plan->run_count;
  return flesh_study_run(&plan->study, &plan->store, &plan->options);
}

static int run_all(flesh_accuracy_plan *plan)
{
  int work_rows = 0, status = FLESH_OK;
  while (work_rows < plan->run_count && plan->rows[work_rows].group == FLESH_ACCURACY_WORK) work_rows++;
  plan->store.first = 0, plan->store.end = work_rows;
  status = flesh_study_run(&plan->study, &plan->store, &plan->options);
  if (!status) status = run_prices(plan, work_rows);
  flesh_path_unlink(flesh_accuracy_states_path(plan, flesh_accuracy_slot(plan, FLESH_ACCURACY_TIGHT)));
  if (status == FLESH_ERR_INTERRUPTED || (!status && flesh_interrupt_signal()))
    return flesh_fail(FLESH_ERR_INTERRUPTED, "interrupted after %d of %d runs; --resume goes on with the others",
                      count_done(plan), plan->run_count);
  return status;
}

/* Runs the methods and reports them; without a reference there is nothing to report. */
static int run_methods(flesh_accuracy_plan *plan)
{
  const int had = count_done(plan);
  printf("%d runs", plan->run_count);
  if (had) printf(", %d of them done before", had);
  printf(", compared at every step of theirs\n");
  fflush(stdout);
  int status = flesh_accuracy_make_reference(plan);
  if (status) return status;
  status = run_all(plan);
  return flesh_study_conclude(&plan->study, &plan->store, &plan->options, status);
}

int flesh_accuracy_run(const flesh_study *study, const flesh_study_options *options)
{
  flesh_accuracy_plan *plan = study->data;
  int status = plan->run_count ? flesh_folder_make(flesh_path("%s/steps", options->out)) : FLESH_OK;
  if (!status) status = flesh_study_store_open(study, options, &plan->store);
  if (!status) status = flesh_study_store_load(&plan->store, study);
  if (!status && plan->run_count) status = run_methods(plan);
  if (!status && plan->mesh) status = flesh_accuracy_run_meshes(plan);
  flesh_study_store_close(&plan->store);
  return status;
}
