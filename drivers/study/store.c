/* store.c: creates, opens and closes the database of a study. */
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <time.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "study/database.h"
#include "cli/json_memory.h"
#include "cli/path.h"
#include "run/provenance.h"
#include "study/tables.h"

/* Time for which a process waits for another one's transaction. */
enum { PATIENCE_MS = 60000 };

/* Number of the layout of the tables. */
static const char format_number[] = "2";

static int open_database(const char *path, int flags, flesh_study_store *store)
{
  *store = (flesh_study_store){.path = strdup(path), .lock = -1, .shard = 1, .shards = 1};
  if (!store->path) return flesh_no_memory();
  if (sqlite3_open_v2(path, &store->database, flags, NULL))
    return flesh_study_store_fail(store, "cannot be opened");
  sqlite3_busy_timeout(store->database, PATIENCE_MS);
  return FLESH_OK;
}

/* Sets the journal to WAL, with which others can read while cases are written; a commit is on the disk before it
 * returns. */
static int prepare_journal(flesh_study_store *store)
{
  for (int tries = 0;; tries++) {
    int code = sqlite3_exec(store->database, "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL;", NULL, NULL, NULL);
    if (!code) return FLESH_OK;
    if (code != SQLITE_BUSY || tries == 500) return flesh_study_store_fail(store, "cannot be written");
    nanosleep(&(struct timespec){0, 20000000}, NULL); /* another process is creating it */
  }
}

int flesh_study_store_check(const flesh_study *study)
{
  flesh_study_store store;
  int bad = -1, status = open_database(":memory:", SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, &store);
  if (!status) status = flesh_study_tables_create(&store, study);
  if (!status) status = flesh_study_derived_write(&store, study);
  if (!status) status = flesh_study_views_write(&store, &bad);
  if (status && bad >= 0) status = flesh_node_fail_within(status, study->derived[bad].node, "%s", "");
  flesh_study_store_close(&store);
  return status;
}

/* Writes what may change when a study is resumed. */
static int set_extent(flesh_study_store *store, const flesh_study *study)
{
  const int status = flesh_study_store_execute(store, "INSERT OR REPLACE INTO meta SELECT * FROM (VALUES ('cases', '%d'), "
                                               "('spec', %Q)) WHERE column2 IS NOT NULL", study->case_count, study->text);
  return status ? status : flesh_study_derived_write(store, study);
}

static int create(flesh_study_store *store, const flesh_study *study)
{
  const int status = flesh_study_tables_create(store, study);
  return status ? status
                : flesh_study_store_execute(store, "INSERT INTO meta VALUES ('format', %Q), ('study', %Q), ('spec_path', %Q), "
                                            "('shard', '%d/%d'), ('fingerprint', %Q)", format_number, study->name,
                                            study->path ? study->path : "", store->shard, store->shards, study->fingerprint);
}

/* Returns the first part of a list such as "flesh 0.3, 600 s" that differs from the other list's; "nothing" if the
 * other list has more parts. New; NULL when out of memory. */
static char *differing_part(const char *list, const char *other)
{
  size_t size;
  while (*list && (size = strcspn(list, ",")) == strcspn(other, ",") && !strncmp(list, other, size)) {
    list += size, other += size;
    list += strspn(list, ", "), other += strspn(other, ", ");
  }
  return *list ? strndup(list, strcspn(list, ",")) : strdup("nothing");
}

static int fail_of_another(const flesh_study_store *store, const flesh_study *study, const char *fingerprint)
{
  char *there = differing_part(fingerprint, study->fingerprint), *here = differing_part(study->fingerprint, fingerprint);
  const int told = there && here && strchr(study->fingerprint, ',') && strchr(fingerprint, ',');
  const int status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: is of another %s: %s, or give another --out%s%s%s%s%s", store->path,
                                study->name, study->different, told ? " (there " : "", told ? there : "",
                                told ? ", here " : "", told ? here : "", told ? ")" : "");
  free(there);
  free(here);
  return status;
}

/* Checks the texts of `meta`, of which those that are missing are NULL: the layout is this program's and, unless `study` is
 * NULL, the database belongs to this study and shard. */
static int compare(const flesh_study_store *store, const flesh_study *study, const char *format, const char *fingerprint,
                   const char *shard)
{
  char wanted[40];
  snprintf(wanted, sizeof wanted, "%d/%d", store->shard, store->shards);
  if (format && strcmp(format, format_number))
    return flesh_fail(FLESH_ERR_FILE, "%s: its layout is number %.20s, and this program's is %s; the version of flesh that "
                      "made it can read it", store->path, format, format_number);
  if (!format || (study && !(fingerprint && shard)))
    return flesh_fail(FLESH_ERR_FILE, "%s: this is no database of a study", store->path);
  if (study && strcmp(fingerprint, study->fingerprint)) return fail_of_another(store, study, fingerprint);
  if (study && strcmp(shard, wanted))
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s: holds shard %s, not %s; give each shard an --out of its own",
                      store->path, shard, wanted);
  return FLESH_OK;
}

/* Checks what the database says of itself. *found: whether it is a study's; without it, a database that is none is an
 * error. */
static int check(const flesh_study_store *store, const flesh_study *study, int *found)
{
  sqlite3_stmt *query = NULL;
  const char *texts[3] = {NULL};
  int status = FLESH_OK, code = sqlite3_prepare_v2(store->database, "SELECT max(value) FILTER (WHERE key = 'format'), "
                                                   "max(value) FILTER (WHERE key = 'fingerprint'), "
                                                   "max(value) FILTER (WHERE key = 'shard') FROM meta", -1, &query, NULL);
  if (!code) code = sqlite3_step(query);
  for (int k = 0; k < 3 && code == SQLITE_ROW; k++) texts[k] = (const char *)sqlite3_column_text(query, k);
  if (found) *found = texts[0] != NULL;
  if (code != SQLITE_ROW && code != SQLITE_ERROR && code != SQLITE_NOTADB) /* these two: the file is no study */
    status = flesh_study_store_fail(store, "cannot be read");
  else if (texts[0] || !found) status = compare(store, study, texts[0], texts[1], texts[2]);
  sqlite3_finalize(query);
  return status;
}

/* Opens a file that stays locked while this process lives, however the process ends. */
static int open_lock(flesh_study_store *store, const char *name)
{
  store->lock_path = strdup(flesh_study_store_beside(store, name));
  if (!store->lock_path) return flesh_no_memory();
  store->lock = flesh_path_open(store->lock_path, O_RDWR | O_CREAT | O_NOFOLLOW, 0666);
  if (store->lock < 0 || flock(store->lock, LOCK_EX | LOCK_NB))
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be locked: %s", store->lock_path, strerror(errno));
  return FLESH_OK;
}

static int enrol(flesh_study_store *store, int argc, char **argv)
{
  char host[80] = "", lock[80];
  struct timespec now;
  gethostname(host, sizeof host - 1);
  clock_gettime(CLOCK_REALTIME, &now);
  snprintf(store->worker, sizeof store->worker, "%s:%ld:%lld%09ld", host, (long)getpid(), (long long)now.tv_sec,
           now.tv_nsec);
  snprintf(lock, sizeof lock, ".study-%ld-%lld%09ld.lock", (long)getpid(), (long long)now.tv_sec, now.tv_nsec);
  int status = open_lock(store, lock);
  if (status) return status;
  json_t *program = flesh_provenance_program(argc, argv);
  char *text = json_dumps(program, JSON_COMPACT);
  if (flesh_json_lacks()) status = flesh_no_memory();
  if (!status)
    status = flesh_study_store_execute(store,
                                       "INSERT INTO workers (name, host, pid, lock, started, program) VALUES (%Q, %Q, %d, "
                                       "%Q, strftime('%%Y-%%m-%%dT%%H:%%M:%%fZ', 'now'), %Q)",
                                       store->worker, host, (int)getpid(), lock, text);
  json_decref(program);
  free(text);
  return status;
}

/* Creates the tables or continues with them, within a transaction. */
static int fill(flesh_study_store *store, const flesh_study *study, const flesh_study_options *options)
{
  int bad = -1, found, status = check(store, study, &found);
  if (!status && !found) status = create(store, study);
  if (!status) status = set_extent(store, study);
  if (!status) status = flesh_study_store_plan(store, study);
  if (!status) status = enrol(store, options->argc, options->argv);
  if (!status && found && study->again)
    status = flesh_study_store_redo(store, study->again, -1);
  if (!status && !found && (status = flesh_study_views_write(store, &bad)) && bad >= 0) status = FLESH_OK;
  return status;
}

/* Decides about an existing database: with --resume it is kept; without, a study that `asks` fails, and others delete
 * it and start again. */
static int make_way(const flesh_study *study, const char *path, int resume)
{
  static const char *const ends[] = {"", "-wal", "-shm"};
  if (resume || !flesh_path_is_file(path)) return FLESH_OK;
  if (study->asks) {
    flesh_study_store there;
    const int status = flesh_study_store_read(path, &there);
    flesh_study_store_close(&there);
    return status == FLESH_ERR_MEMORY ? status
           : status ? FLESH_OK /* no database of a study: opening it reports what it is */
                    : flesh_fail(FLESH_ERR_ARGUMENT,
                                 "%s: is there already; --resume goes on with it, another --out begins a new one", path);
  }
  for (size_t k = 0; k < sizeof ends / sizeof *ends; k++) flesh_path_unlink(flesh_path("%s%s", path, ends[k]));
  return FLESH_OK;
}

int flesh_study_read_shard(const char *text, int *shard, int *shards)
{
  char end;
  *shard = *shards = 1;
  if (!text) return FLESH_OK;
  if (sscanf(text, "%d/%d%c", shard, shards, &end) == 2 && *shard >= 1 && *shard <= *shards) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "--shard is '%s'; it must be i/n with i from 1 to n, as in 2/8", text);
}

int flesh_study_store_open(const flesh_study *study, const flesh_study_options *options, flesh_study_store *store)
{
  int shard, shards, status = flesh_study_read_shard(options->shard, &shard, &shards);
  *store = (flesh_study_store){.lock = -1};
  if (status) return status;
  const char *path = flesh_path("%s/%s.db", options->out, study->name);
  status = flesh_path_check(path);
  if (!status) status = make_way(study, path, options->resume);
  if (!status) status = open_database(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, store);
  store->shard = shard, store->shards = shards;
  store->end = study->case_count;
  if (!status) status = prepare_journal(store);
  if (!status) status = flesh_study_store_execute(store, "BEGIN IMMEDIATE");
  if (status) return status;
  return flesh_study_store_end(store, fill(store, study, options));
}

int flesh_study_store_read(const char *path, flesh_study_store *store)
{
  *store = (flesh_study_store){.path = strdup(path), .lock = -1, .shard = 1, .shards = 1};
  int status = store->path ? flesh_database_read(path, SQLITE_OPEN_READWRITE, &store->database) : flesh_no_memory();
  if (!status) sqlite3_busy_timeout(store->database, PATIENCE_MS);
  return status ? status : check(store, NULL, NULL);
}

void flesh_study_store_close(flesh_study_store *store)
{
  if (store->lock >= 0) {
    /* Leave WAL, as a database in WAL can be read only if SQLite may write beside it; one that is in use stays in
     * WAL. */
    sqlite3_busy_timeout(store->database, 0);
    sqlite3_exec(store->database, "PRAGMA journal_mode = DELETE", NULL, NULL, NULL);
  }
  sqlite3_close(store->database);
  if (store->lock >= 0) {
    flesh_path_unlink(store->lock_path);
    close(store->lock);
  }
  free(store->lock_path);
  free(store->path);
  *store = (flesh_study_store){.lock = -1};
}
