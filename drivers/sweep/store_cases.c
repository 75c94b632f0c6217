/* store_cases.c: the cases in the database of a sweep: claimed, finished, released, recovered and counted by the
 * processes that work on it. */
#include <dirent.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "cli/json_memory.h"
#include "sweep/sweep.h"
#include "sweep/tables.h"

static int claim(flesh_sweep_store *store, int *id)
{
  *id = 0;
  sqlite3_bind_text(store->claim, 1, store->worker, -1, SQLITE_STATIC);
  int code = sqlite3_step(store->claim);
  if (code == SQLITE_ROW) {
    *id = sqlite3_column_int(store->claim, 0);
    code = sqlite3_step(store->claim);
  }
  int status = code == SQLITE_DONE ? FLESH_OK : flesh_sweep_store_fail(store, "cannot be written");
  sqlite3_reset(store->claim);
  return status;
}

int flesh_sweep_store_claim(flesh_sweep_store *store, int *id)
{
  int status = flesh_sweep_store_execute(store, "BEGIN IMMEDIATE");
  return status ? status : flesh_sweep_store_end(store, claim(store, id));
}

static int write_rows(flesh_sweep_store *store, int id, const json_t *rows)
{
  size_t index;
  const json_t *row;
  json_array_foreach((json_t *)rows, index, row) {
    char *text = json_dumps(row, JSON_COMPACT);
    sqlite3_bind_int(store->row, 1, id);
    sqlite3_bind_int64(store->row, 2, (sqlite3_int64)index + 1);
    sqlite3_bind_text(store->row, 3, text, -1, SQLITE_STATIC);
    int code = sqlite3_step(store->row);
    sqlite3_reset(store->row);
    free(text);
    if (code != SQLITE_DONE) return flesh_sweep_store_fail(store, "cannot be written");
  }
  return FLESH_OK;
}

static int write_record(flesh_sweep_store *store, int id, const json_t *record, double seconds)
{
  const json_t *result = json_object_get(record, "result"), *rows = json_object_get(record, "rows");
  char *text = json_is_object(result) ? json_dumps(result, JSON_COMPACT) : NULL;
  sqlite3_stmt *finish = store->finish;
  sqlite3_bind_text(finish, 1, json_string_value(json_object_get(record, "status")), -1, SQLITE_STATIC);
  sqlite3_bind_int64(finish, 2, json_integer_value(json_object_get(record, "exit_code")));
  sqlite3_bind_text(finish, 3, json_string_value(json_object_get(record, "message")), -1, SQLITE_STATIC);
  sqlite3_bind_double(finish, 4, seconds);
  sqlite3_bind_text(finish, 5, text, -1, SQLITE_STATIC);
  sqlite3_bind_int(finish, 6, id);
  sqlite3_bind_text(finish, 7, store->worker, -1, SQLITE_STATIC);
  int status = sqlite3_step(finish) == SQLITE_DONE ? FLESH_OK : flesh_sweep_store_fail(store, "cannot be written");
  sqlite3_reset(finish);
  free(text);
  return status || !rows ? status : write_rows(store, id, rows);
}

int flesh_sweep_store_finish(flesh_sweep_store *store, int id, const json_t *record, double seconds, int *next)
{
  if (next) *next = 0;
  int status = flesh_sweep_store_execute(store, "BEGIN IMMEDIATE");
  if (status) return status;
  status = write_record(store, id, record, seconds);
  if (!status && next) status = claim(store, next);
  return flesh_sweep_store_end(store, status);
}

int flesh_sweep_store_release(flesh_sweep_store *store, int id)
{
  char *sql = sqlite3_mprintf("UPDATE cases SET status = 'planned', worker = NULL, started = NULL "
                              "WHERE id = %d AND worker = %Q AND status = 'running'",
                              id, store->worker);
  int status = sql ? flesh_sweep_store_execute(store, sql) : FLESH_ERR_MEMORY;
  sqlite3_free(sql);
  return status;
}

/* .sweep-<process>-<time>.lock, in no other folder: the names in a database are its writer's. */
static int is_lock(const char *name)
{
  const size_t length = strlen(name);
  return !strncmp(name, ".sweep-", 7) && length > 12 && !strcmp(name + length - 5, ".lock") && !strchr(name, '/');
}

/* Whether the process that has the lock file lives; else the file goes. Within a transaction, as are the makers. */
static int lives(const flesh_sweep_store *store, const char *lock)
{
  if (!is_lock(lock)) return 0;
  char *path = flesh_sweep_store_beside(store, lock);
  if (!path) return 1;
  int file = flesh_path_open(path, O_RDWR | O_NOFOLLOW | O_NONBLOCK, 0), living = 0;
  if (file >= 0) {
    living = flock(file, LOCK_EX | LOCK_NB) != 0;
    if (!living) flesh_path_unlink(path);
    close(file);
  }
  free(path);
  return living;
}

/* Removes what processes left that were killed. */
static void clean(const flesh_sweep_store *store)
{
  char *folder = flesh_sweep_store_beside(store, ".");
  DIR *list = folder ? flesh_path_list(folder) : NULL;
  free(folder);
  if (!list) return;
  for (struct dirent *entry; (entry = readdir(list));) lives(store, entry->d_name);
  closedir(list);
}

static int recover(flesh_sweep_store *store, int *count, int *running)
{
  clean(store);
  sqlite3_stmt *query;
  int status = flesh_sweep_store_prepare(store,
                                         "SELECT worker, lock, count(*) FROM cases LEFT JOIN workers ON name = worker "
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
    char *sql = sqlite3_mprintf("UPDATE cases SET status = 'planned', worker = NULL, started = NULL "
                                "WHERE status = 'running' AND worker IS %Q", worker);
    status = sql ? flesh_sweep_store_execute(store, sql) : FLESH_ERR_MEMORY;
    sqlite3_free(sql);
  }
  if (!status && code != SQLITE_DONE) status = flesh_sweep_store_fail(store, "cannot be read");
  sqlite3_finalize(query);
  return status;
}

int flesh_sweep_store_recover(flesh_sweep_store *store, int *count, int *running)
{
  *count = *running = 0;
  int status = flesh_sweep_store_execute(store, "BEGIN IMMEDIATE");
  return status ? status : flesh_sweep_store_end(store, recover(store, count, running));
}

int flesh_sweep_store_judge(flesh_sweep_store *store)
{
  sqlite3_stmt *query;
  int all = flesh_sweep_store_count(store, NULL), status = FLESH_OK;
  if (!all || flesh_sweep_store_count(store, "refused") < all) return FLESH_OK;
  if (sqlite3_prepare_v2(store->database, "SELECT message FROM cases ORDER BY id LIMIT 1", -1, &query, NULL))
    return flesh_sweep_store_fail(store, "cannot be read");
  if (sqlite3_step(query) == SQLITE_ROW)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "all %d cases are refused; the first: %s", all,
                        sqlite3_column_text(query, 0) ? (const char *)sqlite3_column_text(query, 0) : "(no words)");
  sqlite3_finalize(query);
  return status;
}

int flesh_sweep_store_count(flesh_sweep_store *store, const char *state)
{
  sqlite3_stmt *query;
  int count = 0;
  if (sqlite3_prepare_v2(store->database, "SELECT count(*) FROM cases WHERE ?1 IS NULL OR status = ?1", -1, &query,
                         NULL))
    return 0;
  sqlite3_bind_text(query, 1, state, -1, SQLITE_STATIC);
  if (sqlite3_step(query) == SQLITE_ROW) count = sqlite3_column_int(query, 0);
  sqlite3_finalize(query);
  return count;
}
