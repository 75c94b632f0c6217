/* tables.c: makes the tables of a study's database, and the views that spread its JSON into columns. */
#include "study/tables.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/error.h"

const char *const flesh_study_case_columns[][2] = {{"status", "c.status"},
                                              {"exit_code", "c.exit_code"},
                                              {"message", "c.message"},
                                              {"reason", "json_extract(c.result, '$.failure.reason')"},
                                              {"failed_at", "json_extract(c.result, '$.failure.t')"},
                                              {NULL}};
const char *const flesh_study_last_columns[][2] = {{"nodes", "json_extract(c.result, '$.inputs.mesh.nodes')"},
                                              {"tets", "json_extract(c.result, '$.inputs.mesh.tets')"},
                                              {"seconds", "c.seconds"},
                                              {"started", "c.started"},
                                              {"worker", "c.worker"},
                                              {"host", "w.host"},
                                              {"flesh_commit", "json_extract(w.program, '$.commit')"},
                                              {NULL}};

static int is_taken(const json_t *names, const char *name)
{
  static const char *const own[] = {"id", "repeat", "scene", "overrides", "result", "case_id", "number", "case_key"};
  size_t index;
  const json_t *value;
  for (size_t k = 0; k < sizeof own / sizeof *own; k++)
    if (!strcasecmp(own[k], name)) return 1;
  for (int k = 0; flesh_study_case_columns[k][0]; k++)
    if (!strcasecmp(flesh_study_case_columns[k][0], name)) return 1;
  for (int k = 0; flesh_study_last_columns[k][0]; k++)
    if (!strcasecmp(flesh_study_last_columns[k][0], name)) return 1;
  json_array_foreach((json_t *)names, index, value)
    if (!strcasecmp(json_string_value(value), name)) return 1;
  return !strncasecmp(name, "energy_", 7);
}

static int check_names(const flesh_study *study, const json_t *names)
{
  for (int c = 0; c < study->column_count; c++)
    if (is_taken(names, study->columns[c].name) && !study->columns[c].hidden)
      return flesh_node_fail(study->columns[c].place,
                             "the column %s would be named like one of the results; give the axis another name",
                             study->columns[c].name);
  for (int d = 0; d < study->derived_count; d++) {
    int taken = is_taken(names, study->derived[d].name);
    for (int c = 0; !taken && c < study->column_count; c++)
      taken = !strcasecmp(study->columns[c].name, study->derived[d].name);
    for (int c = 0; !taken && c < d; c++) taken = !strcasecmp(study->derived[c].name, study->derived[d].name);
    if (taken)
      return flesh_node_fail(study->derived[d].node, "name is %s; that column is there already",
                             study->derived[d].name);
  }
  return FLESH_OK;
}

static int insert_named(flesh_study_store *store, const char *table, int number, const char *name, const char *text)
{
  char *sql = sqlite3_mprintf("INSERT INTO %s VALUES (%d, %Q, %Q)", table, number, name, text);
  int status = sql ? flesh_study_store_execute(store, sql) : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  sqlite3_free(sql);
  return status;
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
            "CREATE TABLE workers (name TEXT PRIMARY KEY, host TEXT, pid INTEGER, lock TEXT, started TEXT, "
            "program TEXT);\n"
            "CREATE TABLE table_rows (case_id INTEGER, number INTEGER, data TEXT, PRIMARY KEY (case_id, number)) "
            "WITHOUT ROWID;\n"
            "CREATE TABLE cases (id INTEGER PRIMARY KEY");
  for (int c = 0; c < study->column_count; c++)
    if (!study->columns[c].hidden) flesh_text_print(&sql, ", \"%s\"", study->columns[c].name);
  flesh_text_print(
      &sql,
      "%s, status TEXT NOT NULL, exit_code INTEGER, message TEXT, seconds REAL, started TEXT, worker TEXT, "
      "scene TEXT, overrides TEXT, result TEXT, case_key TEXT UNIQUE);\n"
      "CREATE INDEX cases_by_status ON cases (status, id);\n",
      study->repeats > 1 ? ", repeat INTEGER" : "");
  if (!status)
    status = sql.failed ? flesh_fail(FLESH_ERR_MEMORY, "out of memory") : flesh_study_store_execute(store, sql.data);
  free(sql.data);
  for (int c = 0; !status && c < study->column_count; c++)
    status = insert_named(store, "parameters", c, study->columns[c].name, study->columns[c].key);
  for (int d = 0; !status && d < study->derived_count; d++)
    status = insert_named(store, "derived", d, study->derived[d].name, study->derived[d].expression);
  size_t index;
  json_t *value;
  json_array_foreach(names, index, value) {
    char *insert = sqlite3_mprintf("INSERT INTO figures VALUES (%d, %Q)", (int)index, json_string_value(value));
    if (!status && insert) status = flesh_study_store_execute(store, insert);
    sqlite3_free(insert);
  }
  json_decref(names);
  return status;
}
