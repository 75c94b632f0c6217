/* runs.c: stores the runs of a fit as cases of a study in DIR/fit.db: a run at given parameters, its derivatives, or a
 * map with one weight. Each case is written when it ends, and a case that is there is not repeated. */
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/error.h"
#include "cli/interrupt.h"
#include "cli/json_memory.h"
#include "cli/options.h"
#include "fit/map.h"

/* Hashes everything on which the stages of a map depend. */
static void hash_map(SHA2_CTX *context, const flesh_fit *fit)
{
  const flesh_fit_map *map = fit->map;
  const double numbers[] = {map->edge, map->weight, fit->tolerance, fit->max_iterations};
  for (int k = 0; k <= fit->key_count; k++) { /* the keys and the first tet */
    const flesh_fit_parameter *p = &fit->parameters[k];
    const double own[] = {p->start, p->from, p->to, p->scale};
    SHA256Update(context, (const uint8_t *)own, sizeof own);
    SHA256Update(context, (const uint8_t *)&p->spacing, sizeof p->spacing);
  }
  SHA256Update(context, (const uint8_t *)map->of.key, strlen(map->of.key) + 1);
  SHA256Update(context, (const uint8_t *)numbers, sizeof numbers);
  SHA256Update(context, (const uint8_t *)&map->penalty, sizeof map->penalty);
  SHA256Update(context, (const uint8_t *)map->tets, (size_t)map->count * sizeof *map->tets);
  for (int i = 0; i < fit->count; i++)
    SHA256Update(context, (const uint8_t *)&fit->data[i]->deviation, sizeof(double));
}

/* Hashes everything on which the values of runs depend: scenes, measured quantities, and which keys are set. */
static int make_fingerprint(const flesh_fit *fit, char text[FLESH_STUDY_FINGERPRINT])
{
  SHA2_CTX context;
  int status = FLESH_OK;
  SHA256Init(&context);
  for (int e = 0; e < fit->experiment_count && !status; e++) {
    const flesh_fit_experiment *one = &fit->experiments[e];
    SHA256Update(&context, (const uint8_t *)one->name, strlen(one->name) + 1);
    SHA256Update(&context, (const uint8_t *)one->fingerprint, sizeof one->fingerprint);
    SHA256Update(&context, one->acts, (size_t)fit->key_count);
    for (int k = 0; k < one->measured_count && !status; k++) {
      const flesh_fit_measured *m = &one->measured[k];
      SHA256Update(&context, (const uint8_t *)&m->table, sizeof m->table);
      for (int q = 0; q < m->quantity_count; q++)
        SHA256Update(&context, (const uint8_t *)m->quantities[q].name, strlen(m->quantities[q].name) + 1);
      status = flesh_settings_hash_file(&context, m->path);
    }
  }
  if (fit->map) hash_map(&context, fit);
  for (int k = 0; k < fit->key_count; k++)
    SHA256Update(&context, (const uint8_t *)fit->parameters[k].key, strlen(fit->parameters[k].key) + 1);
  SHA256End(&context, text);
  return status;
}

static const flesh_study_column columns[] = {{.name = "what", .key = "run, tangents (of it) or stage (of a map)"},
                                             {.name = "experiment", .key = "experiments.name"},
                                             {.name = "parameters", .key = "parameters, or values of a map's tets"},
                                             {0}};

#define OF(kind, name) {#name, FLESH_FIELD_##kind, offsetof(flesh_fit_stage, name)}
static const flesh_study_field stage_fields[] = {OF(DOUBLE, weight), OF(DOUBLE, squares), OF(DOUBLE, penalty),
                                                 OF(DOUBLE, determined), OF(INT, iterations), OF(INT, converged), {0}};
#undef OF

static json_t *costs(int runs, double cpu_s) { return json_pack("{sisf}", "runs", runs, "cpu_s", cpu_s); }

static json_t *name_figures(const void *data)
{
  json_t *names = flesh_fields_names(stage_fields);
  (void)data;
  json_array_append_new(names, json_string("runs"));
  json_array_append_new(names, json_string("cpu_s"));
  return names;
}

/* Makes the case that is looked for, the only one of the study. */
static int make_case(const void *data, int number, flesh_study_case *made)
{
  const flesh_fit *fit = data;
  (void)number;
  *made = (flesh_study_case){.values = {fit->wanted[0], fit->wanted[1], fit->wanted[2]}, .repeat = 1};
  return FLESH_OK;
}

static int take_record(void *data, int number, const json_t *record)
{
  flesh_fit *fit = data;
  (void)number;
  fit->record = json_incref((json_t *)record);
  return FLESH_OK;
}

int flesh_fit_runs_open(flesh_fit *fit)
{
  int abandoned, elsewhere, status = make_fingerprint(fit, fit->fingerprint);
  fit->study = (flesh_study){.name = "fit", .text = fit->text, .path = fit->path, .asks = 1,
                             .fingerprint = fit->fingerprint, .columns = columns, .repeats = 1,
                             .different = "scenes, measurements or keys have changed since; undo that", .data = fit,
                             .make = make_case, .take = take_record, .figures = name_figures};
  if (!status) status = flesh_study_store_open(&fit->study, &fit->options, &fit->store);
  return status ? status : flesh_study_store_recover(&fit->store, &abandoned, &elsewhere);
}

/* Looks for the case with these parameters, which it takes; fit->record is NULL if no such case has ended. */
static int find_case(flesh_fit *fit, const char *what, const char *name, json_t *parameters)
{
  char *text = json_dumps(parameters, JSON_COMPACT);
  int status = text ? flesh_study_store_execute(&fit->store, "DELETE FROM temp.wanted") : flesh_no_memory();
  fit->wanted[0] = what, fit->wanted[1] = name, fit->wanted[2] = text;
  json_decref(parameters);
  json_decref(fit->record);
  fit->record = NULL;
  if (!status) status = flesh_study_store_want(&fit->store, &fit->study, 0);
  if (!status) status = flesh_study_store_load(&fit->store, &fit->study);
  free(text);
  return status || fit->record ? status : flesh_interrupt_check();
}

/* Writes the end of the case that was looked for last: `numbers`, or why it failed. Takes both objects. */
static int write_case(flesh_fit *fit, double began, const char *why, json_t *figures, json_t *numbers)
{
  const double seconds = flesh_wall_seconds() - began;
  int number;
  fit->store.first = 0, fit->store.end = 1;
  fit->record = flesh_fields_record(*why ? "failed" : "complete", *why ? flesh_exit_code(FLESH_ERR_SOLVE) : 0, why, figures);
  json_object_set_new(json_object_get(fit->record, "result"), "numbers", numbers);
  const int status = flesh_json_lacks() ? flesh_no_memory() : flesh_study_store_claim(&fit->store, &number);
  return status ? status : flesh_study_store_finish(&fit->store, 0, fit->record, seconds, NULL);
}

/* Reads the numbers [count] of the record. */
static int read_numbers(const flesh_fit *fit, int count, double *numbers)
{
  const json_t *array = json_object_get(json_object_get(fit->record, "result"), "numbers");
  int whole = json_array_size(array) == (size_t)count;
  for (int k = 0; k < count && whole; k++) {
    const json_t *item = json_array_get(array, (size_t)k);
    whole = json_is_number(item);
    numbers[k] = json_number_value(item);
  }
  return whole ? FLESH_OK
               : flesh_fail(FLESH_ERR_FILE, "%s: the record of a case is not whole; give another --out, or move %s away",
                            fit->store.path, fit->options.out);
}

static const char *words_of(const json_t *record)
{
  const char *words = json_string_value(json_object_get(record, "message"));
  return words ? words : "";
}

/* Returns the parameters that act on an experiment; runs that differ only in others are the same. */
static json_t *parameters_of(const flesh_fit *fit, const flesh_fit_experiment *e, const double *p)
{
  json_t *object = json_object();
  for (int k = 0; k < fit->key_count; k++)
    if (e->acts[k]) json_object_set_new(object, fit->parameters[k].name, json_real(p[k]));
  if (fit->map) json_object_set_new(object, "of tets", flesh_json_numbers(fit->map->count, p + fit->key_count)); /* no parameter's name */
  return object;
}

int flesh_fit_values_at(flesh_fit *fit, flesh_fit_experiment *e, const double *p, double *values)
{
  const double began = flesh_wall_seconds();
  double cpu_s;
  int status = find_case(fit, "run", e->name, parameters_of(fit, e, p));
  if (!status && !fit->record) {
    status = flesh_fit_run(fit, e, p, values, &cpu_s);
    fit->made++;
    if (status == FLESH_FIT_RUN_FAILED) status = write_case(fit, began, flesh_error_text(), costs(1, cpu_s), json_null());
    else if (!status) status = write_case(fit, began, "", costs(1, cpu_s), flesh_json_numbers(e->count, values));
  }
  if (status) return status;
  const char *why = words_of(fit->record);
  return *why ? flesh_fail(FLESH_FIT_RUN_FAILED, "%.300s", why) : read_numbers(fit, e->count, values);
}

/* Returns whether the parameters that act on the experiment are the same. */
static int is_same(const flesh_fit *fit, const flesh_fit_experiment *e, const double *p, const double *q)
{
  for (int k = 0; k < fit->parameter_count; k++)
    if ((k >= fit->key_count || e->acts[k]) && p[k] != q[k]) return 0;
  return 1;
}

int flesh_fit_equilibria_at(flesh_fit *fit, flesh_fit_experiment *e, const double *p)
{
  double cpu_s, *values;
  if (e->equilibria.p && is_same(fit, e, e->equilibria.p, p)) return FLESH_OK;
  values = malloc((size_t)e->count * sizeof *values);
  const int status = values ? flesh_fit_run(fit, e, p, values, &cpu_s) : flesh_no_memory();
  free(values);
  fit->made++;
  return status == FLESH_FIT_RUN_FAILED ? flesh_fail_within(FLESH_ERR_SOLVE, "a run that succeeded before now fails: ") : status;
}

/* Computes tangents. FLESH_ERR_ARGUMENT or FLESH_ERR_SOLVE if there are none. */
static int differentiate(flesh_fit *fit, flesh_fit_experiment *e, const double *p, double *tangents)
{
  if (e->moves) return flesh_fit_motion_tangents(fit, e, p, tangents);
  const int status = flesh_fit_equilibria_at(fit, e, p);
  return status ? status : flesh_fit_tangents(fit, e, tangents);
}

int flesh_fit_tangents_at(flesh_fit *fit, flesh_fit_experiment *e, const double *p, double *tangents)
{
  const int count = e->count * fit->key_count;
  const double began = flesh_wall_seconds(), cpu = flesh_cpu_seconds();
  int status = find_case(fit, "tangents", e->name, parameters_of(fit, e, p));
  if (!status && !fit->record) {
    status = differentiate(fit, e, p, tangents);
    const int none = status == FLESH_ERR_ARGUMENT || status == FLESH_ERR_SOLVE;
    if (!status || none) {
      snprintf(e->differences, sizeof e->differences, "%.300s", none ? flesh_error_text() : "");
      return write_case(fit, began, e->differences, costs(e->moves, flesh_cpu_seconds() - cpu),
                        none ? json_null() : flesh_json_numbers(count, tangents));
    }
  }
  if (status) return status;
  snprintf(e->differences, sizeof e->differences, "%.300s", words_of(fit->record));
  return *e->differences ? FLESH_OK : read_numbers(fit, count, tangents);
}

int flesh_fit_stage_read(flesh_fit *fit, int number, flesh_fit_stage *stage, double *p, int *there)
{
  int status = find_case(fit, "stage", "", json_pack("[if]", number, stage->weight));
  *there = !status && fit->record;
  if (!*there) return status;
  const json_t *figures = json_object_get(json_object_get(fit->record, "result"), "figures");
  return flesh_fields_read(stage_fields, figures, stage) ? read_numbers(fit, -1, p) : read_numbers(fit, fit->parameter_count, p);
}

int flesh_fit_stage_write(flesh_fit *fit, int number, double began, const flesh_fit_stage *stage, const double *p)
{
  const int status = find_case(fit, "stage", "", json_pack("[if]", number, stage->weight));
  return status ? status
                : write_case(fit, began, "", flesh_fields_json(stage_fields, stage), flesh_json_numbers(fit->parameter_count, p));
}

/* Sums over all runs in the database. */
json_t *flesh_fit_runs_json(const flesh_fit *fit)
{
  sqlite3_stmt *query;
  json_t *costs = NULL;
  if (!sqlite3_prepare_v2(fit->store.database,
                          "SELECT json_object('used', CAST(total(json_extract(result, '$.figures.runs')) AS INT), 'failed', "
                          "count(*) FILTER (WHERE what = 'run' AND status = 'failed'), 'cpu_s', "
                          "total(json_extract(result, '$.figures.cpu_s'))) FROM cases", -1, &query, NULL) &&
      sqlite3_step(query) == SQLITE_ROW)
    costs = json_loads((const char *)sqlite3_column_text(query, 0), 0, NULL);
  sqlite3_finalize(query);
  json_object_set_new(costs, "made_now", json_integer(fit->made));
  json_object_set_new(costs, "linear_solves", json_integer(fit->linear));
  return costs;
}

void flesh_fit_close(flesh_fit *fit)
{
  for (int e = 0; e < fit->experiment_count; e++) {
    json_decref(fit->experiments[e].inputs);
    flesh_fit_equilibria_clear(&fit->experiments[e].equilibria);
  }
  json_decref(fit->record);
  flesh_study_store_close(&fit->store);
  free(fit->text);
  flesh_arena_free(&fit->arena);
  *fit = (flesh_fit){.options = fit->options, .store = {.lock = -1}};
}
