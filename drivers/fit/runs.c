/* runs.c: the runs of a fit: each is a file in DIR/points, written whole once it has ended, so that nothing is run twice. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/confine.h"
#include "base/folder.h"
#include "base/error.h"
#include "base/scan.h"
#include "base/text.h"
#include "cli/interrupt.h"
#include "cli/json_memory.h"
#include "fit/map.h"
#include "run/result.h"

static int no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory for the runs of a fit"); }

/* Hashes what decides the stages of a map. */
static void hash_map(SHA2_CTX *context, const flesh_fit *fit)
{
  const flesh_fit_map *map = fit->map;
  const double numbers[] = {map->start, map->from, map->to, map->edge, map->weight, fit->tolerance};
  const int words[] = {map->spacing, map->penalty};
  SHA256Update(context, (const uint8_t *)map->key, strlen(map->key) + 1);
  SHA256Update(context, (const uint8_t *)numbers, sizeof numbers);
  SHA256Update(context, (const uint8_t *)words, sizeof words);
  SHA256Update(context, (const uint8_t *)map->tets, (size_t)map->count * sizeof *map->tets);
  for (int i = 0; i < fit->count; i++)
    SHA256Update(context, (const uint8_t *)&flesh_fit_datum_at(fit, i)->deviation, sizeof(double));
}

/* Hashes what decides the values of runs: scenes, what is measured, and which keys are set. */
static int make_fingerprint(const flesh_fit *fit, char text[FLESH_STUDY_FINGERPRINT])
{
  SHA2_CTX context;
  int status = FLESH_OK;
  SHA256Init(&context);
  for (int e = 0; e < fit->experiment_count && !status; e++) {
    const flesh_fit_experiment *one = &fit->experiments[e];
    SHA256Update(&context, (const uint8_t *)one->name, strlen(one->name) + 1);
    SHA256Update(&context, (const uint8_t *)one->fingerprint, sizeof one->fingerprint);
    if (!fit->map) SHA256Update(&context, one->acts, (size_t)fit->parameter_count);
    for (int k = 0; k < one->measured_count && !status; k++) {
      const flesh_fit_measured *m = &one->measured[k];
      SHA256Update(&context, (const uint8_t *)&m->table, sizeof m->table);
      for (int q = 0; q < m->quantity_count; q++)
        SHA256Update(&context, (const uint8_t *)m->quantities[q].name, strlen(m->quantities[q].name) + 1);
      status = flesh_settings_hash_file(&context, m->path);
    }
  }
  if (fit->map) hash_map(&context, fit);
  for (int k = 0; k < fit->parameter_count && !fit->map; k++)
    SHA256Update(&context, (const uint8_t *)fit->parameters[k].key, strlen(fit->parameters[k].key) + 1);
  SHA256End(&context, text);
  return status;
}

static char *path_of(const flesh_fit *fit, int number) { return flesh_text_new("%s/points/%06d.json", fit->out, number); }
static char *stage_path(const flesh_fit *fit, int number) { return flesh_text_new("%s/points/stage_%02d.json", fit->out, number); }

static json_t *array_of(int count, const double *numbers)
{
  json_t *array = numbers ? json_array() : json_null();
  for (int k = 0; k < count && numbers; k++) json_array_append_new(array, json_real(numbers[k]));
  return array;
}

/* New numbers of an array of that size; NULL where it is none. */
static double *read_array(const json_t *array, int count)
{
  double *numbers = json_is_array(array) && json_array_size(array) == (size_t)count
                        ? malloc(((size_t)count + 1) * sizeof *numbers) : NULL;
  for (int k = 0; k < count && numbers; k++) {
    const json_t *item = json_array_get(array, (size_t)k);
    numbers[k] = json_is_number(item) ? json_number_value(item) : NAN;
    if (isfinite(numbers[k])) continue;
    free(numbers);
    return NULL;
  }
  return numbers;
}

static void free_run(flesh_fit_run *run)
{
  free(run->p);
  free(run->values);
  free(run->tangents);
}

/* Room for one run more. */
static flesh_fit_run *add_run(flesh_fit *fit)
{
  if (fit->run_count == fit->run_room) {
    const int room = fit->run_room ? 2 * fit->run_room : 64;
    flesh_fit_run *grown = realloc(fit->runs, (size_t)room * sizeof *grown);
    if (!grown) return NULL;
    fit->runs = grown;
    fit->run_room = room;
  }
  fit->runs[fit->run_count] = (flesh_fit_run){0};
  return &fit->runs[fit->run_count];
}

/* Writes a run as the file of the next number. */
static int write_run(flesh_fit *fit, const flesh_fit_run *run, double cpu_s)
{
  const flesh_fit_experiment *e = &fit->experiments[run->experiment];
  char *path = path_of(fit, fit->written + 1);
  if (!path) return no_memory();
  json_t *value = json_pack("{sssosososssf}", "experiment", e->name, "parameters", array_of(fit->parameter_count, run->p), "values",
                            array_of(e->count, run->values), "tangents",
                            array_of(e->count * fit->parameter_count, run->tangents), "message", "", "cpu_s", cpu_s);
  if (value) json_object_set_new(value, "message", flesh_json_text(run->message));
  const int status = flesh_json_write(path, value);
  if (!status) fit->written++;
  free(path);
  return status;
}

/* Takes a run from its file. */
static int take_run(flesh_fit *fit, const char *path, const json_t *value)
{
  const char *name = json_string_value(json_object_get(value, "experiment"));
  const json_t *values = json_object_get(value, "values"), *tangents = json_object_get(value, "tangents");
  const char *message = json_string_value(json_object_get(value, "message"));
  flesh_fit_run *run = add_run(fit);
  if (!run) return no_memory();
  run->experiment = -1;
  for (int e = 0; e < fit->experiment_count && name; e++)
    if (!strcmp(fit->experiments[e].name, name)) run->experiment = e;
  const int count = run->experiment < 0 ? 0 : fit->experiments[run->experiment].count;
  run->p = read_array(json_object_get(value, "parameters"), fit->parameter_count);
  if (!json_is_null(values)) run->values = read_array(values, count);
  if (!json_is_null(tangents)) run->tangents = read_array(tangents, count * fit->parameter_count);
  fit->run_count++;
  if (run->experiment < 0 || !run->p || !message || !run->values != !!json_is_null(values) ||
      !run->tangents != !!json_is_null(tangents))
    return flesh_fail(FLESH_ERR_FILE, "%s is not a run of this fit; give another folder, or move the folder away", path);
  snprintf(run->message, sizeof run->message, "%s", message);
  fit->counts.cpu_s += json_number_value(json_object_get(value, "cpu_s"));
  fit->counts.read_back++;
  fit->counts.with_tangents += run->tangents && !fit->experiments[run->experiment].moves; /* a motion runs again for them */
  fit->counts.failed += !run->values;
  return FLESH_OK;
}

static int read_file(const char *path, json_t **value)
{
  char *text;
  size_t size;
  int status = flesh_file_load(path, &text, &size);
  if (status) return status;
  *value = json_loadb(text, size, 0, NULL);
  free(text);
  return *value ? FLESH_OK : flesh_fail(FLESH_ERR_FILE, "%s is not JSON; give another folder, or move the folder away", path);
}

static int read_back(flesh_fit *fit)
{
  int status = FLESH_OK;
  for (int number = 1; !status; number++) {
    char *path = path_of(fit, number);
    json_t *value = NULL;
    if (!path) return no_memory();
    const int there = flesh_path_is_there(path);
    if (there) status = read_file(path, &value);
    if (there && !status) status = take_run(fit, path, value);
    if (there && !status) fit->written = number;
    json_decref(value);
    free(path);
    if (!there) break;
  }
  return status;
}

int flesh_fit_stage_read(const flesh_fit *fit, int number, flesh_fit_stage *stage, double *p, int *there)
{
  char *path = stage_path(fit, number);
  json_t *value = NULL;
  int status = path ? FLESH_OK : no_memory();
  *there = path && flesh_path_is_there(path);
  if (*there) status = read_file(path, &value);
  double *map = *there && !status ? read_array(json_object_get(value, "map"), fit->parameter_count) : NULL;
  if (*there && !status && (!map || json_number_value(json_object_get(value, "weight")) != stage->weight))
    status = flesh_fail(FLESH_ERR_FILE, "%s is not a stage of this fit; give another folder, or move the folder away", path);
  if (*there && !status) {
    memcpy(p, map, (size_t)fit->parameter_count * sizeof *p);
    stage->squares = json_number_value(json_object_get(value, "squares"));
    stage->penalty = json_number_value(json_object_get(value, "penalty"));
    stage->iterations = (int)json_integer_value(json_object_get(value, "iterations"));
    stage->converged = json_is_true(json_object_get(value, "converged"));
  }
  json_decref(value);
  free(map);
  free(path);
  return status;
}

int flesh_fit_stage_write(const flesh_fit *fit, int number, const flesh_fit_stage *stage, const double *p)
{
  char *path = stage_path(fit, number);
  if (!path) return no_memory();
  const int status = flesh_json_write(path, json_pack("{sfsfsfsisbso}", "weight", stage->weight, "squares", stage->squares,
                                                      "penalty", stage->penalty, "iterations", stage->iterations, "converged",
                                                      stage->converged, "map", array_of(fit->parameter_count, p)));
  free(path);
  return status;
}

/* Removes the runs of an older fit, and its stages. */
static void clear(const flesh_fit *fit)
{
  char *(*const paths[])(const flesh_fit *, int) = {path_of, stage_path};
  for (int kind = 0, number = 1; kind < 2; number++) {
    char *path = paths[kind](fit, number);
    const int gone = !path || !flesh_path_is_file(path) || flesh_path_unlink(path);
    free(path);
    if (gone) kind++, number = 0;
  }
}

static int write_plan(const char *path, const char *fingerprint)
{
  return flesh_json_write(path, json_pack("{ss}", "fit", fingerprint));
}

int flesh_fit_runs_open(flesh_fit *fit, int resume)
{
  char fingerprint[FLESH_STUDY_FINGERPRINT];
  char *folder = flesh_text_new("%s/points", fit->out), *plan = flesh_text_new("%s/points/fit.json", fit->out);
  json_t *value = NULL;
  int status = folder && plan ? make_fingerprint(fit, fingerprint) : no_memory();
  const int there = plan && flesh_path_is_there(plan);
  if (!status) status = flesh_folder_make(folder);
  if (!status) flesh_folder_clear(folder);
  if (!status && there) status = read_file(plan, &value);
  const char *known = json_string_value(json_object_get(value, "fit"));
  if (!status && there && !resume)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s has runs of a fit; --resume goes on with them, another --out begins anew",
                        fit->out);
  else if (!status && there && (!known || strcmp(known, fingerprint)))
    status = flesh_fail(FLESH_ERR_ARGUMENT,
                        "%s has runs of another fit: scenes, measurements or keys have changed since; undo that, or give "
                        "another --out", fit->out);
  else if (!status && there) status = read_back(fit);
  else if (!status) {
    clear(fit);
    status = write_plan(plan, fingerprint);
  }
  json_decref(value);
  free(folder);
  free(plan);
  return status;
}

/* Which runs differ: in parameters that act on the experiment. */
static int is_same(const flesh_fit *fit, const flesh_fit_run *run, int experiment, const double *p)
{
  if (run->experiment != experiment) return 0;
  for (int k = 0; k < fit->parameter_count; k++)
    if ((fit->map || fit->experiments[experiment].acts[k]) && run->p[k] != p[k]) return 0;
  return 1;
}

int flesh_fit_run_at(flesh_fit *fit, int experiment, const double *p, const flesh_fit_run **found)
{
  const size_t size = (size_t)fit->parameter_count * sizeof *p;
  double cpu_s;
  for (int k = fit->run_count - 1; k >= 0; k--)
    if (is_same(fit, &fit->runs[k], experiment, p)) return *found = &fit->runs[k], FLESH_OK;
  if (flesh_interrupt_signal()) return flesh_fail(FLESH_ERR_INTERRUPTED, "interrupted by %s", flesh_interrupt_name());
  flesh_fit_run *run = add_run(fit);
  if (!run || !(run->p = malloc(size))) return no_memory();
  run->experiment = experiment;
  memcpy(run->p, p, size);
  int status = flesh_fit_make_run(fit, run, &cpu_s);
  if (!status) status = write_run(fit, run, cpu_s);
  if (status) {
    free_run(run);
    return status;
  }
  fit->run_count++;
  fit->counts.runs++;
  fit->counts.failed += !run->values;
  fit->counts.cpu_s += cpu_s;
  *found = run;
  return FLESH_OK;
}

int flesh_fit_keep_at(flesh_fit *fit, int experiment, const double *p)
{
  const flesh_fit_kept *kept = &fit->experiments[experiment].kept;
  const flesh_fit_run there = {.experiment = experiment, .p = kept->p};
  flesh_fit_run again = {.experiment = experiment, .p = (double *)p};
  double cpu_s;
  if (kept->p && is_same(fit, &there, experiment, p)) return FLESH_OK;
  int status = flesh_fit_make_run(fit, &again, &cpu_s);
  if (!status && !kept->p) status = flesh_fail(FLESH_ERR_SOLVE, "a run that succeeded before now fails: %.300s", again.message);
  free(again.values);
  fit->counts.runs++;
  fit->counts.cpu_s += cpu_s;
  return status;
}

/* Fills in tangents; where there are none, e->differences says why. */
static int differentiate(flesh_fit *fit, int experiment, const double *p, double *tangents)
{
  flesh_fit_experiment *e = &fit->experiments[experiment];
  int status = e->moves ? FLESH_OK : flesh_fit_keep_at(fit, experiment, p);
  if (status) return status;
  status = e->moves ? flesh_fit_motion_tangents(fit, experiment, p, tangents) : flesh_fit_tangents(fit, experiment, tangents);
  if (status != FLESH_ERR_ARGUMENT && status != FLESH_ERR_SOLVE) return status;
  snprintf(e->differences, sizeof e->differences, "%.300s", flesh_error_text());
  return FLESH_OK;
}

int flesh_fit_tangents_at(flesh_fit *fit, int experiment, const double *p, const flesh_fit_run **found)
{
  flesh_fit_experiment *e = &fit->experiments[experiment];
  const size_t size = (size_t)fit->parameter_count * sizeof *p, values = (size_t)e->count * sizeof *p;
  int status = flesh_fit_run_at(fit, experiment, p, found);
  if (status || (*found)->tangents || !(*found)->values || *e->differences) return status;
  const int of = (int)(*found - fit->runs);
  flesh_fit_run *run = add_run(fit);
  if (!run) return no_memory();
  *run = (flesh_fit_run){.experiment = experiment, .p = malloc(size), .values = malloc(values),
                         .tangents = calloc((size_t)e->count * (size_t)fit->parameter_count, sizeof *run->tangents)};
  const double cpu = flesh_cpu_seconds();
  if (!run->p || !run->values || !run->tangents) status = no_memory();
  if (!status) {
    memcpy(run->p, p, size);
    memcpy(run->values, fit->runs[of].values, values);
    status = differentiate(fit, experiment, p, run->tangents);
  }
  const double taken = flesh_cpu_seconds() - cpu;
  fit->counts.cpu_s += taken;
  if (!status && !*e->differences) status = write_run(fit, run, taken);
  if (status || *e->differences) {
    free_run(run);
    *found = &fit->runs[of];
    return status;
  }
  fit->run_count++;
  fit->counts.with_tangents += !e->moves;
  fit->counts.runs += e->moves;
  *found = run;
  return FLESH_OK;
}

void flesh_fit_close(flesh_fit *fit)
{
  for (int k = 0; k < fit->run_count; k++) free_run(&fit->runs[k]);
  for (int e = 0; e < fit->experiment_count; e++) {
    json_decref(fit->experiments[e].inputs);
    flesh_fit_kept_clear(&fit->experiments[e].kept);
  }
  free(fit->runs);
  free(fit->text);
  flesh_arena_free(&fit->arena);
  *fit = (flesh_fit){0};
}
