/* write.c: writes the results of a fit: result.json, the fitted scenes, sentences and, by data/studies/fit.sql, fit.csv
 * and the picture. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "cli/json_memory.h"
#include "cli/options.h"
#include "cli/path.h"
#include "fit/map.h"
#include "picture/plot.h"
#include "run/provenance.h"
#include "study/database.h"
#include "study/embedded.h"
#include "study/results.h"

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
    flesh_fit_overrides(fit, e, p, &set);
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

static int write_result(const flesh_fit *fit, json_t *value)
{
  json_object_set_new(value, "runs", flesh_fit_runs_json(fit));
  json_object_set_new(value, "program", flesh_provenance_program(fit->options.argc, fit->options.argv));
  return flesh_json_write(flesh_path("%s/result.json", fit->options.out), value);
}

static int write_found(const flesh_fit *fit, const flesh_fit_found *found, const flesh_fit_statistics *s)
{
  json_t *sentences = json_array();
  for (int k = 0; k < s->sentence_count; k++) json_array_append_new(sentences, json_string(s->sentences[k]));
  json_t *value = json_pack("{sssisssososososo}", "status", found->converged ? "complete" : "failed", "exit_code",
                            found->converged ? 0 : flesh_exit_code(FLESH_ERR_SOLVE), "message", found->words, "parameters",
                            parameters_json(fit, found, s), "identifiability", sentences, "covariance",
                            matrix_json(s->count, s->covariance), "correlation", matrix_json(s->count, s->correlation),
                            "residuals",
                            json_pack("{sisisoso}", "measured_numbers", fit->count, "degrees_of_freedom", s->freedom,
                                      "sum_of_squares", flesh_json_number(s->squares), "scale", flesh_json_number(s->scale)));
  if (!value) return flesh_no_memory();
  json_object_set_new(value, "iterations", json_integer(found->iterations));
  if (fit->map) json_object_set_new(value, "map", flesh_fit_map_json(fit, found));
  json_object_set_new(value, "experiments", experiments_json(fit, found->p, found->values));
  return write_result(fit, value);
}

int flesh_fit_write_ended(const flesh_fit *fit, int status)
{
  char words[1024];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  const int written =
      write_result(fit, json_pack("{sssiso}", "status", status == FLESH_ERR_INTERRUPTED ? "interrupted" : "failed", "exit_code",
                                  flesh_exit_code(status), "message", flesh_json_text(words)));
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
  if (!status && sqlite3_prepare_v2(fit->store.database, "INSERT INTO numbers VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", -1,
                                    &insert, NULL))
    status = flesh_no_memory();
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
    status = flesh_fit_scene_at(fit, e, p, &scene);
    if (!status) status = flesh_scene_write(scene, flesh_path("%s/scenes/%s.yaml", fit->options.out, fit->experiments[e].name));
    flesh_scene_destroy(&scene);
  }
  return status;
}

static void print(const flesh_fit *fit, const flesh_fit_found *found, const flesh_fit_statistics *s)
{
  const flesh_fit_map *map = fit->map;
  double low = INFINITY, high = -INFINITY;
  for (int k = fit->key_count; k < fit->parameter_count; k++) low = fmin(low, found->p[k]), high = fmax(high, found->p[k]);
  if (map) printf("%s of %d tets from %.6g to %.6g%s%s\n", map->of.key, map->count, low, high, *map->unit ? " " : "", map->unit);
  for (int k = 0; k < fit->key_count; k++) {
    printf("%s = %.6g", fit->parameters[k].name, found->p[k]);
    if (!isnan(s->errors[k].standard))
      printf(" +/- %.2g (95 %%: %.6g to %.6g)", s->errors[k].standard, s->errors[k].low, s->errors[k].high);
    putchar('\n');
  }
  for (int k = 0; k < s->sentence_count; k++) printf("%s\n", s->sentences[k]);
  if (*found->words) printf("%s\n", found->words);
  for (int e = 0; e < fit->experiment_count; e++)
    if (*fit->experiments[e].differences)
      printf("derivatives of %s are by differences: %s\n", fit->experiments[e].name, fit->experiments[e].differences);
  if (map)
    printf("%d measured numbers, residuals %.4g times their deviations, weight %.4g, %d runs, %d linear solves\n", fit->count,
           s->scale, found->stages[found->chosen].weight, flesh_fit_runs_used(fit), fit->linear);
  else
    printf("%d measured numbers, sum of squares %.6g, %d iterations, %d runs\n", fit->count, s->squares, found->iterations,
           flesh_fit_runs_used(fit));
  printf("results: %s\n", fit->options.out);
}

int flesh_fit_write(flesh_fit *fit, const flesh_fit_found *found, const flesh_fit_statistics *statistics)
{
  flesh_plot_outcome drawn = {0};
  const char *const sql[] = {flesh_own_text("fit"), NULL};
  const flesh_results to = {.out = fit->options.out, .draw = flesh_plot_draw_noted, .data = &drawn};
  int status = tabulate(fit, found->values);
  if (!status) status = flesh_results_make(fit->store.database, fit->store.path, sql, &to);
  if (!status) status = write_scenes(fit, found->p);
  if (!status && fit->map) status = flesh_fit_map_tables(fit, found);
  if (!status) status = write_found(fit, found, statistics);
  if (!status && !fit->options.quiet) print(fit, found, statistics);
  return status ? status : flesh_plot_accept("fit", flesh_plot_ended(&drawn));
}
