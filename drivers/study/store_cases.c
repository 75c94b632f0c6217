/* store_cases.c: the cases in the database of a study, which the processes that work on it claim, finish, release,
 * recover, count and read. */
#include <dirent.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "cli/json_memory.h"
#include "study/database.h"
#include "study/tables.h"

static int claim(flesh_study_store *store, int *number)
{
  *number = -1;
  sqlite3_bind_text(store->claim, 1, store->worker, -1, SQLITE_STATIC);
  sqlite3_bind_int(store->claim, 2, store->first);
  sqlite3_bind_int(store->claim, 3, store->end);
  int code = sqlite3_step(store->claim);
  if (code == SQLITE_ROW) {
    *number = sqlite3_column_int(store->claim, 0);
    code = sqlite3_step(store->claim);
  }
  int status = code == SQLITE_DONE ? FLESH_OK : flesh_study_store_fail(store, "cannot be written");
  sqlite3_reset(store->claim);
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
  json_array_foreach((json_t *)rows, index, row) {
    char *text = json_dumps(row, JSON_COMPACT);
    const int code = flesh_database_put(store->row, "iit", number, (int)index + 1, text);
    free(text);
    if (code != SQLITE_DONE) return flesh_study_store_fail(store, "cannot be written");
  }
  return FLESH_OK;
}

static int write_record(flesh_study_store *store, int number, const json_t *record, double seconds)
{
  const json_t *result = json_object_get(record, "result"), *rows = json_object_get(record, "rows");
  char *text = json_is_object(result) ? json_dumps(result, JSON_COMPACT) : NULL;
  const int code = flesh_database_put(store->finish, "titdtit", json_string_value(json_object_get(record, "status")),
                                      (int)json_integer_value(json_object_get(record, "exit_code")),
                                      json_string_value(json_object_get(record, "message")), seconds, text, number,
                                      store->worker);
  const int status = code == SQLITE_DONE ? FLESH_OK : flesh_study_store_fail(store, "cannot be written");
  free(text);
  return status || !rows ? status : write_rows(store, number, rows);
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
  return flesh_study_store_execute(store,
                                   "UPDATE cases SET status = 'planned', worker = NULL, started = NULL WHERE id = "
                                   "(SELECT id FROM temp.wanted WHERE number = %d) AND worker = %Q AND status = 'running'",
                                   number, store->worker);
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

static int recover(flesh_study_store *store, int *count, int *running)
{
  clean(store);
  sqlite3_stmt *query;
  int status = flesh_study_store_prepare(store,
                                         "SELECT worker, w.lock, count(*) FROM cases LEFT JOIN workers w ON w.name = worker "
                                         "WHERE status = 'running' AND worker IS NOT ?1 GROUP BY worker",
                                         &query);
  if (status) return status;
  sqlite3_bind_text(query, 1, store->worker, -1, SQLITE_STATIC);
  int code;
  while (!status && (code = sqlite3_step(query)) == SQLITE_ROW) {
    const char *worker = (const char *)sqlite3_column_text(query, 0),
               *lock = (const char *)sqlite3_column_text(query, 1);
    int cases = sqlite3_column_int(query, 2);
    if (lock && lives(store, lock)) {
      *running += cases;
      continue;
    }
    *count += cases;
    status = flesh_study_store_execute(store, "UPDATE cases SET status = 'planned', worker = NULL, started = NULL "
                                       "WHERE status = 'running' AND worker IS %Q", worker);
  }
  if (!status && code != SQLITE_DONE) status = flesh_study_store_fail(store, "cannot be read");
  sqlite3_finalize(query);
  return status;
}

int flesh_study_store_recover(flesh_study_store *store, int *count, int *running)
{
  *count = *running = 0;
  int status = flesh_study_store_execute(store, "BEGIN IMMEDIATE");
  return status ? status : flesh_study_store_end(store, recover(store, count, running));
}

int flesh_study_store_judge(flesh_study_store *store, const char *condition, int all, const char *words)
{
  sqlite3_stmt *query;
  char *sql = sqlite3_mprintf("SELECT count(*), min(number), message FROM temp.wanted JOIN cases USING (id) WHERE %s",
                              condition);
  int status = sql ? flesh_study_store_prepare(store, sql, &query) : flesh_no_memory();
  sqlite3_free(sql);
  if (status) return status;
  const int cases = flesh_study_store_count(store, NULL);
  const int count = sqlite3_step(query) == SQLITE_ROW ? sqlite3_column_int(query, 0) : 0;
  const char *message = count ? (const char *)sqlite3_column_text(query, 2) : NULL;
  if (!message) message = "(no words)";
  if (count && all && count == cases)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "all %d cases %s; the first: %s", count, words, message);
  if (count && !all)
    status = flesh_fail(FLESH_ERR_FILE, "%d of %d cases %s; the first: %s", count, cases, words, message);
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
    status = study->take(study->taker, sqlite3_column_int(query, 0), record);
    json_decref(record);
  }
  if (!status && code != SQLITE_DONE) status = flesh_study_store_fail(store, "cannot be read");
  sqlite3_finalize(query);
  return status;
}
