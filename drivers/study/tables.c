/* tables.c: creates the tables of a study's database, and the views `results` and `rows` that expand its JSON into
 * columns. */
#include "study/tables.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/error.h"

/* Names and expressions of the columns that `results` has in every study: before and behind the figures. */
static const char *const case_columns[][2] = {{"status", "c.status"},
                                              {"exit_code", "c.exit_code"},
                                              {"message", "c.message"},
                                              {"reason", "json_extract(c.result, '$.failure.reason')"},
                                              {"failed_at", "json_extract(c.result, '$.failure.t')"},
                                              {NULL}};
static const char *const last_columns[][2] = {{"nodes", "json_extract(c.result, '$.inputs.mesh.nodes')"},
                                              {"tets", "json_extract(c.result, '$.inputs.mesh.tets')"},
                                              {"seconds", "c.seconds"},
                                              {"started", "c.started"},
                                              {"worker", "c.worker"},
                                              {"host", "w.host"},
                                              {"flesh_commit", "json_extract(w.program, '$.commit')"},
                                              {NULL}};

/* Returns whether a figure's path, such as a probe's, becomes a column of this name; COLUMN_NAME does the same in
 * SQL. */
static int is_column_of(const char *path, const char *name)
{
  const int of_probe = !strncmp(path, "probes.", 7);
  for (path += of_probe ? 7 : 0; *path; path++) {
    if (*path == '"') continue;
    const char letter = of_probe && strchr(".-", *path) ? '_' : *path;
    if (tolower(letter) != tolower(*name++)) return 0;
  }
  return !*name;
}
#define COLUMN_NAME                                                                                       \
  "CASE WHEN path GLOB 'energies.*' THEN 'energy_' || substr(path, 10) "                                  \
  "WHEN path GLOB 'probes.*' THEN replace(replace(replace(substr(path, 8), '\"', ''), '.', '_'), '-', '_') ELSE path END"

static int is_taken(const json_t *names, const char *name)
{
  static const char *const own[] = {"id", "repeat", "scene", "overrides", "result", "case_id", "number", "case_key"};
  size_t index;
  const json_t *value;
  for (size_t k = 0; k < sizeof own / sizeof *own; k++)
    if (!strcasecmp(own[k], name)) return 1;
  for (int k = 0; case_columns[k][0]; k++)
    if (!strcasecmp(case_columns[k][0], name)) return 1;
  for (int k = 0; last_columns[k][0]; k++)
    if (!strcasecmp(last_columns[k][0], name)) return 1;
  json_array_foreach((json_t *)names, index, value)
    if (is_column_of(json_string_value(value), name)) return 1;
  return !strncasecmp(name, "energy_", 7);
}

static int check_names(const flesh_study *study, const json_t *names)
{
  for (int c = 0; study->columns[c].name; c++)
    if (is_taken(names, study->columns[c].name) && !study->columns[c].hidden)
      return flesh_node_fail(study->columns[c].place,
                             "the column %s would be named like one of the results; give the axis another name",
                             study->columns[c].name);
  for (int d = 0; d < study->derived_count; d++) {
    int taken = is_taken(names, study->derived[d].name);
    for (int c = 0; !taken && study->columns[c].name; c++)
      taken = !strcasecmp(study->columns[c].name, study->derived[d].name);
    for (int c = 0; !taken && c < d; c++) taken = !strcasecmp(study->derived[c].name, study->derived[d].name);
    if (taken)
      return flesh_node_fail(study->derived[d].node, "name is %s; that column is there already",
                             study->derived[d].name);
  }
  return FLESH_OK;
}

int flesh_study_tables_create(flesh_study_store *store, const flesh_study *study)
{
  flesh_text sql = {0};
  json_t *names = study->fields ? flesh_fields_names(study->fields) : study->figures(study->data);
  int status = check_names(study, names);
  flesh_text_print(
      &sql, "CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT);\n"
            "CREATE TABLE parameters (number INTEGER PRIMARY KEY, name TEXT, key TEXT);\n"
            "CREATE TABLE derived (number INTEGER PRIMARY KEY, name TEXT, expression TEXT);\n"
            "CREATE TABLE figures (number INTEGER PRIMARY KEY, path TEXT UNIQUE);\n"
            "CREATE TABLE workers (name TEXT PRIMARY KEY, host TEXT, pid INTEGER, lock TEXT, started TEXT, program TEXT);\n"
            "CREATE TABLE table_rows (case_id INTEGER, number INTEGER, data TEXT, PRIMARY KEY (case_id, number)) WITHOUT ROWID;\n"
            "CREATE TABLE cases (id INTEGER PRIMARY KEY");
  for (int c = 0; study->columns[c].name; c++)
    if (!study->columns[c].hidden) flesh_text_print(&sql, ", \"%s\"", study->columns[c].name);
  flesh_text_print(
      &sql,
      "%s, status TEXT NOT NULL, exit_code INTEGER, message TEXT, seconds REAL, started TEXT, worker TEXT, "
      "scene TEXT, overrides TEXT, result TEXT, case_key TEXT UNIQUE);\n"
      "CREATE INDEX cases_by_status ON cases (status, id);\n",
      study->repeats > 1 ? ", repeat INTEGER" : "");
  if (!status) status = sql.failed ? flesh_no_memory() : flesh_study_store_execute(store, "%s", sql.data);
  free(sql.data);
  for (int c = 0; !status && study->columns[c].name; c++)
    status = flesh_study_store_execute(store, "INSERT INTO parameters VALUES (%d, %Q, %Q)", c, study->columns[c].name,
                                       study->columns[c].key);
  size_t index;
  json_t *value;
  json_array_foreach(names, index, value)
    if (!status)
      status = flesh_study_store_execute(store, "INSERT INTO figures VALUES (%d, %Q)", (int)index, json_string_value(value));
  json_decref(names);
  return status;
}

int flesh_study_derived_write(flesh_study_store *store, const flesh_study *study)
{
  int status = flesh_study_store_execute(store, "DELETE FROM derived");
  for (int d = 0; !status && d < study->derived_count; d++)
    status = flesh_study_store_execute(store, "INSERT INTO derived VALUES (%d, %Q, %Q)", d, study->derived[d].name,
                                       study->derived[d].expression);
  return status;
}

static void print_column(flesh_text *text, const char *alias, const char *expression)
{
  flesh_text_print(text, ", %s AS \"%s\"", expression, alias);
}

/* Prints a column for each row of a query that returns a name and an expression. */
static int print_columns(flesh_study_store *store, const char *sql, flesh_text *text)
{
  sqlite3_stmt *query;
  int status = flesh_study_store_prepare(store, sql, &query), code = SQLITE_DONE;
  while (!status && (code = sqlite3_step(query)) == SQLITE_ROW)
    print_column(text, (const char *)sqlite3_column_text(query, 0), (const char *)sqlite3_column_text(query, 1));
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
  for (int k = 0; case_columns[k][0]; k++)
    print_column(text, case_columns[k][0], case_columns[k][1]);
  if (!status) /* a study interrupted before it had read a scene has no names */
    status = flesh_study_store_execute(
        store, "INSERT OR IGNORE INTO figures (path) SELECT DISTINCT f.key FROM cases, json_each(cases.result, '$.figures') f "
               "WHERE f.type <> 'object' AND f.key NOT GLOB '*[^A-Za-z0-9_]*';"
               "INSERT OR IGNORE INTO figures (path) SELECT DISTINCT 'energies.' || e.key "
               "FROM cases, json_each(cases.result, '$.figures.energies') e;"
               "INSERT OR IGNORE INTO figures (path) SELECT DISTINCT 'probes.\"' || p.key || '\".' || f.key FROM cases, "
               "json_each(cases.result, '$.figures.probes') p, json_each(p.value) f WHERE f.key <> 'unit'");
  if (!status)
    status = print_columns(store,
                      "SELECT " COLUMN_NAME ", "
                      "'json_extract(c.result, ''$.figures.' || path || ''')' FROM figures ORDER BY number",
                      text);
  for (int k = 0; last_columns[k][0]; k++)
    print_column(text, last_columns[k][0], last_columns[k][1]);
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
  char words[1024] = "";
  *bad = -1;
  for (int view = 0; !status && view < 2; view++) {
    flesh_text text = {0};
    status = view ? print_rows(store, &text) : print_results(store, &text);
    char *sql = status || text.failed ? NULL : sqlite3_mprintf("%s", text.data);
    free(text.data);
    if (!status && !sql) status = flesh_no_memory();
    /* If a derived column fails, the other columns are still made. */
    if (!status && !view && (derived = derive(store, &sql, bad)))
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
