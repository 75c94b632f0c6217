/* sweep.c: the database of a sweep in a report. */
#include <math.h>
#include <sqlite3.h>
#include <stdlib.h>
#include <string.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/text.h"
#include "report/csv.h"
#include "report/part.h"
#include "study/database.h"
#include "cli/json_memory.h"

/* An open database and what is asked of it. */
typedef struct source {
  const char *path;
  sqlite3 *database;
} source;

static int lost(const source *s)
{
  return flesh_database_fail(s->database, s->path, "this is no database of a sweep");
}

/* Runs the query and returns its rows as columns (new). */
static int ask(const source *s, const char *sql, json_t **columns)
{
  sqlite3_stmt *query = NULL;
  *columns = NULL;
  if (sqlite3_prepare_v2(s->database, sql, -1, &query, NULL)) return lost(s);
  *columns = flesh_report_query(query, 0);
  sqlite3_finalize(query);
  return *columns ? FLESH_OK : lost(s);
}

/* Columns that say nothing: none of their rows has a value. */
static void drop_empty(json_t *columns)
{
  for (size_t k = json_array_size(columns); k-- > 0;) {
    const json_t *values = json_object_get(json_array_get(columns, k), "values"), *value;
    size_t i, found = 0;
    json_array_foreach(values, i, value) found +=
        !json_is_null(value) && strcmp(json_is_string(value) ? json_string_value(value) : "-", "");
    if (!found && json_array_size(values)) json_array_remove(columns, k);
  }
}

/* "18 cases: 17 complete, 1 failed." */
static int say_counts(const source *s, json_t *part)
{
  char words[1000] = "";
  json_t *counts;
  int all = 0,
      status =
          ask(s, "SELECT status, count(*) AS number FROM cases GROUP BY status ORDER BY 2 DESC",
              &counts);
  for (size_t k = 0; k < flesh_report_rows(counts) && !status; k++) {
    const int number = (int)flesh_report_number(counts, "number", k);
    all += number;
    flesh_text_add(words, sizeof words, "%s%d %.40s", k ? ", " : "", number, flesh_report_text(counts, "status", k));
  }
  if (!status) flesh_report_say(part, "%d %s: %s.", all, all == 1 ? "case" : "cases", words);
  json_decref(counts);
  return status;
}

/* The least and the greatest of a figure, and whose they are. */
static void say_extremes(json_t *part, const json_t *results, const char *name)
{
  size_t low = 0, high = 0, found = 0;
  for (size_t k = 0; k < flesh_report_rows(results); k++) {
    const double value = flesh_report_number(results, name, k);
    if (isnan(value)) continue;
    if (!found++) low = high = k;
    if (value < flesh_report_number(results, name, low)) low = k;
    if (value > flesh_report_number(results, name, high)) high = k;
  }
  if (found > 1)
    flesh_report_say(
        part, "%s is from %.4g (case %g) to %.4g (case %g).", name,
        flesh_report_number(results, name, low), flesh_report_number(results, "id", low),
        flesh_report_number(results, name, high), flesh_report_number(results, "id", high));
}

static int is_number(const json_t *columns, const char *name)
{
  const json_t *values = flesh_report_column(columns, name), *value;
  size_t k;
  json_array_foreach(values, k, value) if (json_is_number(value)) return 1;
  return 0;
}

/* A figure over the first axis of numbers, a series for each value of another axis. */
static int add_plot(const source *s, json_t *part, int table, const json_t *results)
{
  static const char *const figures[] = {"max_volume_drift", "error_position_rms", "newton",
                                        "seconds", NULL};
  json_t *axes, *derived = NULL;
  const char *x = NULL, *group = NULL, *y = NULL;
  int status = ask(s, "SELECT name FROM parameters ORDER BY number", &axes);
  if (!status) status = ask(s, "SELECT name FROM derived ORDER BY number", &derived);
  for (size_t k = 0; k < flesh_report_rows(axes) && !status; k++) {
    const char *name = flesh_report_text(axes, "name", k);
    if (!flesh_report_column(results, name)) continue;
    if (!x && is_number(results, name)) x = name;
    else if (!group) group = name;
  }
  for (size_t k = 0; k < flesh_report_rows(derived) && !y; k++)
    if (is_number(results, flesh_report_text(derived, "name", k)))
      y = flesh_report_text(derived, "name", k);
  for (int k = 0; figures[k] && !y; k++)
    if (is_number(results, figures[k])) y = figures[k];
  if (!status && y) {
    say_extremes(part, results, y);
    flesh_report_add_plot(part, &(flesh_report_plot){.title = "Cases",
                                                     .x = x ? x : "id",
                                                     .y = y,
                                                     .lines = 1,
                                                     .choose = 1,
                                                     .table = table,
                                                     .group = group});
  }
  json_decref(axes);
  json_decref(derived);
  return status;
}

static int add_tables(const source *s, json_t *part)
{
  json_t *results, *rows = NULL, *meta = NULL, *worker = NULL;
  int status = say_counts(s, part);
  if (!status) status = ask(s, "SELECT * FROM results ORDER BY id", &results);
  if (status) return status;
  drop_empty(results);
  json_incref(results);
  const int table = flesh_report_table(part, "Results", results, 1);
  status = add_plot(s, part, table, results);
  json_decref(results);
  if (!status) status = ask(s, "SELECT * FROM rows LIMIT 5000", &rows);
  if (status == FLESH_ERR_FILE)
    status = FLESH_OK; /* only other commands than `flesh run` have rows */
  else if (!status && flesh_report_rows(rows))
    flesh_report_table(part, "Rows of the cases", rows, 0);
  else json_decref(rows);
  if (!status) status = ask(s, "SELECT value AS spec FROM meta WHERE key = 'spec'", &meta);
  if (!status && flesh_report_rows(meta))
    flesh_report_source(part, "the sweep's spec",
                        flesh_json_text(flesh_report_text(meta, "spec", 0)));
  if (!status) status = ask(s, "SELECT program FROM workers ORDER BY started LIMIT 1", &worker);
  if (!status && flesh_report_rows(worker))
    flesh_report_source(part, "provenance",
                        json_loads(flesh_report_text(worker, "program", 0), 0, NULL));
  json_decref(meta);
  json_decref(worker);
  return status;
}

int flesh_report_is_database(const char *path)
{
  const size_t length = strlen(path);
  return length > 3 && !strcmp(path + length - 3, ".db");
}

int flesh_report_add_sweep(flesh_report *report, const char *path)
{
  char *whole = flesh_report_is_database(path) ? strdup(path) : flesh_report_path(path, "sweep.db");
  if (!whole) return flesh_report_no_memory();
  source s = {.path = whole};
  json_t *part = flesh_report_part(report, "Sweep", whole);
  int status = flesh_path_check(whole);
  if (!status) status = flesh_database_read(whole, SQLITE_OPEN_READONLY, &s.database);
  if (!status) status = add_tables(&s, part);
  sqlite3_close(s.database);
  free(whole);
  if (!status)
    flesh_report_note(
        part, "A sweep's database holds no motion; `keep: true` in its spec leaves the cases' "
              "folders, which a report can be given beside it.");
  return status;
}
