/* pictures.c: the curves as tables of a database in memory, of which data/studies/material.sql makes table and pictures. */
#include <math.h>
#include <sqlite3.h>
#include <string.h>

#include "base/error.h"
#include "material/curves.h"
#include "material/form.h"
#include "study/database.h"
#include "study/embedded.h"
#include "study/results.h"

static const char tables[] =
    "CREATE TABLE given (mu, lambda, young, poisson);"
    "CREATE TABLE paths (path INTEGER PRIMARY KEY, name, title, parameter, stress, low, high);"
    "CREATE TABLE materials (line INTEGER PRIMARY KEY, energy, constants, label, colour, mu, lambda, twice);"
    "CREATE TABLE samples (path, line, point, s, psi, psi_minus_rest, stress, smallest_eigenvalue);";

/* Adds a row: whole numbers, texts, numbers. */
static void insert(sqlite3_stmt *row, int wholes, const int *whole, int texts, const char *const *text, int numbers,
                   const double *number)
{
  int at = 1;
  for (int k = 0; k < wholes; k++) sqlite3_bind_int(row, at++, whole[k]);
  for (int k = 0; k < texts; k++) sqlite3_bind_text(row, at++, text[k], -1, SQLITE_TRANSIENT);
  for (int k = 0; k < numbers; k++) sqlite3_bind_double(row, at++, number[k]); /* NaN is NULL */
  sqlite3_step(row);
  sqlite3_reset(row);
}

static void insert_samples(sqlite3_stmt *row, int path, int line, const flesh_curves *all)
{
  const flesh_path *p = &all->paths[path];
  for (int k = 0; k <= FLESH_CURVE_STEPS; k++) {
    double values[2 + FLESH_CURVE_QUANTITIES] = {flesh_path_parameter(p, k)};
    flesh_curve_sample(&all->curves[line], p, values[0], &values[1], values + 2);
    for (int v = 0; v < 2 + FLESH_CURVE_QUANTITIES; v++)
      if (!isfinite(values[v])) values[v] = NAN;
    insert(row, 3, (int[]){path, line, k}, 0, NULL, 2 + FLESH_CURVE_QUANTITIES, values);
  }
}

static void fill(sqlite3_stmt *const rows[4], const flesh_curves *all)
{
  insert(rows[0], 0, NULL, 0, NULL, 4, (double[]){all->mu, all->lambda, all->young, all->poisson});
  for (int c = 0; c < all->count; c++) {
    const flesh_material *m = &all->curves[c].material;
    const char *const texts[] = {flesh_energy_name(m->energy), flesh_constants_name(m->constants), all->curves[c].label,
                                 flesh_forms[m->energy].colour};
    insert(rows[2], 2, (int[]){c, flesh_form_takes(m->energy, FLESH_CONSTANTS_AS_E)}, 4, texts, 2,
           (double[]){m->mu, m->incompressible ? NAN : m->lambda});
  }
  for (int p = 0; p < FLESH_PATHS; p++) {
    const flesh_path *path = &all->paths[p];
    const char *const texts[] = {path->name, path->title, path->parameter, path->stress};
    insert(rows[1], 1, &p, 4, texts, 2, (double[]){fmin(path->start, path->end), fmax(path->start, path->end)});
    for (int c = 0; c < all->count; c++) insert_samples(rows[3], p, c, all);
  }
}

static void draw(void *outcome, const char *folder, const char *name) { flesh_plot_note(outcome, flesh_plot_draw(folder, name)); }

int flesh_curves_write(const char *folder, const flesh_curves *all, flesh_plot_outcome *outcome)
{
  static const char *const inserts[] = {
      "INSERT INTO given VALUES (?, ?, ?, ?)", "INSERT INTO paths VALUES (?, ?, ?, ?, ?, ?, ?)",
      "INSERT INTO materials (line, twice, energy, constants, label, colour, mu, lambda) VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
      "INSERT INTO samples VALUES (?, ?, ?, ?, ?, ?, ?, ?)"};
  const char *const sql[] = {flesh_own_text("plot_same"), flesh_own_text("material"), NULL};
  const flesh_results to = {.out = folder, .draw = draw, .data = outcome};
  sqlite3_stmt *rows[4] = {NULL};
  sqlite3 *database = NULL;
  int bad = sqlite3_open(":memory:", &database) || sqlite3_exec(database, tables, NULL, NULL, NULL);
  for (int k = 0; k < 4 && !bad; k++) bad = sqlite3_prepare_v2(database, inserts[k], -1, &rows[k], NULL);
  if (!bad) fill(rows, all);
  for (int k = 0; k < 4; k++) sqlite3_finalize(rows[k]);
  const int status = bad || sqlite3_errcode(database) == SQLITE_NOMEM ? flesh_no_memory()
                                                                      : flesh_results_make(database, "the curves", sql, &to);
  sqlite3_close(database);
  return status;
}
