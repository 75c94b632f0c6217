/* store_plan.c: writes the cases of a study as rows of its database; a case is found again by the values of its
 * columns. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "scene/words.h"
#include "study/database.h"
#include "study/tables.h"

void flesh_study_case_free(flesh_study_case *made)
{
  flesh_overrides_close(&made->overrides);
  free(made->owned);
  *made = (flesh_study_case){0};
}

static void bind_value(sqlite3_stmt *statement, int at, const char *value, const flesh_node *node)
{
  double number;
  if (node && node->kind == FLESH_NODE_SCALAR) value = node->text;
  if (!(node && node->quoted) && flesh_number_parse(value, &number) && isfinite(number)) {
    if (number == floor(number) && fabs(number) < 1e15 && !strpbrk(value, ".eE/"))
      sqlite3_bind_int64(statement, at, (sqlite3_int64)number);
    else sqlite3_bind_double(statement, at, number);
  } else {
    sqlite3_bind_text(statement, at, value, -1, SQLITE_TRANSIENT);
  }
}

static void print_list(flesh_text *text, int count, const char *const *values)
{
  flesh_text_print(text, "[");
  for (int k = 0; k < count; k++) {
    if (k) flesh_text_print(text, ", ");
    flesh_text_quote(text, values[k]);
  }
  flesh_text_print(text, "]");
}

/* The prepared statements, which serve one case after another. */
typedef struct planner {
  const flesh_study *study;
  flesh_study_store *store;
  sqlite3_stmt *find, *insert, *want;
} planner;

/* Finds the id of a key, 0 if there is none. Returns SQLite's code. */
static int find(planner *p, const char *key, sqlite3_int64 *id)
{
  *id = 0;
  sqlite3_bind_text(p->find, 1, key, -1, SQLITE_TRANSIENT);
  int code = sqlite3_step(p->find);
  if (code == SQLITE_ROW) *id = sqlite3_column_int64(p->find, 0);
  sqlite3_reset(p->find);
  return code == SQLITE_ROW ? SQLITE_DONE : code;
}

/* Inserts a case. In a new database its id is its number plus one, so that shards agree on it. */
static int insert(planner *p, int number, const flesh_study_case *c, const char *key, const char *overrides)
{
  int at = 1;
  sqlite3_bind_int(p->insert, at++, number + 1);
  sqlite3_bind_text(p->insert, at++, key, -1, SQLITE_TRANSIENT);
  for (int k = 0; p->study->columns[k].name; k++)
    if (!p->study->columns[k].hidden) bind_value(p->insert, at++, c->values[k], c->nodes[k]);
  if (p->study->repeats > 1) sqlite3_bind_int(p->insert, at++, c->repeat);
  sqlite3_bind_text(p->insert, at++, c->scene, -1, SQLITE_TRANSIENT);
  sqlite3_bind_text(p->insert, at++, overrides, -1, SQLITE_TRANSIENT);
  const int code = sqlite3_step(p->insert);
  sqlite3_reset(p->insert);
  return code;
}

static int plan_case(planner *p, int number)
{
  flesh_study_case c;
  flesh_text key = {0}, overrides = {0};
  sqlite3_int64 id = 0;
  int status = p->study->make(p->study->data, number, &c);
  if (status) return status;
  int columns = 0;
  while (p->study->columns[columns].name) columns++;
  print_list(&key, columns, c.values);
  if (p->study->repeats > 1) flesh_text_print(&key, " %d", c.repeat);
  print_list(&overrides, c.overrides.texts.count, c.overrides.texts.values);
  if (key.failed || overrides.failed) status = flesh_no_memory();
  int code = status ? SQLITE_DONE : find(p, key.data, &id);
  if (!status && code == SQLITE_DONE && !id) {
    code = insert(p, number, &c, key.data, overrides.data);
    id = sqlite3_last_insert_rowid(p->store->database);
  }
  if (!status && code == SQLITE_DONE) code = flesh_database_put(p->want, "li", id, number);
  if (code != SQLITE_DONE) status = flesh_study_store_fail(p->store, "cannot be written");
  free(key.data);
  free(overrides.data);
  flesh_study_case_free(&c);
  return status;
}

static int prepare(planner *p)
{
  flesh_text sql = {0};
  int columns = 2 + (p->study->repeats > 1);
  flesh_text_print(&sql, "INSERT INTO cases (id, case_key");
  for (int c = 0; p->study->columns[c].name; c++) {
    if (p->study->columns[c].hidden) continue;
    flesh_text_print(&sql, ", \"%s\"", p->study->columns[c].name);
    columns++;
  }
  flesh_text_print(&sql, "%s, scene, overrides, status) VALUES "
                         "(CASE WHEN EXISTS (SELECT 1 FROM cases WHERE id = ?1) THEN NULL ELSE ?1 END, ?",
                   p->study->repeats > 1 ? ", repeat" : "");
  for (int c = 0; c < columns; c++) flesh_text_print(&sql, ", ?");
  flesh_text_print(&sql, ", 'planned')");
  int status = sql.failed ? flesh_no_memory()
                          : flesh_study_store_prepare(p->store, sql.data, &p->insert);
  free(sql.data);
  if (!status) status = flesh_study_store_prepare(p->store, "SELECT id FROM cases WHERE case_key = ?", &p->find);
  if (!status) status = flesh_study_store_prepare(p->store, "INSERT OR IGNORE INTO temp.wanted VALUES (?, ?)", &p->want);
  return status;
}

/* Plans every `stride`-th case from `first` to before `end`. */
static int plan_cases(flesh_study_store *store, const flesh_study *study, int first, int end, int stride)
{
  planner p = {.study = study, .store = store};
  int status = prepare(&p);
  for (int number = first; !status && number < end; number += stride) status = plan_case(&p, number);
  sqlite3_finalize(p.find);
  sqlite3_finalize(p.insert);
  sqlite3_finalize(p.want);
  return status;
}

int flesh_study_store_plan(flesh_study_store *store, const flesh_study *study)
{
  const int status =
      flesh_study_store_execute(store, "CREATE TEMP TABLE wanted (id INTEGER PRIMARY KEY, number INTEGER UNIQUE)");
  return status ? status : plan_cases(store, study, store->shard - 1, study->case_count, store->shards);
}

int flesh_study_store_want(flesh_study_store *store, const flesh_study *study, int number)
{
  int status = flesh_study_store_execute(store, "BEGIN IMMEDIATE");
  if (status) return status;
  status = plan_cases(store, study, number, number + 1, 1);
  if (!status && study->again) status = flesh_study_store_redo(store, study->again, number);
  return flesh_study_store_end(store, status);
}

int flesh_study_store_redo(flesh_study_store *store, const char *condition, int number)
{
  return flesh_study_store_execute(store, "UPDATE cases SET status = 'planned', worker = NULL, started = NULL WHERE (%s) AND "
                                   "status <> 'running' AND id IN (SELECT id FROM temp.wanted WHERE %d IN (number, -1))",
                                   condition, number);
}
