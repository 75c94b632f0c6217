/* merge.c: `flesh sweep merge OUT.db IN.db...`: joins the databases of shards. */
#include <stdio.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/file.h"
#include "study/database.h"
#include "cli/options.h"
#include "study/tables.h"
#include "sweep/sweep.h"

/* Calls sql with one text bound; a failure names `path`. */
static int execute_with(flesh_study_store *store, const char *sql, const char *text, const char *path)
{
  sqlite3_stmt *statement;
  int status = flesh_study_store_prepare(store, sql, &statement);
  if (status) return status;
  sqlite3_bind_text(statement, 1, text, -1, SQLITE_STATIC);
  int code = sqlite3_step(statement);
  if (code != SQLITE_DONE && code != SQLITE_ROW)
    status = flesh_database_fail(store->database, path, "cannot be merged");
  sqlite3_finalize(statement);
  return status;
}

/* Figures that no two runs share. */
#define TIMED                                                                                                          \
  "'$.figures.wall_s', '$.figures.cpu_s', '$.figures.wall_s_median', '$.figures.wall_s_min', '$.figures.time_ratio', "  \
  "'$.figures.took_s', '$.figures.peak_memory_kB', '$.inputs'"

/* Cases that were finished in both with other figures, times aside. */
static const char different_sql[] =
    "SELECT count(*) FROM main.cases a JOIN part.cases b USING (id) WHERE a.result IS NOT NULL AND b.result IS "
    "NOT NULL "
    "AND (a.status <> b.status OR "
    "json_remove(a.result, " TIMED ") <> json_remove(b.result, " TIMED "))";

static const char join_sql[] =
    "BEGIN;"
    "DELETE FROM main.table_rows WHERE case_id IN (SELECT a.id FROM main.cases a JOIN part.cases b USING (id) WHERE "
    "a.status IN ('planned', 'running') AND b.status NOT IN ('planned', 'running'));"
    "INSERT INTO main.table_rows SELECT r.* FROM part.table_rows r LEFT JOIN main.cases a ON a.id = r.case_id "
    "WHERE a.id IS NULL OR a.status IN ('planned', 'running');"
    "DELETE FROM main.cases WHERE status IN ('planned', 'running') AND id IN "
    "(SELECT id FROM part.cases WHERE status NOT IN ('planned', 'running'));"
    "INSERT OR IGNORE INTO main.cases SELECT * FROM part.cases;"
    "INSERT OR IGNORE INTO main.workers SELECT * FROM part.workers;"
    "INSERT OR IGNORE INTO main.figures (path) SELECT path FROM part.figures;"
    "COMMIT;";

static int join(flesh_study_store *store, const char *path)
{
  int status = flesh_database_allow(path);
  if (!status) status = execute_with(store, "ATTACH ? AS part", path, path);
  if (status) return status;
  if (!flesh_study_store_number(store, "SELECT count(*) FROM part.sqlite_master WHERE name = 'cases'"))
    status = flesh_fail(FLESH_ERR_FILE, "%s: this is no database of a study", path);
  else if (!flesh_study_store_number(store, "SELECT count(*) FROM main.meta a JOIN part.meta b USING (key, value) WHERE key = "
                             "'fingerprint'"))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: is of another sweep than the first one given", path);
  else if (flesh_study_store_number(store, "SELECT count(*) FROM main.cases a JOIN part.cases b USING (id) WHERE a.case_key "
                                           "<> b.case_key"))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: its cases have other numbers than those of the first one given", path);
  int different = status ? 0 : flesh_study_store_number(store, different_sql);
  if (different)
    fprintf(
        stderr,
        "flesh sweep merge: %s: %d of its cases have other figures than before (another build or machine?); the first ones "
        "are kept\n",
        path, different);
  if (!status && sqlite3_exec(store->database, join_sql, NULL, NULL, NULL))
    status = flesh_database_fail(store->database, path, "cannot be merged");
  return status ? status : flesh_study_store_execute(store, "DETACH part"); /* a failed merge is thrown away whole */
}

static int merge(const char *out, const char *temporary, int count, char **paths)
{
  flesh_study_store first, store = {.lock = -1};
  int status = flesh_study_store_read(paths[0], &first);
  if (!status) status = execute_with(&first, "VACUUM INTO ?", temporary, paths[0]);
  flesh_study_store_close(&first);
  if (!status) status = flesh_study_store_read(temporary, &store);
  /* Nothing stands beside it: what is killed half-way is thrown away whole. */
  if (!status) status = flesh_study_store_execute(&store, "PRAGMA journal_mode = MEMORY");
  for (int p = 1; !status && p < count; p++) status = join(&store, paths[p]);
  if (!status)
    status = flesh_study_store_execute(&store, "UPDATE cases SET status = 'planned', worker = NULL, started = NULL "
                                               "WHERE status = 'running';"
                                               "UPDATE meta SET value = '1/1' WHERE key = 'shard';");
  if (!status && (status = flesh_study_store_make_views(&store)) == FLESH_ERR_ARGUMENT) {
    fprintf(stderr, "flesh sweep merge: %s\n", flesh_error_text()); /* a derived column: the rest stands */
    status = FLESH_OK;
  }
  if (!status) {
    int whole = flesh_study_store_number(&store, "SELECT value + (SELECT count(*) FROM cases WHERE id > value) "
                                                "FROM meta WHERE key = 'cases'");
    int done = flesh_study_store_number(&store, "SELECT count(*) FROM cases WHERE status <> 'planned'");
    printf("%s: %d of %d cases are done", out, done, whole);
    printf(done < whole ? "; as sweep.db in a folder, `flesh sweep SPEC --out FOLDER --resume` does the others\n"
                        : "\n");
  }
  flesh_study_store_close(&store);
  return status;
}

int flesh_sweep_merge(int argc, char **argv)
{
  const flesh_option rows[] = {{0}};
  const flesh_usage usage = {"sweep merge", "OUT.db IN.db...", "Joins the databases of shards into a new one.", NULL,
                             2, 100000, rows, NULL, 0};
  int count, code = flesh_options_read(&usage, argc, argv, &count);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  const char *out = argv[1];
  int status = FLESH_OK;
  if (!flesh_path_access(out, F_OK)) status = flesh_fail(FLESH_ERR_FILE, "%s: is there already; give a new name", out);
  flesh_file file = {0};
  if (!status) {
    flesh_file_clear(out);
    status = flesh_file_open(out, &file);
  }
  /* SQLite fills the file, which is empty so far, and it takes its name when it is whole. */
  if (!status) status = merge(out, file.temporary, count - 1, argv + 2);
  if (!status) status = flesh_file_commit(&file);
  flesh_file_abandon(&file);
  return status ? flesh_command_fail("sweep merge", status) : 0;
}
