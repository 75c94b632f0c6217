/* store_cases.c: the cases in the database of a study: writes them as rows, which are found again by the values of their
 * columns, and which the processes that work on the study claim, finish, release, recover, count and read. */
#include <dirent.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/file.h"
#include "cli/json_memory.h"
#include "scene/words.h"
#include "study/database.h"
#include "study/tables.h"

void flesh_study_case_free(flesh_study_case *made)
{
  flesh_overrides_close(&made->overrides);
  flesh_arena_free(&made->arena);
  *made = (flesh_study_case){0};
}

const char *flesh_study_case_number(flesh_study_case *made, double number)
{
  char text[FLESH_NUMBER_SIZE];
  return flesh_arena_print(&made->arena, "%s", flesh_number_text(number, text));
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
  sqlite3_stmt *insert, *want;
} planner;

/* Inserts a case unless there is one with this key. In a new database its id is its number plus one, so that shards agree
 * on it. Returns SQLite's code. */
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
  int columns = 0, code = SQLITE_DONE, status = p->study->make(p->study->data, number, &c);
  if (status) return status;
  for (; p->study->columns[columns].name; columns++)
    if (!c.values[columns]) status = flesh_no_memory();
  if (!status) print_list(&key, columns, c.values);
  if (p->study->repeats > 1) flesh_text_print(&key, " %d", c.repeat);
  print_list(&overrides, c.overrides.texts.count, c.overrides.texts.values);
  if (key.failed || overrides.failed || c.overrides.failed) status = flesh_no_memory();
  if (!status) code = insert(p, number, &c, key.data, overrides.data);
  if (!status && code == SQLITE_DONE) code = flesh_database_put(p->want, "it", number, key.data);
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
  flesh_text_print(&sql, "INSERT OR IGNORE INTO cases (id, case_key");
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
  return status ? status
                : flesh_study_store_prepare(
                      p->store, "INSERT OR IGNORE INTO temp.wanted SELECT id, ?1 FROM cases WHERE case_key = ?2", &p->want);
}

/* Plans every `stride`-th case from `first` to before `end`. */
static int plan_cases(flesh_study_store *store, const flesh_study *study, int first, int end, int stride)
{
  planner p = {.study = study, .store = store};
  int status = prepare(&p);
  for (int number = first; !status && number < end; number += stride) status = plan_case(&p, number);
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
  return flesh_study_store_execute(store, FLESH_STUDY_PLAN_AGAIN "(%s) AND status <> 'running' AND id IN "
                                   "(SELECT id FROM temp.wanted WHERE %d IN (number, -1))", condition, number);
}

static int claim(flesh_study_store *store, int *number)
{
  static const char sql[] =
      "UPDATE cases SET status = 'running', worker = ?1, started = strftime('%Y-%m-%dT%H:%M:%fZ', 'now') "
      "WHERE id = (SELECT id FROM cases WHERE status = 'planned' AND EXISTS (SELECT 1 FROM temp.wanted w "
      "WHERE w.id = cases.id AND w.number >= ?2 AND w.number < ?3) ORDER BY id LIMIT 1) "
      "RETURNING (SELECT number FROM temp.wanted w WHERE w.id = cases.id)";
  sqlite3_stmt *query;
  int status = flesh_study_store_prepare(store, sql, &query);
  *number = -1;
  if (status) return status;
  sqlite3_bind_text(query, 1, store->worker, -1, SQLITE_STATIC);
  sqlite3_bind_int(query, 2, store->first);
  sqlite3_bind_int(query, 3, store->end);
  int code = sqlite3_step(query);
  if (code == SQLITE_ROW) {
    *number = sqlite3_column_int(query, 0);
    code = sqlite3_step(query);
  }
  if (code != SQLITE_DONE) status = flesh_study_store_fail(store, "cannot be written");
  sqlite3_finalize(query);
  return status;
}

int flesh_study_store_claim(flesh_study_store *store, int *number)
{
  *number = -1;
  int status = flesh_study_store_execute(store, "BEGIN IMMEDIATE");
  return status ? status : flesh_study_store_end(store, claim(store, number));
}

static int write_rows(flesh_study_store *store, int number, const json_t *rows)
{
  size_t index;
  const json_t *row;
  int status = FLESH_OK;
  json_array_foreach((json_t *)rows, index, row) {
    char *text = json_dumps(row, JSON_COMPACT);
    if (!status)
      status = flesh_study_store_execute(store, "INSERT OR REPLACE INTO table_rows VALUES ((SELECT id FROM temp.wanted WHERE "
                                         "number = %d), %d, %Q)", number, (int)index + 1, text);
    free(text);
  }
  return status;
}

static int write_record(flesh_study_store *store, int number, const json_t *record, double seconds)
{
  const json_t *result = json_object_get(record, "result");
  char *text = json_is_object(result) ? json_dumps(result, JSON_COMPACT) : NULL;
  const int status = flesh_study_store_execute(
      store, "UPDATE cases SET status = %Q, exit_code = %d, message = %Q, seconds = %!.17g, result = %Q "
      "WHERE id = (SELECT id FROM temp.wanted WHERE number = %d) AND worker = %Q",
      json_string_value(json_object_get(record, "status")), (int)json_integer_value(json_object_get(record, "exit_code")),
      json_string_value(json_object_get(record, "message")), seconds, text, number, store->worker);
  free(text);
  return status ? status : write_rows(store, number, json_object_get(record, "rows"));
}

int flesh_study_store_finish(flesh_study_store *store, int number, const json_t *record, double seconds, int *next)
{
  if (next) *next = -1;
  int status = flesh_study_store_execute(store, "BEGIN IMMEDIATE");
  if (status) return status;
  status = write_record(store, number, record, seconds);
  if (!status && next) status = claim(store, next);
  return flesh_study_store_end(store, status);
}

int flesh_study_store_release(flesh_study_store *store, int number)
{
  return flesh_study_store_execute(store, FLESH_STUDY_PLAN_AGAIN "id = (SELECT id FROM temp.wanted WHERE number = %d) AND "
                                   "worker = %Q AND status = 'running'", number, store->worker);
}

/* Returns whether the name is .study-<process>-<time>.lock, without a folder: whoever wrote a database chose the names
 * in it. */
static int is_lock(const char *name)
{
  const size_t length = strlen(name);
  return !strncmp(name, ".study-", 7) && length > 12 && !strcmp(name + length - 5, ".lock") && !strchr(name, '/');
}

/* Returns whether the process that holds the lock file lives; else removes the file. Called within a transaction, in
 * which lock files are also made. */
static int lives(const flesh_study_store *store, const char *lock)
{
  if (!is_lock(lock)) return 0;
  const char *path = flesh_study_store_beside(store, lock);
  int file = flesh_path_open(path, O_RDWR | O_NOFOLLOW | O_NONBLOCK, 0), living = 0;
  if (file >= 0) {
    living = flock(file, LOCK_EX | LOCK_NB) != 0;
    if (!living) flesh_path_unlink(path);
    close(file);
  }
  return living;
}

/* Removes the lock files of processes that were killed. */
static void clean(const flesh_study_store *store)
{
  DIR *list = flesh_path_list(flesh_study_store_beside(store, "."));
  if (!list) return;
  for (struct dirent *entry; (entry = readdir(list));) lives(store, entry->d_name);
  closedir(list);
}

/* Implements lives(lock) for the SQL below. */
static void call_lives(sqlite3_context *context, int count, sqlite3_value **values)
{
  (void)count;
  const char *lock = (const char *)sqlite3_value_text(values[0]);
  sqlite3_result_int(context, lock && lives(sqlite3_user_data(context), lock));
}

static int recover(flesh_study_store *store, int *count, int *running)
{
  clean(store);
  if (sqlite3_create_function(store->database, "lives", 1, SQLITE_UTF8, store, call_lives, NULL, NULL)) return flesh_no_memory();
  const int status = flesh_study_store_execute(
      store, FLESH_STUDY_PLAN_AGAIN "status = 'running' AND worker IS NOT %Q AND "
      "NOT lives((SELECT w.lock FROM workers w WHERE w.name = cases.worker))", store->worker);
  *count = status ? 0 : sqlite3_changes(store->database);
  *running = flesh_study_store_number(store, "SELECT count(*) FROM cases WHERE status = 'running' AND worker IS NOT %Q",
                                      store->worker);
  return status;
}

int flesh_study_store_recover(flesh_study_store *store, int *count, int *running)
{
  *count = *running = 0;
  const int status = flesh_study_store_execute(store, "BEGIN IMMEDIATE");
  return status ? status : flesh_study_store_end(store, recover(store, count, running));
}

int flesh_study_store_judge(flesh_study_store *store)
{
  sqlite3_stmt *query;
  int status = flesh_study_store_prepare(store, "SELECT count(*), min(number), message FROM temp.wanted JOIN cases USING (id) "
                                                "WHERE exit_code = 3", &query);
  if (status) return status;
  const int count = sqlite3_step(query) == SQLITE_ROW ? sqlite3_column_int(query, 0) : 0;
  const char *message = count ? (const char *)sqlite3_column_text(query, 2) : NULL;
  if (count)
    status = flesh_fail(FLESH_ERR_FILE, "%d of %d cases could not write or read their files; the first: %s", count,
                        flesh_study_store_count(store, NULL), message ? message : "(no words)");
  sqlite3_finalize(query);
  return status;
}

int flesh_study_store_count(flesh_study_store *store, const char *state)
{
  return flesh_study_store_number(
      store, "SELECT count(*) FROM temp.wanted JOIN cases USING (id) WHERE %Q IS NULL OR status = %Q", state, state);
}

/* Returns a row of cases as the record from which it was written. */
static json_t *read_record(sqlite3_stmt *query)
{
  const char *result = (const char *)sqlite3_column_text(query, 4), *message = (const char *)sqlite3_column_text(query, 3);
  return json_pack("{so* si so* so*}", "status", flesh_json_text((const char *)sqlite3_column_text(query, 1)), "exit_code",
                   sqlite3_column_int(query, 2), "message", flesh_json_text(message ? message : ""), "result",
                   result ? json_loads(result, 0, NULL) : json_null());
}

int flesh_study_store_load(flesh_study_store *store, const flesh_study *study)
{
  sqlite3_stmt *query;
  int code = SQLITE_DONE;
  int status = flesh_study_store_prepare(store,
                                         "SELECT number, status, exit_code, message, result FROM temp.wanted JOIN cases "
                                         "USING (id) WHERE status NOT IN ('planned', 'running') ORDER BY number",
                                         &query);
  while (!status && (code = sqlite3_step(query)) == SQLITE_ROW) {
    json_t *record = read_record(query);
    status = study->take(study->data, sqlite3_column_int(query, 0), record);
    json_decref(record);
  }
  if (!status && code != SQLITE_DONE) status = flesh_study_store_fail(store, "cannot be read");
  sqlite3_finalize(query);
  return status;
}
