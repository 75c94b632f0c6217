/* write.c: writes the results of a fit: result.json, the fitted scenes, of a map tets.csv and map.vtu and, by
 * data/studies/fit.sql and fit_words.sql, fit.csv, the picture and the words. */
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "cli/json_memory.h"
#include "cli/options.h"
#include "cli/path.h"
#include "fit/map.h"
#include "mesh/inspect.h"
#include "output/vtu.h"
#include "picture/plot.h"
#include "run/provenance.h"
#include "study/csv.h"
#include "study/database.h"
#include "study/embedded.h"
#include "study/results.h"
#include "study/tables.h"

static json_t *matrix_json(int n, const double *matrix)
{
  json_t *rows = json_array();
  for (int a = 0; a < n; a++) json_array_append_new(rows, flesh_json_numbers(n, matrix + (size_t)a * (size_t)n));
  return rows;
}

static json_t *parameters_json(const flesh_fit *fit, const flesh_fit_found *found, const flesh_fit_statistics *s)
{
  json_t *list = json_array();
  for (int k = 0; k < fit->key_count; k++) {
    const flesh_fit_parameter *p = &fit->parameters[k];
    const flesh_fit_error *error = &s->errors[k];
    json_array_append_new(list, json_pack("{sssssosososososo}", "name", p->name, "key", p->key, "value",
                                          flesh_json_number(found->p[k]),
                                          "standard_error", flesh_json_number(error->standard), "low_95",
                                          flesh_json_number(error->low), "high_95", flesh_json_number(error->high), "start",
                                          flesh_json_number(p->start), "at_bound",
                                          found->at_bound[k] ? json_string(found->at_bound[k] > 0 ? "upper" : "lower")
                                                             : json_null()));
  }
  return list;
}

static json_t *derivatives_json(const flesh_fit *fit, const flesh_fit_experiment *e)
{
  char words[FLESH_FIT_WORDS + 40];
  const char *way = *e->differences ? "by differences: " : fit->map ? "by tangents and adjoints" : "by tangents";
  snprintf(words, sizeof words, "%s%s", way, e->differences);
  return flesh_json_text(words);
}

static json_t *experiments_json(const flesh_fit *fit, const double *p, const double *values)
{
  json_t *list = json_array();
  for (int e = 0; e < fit->experiment_count; e++) {
    const flesh_fit_experiment *one = &fit->experiments[e];
    const double sum = flesh_fit_squares(fit, one->first, one->count, values);
    flesh_overrides set;
    flesh_fit_overrides(fit, one, p, &set);
    if (set.failed) flesh_json_note_lack();
    json_t *overrides = json_array(), *files = json_array();
    for (int k = 0; k < set.texts.count; k++) json_array_append_new(overrides, flesh_json_text(set.texts.values[k]));
    for (int k = 0; k < one->measured_count; k++) json_array_append_new(files, flesh_json_text(one->measured[k].path));
    flesh_overrides_close(&set);
    json_array_append_new(list, json_pack("{sssisososososO}", "name", one->name, "measured_numbers", one->count, "residual_rms",
                                          flesh_json_number(sqrt(sum / one->count)), "derivatives",
                                          derivatives_json(fit, one), "measured", files, "overrides", overrides, "inputs",
                                          one->inputs));
  }
  return list;
}

static json_t *stages_json(const flesh_fit_found *found)
{
  json_t *list = json_array();
  for (int k = 0; k < found->stage_count; k++) {
    const flesh_fit_stage *s = &found->stages[k];
    json_array_append_new(list, json_pack("{sfsfsfsfsisb}", "weight", s->weight, "sum_of_squares", s->squares, "penalty",
                                          s->penalty, "determined_numbers", s->determined, "iterations", s->iterations,
                                          "converged", s->converged));
  }
  return list;
}

static json_t *map_json(const flesh_fit *fit, const flesh_fit_found *found)
{
  const flesh_fit_map *map = fit->map;
  return json_pack("{sssisssfsssosososo}", "constant", map->of.key, "tets", map->count, "penalty",
                   map->penalty == FLESH_FIT_QUADRATIC ? "quadratic" : "variation", "weight",
                   found->stages[found->chosen].weight, "weight_from", isnan(map->weight) ? "discrepancy" : "spec",
                   "determined_numbers", flesh_json_number(found->determined), "median_deviation",
                   flesh_json_number(found->median), "largest_deviation", flesh_json_number(found->largest), "stages",
                   stages_json(found));
}

/* Adds what every end of a fit has. */
static json_t *with_runs(const flesh_fit *fit, json_t *value)
{
  json_object_set_new(value, "runs", flesh_fit_runs_json(fit));
  json_object_set_new(value, "program", flesh_provenance_program(fit->options.argc, fit->options.argv));
  return value;
}

/* Returns what the SQL says of a map beside its result. */
static json_t *map_facts(const flesh_fit *fit, const flesh_fit_found *found)
{
  const flesh_fit_map *map = fit->map;
  const double *p = found->p + fit->key_count, hardly = 0.5; /* a tet is hardly known if the deviation of its q is larger */
  int hardly_known = 0, at_bounds = 0;
  for (int k = 0; k < map->count; k++) {
    at_bounds += found->at_bound[fit->key_count + k] != 0;
    hardly_known += found->deviations && found->deviations[k] > hardly;
  }
  return json_pack("{sf sf ss sb si si}", "low", gsl_stats_min(p, 1, (size_t)map->count), "high",
                   gsl_stats_max(p, 1, (size_t)map->count), "unit", map->unit, "is_share", map->of.spacing == FLESH_LOGARITHMIC,
                   "hardly_known", hardly_known, "at_bounds", at_bounds);
}

/* Writes result.json, with sentences about what is determined, and prints them. */
static int tell(flesh_fit *fit, const flesh_fit_found *found, const flesh_fit_statistics *s)
{
  const char *const sql[] = {flesh_own_text("fit_words"), NULL};
  const flesh_results to = {.out = fit->options.out, .quiet = fit->options.quiet};
  json_t *value = json_pack("{sssisssosOsososo}", "status", found->converged ? "complete" : "failed", "exit_code",
                            found->converged ? 0 : flesh_exit_code(FLESH_ERR_SOLVE), "message", found->words, "parameters",
                            parameters_json(fit, found, s), "identifiability", s->sentences, "covariance",
                            matrix_json(s->count, s->covariance), "correlation", matrix_json(s->count, s->correlation),
                            "residuals",
                            json_pack("{sisisoso}", "measured_numbers", fit->count, "degrees_of_freedom", s->freedom,
                                      "sum_of_squares", flesh_json_number(s->squares), "scale", flesh_json_number(s->scale)));
  json_object_set_new(value, "iterations", json_integer(found->iterations));
  if (fit->map) json_object_set_new(value, "map", map_json(fit, found));
  json_object_set_new(value, "experiments", experiments_json(fit, found->p, found->values));
  json_t *all = json_pack("{so so so*}", "result", with_runs(fit, value), "out", flesh_json_text(fit->options.out), "map",
                          fit->map ? map_facts(fit, found) : NULL);
  char *text = json_dumps(all, JSON_COMPACT);
  int status = flesh_json_lacks() ? flesh_no_memory()
                                  : flesh_study_store_execute(&fit->store, "CREATE TEMP TABLE found AS SELECT %Q AS data", text);
  json_decref(all);
  free(text);
  return status ? status : flesh_results_make(fit->store.database, fit->store.path, sql, &to);
}

int flesh_fit_write_ended(const flesh_fit *fit, int status)
{
  char words[1024];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  json_t *value = json_pack("{sssiso}", "status", status == FLESH_ERR_INTERRUPTED ? "interrupted" : "failed", "exit_code",
                            flesh_exit_code(status), "message", flesh_json_text(words));
  const int written = flesh_json_write(flesh_path("%s/result.json", fit->options.out), with_runs(fit, value));
  flesh_fail(status, "%s", words);
  return written;
}

/* Fills the table that the SQL reads. */
static int tabulate(flesh_fit *fit, const double *values)
{
  static const char table[] = "CREATE TEMP TABLE numbers (file, experiment, measured, row, place, quantity, unit, t, value, "
                              "deviation, fitted, residual)";
  sqlite3_stmt *insert = NULL;
  int i = 0, file = 0, code = SQLITE_DONE, status = flesh_study_store_execute(&fit->store, table);
  if (!status)
    status = flesh_study_store_prepare(&fit->store, "INSERT INTO numbers VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", &insert);
  for (int e = 0; e < fit->experiment_count && !status; e++)
    for (int k = 0; k < fit->experiments[e].measured_count; k++, file++) {
      const flesh_fit_measured *m = &fit->experiments[e].measured[k];
      const char *slash = strrchr(m->path, '/');
      for (int d = 0; d < m->count && code == SQLITE_DONE; d++, i++) {
        const flesh_fit_datum *datum = &m->data[d];
        const flesh_fit_quantity *q = &m->quantities[datum->quantity];
        code = flesh_database_put(insert, "ittiittddddd", file, fit->experiments[e].name, slash ? slash + 1 : m->path,
                                  datum->row + 1, datum->quantity, q->name, q->unit, datum->t, datum->value, datum->deviation,
                                  values[i], flesh_fit_residual(fit, i, values));
      }
    }
  sqlite3_finalize(insert);
  return status || code == SQLITE_DONE ? status : flesh_no_memory();
}

/* Writes the scene of each experiment with the fitted parameters. */
static int write_scenes(const flesh_fit *fit, const double *p)
{
  int status = flesh_folder_make(flesh_path("%s/scenes", fit->options.out));
  for (int e = 0; e < fit->experiment_count && !status; e++) {
    flesh_scene *scene = NULL;
    status = flesh_fit_scene_at(fit, &fit->experiments[e], p, &scene);
    if (!status) status = flesh_scene_write(scene, flesh_path("%s/scenes/%s.yaml", fit->options.out, fit->experiments[e].name));
    flesh_scene_destroy(&scene);
  }
  return status;
}

static int write_tets(const flesh_fit *fit, const flesh_fit_found *found, const flesh_mesh *mesh)
{
  const flesh_fit_map *map = fit->map;
  flesh_file file;
  const int status = flesh_file_open(flesh_path("%s/tets.csv", fit->options.out), &file);
  if (status) return status;
  const char *unit = *map->unit ? map->unit : "1";
  fprintf(file.stream, "tet,X [m],Y [m],Z [m],%s [%s],low_95 [%s],high_95 [%s],deviation of q,resolution\n", map->of.key, unit,
          unit, unit);
  for (int k = 0; k < map->count; k++) {
    const double p = found->p[fit->key_count + k], q = flesh_fit_q_of(&map->of, p);
    const double deviation = found->deviations ? found->deviations[k] : NAN;
    double centre[3];
    fprintf(file.stream, "%d", map->tets[k]);
    flesh_mesh_centre(mesh, flesh_mesh_positions(mesh), map->tets[k], centre);
    for (int c = 0; c < 3; c++) flesh_table_field(file.stream, centre[c]);
    const double fields[] = {p, flesh_fit_p_of(&map->of, q - 1.96 * deviation),
                             flesh_fit_p_of(&map->of, q + 1.96 * deviation), deviation,
                             found->resolutions ? found->resolutions[k] : NAN};
    for (int c = 0; c < 5; c++) flesh_table_field(file.stream, fields[c]);
    putc('\n', file.stream);
  }
  return flesh_file_commit(&file);
}

/* Writes the body at rest with the map as cell data; NaN in tets outside the map. */
static int write_vtu(const flesh_fit *fit, const flesh_fit_found *found, const flesh_mesh *mesh)
{
  const flesh_fit_map *map = fit->map;
  const int tets = flesh_mesh_tet_count(mesh);
  const double *const from[] = {found->p + fit->key_count, found->deviations, found->resolutions};
  double *room = malloc(3 * (size_t)tets * sizeof *room);
  int status = room ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "out of memory for the results of a map");
  for (int k = 0; k < 3 * tets && !status; k++) room[k] = NAN;
  for (int a = 0; a < 3 && !status; a++)
    for (int k = 0; k < map->count && from[a]; k++) room[(size_t)a * (size_t)tets + (size_t)map->tets[k]] = from[a][k];
  const char *unit = *map->unit ? map->unit : NULL;
  const flesh_vtu_array arrays[] = {{.name = map->of.key, .components = 1, .doubles = room, .unit = unit},
                                    {.name = "deviation", .components = 1, .doubles = room + tets},
                                    {.name = "resolution", .components = 1, .doubles = room + 2 * (size_t)tets}};
  const flesh_vtu content = {.points = flesh_mesh_node_count(mesh), .tets = tets, .positions = flesh_mesh_positions(mesh),
                             .tet_nodes = flesh_mesh_tets(mesh), .edge_nodes = flesh_mesh_tet_edges(mesh),
                             .cell_array_count = from[1] ? 3 : 1, .cell_arrays = arrays};
  if (!status) status = flesh_vtu_write(flesh_path("%s/map.vtu", fit->options.out), &content);
  free(room);
  return status;
}

static int write_map(const flesh_fit *fit, const flesh_fit_found *found)
{
  flesh_scene *scene = NULL;
  int status = flesh_fit_scene_at(fit, fit->experiments, found->p, &scene);
  if (!status) status = write_tets(fit, found, flesh_scene_mesh(scene));
  if (!status) status = write_vtu(fit, found, flesh_scene_mesh(scene));
  flesh_scene_destroy(&scene);
  return status;
}

int flesh_fit_write(flesh_fit *fit, const flesh_fit_found *found, const flesh_fit_statistics *statistics)
{
  flesh_plot_outcome drawn = {0};
  const char *const sql[] = {flesh_own_text("fit"), NULL};
  const flesh_results to = {.out = fit->options.out, .draw = flesh_plot_draw_noted, .data = &drawn};
  int status = tabulate(fit, found->values);
  if (!status) status = flesh_results_make(fit->store.database, fit->store.path, sql, &to);
  if (!status) status = write_scenes(fit, found->p);
  if (!status && fit->map) status = write_map(fit, found);
  if (!status) status = tell(fit, found, statistics);
  return status ? status : flesh_plot_accept("fit", flesh_plot_ended(&drawn));
}
