/* studies.c: comparisons in a report: of energies, of methods, and of solvers in hard cases. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/text.h"
#include "report/csv.h"
#include "report/part.h"

enum { MOST_SHOWN = 6 };

/* An energy with its constants, as in "D with raw constants"; matched ones go without saying. */
static void name_energy(const json_t *rows, size_t k, char name[64])
{
  const char *constants = flesh_report_text(rows, "constants", k);
  const int matched = !strcmp(constants, "matched");
  snprintf(name, 64, "%.20s%s%.20s%s", flesh_report_text(rows, "energy", k), matched ? "" : " with ",
           matched ? "" : !strcmp(constants, "as_e") ? "the" : constants,
           matched ? "" : !strcmp(constants, "as_e") ? " constants of E" : " constants");
}

/* How many rows have another text than `word` in the column. */
static size_t count_others(const json_t *rows, const char *column, const char *word)
{
  size_t others = 0;
  for (size_t k = 0; k < flesh_report_rows(rows); k++) others += strcmp(flesh_report_text(rows, column, k), word) != 0;
  return others;
}

/* Which energy keeps the volume best and worst, in the rows of this Poisson's ratio for which `is_of` holds. */
static void say_drift(json_t *part, const json_t *rows, double poisson,
                            int (*is_of)(const json_t *, size_t, double))
{
  const size_t count = flesh_report_rows(rows), others = count_others(rows, "status", "complete");
  double least = INFINITY, most = -INFINITY;
  char best[64] = "", worst[64] = "", words[400];
  for (size_t k = 0; k < count; k++) {
    const double drift = fabs(flesh_report_number(rows, "max_volume_drift", k));
    if (!is_of(rows, k, poisson) || isnan(drift)) continue;
    if (drift < least) least = drift, name_energy(rows, k, best);
    if (drift > most) most = drift, name_energy(rows, k, worst);
  }
  snprintf(words, sizeof words, "%.100s at Poisson's ratio %g: ", flesh_report_text(rows, "scene", count - 1), poisson);
  if (!*best) flesh_text_add(words, sizeof words, "no run has a volume to be compared.");
  else if (!strcmp(best, worst))
    flesh_text_add(words, sizeof words, "%s changes its volume by at most %.2g %%.", best, 100 * most);
  else
    flesh_text_add(words, sizeof words, "%s keeps its volume best, within %.2g %%, and %s worst, within %.2g %%.", best,
                   100 * least, worst, 100 * most);
  if (others) flesh_text_add(words, sizeof words, " %zu of %zu runs did not complete.", others, count);
  flesh_report_say(part, "%s", words);
}

static void say_accuracy(json_t *part, const json_t *rows)
{
  static const double errors[] = {0.01, 0.1};
  for (size_t e = 0; e < sizeof errors / sizeof *errors; e++) {
    size_t best = 0, found = 0;
    for (size_t k = 0; k < flesh_report_rows(rows); k++) {
      if (strcmp(flesh_report_text(rows, "price", k), "work") ||
          !(flesh_report_number(rows, "error_over_motion", k) <= errors[e]))
        continue;
      if (!found++ || flesh_report_number(rows, "cpu_s", k) < flesh_report_number(rows, "cpu_s", best)) best = k;
    }
    if (!found) continue;
    flesh_report_say(part, "With an error of at most %g %% of the motion, %s (%s) takes the least CPU time, %.2g s.",
                     100 * errors[e], flesh_report_text(rows, "method", best), flesh_report_text(rows, "setting", best),
                     flesh_report_number(rows, "cpu_s", best));
    return;
  }
  flesh_report_say(part, "No run has an error of at most 10 %% of the motion.");
}

/* A case of hardcases.csv with what is not by default. */
static void name_case(const json_t *rows, size_t k, char name[300])
{
  char energy[64];
  const double seed = flesh_report_number(rows, "seed", k);
  const char *solver = flesh_report_text(rows, "solver", k), *element = flesh_report_text(rows, "element", k);
  name_energy(rows, k, energy);
  snprintf(name, 300, "%.80s: %s, Poisson's ratio %g", flesh_report_text(rows, "case", k), energy,
           flesh_report_number(rows, "poisson", k));
  if (strcmp(solver, "default")) flesh_text_add(name, 300, ", solver %.40s", solver);
  if (strcmp(element, "tet4")) flesh_text_add(name, 300, ", %.20s", element);
  if (seed > 1) flesh_text_add(name, 300, ", seed %.0f", seed);
}

static void say_hardcases(json_t *part, const json_t *rows)
{
  const size_t count = flesh_report_rows(rows);
  char name[300], first[400] = "", more[40] = "";
  size_t others = 0;
  for (size_t k = 0; k < count; k++) {
    const char *outcome = flesh_report_text(rows, "outcome", k);
    if (!strcmp(outcome, "recovered") || !strcmp(outcome, "untangled") || !strcmp(outcome, "equilibrium")) continue;
    if (others++) continue;
    name_case(rows, k, name);
    snprintf(first, sizeof first, "; not so %s (%.60s)", name, outcome);
  }
  if (others > 1) snprintf(more, sizeof more, " and %zu more", others - 1);
  flesh_report_say(part, "%zu of %zu cases are back at rest, or in the equilibrium that was to be kept%s%s.",
                   count - others, count, first, more);
}

/* folder/name as a table; *number -1 with a note where there is none. */
static int add_table(json_t *part, const char *folder, const char *name, int open, int *number)
{
  json_t *columns;
  const int status = flesh_report_csv(folder, name, 0, &columns, NULL);
  *number = -1;
  if (columns) *number = flesh_report_table(part, name, columns, open);
  else if (!status) flesh_report_note(part, "There is no %s that can be read.", name);
  return status;
}

/* The verdict as the command has written it. */
static int add_verdict(json_t *part, const char *folder, const char *name)
{
  json_t *text;
  const int status = flesh_report_file(folder, name, &text);
  if (text) json_array_append_new(json_object_get(part, "verdict"), text);
  else if (!status) flesh_report_note(part, "There is no %s: the command did not end.", name);
  return status;
}

/* folder/name as a folded text, or as JSON. */
static int add_source(json_t *part, const char *title, const char *folder, const char *name,
                      int (*read)(const char *, const char *, json_t **))
{
  json_t *value;
  const int status = read(folder, name, &value);
  flesh_report_source(part, title, value);
  return status;
}

static const json_t *columns_of(const json_t *part, int table)
{
  return json_object_get(json_array_get(json_object_get(part, "tables"), (size_t)table), "columns");
}

/* The folder of a row of drift.csv; flesh drift names it so. */
static char *drift_folder(const char *folder, const json_t *rows, size_t k, char name[200])
{
  char path[220];
  snprintf(name, 200, "%s_%s_%s_%g_%s", flesh_report_text(rows, "scene", k),
           flesh_report_text(rows, "energy", k), flesh_report_text(rows, "constants", k),
           flesh_report_number(rows, "poisson", k), flesh_report_text(rows, "solver", k));
  snprintf(path, sizeof path, "runs/%s", name);
  return flesh_report_path(folder, path);
}

static double greatest_ratio(const json_t *rows)
{
  const size_t count = flesh_report_rows(rows);
  double most = -INFINITY;
  for (size_t k = 0; k < count; k++) most = fmax(most, flesh_report_number(rows, "poisson", k));
  return most;
}

/* Whether a row is of those that the pictures are of: the last scene's, at the greatest ratio, with
 * its own solver. */
static int is_chosen(const json_t *rows, size_t k, double greatest)
{
  const size_t last = flesh_report_rows(rows) - 1;
  return flesh_report_number(rows, "poisson", k) == greatest &&
         !strcmp(flesh_report_text(rows, "scene", k), flesh_report_text(rows, "scene", last)) &&
         !strcmp(flesh_report_text(rows, "element", k), flesh_report_text(rows, "element", last)) &&
         !strcmp(flesh_report_text(rows, "solver", k), flesh_report_text(rows, "solver", 0));
}

static int add_chosen_drift(flesh_report *report, json_t *part, const char *folder, int table,
                            json_t *plot)
{
  int status = FLESH_OK, sources = 0;
  const size_t count = flesh_report_rows(columns_of(part, table));
  const double greatest = greatest_ratio(columns_of(part, table));
  for (size_t k = 0; k < count && !status; k++) {
    const json_t *rows = columns_of(part, table);
    char name[200], label[64], shown[200], file[220];
    if (!is_chosen(rows, k, greatest)) continue;
    const char *energy = flesh_report_text(rows, "energy", k),
               *constants = flesh_report_text(rows, "constants", k);
    name_energy(rows, k, label);
    char *path = drift_folder(folder, rows, k, name);
    if (!path) return flesh_report_no_memory();
    snprintf(file, sizeof file, "runs/%s/result.json", name);
    const char *colour = strcmp(constants, "as_e") ? flesh_report_energy_colour(energy) : "#8B4513";
    status = flesh_report_add_history(part, plot, path, "history.csv", label, colour);
    snprintf(shown, sizeof shown, "%s, %.100s", label, flesh_report_text(columns_of(part, table), "scene", k));
    if (!status) status = flesh_report_show(report, path, shown, 1);
    if (!status && !sources++) {
      status = add_source(part, "scene of the first run shown", path, "scene.yaml", flesh_report_file);
      if (!status) status = add_source(part, "provenance of that run", folder, file, flesh_report_json);
    }
    free(path);
  }
  return status;
}

int flesh_report_add_drift(flesh_report *report, const char *folder)
{
  static const char *const setting[] = {"scene", "energy", "constants", "solver", NULL};
  json_t *part = flesh_report_part(report, "How the energies keep the volume", folder);
  int table = -1, status = add_table(part, folder, "drift.csv", 1, &table);
  if (!status && flesh_report_rows(columns_of(part, table)))
    say_drift(part, columns_of(part, table), greatest_ratio(columns_of(part, table)), is_chosen);
  if (!status) status = add_verdict(part, folder, "verdict.txt");
  if (status || table < 0) return status;
  char title[300];
  const json_t *rows = columns_of(part, table);
  const size_t count = flesh_report_rows(rows);
  if (!count)
    return flesh_fail(FLESH_ERR_FILE, "%s/drift.csv: it has no rows: the comparison has not begun",
                      folder);
  snprintf(title, sizeof title, "Volume against time: %.150s, Poisson's ratio %g, %.50s",
           flesh_report_text(rows, "scene", count - 1), greatest_ratio(rows), flesh_report_text(rows, "solver", 0));
  json_t *plot = flesh_report_add_plot(
      part,
      &(flesh_report_plot){
          .title = title, .x = "t", .y = "volume_ratio", .lines = 1, .choose = 1, .table = -1});
  snprintf(title, sizeof title, "Largest change of volume, %.50s",
           flesh_report_text(rows, "solver", 0));
  flesh_report_add_plot(part, &(flesh_report_plot){.title = title,
                                                   .x = "poisson",
                                                   .y = "max_volume_drift",
                                                   .log_y = 1,
                                                   .choose = 1,
                                                   .table = table,
                                                   .group = "energy",
                                                   .where = "solver",
                                                   .is = flesh_report_text(rows, "solver", 0)});
  flesh_report_add_grid(part, "How the runs ended", table, "poisson", setting, "status");
  return add_chosen_drift(report, part, folder, table, plot);
}

/* Columns of a table against each other, on logarithmic axes. */
static void add_costs(json_t *part, int table, flesh_report_plot plot)
{
  plot.log_x = plot.log_y = plot.choose = 1;
  plot.table = table;
  flesh_report_add_plot(part, &plot);
}

int flesh_report_add_accuracy(flesh_report *report, const char *folder)
{
  json_t *part = flesh_report_part(report, "What accuracy costs", folder);
  int table, orders, status = add_table(part, folder, "accuracy.csv", 1, &table);
  if (!status && flesh_report_rows(columns_of(part, table))) say_accuracy(part, columns_of(part, table));
  if (!status) status = add_verdict(part, folder, "verdict.txt");
  if (!status) status = add_table(part, folder, "orders.csv", 1, &orders);
  if (status) return status;
  static const char *const plots[][2] = {{"Error against CPU time", "cpu_s"},
                                         {"Error against residual evaluations", "residual_evaluations"},
                                         {"Error against step or tolerance", "value"}};
  for (size_t k = 0; k < sizeof plots / sizeof *plots && table >= 0; k++)
    add_costs(part, table, (flesh_report_plot){.title = plots[k][0], .x = plots[k][1], .y = "error_position_rms",
                                               .lines = 1, .group = "method", .where = "price", .is = "work"});
  if (flesh_report_has(folder, "mesh.csv")) {
    status = add_verdict(part, folder, "mesh.txt");
    if (!status) status = add_table(part, folder, "mesh.csv", 1, &table);
    if (!status && table >= 0)
      add_costs(part, table, (flesh_report_plot){.title = "Error of the mesh against CPU time", .x = "cpu_s",
                                                 .y = "error_over_motion", .lines = 1, .group = "element"});
  }
  json_t *all = NULL;
  if (!status) status = flesh_report_json(folder, "accuracy.json", &all);
  flesh_report_source(part, "the reference", json_incref(json_object_get(all, "reference")));
  flesh_report_source(part, "provenance", json_incref(json_object_get(all, "program")));
  json_decref(all);
  flesh_report_note(
      part, "The comparison keeps no motion of its runs: the commands of the verdict repeat them.");
  return status;
}

int flesh_report_add_bench(flesh_report *report, const char *folder)
{
  json_t *part = flesh_report_part(report, "What kernels and steps take", folder), *all = NULL;
  int table, status = add_table(part, folder, "bench.csv", 1, &table);
  if (table >= 0)
    add_costs(part, table, (flesh_report_plot){.title = "Time of a tet against the number of tets", .x = "tets",
                                               .y = "ns_per_tet", .lines = 1, .group = "name"});
  if (!status) status = flesh_report_json(folder, "bench.json", &all);
  flesh_report_source(part, "the machine's ceilings", json_incref(json_object_get(all, "ceilings")));
  flesh_report_source(part, "provenance", json_incref(json_object_get(all, "program")));
  json_decref(all);
  return status;
}

/* Whether the mesh of a case is there: what recovered leaves none. */
static int has_mesh(const char *folder, const char *name)
{
  char *path = flesh_report_path(folder, name);
  const int found = path && flesh_report_has(path, "body.mesh") && flesh_report_has(path, "out/state.txt");
  free(path);
  return found;
}

static int show_cases(flesh_report *report, json_t *part, const char *folder, int table)
{
  const json_t *rows = columns_of(part, table);
  int status = FLESH_OK, shown = 0, failed = 0;
  for (size_t k = 0; k < flesh_report_rows(rows) && !status; k++) {
    const char *name = flesh_report_text(rows, "folder", k);
    char *path, label[300];
    if (!strcmp(flesh_report_text(rows, "outcome", k), "recovered")) continue;
    failed++;
    if (shown == MOST_SHOWN || !has_mesh(folder, name)) continue;
    char *whole = flesh_report_path(folder, name);
    path = whole ? flesh_report_path(whole, "out") : NULL;
    name_case(rows, k, label);
    status = path ? flesh_report_show(report, path, label, 1) : flesh_report_no_memory();
    shown++;
    free(path);
    free(whole);
  }
  if (!failed)
    flesh_report_note(
        part, "Cases that recover leave no mesh behind: there is nothing to be seen in three "
              "dimensions. `flesh run` repeats each from the scene in its folder.");
  else if (shown < failed)
    flesh_report_note(part, "Of %d cases that did not recover %d are shown.", failed, shown);
  return status;
}

int flesh_report_add_hardcases(flesh_report *report, const char *folder)
{
  static const char *const setting[] = {"energy", "constants", "poisson", "step",
                                        "solver", "element",   NULL};
  json_t *part = flesh_report_part(report, "Hard cases", folder);
  int table = -1, profiles, status = add_table(part, folder, "hardcases.csv", 0, &table);
  if (!status && flesh_report_rows(columns_of(part, table))) say_hardcases(part, columns_of(part, table));
  if (!status) status = add_verdict(part, folder, "verdict.txt");
  if (status || table < 0) return status;
  flesh_report_add_grid(part, "What became of the cases", table, "case", setting, "outcome");
  add_costs(part, table, (flesh_report_plot){.title = "Work of the cases", .x = "newton", .y = "cpu_s", .group = "outcome"});
  if (flesh_report_has(folder, "profiles.csv")) status = add_table(part, folder, "profiles.csv", 0, &profiles);
  if (!status) status = show_cases(report, part, folder, table);
  if (!status && flesh_report_rows(columns_of(part, table))) {
    char file[300];
    snprintf(file, sizeof file, "%.250s/out/result.json",
             flesh_report_text(columns_of(part, table), "folder", 0));
    status = add_source(part, "provenance of the first case", folder, file, flesh_report_json);
  }
  return status;
}
