/* runs.c: the part of a report about runs (verdict, figures, histories, probes, scenes and provenance), made by
 * data/studies/report_runs.sql, and that about the database of a sweep, by report_sweep.sql. */
#include <stdlib.h>
#include <string.h>

#include "cli/json_memory.h"
#include "base/confine.h"
#include "report/report.h"
#include "run/run_folder.h"
#include "study/database.h"
#include "study/study.h"

static int insert_run(flesh_study_store *store, int number, const char *folder)
{
  const char *name;
  const size_t length = flesh_run_folder_name(folder, &name);
  json_t *result = NULL, *shown = flesh_json_bytes(name, length);
  int status = flesh_report_json(folder, "result.json", &result);
  char *text = json_is_object(result) ? json_dumps(result, JSON_COMPACT) : NULL;
  if (!status)
    status = flesh_study_store_execute(store, "INSERT INTO runs VALUES (%d, %Q, %Q, %Q)", number, folder,
                                       json_string_value(shown), text);
  json_decref(shown);
  json_decref(result);
  free(text);
  return status;
}

/* Fills the part by the text `sql` on a database in memory with the table of report_runs.sql. */
static int tell(flesh_report *report, json_t *part, const char *folder, const char *sql, int count, char *const *folders)
{
  flesh_study_store store = {.path = "a report"};
  if (sqlite3_open(":memory:", &store.database)) {
    sqlite3_close(store.database);
    return flesh_report_no_memory();
  }
  int status = flesh_study_store_execute(&store, "CREATE TABLE runs (number INTEGER PRIMARY KEY, folder, name, result)");
  for (int r = 0; r < count && !status; r++) status = insert_run(&store, r, folders[r]);
  if (!status) status = flesh_report_tell(report, part, folder, sql, store.database);
  sqlite3_close(store.database);
  return status;
}

int flesh_report_add_study(flesh_report *report, const char *title, const char *sql, const char *folder)
{
  return tell(report, flesh_report_part(report, title, folder), folder, sql, 1, (char *const[]){(char *)folder});
}

/* Returns the column to plot against time at first: the first of `wanted` that a table has, else the last of
 * `wanted`. */
static const char *first_column(const json_t *part, const char *const *wanted)
{
  const json_t *tables = json_object_get(part, "tables"), *table;
  size_t k;
  for (; wanted[1]; wanted++)
    json_array_foreach(tables, k, table) if (flesh_report_column(json_object_get(table, "columns"),
                                                                 *wanted)) return *wanted;
  return *wanted;
}

int flesh_report_add_runs(flesh_report *report, int count, char *const *folders)
{
  static const char *const motions[] = {"volume_ratio", "energy_total", "newton", NULL};
  json_t *part = flesh_report_part(report, count > 1 ? "Runs" : "Run", count > 1 ? "" : folders[0]);
  const int status = tell(report, part, "", "report_runs", count, folders);
  const json_t *tables = json_object_get(part, "tables"), *plots = json_object_get(part, "plots");
  const json_t *last = json_object_get(json_array_get(tables, json_array_size(tables) - 1), "columns");
  const char *second = json_string_value(json_object_get(json_array_get(last, 1), "name"));
  json_object_set_new(json_array_get(plots, 0), "y", json_string(first_column(part, motions)));
  json_object_set_new(json_array_get(plots, 1), "y", json_string(second ? second : ""));
  return status;
}

int flesh_report_is_database(const char *path)
{
  const size_t length = strlen(path);
  return length > 3 && !strcmp(path + length - 3, ".db");
}

int flesh_report_add_sweep(flesh_report *report, const char *path)
{
  static const char asked[] = "SELECT 1 FROM cases, results, rows, parameters, derived, meta, workers";
  sqlite3 *database = NULL;
  sqlite3_stmt *query = NULL;
  char *whole = strdup(flesh_report_is_database(path) ? path : flesh_report_path(path, "sweep.db"));
  if (!whole) return flesh_report_no_memory();
  json_t *part = flesh_report_part(report, "Sweep", whole);
  int status = flesh_path_check(whole);
  if (!status) status = flesh_database_read(whole, SQLITE_OPEN_READONLY, &database);
  if (!status && sqlite3_prepare_v2(database, asked, -1, &query, NULL))
    status = flesh_database_fail(database, whole, "this is no database of a sweep");
  sqlite3_finalize(query);
  if (!status) status = flesh_report_tell(report, part, whole, "report_sweep", database);
  sqlite3_close(database);
  free(whole);
  return status;
}
