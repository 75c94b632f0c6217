/* tables.c: makes the tables of a sweep's database, and the views that spread its JSON into columns. */
#include "sweep/tables.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/error.h"
#include "run/result.h"

const char *const flesh_sweep_case_columns[][2] = {{"status", "c.status"},
                                              {"exit_code", "c.exit_code"},
                                              {"message", "c.message"},
                                              {"reason", "json_extract(c.result, '$.failure.reason')"},
                                              {"failed_at", "json_extract(c.result, '$.failure.t')"},
                                              {NULL}};
const char *const flesh_sweep_last_columns[][2] = {{"nodes", "json_extract(c.result, '$.inputs.mesh.nodes')"},
                                              {"tets", "json_extract(c.result, '$.inputs.mesh.tets')"},
                                              {"seconds", "c.seconds"},
                                              {"started", "c.started"},
                                              {"worker", "c.worker"},
                                              {"host", "w.host"},
                                              {"flesh_commit", "json_extract(w.program, '$.commit')"},
                                              {NULL}};

/* Figures of result.json and the energies of the first case's scene, as "name" and "energies.name". */
static json_t *figure_names(const flesh_sweep *sweep)
{
  json_t *names = json_array(), *figures = NULL, *value;
  flesh_scene *scene = NULL;
  flesh_figures empty = {0};
  const char *key, *inner;
  flesh_sweep_case c;
  if (flesh_sweep_case_make(sweep, 1, &c)) return names;
  if (!flesh_scene_read(c.scene, c.count, c.overrides, &scene) &&
      !flesh_figures_open(&empty, flesh_scene_system(scene)))
    figures = flesh_figures_json(&empty, flesh_scene_system(scene));
  json_object_foreach(figures, key, value) {
    json_t *below;
    if (!json_is_object(value)) json_array_append_new(names, json_string(key));
    else json_object_foreach(value, inner, below) json_array_append_new(names, json_sprintf("energies.%s", inner));
  }
  json_decref(figures);
  flesh_figures_close(&empty);
  flesh_scene_destroy(&scene);
  flesh_sweep_case_free(&c);
  return names;
}

static int is_taken(const json_t *names, const char *name)
{
  static const char *const own[] = {"id", "repeat", "scene", "overrides", "result", "case_id", "number"};
  size_t index;
  const json_t *value;
  for (size_t k = 0; k < sizeof own / sizeof *own; k++)
    if (!strcasecmp(own[k], name)) return 1;
  for (int k = 0; flesh_sweep_case_columns[k][0]; k++)
    if (!strcasecmp(flesh_sweep_case_columns[k][0], name)) return 1;
  for (int k = 0; flesh_sweep_last_columns[k][0]; k++)
    if (!strcasecmp(flesh_sweep_last_columns[k][0], name)) return 1;
  json_array_foreach((json_t *)names, index, value)
    if (!strcasecmp(json_string_value(value), name)) return 1;
  return !strncasecmp(name, "energy_", 7);
}

static int check_names(const flesh_sweep *sweep, const json_t *names)
{
  for (int c = 0; c < sweep->column_count; c++)
    if (is_taken(names, sweep->columns[c].name) && !flesh_sweep_is_scene(&sweep->columns[c]))
      return flesh_node_fail(sweep->columns[c].place,
                             "the column %s would be named like one of the results; give the axis another name",
                             sweep->columns[c].name);
  for (int d = 0; d < sweep->derived_count; d++) {
    int taken = is_taken(names, sweep->derived[d].name);
    for (int c = 0; !taken && c < sweep->column_count; c++)
      taken = !strcasecmp(sweep->columns[c].name, sweep->derived[d].name);
    for (int c = 0; !taken && c < d; c++) taken = !strcasecmp(sweep->derived[c].name, sweep->derived[d].name);
    if (taken)
      return flesh_node_fail(sweep->derived[d].node, "name is %s; that column is there already",
                             sweep->derived[d].name);
  }
  return FLESH_OK;
}

static int insert_named(flesh_sweep_store *store, const char *table, int number, const char *name, const char *text)
{
  char *sql = sqlite3_mprintf("INSERT INTO %s VALUES (%d, %Q, %Q)", table, number, name, text);
  int status = sql ? flesh_sweep_store_execute(store, sql) : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  sqlite3_free(sql);
  return status;
}

int flesh_sweep_tables_create(flesh_sweep_store *store, const flesh_sweep *sweep)
{
  flesh_text sql = {0};
  json_t *names = sweep->command == FLESH_SWEEP_RUN ? figure_names(sweep) : json_array();
  int status = check_names(sweep, names);
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
  for (int c = 0; c < sweep->column_count; c++)
    if (!flesh_sweep_is_scene(&sweep->columns[c])) flesh_text_print(&sql, ", \"%s\"", sweep->columns[c].name);
  flesh_text_print(
      &sql,
      "%s, status TEXT NOT NULL, exit_code INTEGER, message TEXT, seconds REAL, started TEXT, worker TEXT, "
      "scene TEXT, overrides TEXT, result TEXT);\n"
      "CREATE INDEX cases_by_status ON cases (status, id);\n",
      sweep->repeats > 1 ? ", repeat INTEGER" : "");
  if (!status)
    status = sql.failed ? flesh_fail(FLESH_ERR_MEMORY, "out of memory") : flesh_sweep_store_execute(store, sql.data);
  free(sql.data);
  for (int c = 0; !status && c < sweep->column_count; c++)
    status = insert_named(store, "parameters", c, sweep->columns[c].name, sweep->columns[c].key);
  for (int d = 0; !status && d < sweep->derived_count; d++)
    status = insert_named(store, "derived", d, sweep->derived[d].name, sweep->derived[d].expression);
  size_t index;
  json_t *value;
  json_array_foreach(names, index, value) {
    char *insert = sqlite3_mprintf("INSERT INTO figures VALUES (%d, %Q)", (int)index, json_string_value(value));
    if (!status && insert) status = flesh_sweep_store_execute(store, insert);
    sqlite3_free(insert);
  }
  json_decref(names);
  return status;
}
