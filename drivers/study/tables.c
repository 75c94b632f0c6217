/* tables.c: creates the tables of a study's database, and the views `results` and `rows` that expand its JSON into
 * columns. */
#include "study/tables.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"

/* Names and expressions of the columns that `results` has in every study: before and behind the figures. */
#define FIRST_COLUMNS                                                                                     \
  "VALUES ('status', 'c.status'), ('exit_code', 'c.exit_code'), ('message', 'c.message'), "               \
  "('reason', 'json_extract(c.result, ''$.failure.reason'')'), "                                          \
  "('failed_at', 'json_extract(c.result, ''$.failure.t'')')"
#define LAST_COLUMNS                                                                                      \
  "VALUES ('nodes', 'json_extract(c.result, ''$.inputs.mesh.nodes'')'), "                                 \
  "('tets', 'json_extract(c.result, ''$.inputs.mesh.tets'')'), ('seconds', 'c.seconds'), "                \
  "('started', 'c.started'), ('worker', 'c.worker'), ('host', 'w.host'), "                                \
  "('flesh_commit', 'json_extract(w.program, ''$.commit'')')"

/* Name of the column that a figure's path, such as a probe's, becomes. */
#define COLUMN_NAME                                                                                       \
  "CASE WHEN path GLOB 'energies.*' THEN 'energy_' || substr(path, 10) "                                  \
  "WHEN path GLOB 'probes.*' THEN replace(replace(replace(substr(path, 8), '\"', ''), '.', '_'), '-', '_') ELSE path END"

/* Returns whether `results`, or the table of cases, has a column with that name, in letters of either case. */
static int is_taken(flesh_study_store *store, const char *name)
{
  return flesh_study_store_number(
      store,
      "SELECT count(*) FROM (" FIRST_COLUMNS " UNION ALL " LAST_COLUMNS " UNION ALL SELECT " COLUMN_NAME ", '' FROM figures "
      "UNION ALL SELECT name, '' FROM parameters UNION ALL SELECT name, '' FROM derived "
      "UNION ALL SELECT value, '' FROM json_each('[\"id\", \"repeat\", \"scene\", \"overrides\", \"result\", \"case_id\", "
      "\"number\", \"case_key\"]')) WHERE lower(column1) = lower(%Q) OR lower(%Q) GLOB 'energy_*'",
      name, name);
}

/* Adds paths of the figures in JSON objects `result` of a table of cases. */
#define ADD_FIGURES                                                                                       \
  "INSERT OR IGNORE INTO figures (path) SELECT DISTINCT CASE f.path WHEN '$.figures' THEN f.key "         \
  "WHEN '$.figures.energies' THEN 'energies.' || f.key ELSE substr(f.path, 11) || '.' || f.key END "      \
  "FROM %s AS c, json_tree(c.result, '$.figures') AS f WHERE f.type <> 'object' AND "                     \
  "(f.path = '$.figures' AND f.key NOT GLOB '*[^A-Za-z0-9_]*' OR f.path = '$.figures.energies' "          \
  "OR f.path GLOB '$.figures.probes.*' AND f.key <> 'unit')"

/* Writes the names of the figures, an array or an object with them, and of the columns. */
static int write_names(flesh_study_store *store, const flesh_study *study, json_t *figures)
{
  int status = FLESH_OK;
  size_t index;
  const json_t *value;
  json_array_foreach(figures, index, value)
    if (!status)
      status = flesh_study_store_execute(store, "INSERT INTO figures VALUES (%d, %Q)", (int)index, json_string_value(value));
  char *text = json_is_object(figures) ? json_dumps(figures, JSON_COMPACT) : NULL;
  char *source = sqlite3_mprintf("(SELECT json_object('figures', json(%Q)) AS result)", text);
  if (text && !status) status = flesh_study_store_execute(store, ADD_FIGURES, source);
  free(text);
  sqlite3_free(source);
  for (int c = 0; !status && study->columns[c].name; c++) {
    const flesh_study_column *column = &study->columns[c];
    if (!column->hidden && is_taken(store, column->name))
      return flesh_node_fail(column->place,
                             "the column %s would be named like one of the results; give the axis another name", column->name);
    status = flesh_study_store_execute(store, "INSERT INTO parameters VALUES (%d, %Q, %Q)", c, column->name, column->key);
  }
  return status;
}

int flesh_study_tables_create(flesh_study_store *store, const flesh_study *study)
{
  flesh_text columns = {0};
  json_t *figures = study->fields ? flesh_fields_names(study->fields) : study->figures(study->data);
  int status = flesh_study_store_execute(
      store, "CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT);\n"
             "CREATE TABLE parameters (number INTEGER PRIMARY KEY, name TEXT, key TEXT);\n"
             "CREATE TABLE derived (number INTEGER PRIMARY KEY, name TEXT, expression TEXT);\n"
             "CREATE TABLE figures (number INTEGER PRIMARY KEY, path TEXT UNIQUE);\n"
             "CREATE TABLE workers (name TEXT PRIMARY KEY, host TEXT, pid INTEGER, lock TEXT, started TEXT, program TEXT);\n"
             "CREATE TABLE table_rows (case_id INTEGER, number INTEGER, data TEXT, PRIMARY KEY (case_id, number)) WITHOUT ROWID");
  if (!status) status = write_names(store, study, figures);
  json_decref(figures);
  for (int c = 0; study->columns[c].name; c++)
    if (!study->columns[c].hidden) flesh_text_print(&columns, ", \"%s\"", study->columns[c].name);
  flesh_text_print(&columns, "%s", study->repeats > 1 ? ", repeat INTEGER" : "");
  if (!status && columns.failed) status = flesh_no_memory();
  if (!status)
    status = flesh_study_store_execute(
        store, "CREATE TABLE cases (id INTEGER PRIMARY KEY%s, status TEXT NOT NULL, exit_code INTEGER, message TEXT, "
               "seconds REAL, started TEXT, worker TEXT, scene TEXT, overrides TEXT, result TEXT, case_key TEXT UNIQUE);\n"
               "CREATE INDEX cases_by_status ON cases (status, id)", columns.data);
  free(columns.data);
  return status;
}

int flesh_study_derived_write(flesh_study_store *store, const flesh_study *study)
{
  int status = flesh_study_store_execute(store, "DELETE FROM derived");
  for (int d = 0; !status && d < study->derived_count; d++) {
    const flesh_study_derived *derived = &study->derived[d];
    if (is_taken(store, derived->name))
      return flesh_node_fail(derived->node, "name is %s; that column is there already", derived->name);
    status = flesh_study_store_execute(store, "INSERT INTO derived VALUES (%d, %Q, %Q)", d, derived->name, derived->expression);
  }
  return status;
}

/* Prints a column for each row of a query that returns a name and an expression. */
static int print_columns(flesh_study_store *store, const char *sql, flesh_text *text)
{
  sqlite3_stmt *query;
  int status = flesh_study_store_prepare(store, sql, &query), code = SQLITE_DONE;
  while (!status && (code = sqlite3_step(query)) == SQLITE_ROW)
    flesh_text_print(text, ", %s AS \"%s\"", (const char *)sqlite3_column_text(query, 1),
                     (const char *)sqlite3_column_text(query, 0));
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
  int status = print_columns(store, axes_sql, text);
  if (!status) status = print_columns(store, FIRST_COLUMNS, text);
  if (!status) status = flesh_study_store_execute(store, ADD_FIGURES, "cases"); /* interrupted studies may have no names yet */
  if (!status)
    status = print_columns(store,
                      "SELECT " COLUMN_NAME ", "
                      "'json_extract(c.result, ''$.figures.' || path || ''')' FROM figures ORDER BY number",
                      text);
  if (!status) status = print_columns(store, LAST_COLUMNS, text);
  flesh_text_print(text, " FROM cases c LEFT JOIN workers w ON w.name = c.worker");
  return status;
}

static int print_rows(flesh_study_store *store, flesh_text *text)
{
  flesh_text_print(text, "SELECT r.case_id AS case_id, r.number AS number");
  int status = print_columns(store, axes_sql, text);
  if (!status)
    status = print_columns(store,
                      "SELECT CASE WHEN lower(key) IN (SELECT lower(name) FROM parameters) OR "
                      "lower(key) IN ('case_id', 'number', 'repeat') THEN 'row_' ELSE '' END || key, "
                      "'json_extract(r.data, ''$.\"' || key || '\"'')' FROM (SELECT key, min(json_each.id) AS place "
                      "FROM table_rows, json_each(table_rows.data) GROUP BY key ORDER BY place)",
                      text);
  flesh_text_print(text, " FROM table_rows r JOIN cases c ON c.id = r.case_id");
  return status;
}

/* Returns whether the text is a single valid statement. */
static int is_valid(flesh_study_store *store, const char *sql)
{
  sqlite3_stmt *query = NULL;
  const char *rest = "";
  int code = sqlite3_prepare_v2(store->database, sql, -1, &query, &rest);
  sqlite3_finalize(query);
  return !code && !rest[strspn(rest, " \t\r\n;")];
}

/* Wraps the select in *sql into one that adds the derived columns. */
static int derive(flesh_study_store *store, char **sql, int *bad)
{
  sqlite3_stmt *query;
  int status = flesh_study_store_prepare(store, "SELECT name, expression FROM derived ORDER BY number", &query);
  for (int number = 0; !status && sqlite3_step(query) == SQLITE_ROW; number++) {
    const char *name = (const char *)sqlite3_column_text(query, 0), *is = (const char *)sqlite3_column_text(query, 1);
    char words[FLESH_STUDY_WORDS], *table = sqlite3_mprintf("(%s)", *sql);
    char *inner = sqlite3_mprintf("SELECT (%s\n) FROM %s", is, table);
    char *outer = sqlite3_mprintf("SELECT *, (%s\n) AS \"%w\" FROM (%s)", is, name, *sql);
    if (!table || !inner || !outer) status = flesh_no_memory();
    else if (!is_valid(store, inner)) {
      *bad = number;
      status = flesh_fail(FLESH_ERR_ARGUMENT, "the column %s is '%s'; it must be an expression of SQLite: %s", name, is,
                          sqlite3_errcode(store->database) ? flesh_study_store_words(store, table, words)
                                                           : "it is more than one");
    }
    sqlite3_free(table);
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

/* Creates the view again if it differs from `select`. */
static int replace_view(flesh_study_store *store, const char *name, const char *select)
{
  if (flesh_study_store_number(store, "SELECT 1 FROM sqlite_master WHERE name = %Q AND sql = 'CREATE VIEW %q AS %q'", name,
                               name, select))
    return FLESH_OK;
  const int status = flesh_study_store_execute(store, "DROP VIEW IF EXISTS %s", name);
  return status ? status : flesh_study_store_execute(store, "CREATE VIEW %s AS %s", name, select);
}

int flesh_study_views_write(flesh_study_store *store, int *bad)
{
  int status = FLESH_OK, derived = FLESH_OK;
  *bad = -1;
  for (int view = 0; !status && view < 2; view++) {
    flesh_text text = {0};
    status = view ? print_rows(store, &text) : print_results(store, &text);
    char *sql = status || text.failed ? NULL : sqlite3_mprintf("%s", text.data);
    free(text.data);
    if (!status && !sql) status = flesh_no_memory();
    /* If a derived column fails, the other columns are still made. */
    if (!status && !view) derived = derive(store, &sql, bad);
    if (!status) status = replace_view(store, view ? "rows" : "results", sql);
    sqlite3_free(sql);
  }
  return status ? status : derived;
}

int flesh_study_store_make_views(flesh_study_store *store)
{
  int bad, status = flesh_study_store_execute(store, "BEGIN IMMEDIATE");
  if (status) return status;
  status = flesh_study_views_write(store, &bad);
  const int ended = flesh_study_store_end(store, bad < 0 ? status : FLESH_OK);
  return ended ? ended : status;
}
