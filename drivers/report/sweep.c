/* sweep.c: the database of a sweep in a report, as data/studies/report_sweep.sql tells it. */
#include <stdlib.h>
#include <string.h>

#include "base/confine.h"
#include "report/csv.h"
#include "report/report.h"
#include "study/database.h"

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
  if (!status) status = flesh_report_tell_of(report, part, whole, "report_sweep", database);
  sqlite3_close(database);
  free(whole);
  return status;
}
