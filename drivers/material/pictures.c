/* pictures.c: the curves as tables of a database in memory, of which data/studies/material.sql makes table and pictures. */
#include <math.h>
#include <sqlite3.h>

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

static void insert_samples(sqlite3_stmt *row, int path, int line, const flesh_curves *all)
{
  const flesh_path *p = &all->paths[path];
  for (int k = 0; k <= FLESH_CURVE_STEPS; k++) {
    double values[2 + FLESH_CURVE_QUANTITIES] = {flesh_path_parameter(p, k)};
    flesh_curve_sample(&all->curves[line], p, values[0], &values[1], values + 2);
    for (int v = 0; v < 2 + FLESH_CURVE_QUANTITIES; v++)
      if (!isfinite(values[v])) values[v] = NAN;
    flesh_database_put(row, "iiiddddd", path, line, k, values[0], values[1], values[2], values[3], values[4]);
  }
}

static void fill(sqlite3_stmt *const rows[4], const flesh_curves *all)
{
  flesh_database_put(rows[0], "dddd", all->mu, all->lambda, all->young, all->poisson);
  for (int c = 0; c < all->count; c++) {
    const flesh_material *m = &all->curves[c].material;
    flesh_database_put(rows[2], "ittttddi", c, flesh_energy_name(m->energy), flesh_constants_name(m->constants),
                       all->curves[c].label, flesh_forms[m->energy].colour, m->mu, m->incompressible ? NAN : m->lambda,
                       flesh_form_takes(m->energy, FLESH_CONSTANTS_AS_E));
  }
  for (int p = 0; p < FLESH_PATHS; p++) {
    const flesh_path *path = &all->paths[p];
    flesh_database_put(rows[1], "ittttdd", p, path->name, path->title, path->parameter, path->stress,
                       fmin(path->start, path->end), fmax(path->start, path->end));
    for (int c = 0; c < all->count; c++) insert_samples(rows[3], p, c, all);
  }
}

int flesh_curves_write(const char *folder, const flesh_curves *all, flesh_plot_outcome *outcome)
{
  static const char *const inserts[] = {
      "INSERT INTO given VALUES (?, ?, ?, ?)", "INSERT INTO paths VALUES (?, ?, ?, ?, ?, ?, ?)",
      "INSERT INTO materials VALUES (?, ?, ?, ?, ?, ?, ?, ?)", "INSERT INTO samples VALUES (?, ?, ?, ?, ?, ?, ?, ?)"};
  const char *const sql[] = {flesh_own_text("plot_same"), flesh_own_text("material"), NULL};
  const flesh_results to = {.out = folder, .draw = flesh_plot_draw_noted, .data = outcome};
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
