/* curves.c: reads tables of results into SQL, for `flesh plot` and for error bars. */
#include "plot/curves.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/confine.h"
#include "base/error.h"
#include "cli/path.h"
#include "run/run_folder.h"
#include "study/database.h"

enum { TABLES = 7, LABEL = 200 };

/* A folder of results or a CSV file. */
typedef struct source {
  const char *path;
  char label[LABEL];
  int count;
  flesh_csv tables[TABLES];
} source;

/* Returns the unit of a column of history.csv (observer.h), whose header has none. Columns of effects have the unit of
 * their last word, as weld_traction, or weld_2_traction for the second weld. */
static const char *history_unit(const char *name)
{
  static const char *const units[][2] = {
      {"t", "s"},   {"h", "s"},     {"residual", "N"}, {"residual_target", "N"}, {"volume", "m^3"},
      {"gap", "m"}, {"force", "N"}, {"released", "J"}, {"traction", "Pa"}};
  if (!strncmp(name, "energy_", 7)) return "J";
  if (!strncmp(name, "contact_", 8) || !strncmp(name, "weld_", 5)) name = strrchr(name, '_') + 1;
  for (size_t k = 0; k < sizeof units / sizeof *units; k++)
    if (!strcmp(name, units[k][0])) return units[k][1];
  return "";
}

void flesh_csv_label(const flesh_csv *csv, int column, char name[FLESH_CSV_NAME], char unit[FLESH_CSV_NAME])
{
  const char *header = csv->names[column], *bracket = strrchr(header, '['), *slash = strrchr(csv->path, '/');
  size_t length = strlen(header);
  *unit = 0;
  if (bracket && bracket > header && header[length - 1] == ']') {
    snprintf(unit, FLESH_CSV_NAME, "%.*s", (int)(header + length - 1 - bracket - 1), bracket + 1);
    length = (size_t)(bracket - header);
    while (length && header[length - 1] == ' ') length--;
  }
  snprintf(name, FLESH_CSV_NAME, "%.*s", (int)length, header);
  if (!*unit && !strcmp(slash ? slash + 1 : csv->path, "history.csv"))
    snprintf(unit, FLESH_CSV_NAME, "%s", history_unit(name));
  if (!strcmp(unit, "1")) *unit = 0;
}

int flesh_csv_find_label(const flesh_csv *csv, const char *wanted, char unit[FLESH_CSV_NAME])
{
  char name[FLESH_CSV_NAME];
  for (int c = 0; c < csv->columns; c++) {
    flesh_csv_label(csv, c, name, unit);
    if (!strcmp(name, wanted)) return c;
  }
  return -1;
}

/* Reads the tables of a folder of results. */
static int read_folder(source *s)
{
  static const char *const names[TABLES] = {"history.csv",  "probes.csv", "drift.csv",    "fit.csv",
                                            "accuracy.csv", "orders.csv", "hardcases.csv"};
  int status = flesh_confine(s->path);
  for (int k = 0; k < TABLES && !status; k++) {
    const char *path = flesh_path("%s/%s", s->path, names[k]);
    status = flesh_path_check(path);
    if (!status && flesh_path_is_file(path)) status = flesh_csv_read(path, FLESH_CSV_WHOLE, &s->tables[s->count++]);
  }
  if (!status && !s->count)
    return flesh_fail(FLESH_ERR_FILE, "%s: this folder has no history.csv, nor another table of flesh's; give the folder of a run "
                                      "or a CSV file (`flesh sweep plot` draws sweeps)", s->path);
  return status;
}

/* Sets the label to the last part of the path; for "run/history.csv" it is that of "run". */
static void find_label(source *s, int is_folder)
{
  const char *name;
  size_t length = flesh_run_folder_name(s->path, &name);
  if (!is_folder && name > s->path + 1 && (!strcmp(name, "history.csv") || !strcmp(name, "probes.csv")))
    length = flesh_run_folder_name(flesh_path("%.*s", (int)(name - s->path), s->path), &name);
  snprintf(s->label, LABEL, "%.*s", (int)length, name);
  char *dot = strrchr(s->label, '.');
  if (!is_folder && dot && !strcmp(dot, ".csv")) *dot = 0;
}

/* Reads the sources. If two have the same label, all labels are paths instead. */
static int read_sources(source *sources, int count, char *const *paths)
{
  int status = FLESH_OK, same = 0;
  for (int k = 0; k < count && !status; k++) {
    source *s = &sources[k];
    struct stat info;
    s->path = paths[k];
    const int is_folder = !flesh_path_stat(s->path, &info) && S_ISDIR(info.st_mode);
    status = is_folder ? read_folder(s) : flesh_csv_read(s->path, FLESH_CSV_WHOLE, &s->tables[0]);
    if (!is_folder && !status) s->count = 1;
    find_label(s, is_folder);
    for (int j = 0; j < k; j++) same |= !strcmp(sources[j].label, s->label);
  }
  for (int k = 0; k < count && same; k++) snprintf(sources[k].label, LABEL, "%s", paths[k]);
  return status;
}

/* Fills the table `headers`. */
static int add_headers(sqlite3_stmt *insert, const source *sources, int count)
{
  int code = SQLITE_DONE;
  for (int k = 0; k < count; k++)
    for (int t = 0; t < sources[k].count; t++)
      for (int c = 0; c < sources[k].tables[t].columns && code == SQLITE_DONE; c++) {
        const flesh_csv *csv = &sources[k].tables[t];
        char name[FLESH_CSV_NAME], unit[FLESH_CSV_NAME];
        flesh_csv_label(csv, c, name, unit);
        code = flesh_database_put(insert, "iiiitttttt", k, t, c, csv->rows, sources[k].path, sources[k].label, csv->path,
                                  csv->names[c], name, unit);
      }
  return code == SQLITE_DONE ? FLESH_OK : flesh_no_memory();
}

/* Fills the table `cells` with the columns that `query` names. */
static int add_cells(sqlite3_stmt *insert, const source *sources, sqlite3_stmt *query)
{
  int code = SQLITE_DONE;
  while (code == SQLITE_DONE && sqlite3_step(query) == SQLITE_ROW) {
    const flesh_csv *csv = &sources[sqlite3_column_int(query, 1)].tables[sqlite3_column_int(query, 2)];
    const int id = sqlite3_column_int(query, 0), column = sqlite3_column_int(query, 3);
    for (int row = 0; row < csv->rows && code == SQLITE_DONE; row++) {
      const char *cell = flesh_csv_cell(csv, row, column);
      double value;
      code = flesh_csv_number(csv, row, column, &value)
                 ? flesh_database_put(insert, "iitd", id, row, cell, isfinite(value) ? value : NAN)
                 : flesh_database_put(insert, "iitt", id, row, cell, "word");
    }
  }
  return code == SQLITE_DONE ? FLESH_OK : flesh_no_memory();
}

static int prepare(sqlite3 *database, const char *sql, sqlite3_stmt **statement)
{
  return sqlite3_prepare_v2(database, sql, -1, statement, NULL) ? flesh_no_memory() : FLESH_OK;
}

int flesh_curves_make(sqlite3 *database, int count, char *const *paths, const char *columns, const char *rest,
                      const flesh_results *to)
{
  static const char tables[] = /* with types, so that numbers compared with those of other tables find the index */
      "CREATE TABLE headers (id INTEGER PRIMARY KEY, source INT, tab INT, column INT, rows INT, path, label, file,"
      "  header, name, unit);"
      "CREATE TABLE cells (id INT, row INT, word, number, PRIMARY KEY (id, row)) WITHOUT ROWID;";
  const char *const sql[][2] = {{columns}, {rest}};
  source *sources = calloc((size_t)count + 1, sizeof *sources);
  sqlite3_stmt *headers = NULL, *cells = NULL, *query = NULL;
  int status = sources ? read_sources(sources, count, paths) : flesh_no_memory();
  if (!status && sqlite3_exec(database, tables, NULL, NULL, NULL)) status = flesh_no_memory();
  if (!status) status = prepare(database, "INSERT INTO headers VALUES (NULL, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", &headers);
  if (!status) status = add_headers(headers, sources, count);
  if (!status) status = flesh_results_make(database, "the tables", sql[0], to);
  if (!status) status = prepare(database, "SELECT * FROM needed", &query);
  if (!status) status = prepare(database, "INSERT INTO cells VALUES (?, ?, ?, ?)", &cells);
  if (!status) status = add_cells(cells, sources, query);
  if (!status) status = flesh_results_make(database, "the tables", sql[1], to);
  sqlite3_finalize(headers);
  sqlite3_finalize(query);
  sqlite3_finalize(cells);
  for (int k = 0; sources && k < count; k++)
    for (int t = 0; t < TABLES; t++) flesh_csv_clear(&sources[k].tables[t]);
  free(sources);
  return status;
}
