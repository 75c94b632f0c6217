/* runs.c: runs in a report: their verdict, figures, histories, probes, scenes and provenance. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/text.h"
#include "flesh/status.h"
#include "report/csv.h"
#include "report/part.h"
#include "run/run_folder.h"
#include "cli/json_memory.h"

/* A figure of result.json; NAN without. */
static double figure(const json_t *result, const char *name)
{
  const json_t *value = json_object_get(json_object_get(result, "figures"), name);
  return json_is_number(value) ? json_number_value(value) : NAN;
}

static const char *text_of(const json_t *object, const char *name)
{
  const char *text = json_string_value(json_object_get(object, name));
  return text ? text : "";
}

/* The letter of its first material's energy; "" without. */
static const char *energy_of(const json_t *result)
{
  return text_of(json_array_get(json_object_get(result, "materials"), 0), "energy");
}

static const char *colour_of(const json_t *result) { return flesh_report_energy_colour(energy_of(result)); }

/* How a run ended, and what became of its volume and its tets; no result: it left none. */
static void judge_run(json_t *part, const char *name, const json_t *result)
{
  if (!result) {
    flesh_report_say(part, "%s left no result.json: it is still going on, or it was killed.", name);
    return;
  }
  const char *status = text_of(result, "status"), *message = text_of(result, "message");
  const double steps = figure(result, "steps"), t = figure(result, "t_end"),
               drift = figure(result, "max_volume_drift");
  const double inverted = figure(result, "max_inverted"), least = figure(result, "J_min"),
               bound = figure(result, "J_bound");
  char words[1600], inversion[200];
  snprintf(words, sizeof words, "%.300s is %.200s", name, status);
  if (steps >= 0 && isfinite(t)) flesh_text_add(words, sizeof words, " after %.0f steps, at t = %.4g s", steps, t);
  if (inverted > 0)
    snprintf(inversion, sizeof inversion,
             "up to %.0f tets were inverted (J <= 0 at a point of quadrature), first at t = %.4g s", inverted,
             figure(result, "first_inverted_t"));
  else if (bound <= 0)
    snprintf(inversion, sizeof inversion,
             "no tet was inverted (least J %.4g at a point of quadrature; its lower bound near corners is %.2g)",
             least, bound);
  else snprintf(inversion, sizeof inversion, "no tet was inverted (least J %.4g)", least);
  flesh_text_add(words, sizeof words, "%s%s", *message ? ": " : "", message);
  if (isfinite(drift))
    flesh_report_say(part, "%s. Its volume changed by at most %.3g %%, at the end by %.2g %%; %s.",
                     words, 100 * drift, 100 * fabs(figure(result, "final_volume_drift")),
                     inversion);
  else flesh_report_say(part, "%s.", words);
  if (*text_of(result, "warning"))
    flesh_report_say(part, "%s: %s", name, text_of(result, "warning"));
  if (*text_of(result, "notes")) flesh_report_say(part, "%s: %s.", name, text_of(result, "notes"));
  if (figure(result, "solves_unconverged") > 0)
    flesh_report_say(part, "%s: %.0f of %.0f solves did not reach the tolerance.", name,
                     figure(result, "solves_unconverged"), figure(result, "solves"));
}

/* Says which of several runs changed their volume least and most. */
static void compare_runs(json_t *part, int count, char *const *names, json_t *const *results)
{
  int least = -1, most = -1;
  for (int r = 0; r < count; r++) {
    const double drift = figure(results[r], "max_volume_drift");
    if (isnan(drift)) continue;
    if (least < 0 || drift < figure(results[least], "max_volume_drift")) least = r;
    if (most < 0 || drift > figure(results[most], "max_volume_drift")) most = r;
  }
  if (least >= 0 && least != most)
    flesh_report_say(part,
                     "Of %d runs %s changed its volume least, by %.3g %%, and %s most, by %.3g %%.",
                     count, names[least], 100 * figure(results[least], "max_volume_drift"),
                     names[most], 100 * figure(results[most], "max_volume_drift"));
}

/* A row per run. */
static void add_figures(json_t *part, int count, char *const *names, json_t *const *results)
{
  static const struct {
    const char *figure, *title;
  } columns[] = {{"steps", "steps"},
                 {"t_end", "t_end [s]"},
                 {"max_volume_drift", "max_volume_drift"},
                 {"final_volume_drift", "final_volume_drift"},
                 {"J_min", "J_min"},
                 {"J_bound", "J_bound"},
                 {"max_inverted", "max_inverted"},
                 {"newton_per_step", "newton_per_step"},
                 {"linear_per_newton", "linear_per_newton"},
                 {"residual", "residual [N]"},
                 {"work_put_in", "work_put_in [J]"},
                 {"energy_gain", "energy_gain"},
                 {"cpu_s", "cpu [s]"},
                 {"peak_memory_kB", "peak memory [kB]"}};
  json_t *table = json_array(), *of_names = json_array(), *energies = json_array(),
         *statuses = json_array();
  for (int r = 0; r < count; r++) {
    json_array_append_new(of_names, flesh_json_text(names[r]));
    json_array_append_new(energies, json_string(energy_of(results[r])));
    json_array_append_new(statuses,
                          json_string(results[r] ? text_of(results[r], "status") : "no result"));
  }
  flesh_report_add_column(table, "run", of_names);
  flesh_report_add_column(table, "energy", energies);
  flesh_report_add_column(table, "status", statuses);
  for (size_t c = 0; c < sizeof columns / sizeof *columns; c++) {
    json_t *values = json_array();
    for (int r = 0; r < count; r++) {
      const double value = figure(results[r], columns[c].figure);
      json_array_append_new(values, isfinite(value) ? json_real(value) : json_null());
    }
    flesh_report_add_column(table, columns[c].title, values);
  }
  flesh_report_table(part, count > 1 ? "Figures of the runs" : "Figures of the run", table, 1);
}

/* The column to plot against time at first: the first of those wanted that a table has, else the last. */
static const char *first_column(const json_t *part, const char *const *wanted)
{
  const json_t *tables = json_object_get(part, "tables"), *table;
  size_t k;
  for (; wanted[1]; wanted++)
    json_array_foreach(tables, k, table) if (flesh_report_column(json_object_get(table, "columns"),
                                                                 *wanted)) return *wanted;
  return *wanted;
}

/* Histories, and where there are some, probes. */
static int add_histories(json_t *part, int count, char *const *folders, char *const *names,
                         json_t *const *results)
{
  static const char *const motions[] = {"volume_ratio", "energy_total", "newton", NULL};
  flesh_report_plot of = {.title = "History", .x = "t", .y = "", .lines = 1, .choose = 1, .table = -1};
  json_t *plot = flesh_report_add_plot(part, &of);
  int status = FLESH_OK, probes = 0;
  for (int r = 0; r < count && !status; r++) {
    probes |= flesh_report_has(folders[r], "probes.csv");
    status = flesh_report_add_history(part, plot, folders[r], "history.csv", names[r], colour_of(results[r]));
  }
  json_object_set_new(plot, "y", json_string(first_column(part, motions)));
  if (!probes || status) return status;
  of.title = "Probes", of.x = "t [s]";
  plot = flesh_report_add_plot(part, &of);
  for (int r = 0; r < count && !status; r++)
    if (flesh_report_has(folders[r], "probes.csv"))
      status = flesh_report_add_history(part, plot, folders[r], "probes.csv", names[r], colour_of(results[r]));
  const json_t *tables = json_object_get(part, "tables");
  const json_t *columns =
      json_object_get(json_array_get(tables, json_array_size(tables) - 1), "columns");
  const char *second = json_string_value(json_object_get(json_array_get(columns, 1), "name"));
  json_object_set_new(plot, "y", json_string(second ? second : ""));
  return status;
}

int flesh_report_add_runs(flesh_report *report, int count, char *const *folders)
{
  char **names = calloc((size_t)count + 1, sizeof *names);
  json_t **results = calloc((size_t)count + 1, sizeof *results);
  json_t *part = flesh_report_part(report, count > 1 ? "Runs" : "Run", count > 1 ? "" : folders[0]);
  int status =
      names && results ? FLESH_OK : flesh_report_no_memory();
  for (int r = 0; r < count && !status; r++) {
    status = flesh_report_json(folders[r], "result.json", &results[r]);
    if (!status && !(names[r] = flesh_run_folder_name(folders[r])))
      status = flesh_report_no_memory();
  }
  if (!status && count > 1) compare_runs(part, count, names, results);
  for (int r = 0; r < count && !status; r++) judge_run(part, names[r], results[r]);
  if (!status) add_figures(part, count, names, results);
  if (!status) status = add_histories(part, count, folders, names, results);
  for (int r = 0; r < count && !status; r++) {
    char title[300];
    json_t *scene;
    snprintf(title, sizeof title, "%s: scene", names[r]);
    status = flesh_report_file(folders[r], "scene.yaml", &scene);
    flesh_report_source(part, title, scene);
    snprintf(title, sizeof title, "%s: result and provenance", names[r]);
    flesh_report_source(part, title, json_incref(results[r]));
    if (!status) status = flesh_report_show(report, folders[r], names[r], 0);
  }
  for (int r = 0; names && results && r < count; r++) {
    free(names[r]);
    json_decref(results[r]);
  }
  free(names);
  free(results);
  return status;
}
