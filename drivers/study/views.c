/* views.c: the views `results` and `rows`: the JSON of a study's database spread into columns. */
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/error.h"
#include "study/tables.h"

static int no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory"); }

static int print_columns(flesh_text *text, const char *alias, const char *expression)
{
  flesh_text_print(text, ", %s AS \"%s\"", expression, alias);
  return 0;
}

/* Calls `print` with every row of a query of two texts. */
static int for_rows(flesh_study_store *store, const char *sql, flesh_text *text)
{
  sqlite3_stmt *query;
  int status = flesh_study_store_prepare(store, sql, &query), code = SQLITE_DONE;
  while (!status && (code = sqlite3_step(query)) == SQLITE_ROW)
    print_columns(text, (const char *)sqlite3_column_text(query, 0), (const char *)sqlite3_column_text(query, 1));
  if (!status && code != SQLITE_DONE) status = flesh_study_store_fail(store, "cannot be read");
  sqlite3_finalize(query);
  return status;
}

static const char axes_sql[] =
    "SELECT name, 'c.\"' || name || '\"' FROM (SELECT number, name FROM parameters UNION ALL "
    "SELECT 1000, name FROM pragma_table_info('cases') WHERE name = 'repeat' ORDER BY number)";

static int print_results(flesh_study_store *store, flesh_text *text)
{
  flesh_text_print(text, "SELECT c.id AS id");
  int status = for_rows(store, axes_sql, text);
  for (int k = 0; flesh_study_case_columns[k][0]; k++)
    print_columns(text, flesh_study_case_columns[k][0], flesh_study_case_columns[k][1]);
  if (!status)
    status = flesh_study_store_execute(store, "INSERT OR IGNORE INTO figures (path) SELECT DISTINCT 'energies.' || key "
                                              "FROM cases, json_each(cases.result, '$.figures.energies')");
  if (!status)
    status = for_rows(store,
                      "SELECT replace(path, 'energies.', 'energy_'), "
                      "'json_extract(c.result, ''$.figures.' || path || ''')' FROM figures ORDER BY number",
                      text);
  for (int k = 0; flesh_study_last_columns[k][0]; k++)
    print_columns(text, flesh_study_last_columns[k][0], flesh_study_last_columns[k][1]);
  flesh_text_print(text, " FROM cases c LEFT JOIN workers w ON w.name = c.worker");
  return status;
}

static int print_rows(flesh_study_store *store, flesh_text *text)
{
  flesh_text_print(text, "SELECT r.case_id AS case_id, r.number AS number");
  int status = for_rows(store, axes_sql, text);
  if (!status)
    status = for_rows(store,
                      "SELECT CASE WHEN lower(key) IN (SELECT lower(name) FROM parameters) OR "
                      "lower(key) IN ('case_id', 'number', 'repeat') THEN 'row_' ELSE '' END || key, "
                      "'json_extract(r.data, ''$.\"' || key || '\"'')' FROM (SELECT key, min(json_each.id) AS place "
                      "FROM table_rows, json_each(table_rows.data) GROUP BY key ORDER BY place)",
                      text);
  flesh_text_print(text, " FROM table_rows r JOIN cases c ON c.id = r.case_id");
  return status;
}

static int is_run(flesh_study_store *store)
{
  sqlite3_stmt *query;
  int run = 1;
  if (sqlite3_prepare_v2(store->database, "SELECT value = 'run' FROM meta WHERE key = 'command'", -1, &query, NULL))
    return 1;
  if (sqlite3_step(query) == SQLITE_ROW) run = sqlite3_column_int(query, 0);
  sqlite3_finalize(query);
  return run;
}

/* Whether the statement, which must be a single one, is valid. */
static int is_valid(flesh_study_store *store, const char *sql)
{
  sqlite3_stmt *query = NULL;
  const char *rest = "";
  int code = sqlite3_prepare_v2(store->database, sql, -1, &query, &rest);
  sqlite3_finalize(query);
  return !code && !rest[strspn(rest, " \t\r\n;")];
}

/* Puts the derived columns around the select in *sql. */
static int derive(flesh_study_store *store, char **sql, int *bad)
{
  sqlite3_stmt *query;
  int status = flesh_study_store_prepare(store, "SELECT name, expression FROM derived ORDER BY number", &query);
  for (int number = 0; !status && sqlite3_step(query) == SQLITE_ROW; number++) {
    const char *name = (const char *)sqlite3_column_text(query, 0), *is = (const char *)sqlite3_column_text(query, 1);
    char *inner = sqlite3_mprintf("SELECT (%s\n) FROM (%s)", is, *sql);
    char *outer = sqlite3_mprintf("SELECT *, (%s\n) AS \"%w\" FROM (%s)", is, name, *sql);
    if (!inner || !outer) status = no_memory();
    else if (!is_valid(store, inner)) {
      *bad = number;
      status = flesh_fail(FLESH_ERR_ARGUMENT, "the column %s is '%s'; it must be an expression of SQLite: %s", name, is,
                          sqlite3_errmsg(store->database));
    }
    sqlite3_free(inner);
    if (status) sqlite3_free(outer);
    else {
      sqlite3_free(*sql);
      *sql = outer;
    }
  }
  sqlite3_finalize(query);
  return status;
}

/* Makes the view where it is not as it should be. */
static int replace_view(flesh_study_store *store, const char *name, const char *select)
{
  sqlite3_stmt *query;
  char *sql = sqlite3_mprintf("CREATE VIEW %s AS %s", name, select);
  int status =
      sql ? flesh_study_store_prepare(store, "SELECT 1 FROM sqlite_master WHERE name = ?1 AND sql = ?2", &query)
          : no_memory();
  if (status) {
    sqlite3_free(sql);
    return status;
  }
  sqlite3_bind_text(query, 1, name, -1, SQLITE_STATIC);
  sqlite3_bind_text(query, 2, sql, -1, SQLITE_STATIC);
  int same = sqlite3_step(query) == SQLITE_ROW;
  sqlite3_finalize(query);
  char *drop = sqlite3_mprintf("DROP VIEW IF EXISTS %s", name);
  if (!same) status = flesh_study_store_execute(store, drop);
  if (!same && !status) status = flesh_study_store_execute(store, sql);
  sqlite3_free(drop);
  sqlite3_free(sql);
  return status;
}

int flesh_study_views_write(flesh_study_store *store, int *bad)
{
  int run = is_run(store), status = FLESH_OK, derived = FLESH_OK;
  char words[1024] = "";
  *bad = -1;
  for (int view = 0; !status && view < 2; view++) {
    flesh_text text = {0};
    status = view ? print_rows(store, &text) : print_results(store, &text);
    char *sql = status || text.failed ? NULL : sqlite3_mprintf("%s", text.data);
    free(text.data);
    if (!status && !sql) status = no_memory();
    /* A column that cannot be derived leaves the others as they are. */
    if (!status && view != run && (derived = derive(store, &sql, bad)))
      snprintf(words, sizeof words, "%s", flesh_error_text());
    if (!status) status = replace_view(store, view ? "rows" : "results", sql);
    sqlite3_free(sql);
  }
  return status || !derived ? status : flesh_fail(derived, "%s", words);
}

int flesh_study_store_make_views(flesh_study_store *store)
{
  int bad, status = flesh_study_store_execute(store, "BEGIN IMMEDIATE");
  if (status) return status;
  status = flesh_study_views_write(store, &bad);
  char words[1024];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  int ended = flesh_study_store_execute(store, status && bad < 0 ? "ROLLBACK" : "COMMIT");
  return status ? flesh_fail(status, "%s", words) : ended;
}
