/* store.c: the database of a sweep: making, opening and closing it. */
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <time.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/scan.h"
#include "study/database.h"
#include "cli/json_memory.h"
#include "run/provenance.h"
#include "scene/words.h"
#include "sweep/sweep.h"
#include "sweep/tables.h"

/* How long a process waits for another one's transaction. */
enum { PATIENCE_MS = 60000 };

const char flesh_sweep_schema_text[] =
    "Tables of the database:\n"
    "  cases       a row per case: id (from 1, the same in every shard), a column per axis, repeat (of several),\n"
    "              status (planned, running, complete, failed, out of budget, crashed, refused,\n"
    "              interrupted), exit_code, message,\n"
    "              seconds (of the whole case), started (UTC), worker, scene, overrides (as for --set, JSON),\n"
    "              result (JSON as in result.json: status, failure, figures, materials, inputs with their sha256)\n"
    "  table_rows  of drift, accuracy and hardcases: case_id, number, data (a row of the command's CSV as JSON)\n"
    "  parameters  number, name, key: the axes;  derived: number, name, expression;  meta: key, value (spec, ...)\n"
    "  workers     name, host, pid, lock, started, program (JSON: version, commit, compiler, libraries, machine)\n"
    "  results     view: the cases with every figure as a column (energies as energy_NAME), reason and failed_at of\n"
    "              failures, nodes and tets of the mesh, host and flesh_commit, and the derived columns\n"
    "  rows        view: table_rows with the axes and a column per field\n"
    "Costs that do not depend on the machine: steps, newton, linear, assemblies, projections, residuals, ...\n";

static int open_database(const char *path, int flags, flesh_sweep_store *store)
{
  *store = (flesh_sweep_store){.path = strdup(path), .lock = -1, .shard = 1, .shards = 1};
  if (!store->path) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  if (sqlite3_open_v2(path, &store->database, flags, NULL))
    return flesh_sweep_store_fail(store, "cannot be opened");
  sqlite3_busy_timeout(store->database, PATIENCE_MS);
  return FLESH_OK;
}

/* Returns the value of the key in `meta`, as a new text; NULL if it has none, as in a file that is no sweep. */
static int text_of(flesh_sweep_store *store, const char *key, char **value)
{
  sqlite3_stmt *query;
  *value = NULL;
  int code = sqlite3_prepare_v2(store->database, "SELECT value FROM meta WHERE key = ?", -1, &query, NULL);
  if (!code) {
    sqlite3_bind_text(query, 1, key, -1, SQLITE_STATIC);
    code = sqlite3_step(query);
    const unsigned char *text = code == SQLITE_ROW ? sqlite3_column_text(query, 0) : NULL;
    if (text && !(*value = strdup((const char *)text))) code = SQLITE_NOMEM;
    sqlite3_finalize(query);
  }
  return code == SQLITE_NOMEM ? flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory", store->path) : FLESH_OK;
}

static int set_meta(flesh_sweep_store *store, const char *key, const char *value)
{
  sqlite3_stmt *insert;
  int status = flesh_sweep_store_prepare(store, "INSERT OR REPLACE INTO meta VALUES (?, ?)", &insert);
  if (status) return status;
  sqlite3_bind_text(insert, 1, key, -1, SQLITE_STATIC);
  sqlite3_bind_text(insert, 2, value, -1, SQLITE_STATIC);
  if (sqlite3_step(insert) != SQLITE_DONE) status = flesh_sweep_store_fail(store, "cannot be written");
  sqlite3_finalize(insert);
  return status;
}

/* WAL lets readers look on while cases are written; a commit is on the disk before it returns. */
static int prepare_journal(flesh_sweep_store *store)
{
  for (int tries = 0;; tries++) {
    int code = sqlite3_exec(store->database, "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL;", NULL, NULL, NULL);
    if (!code) return FLESH_OK;
    if (code != SQLITE_BUSY || tries == 500) return flesh_sweep_store_fail(store, "cannot be written");
    nanosleep(&(struct timespec){0, 20000000}, NULL); /* another process is making it */
  }
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

static int insert_case(flesh_sweep_store *store, sqlite3_stmt *insert, const flesh_sweep *sweep, int id)
{
  flesh_sweep_case c;
  flesh_text list = {0};
  int at = 1, status = flesh_sweep_case_make(sweep, id, &c);
  if (status) return status;
  sqlite3_bind_int(insert, at++, id);
  for (int k = 0; k < sweep->column_count; k++)
    if (!flesh_sweep_is_scene(&sweep->columns[k])) bind_value(insert, at++, c.values[k], c.nodes[k]);
  if (sweep->repeats > 1) sqlite3_bind_int(insert, at++, c.repeat);
  sqlite3_bind_text(insert, at++, c.scene, -1, SQLITE_TRANSIENT);
  for (int k = 0; k < c.count; k++) {
    flesh_text_print(&list, k ? ", " : "[");
    flesh_text_quote(&list, c.overrides[k]);
  }
  flesh_text_print(&list, c.count ? "]" : "[]");
  sqlite3_bind_text(insert, at++, list.data, -1, SQLITE_TRANSIENT);
  if (list.failed) status = flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  else if (sqlite3_step(insert) != SQLITE_DONE) status = flesh_sweep_store_fail(store, "cannot be written");
  sqlite3_reset(insert);
  free(list.data);
  flesh_sweep_case_free(&c);
  return status;
}

/* The plan's rows of this shard; those that are there stay. */
static int insert_cases(flesh_sweep_store *store, const flesh_sweep *sweep)
{
  flesh_text sql = {0};
  sqlite3_stmt *insert = NULL;
  flesh_text_print(&sql, "INSERT OR IGNORE INTO cases (id");
  int columns = 2 + (sweep->repeats > 1);
  for (int c = 0; c < sweep->column_count; c++) {
    if (flesh_sweep_is_scene(&sweep->columns[c])) continue;
    flesh_text_print(&sql, ", \"%s\"", sweep->columns[c].name);
    columns++;
  }
  flesh_text_print(&sql, "%s, scene, overrides, status) VALUES (?", sweep->repeats > 1 ? ", repeat" : "");
  for (int c = 0; c < columns; c++) flesh_text_print(&sql, ", ?");
  flesh_text_print(&sql, ", 'planned')");
  int status = sql.failed ? flesh_fail(FLESH_ERR_MEMORY, "out of memory")
                          : flesh_sweep_store_prepare(store, sql.data, &insert);
  for (int id = store->shard; !status && id <= sweep->case_count; id += store->shards)
    status = insert_case(store, insert, sweep, id);
  sqlite3_finalize(insert);
  free(sql.data);
  return status;
}

int flesh_sweep_store_check(const flesh_sweep *sweep)
{
  flesh_sweep_store store;
  int bad = -1, status = open_database(":memory:", SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, &store);
  if (!status) status = flesh_sweep_tables_create(&store, sweep);
  if (!status) status = set_meta(&store, "command", flesh_sweep_commands[sweep->command]);
  /* The fields of other commands than run are known only when their tables are there. */
  if (!status) status = flesh_sweep_views_write(&store, &bad);
  if (status && bad >= 0)
    status = sweep->command == FLESH_SWEEP_RUN ? flesh_node_fail_within(status, sweep->derived[bad].node, "%s", "")
                                               : FLESH_OK;
  flesh_sweep_store_close(&store);
  return status;
}

static int create(flesh_sweep_store *store, const flesh_sweep *sweep)
{
  char shard[40], count[16];
  snprintf(shard, sizeof shard, "%d/%d", store->shard, store->shards);
  snprintf(count, sizeof count, "%d", sweep->case_count);
  int status = flesh_sweep_tables_create(store, sweep);
  const struct {
    const char *key, *value;
  } rows[] = {{"format", "1"},          {"spec", sweep->text},   {"spec_path", sweep->path},
              {"shard", shard},         {"cases", count},        {"command", flesh_sweep_commands[sweep->command]},
              {"fingerprint", sweep->fingerprint}};
  for (size_t k = 0; !status && k < sizeof rows / sizeof *rows; k++)
    status = set_meta(store, rows[k].key, rows[k].value);
  return status ? status : insert_cases(store, sweep);
}

/* Whether the database is of this sweep and shard. */
static int compare(flesh_sweep_store *store, const flesh_sweep *sweep)
{
  char *fingerprint, *shard = NULL;
  char wanted[40];
  int status = text_of(store, "fingerprint", &fingerprint);
  if (!status) status = text_of(store, "shard", &shard);
  snprintf(wanted, sizeof wanted, "%d/%d", store->shard, store->shards);
  if (status) { /* out of memory */
  } else if (!fingerprint || !shard) status = flesh_fail(FLESH_ERR_FILE, "%s: is no database of a sweep", store->path);
  else if (strcmp(fingerprint, sweep->fingerprint))
    status = flesh_fail(FLESH_ERR_ARGUMENT,
                        "%s: is of another sweep: %s or the scene it names has changed since; undo that, or give "
                        "another --out",
                        store->path, sweep->path);
  else if (strcmp(shard, wanted))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: holds shard %s, not %s; give each shard an --out of its own",
                        store->path, shard, wanted);
  free(fingerprint);
  free(shard);
  return status;
}

char *flesh_sweep_store_beside(const flesh_sweep_store *store, const char *name)
{
  const char *slash = strrchr(store->path, '/');
  char *path = malloc(strlen(store->path) + strlen(name) + 2);
  if (path) sprintf(path, "%.*s%s", slash ? (int)(slash + 1 - store->path) : 0, store->path, name);
  return path;
}

/* A file that stays locked while this process lives, however it ends. */
static int open_lock(flesh_sweep_store *store, const char *name)
{
  store->lock_path = flesh_sweep_store_beside(store, name);
  if (!store->lock_path) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  store->lock = flesh_path_open(store->lock_path, O_RDWR | O_CREAT | O_NOFOLLOW, 0666);
  if (store->lock < 0 || flock(store->lock, LOCK_EX | LOCK_NB))
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be locked: %s", store->lock_path, strerror(errno));
  return FLESH_OK;
}

static int enrol(flesh_sweep_store *store, int argc, char **argv)
{
  char host[80] = "", lock[80];
  struct timespec now;
  sqlite3_stmt *insert;
  gethostname(host, sizeof host - 1);
  clock_gettime(CLOCK_REALTIME, &now);
  snprintf(store->worker, sizeof store->worker, "%s:%ld:%lld%09ld", host, (long)getpid(), (long long)now.tv_sec,
           now.tv_nsec);
  snprintf(lock, sizeof lock, ".sweep-%ld-%lld%09ld.lock", (long)getpid(), (long long)now.tv_sec, now.tv_nsec);
  int status = open_lock(store, lock);
  if (!status)
    status =
        flesh_sweep_store_prepare(store,
                                  "INSERT INTO workers (name, host, pid, lock, started, program) VALUES (?, ?, ?, ?, "
                                  "strftime('%Y-%m-%dT%H:%M:%fZ', 'now'), ?)",
                                  &insert);
  if (status) return status;
  json_t *program = flesh_provenance_program(argc, argv);
  char *text = json_dumps(program, JSON_COMPACT);
  if (flesh_json_lacks()) status = flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  sqlite3_bind_text(insert, 1, store->worker, -1, SQLITE_STATIC);
  sqlite3_bind_text(insert, 2, host, -1, SQLITE_STATIC);
  sqlite3_bind_int64(insert, 3, getpid());
  sqlite3_bind_text(insert, 4, lock, -1, SQLITE_STATIC);
  sqlite3_bind_text(insert, 5, text, -1, SQLITE_STATIC);
  if (!status && sqlite3_step(insert) != SQLITE_DONE) status = flesh_sweep_store_fail(store, "cannot be written");
  sqlite3_finalize(insert);
  json_decref(program);
  free(text);
  return status;
}

static int prepare_statements(flesh_sweep_store *store)
{
  int status = flesh_sweep_store_prepare(
      store,
      "UPDATE cases SET status = 'running', worker = ?, started = strftime('%Y-%m-%dT%H:%M:%fZ', 'now') "
      "WHERE id = (SELECT id FROM cases WHERE status = 'planned' ORDER BY id LIMIT 1) RETURNING id",
      &store->claim);
  if (!status)
    status =
        flesh_sweep_store_prepare(store,
                                  "UPDATE cases SET status = ?, exit_code = ?, message = ?, seconds = ?, result = ? "
                                  "WHERE id = ? AND worker = ?",
                                  &store->finish);
  if (!status)
    status = flesh_sweep_store_prepare(store, "INSERT OR REPLACE INTO table_rows VALUES (?, ?, ?)", &store->row);
  return status;
}

int flesh_sweep_store_open(const char *path, const flesh_sweep *sweep, int shard, int shards, int resume, int argc,
                           char **argv, flesh_sweep_store *store)
{
  int status = flesh_path_check(path), there = flesh_path_is_file(path);
  *store = (flesh_sweep_store){.lock = -1};
  if (!status) status = open_database(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, store);
  store->shard = shard;
  store->shards = shards;
  if (!status && there && !resume) {
    char *format;
    status = text_of(store, "format", &format);
    if (format)
      status = flesh_fail(FLESH_ERR_ARGUMENT,
                          "%s: is there already; --resume goes on with it, another --out begins a new one", path);
    free(format);
  }
  if (!status) status = prepare_journal(store);
  if (!status) status = flesh_sweep_store_execute(store, "BEGIN IMMEDIATE");
  if (status) return status;
  char *format;
  status = text_of(store, "format", &format);
  int found = format != NULL;
  free(format);
  if (!status) status = found ? compare(store, sweep) : create(store, sweep);
  if (!status && found) status = insert_cases(store, sweep);
  if (!status) status = enrol(store, argc, argv);
  int bad = -1;
  if (!status && !found && (status = flesh_sweep_views_write(store, &bad)) && bad >= 0) status = FLESH_OK;
  status = flesh_sweep_store_end(store, status);
  return status ? status : prepare_statements(store);
}

int flesh_sweep_store_read(const char *path, flesh_sweep_store *store)
{
  *store = (flesh_sweep_store){.path = strdup(path), .lock = -1, .shard = 1, .shards = 1};
  int status = store->path ? flesh_database_read(path, SQLITE_OPEN_READWRITE, &store->database)
                           : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  if (!status) sqlite3_busy_timeout(store->database, PATIENCE_MS);
  char *format = NULL;
  if (!status) status = text_of(store, "format", &format);
  if (!status && !format) status = flesh_fail(FLESH_ERR_FILE, "%s: is no database of a sweep", path);
  free(format);
  return status;
}

void flesh_sweep_store_close(flesh_sweep_store *store)
{
  sqlite3_finalize(store->claim);
  sqlite3_finalize(store->finish);
  sqlite3_finalize(store->row);
  sqlite3_close(store->database);
  if (store->lock >= 0) {
    flesh_path_unlink(store->lock_path);
    close(store->lock);
  }
  free(store->lock_path);
  free(store->path);
  *store = (flesh_sweep_store){.lock = -1};
}
