/* verbs.c: the commands of `flesh sweep` for databases: `export` prints the results as a table; `merge` joins the
 * databases of shards; `plot` draws a figure against an axis as lines, or over two axes as a heat map. */
#include <ctype.h>
#include <stdio.h>
#include <unistd.h>

#include "base/error.h"
#include "base/confine.h"
#include "base/file.h"
#include "cli/options.h"
#include "cli/output.h"
#include "picture/plot.h"
#include "study/database.h"
#include "study/embedded.h"
#include "study/formats.h"
#include "study/results.h"
#include "study/tables.h"
#include "sweep/sweep.h"

#define NAME_OF(name, doc) "|" #name
#define DOC_OF(name, doc) ", " doc
#define FORMAT_OF(name, doc) &flesh_format_##name,
static const flesh_format *const formats[] = {FLESH_FORMAT_LIST(FORMAT_OF)};

/* The words of --table, in their order. */
static const char *const tables[] = {"results", "rows"};

static int print_table(flesh_study_store *store, const char *columns, const char *view, const char *where,
                       const flesh_format *format, FILE *stream)
{
  sqlite3_stmt *query = NULL;
  const char *rest = "";
  char words[FLESH_STUDY_WORDS];
  char *sql = sqlite3_mprintf("SELECT %s FROM %s WHERE (%s\n) ORDER BY %s", columns, view, where ? where : "1",
                              strcmp(view, "rows") ? "id" : "case_id, number");
  if (!sql) return flesh_no_memory();
  int code = sqlite3_prepare_v2(store->database, sql, -1, &query, &rest), status = FLESH_OK;
  if (code || *rest || !sqlite3_stmt_readonly(query))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: --columns %s%s%s: %s", store->path, columns, where ? ", --where " : "",
                        where ? where : "",
                        code ? flesh_study_store_words(store, view, words) : "not a list of columns and a condition");
  if (!status) status = flesh_format_print(store->path, query, format, stream);
  sqlite3_finalize(query);
  sqlite3_free(sql);
  return status;
}

int flesh_sweep_export(int argc, char **argv)
{
  const char *out = NULL, *columns = "*", *where = NULL;
  int format = 0, table = 0;
  const flesh_option rows[] = {
      {"format", &(FLESH_FORMAT_LIST(NAME_OF))[1], FLESH_OPTION_CHOICE, &format, &(FLESH_FORMAT_LIST(DOC_OF))[2]},
      {"table", "results|rows", FLESH_OPTION_CHOICE, &table,
       "a row per case (default), or per row of the tables that cases of accuracy and bench make"},
      {"columns", "LIST", FLESH_OPTION_TEXT, &columns, "columns or SQLite's expressions of them (default *: all)"},
      {"where", "CONDITION", FLESH_OPTION_TEXT, &where, "which rows, as in --where \"status = 'complete'\""},
      {"out", "FILE", FLESH_OPTION_TEXT, &out, "write this file (default: standard output)"},
      {0}};
  const flesh_usage usage = {"sweep export", "DB", "Writes the results of a sweep as a table.", NULL, 1, 1, rows, NULL, 0};
  flesh_study_store store = {.lock = -1};
  flesh_file file = {0};
  int count, code = flesh_options_read(&usage, argc, argv, &count);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  int status = flesh_study_store_read(argv[1], &store);
  if (!status && out) status = flesh_output_prepare_from(out, 1, argv + 1, NULL);
  if (!status && out) status = flesh_file_open(out, &file);
  if (!status) status = print_table(&store, columns, tables[table], where, formats[format], out ? file.stream : stdout);
  if (!status && out) status = flesh_file_commit(&file);
  flesh_file_abandon(&file);
  flesh_study_store_close(&store);
  return status ? flesh_command_fail("sweep export", status) : 0;
}

static int fail_to_merge(flesh_study_store *store, const char *path)
{
  return flesh_database_fail(store->database, path, "cannot be merged");
}

/* Figures that differ between any two runs. */
#define TIMED                                                                                                          \
  "'$.figures.wall_s', '$.figures.cpu_s', '$.figures.wall_s_median', '$.figures.wall_s_min', '$.figures.time_ratio', "  \
  "'$.figures.took_s', '$.figures.peak_memory_kB', '$.inputs'"

/* Statement that counts the cases finished in both databases with different figures, apart from times. */
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
  if (!status && flesh_study_store_execute(store, "ATTACH %Q AS part", path)) status = fail_to_merge(store, path);
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
  if (!status && sqlite3_exec(store->database, join_sql, NULL, NULL, NULL)) status = fail_to_merge(store, path);
  return status ? status : flesh_study_store_execute(store, "DETACH part"); /* after a failed merge the whole file is discarded */
}

static int merge(const char *out, const char *temporary, int count, char **paths)
{
  flesh_study_store first, store = {.lock = -1};
  int status = flesh_study_store_read(paths[0], &first);
  if (!status && flesh_study_store_execute(&first, "VACUUM INTO %Q", temporary)) status = fail_to_merge(&first, paths[0]);
  flesh_study_store_close(&first);
  if (!status) status = flesh_study_store_read(temporary, &store);
  /* Keep the journal in memory: a merge that is killed half-way is discarded as a whole. */
  if (!status) status = flesh_study_store_execute(&store, "PRAGMA journal_mode = MEMORY");
  for (int p = 1; !status && p < count; p++) status = join(&store, paths[p]);
  if (!status)
    status = flesh_study_store_execute(&store, FLESH_STUDY_PLAN_AGAIN "status = 'running';"
                                               "UPDATE meta SET value = '1/1' WHERE key = 'shard';");
  if (!status && (status = flesh_study_store_make_views(&store)) == FLESH_ERR_ARGUMENT) {
    fprintf(stderr, "flesh sweep merge: %s\n", flesh_error_text()); /* of a derived column; the others are valid */
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
  /* SQLite fills the file, which is empty until then; the file gets its name when it is complete. */
  if (!status) status = merge(out, file.temporary, count - 1, argv + 2);
  if (!status) status = flesh_file_commit(&file);
  flesh_file_abandon(&file);
  return status ? flesh_command_fail("sweep merge", status) : 0;
}

enum { NAME = 120 };

/* Data of a picture; x, y, z and by are columns or expressions of SQLite. */
typedef struct picture {
  flesh_study_store store;
  const char *x, *y, *z, *by, *where, *table, *log, *title;
  char folder[1024], name[NAME];
} picture;

/* Executes a statement and frees it. FLESH_ERR_ARGUMENT with the options if SQLite rejects it. */
static int execute(picture *p, char *sql)
{
  sqlite3_stmt *query = NULL;
  char words[FLESH_STUDY_WORDS];
  if (!sql) return flesh_no_memory();
  int status = FLESH_OK;
  if (sqlite3_prepare_v2(p->store.database, sql, -1, &query, NULL))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: --x %s --y %s%s%s%s%s%s%s: %s%s", p->store.path, p->x, p->y,
                        p->z ? " --z " : "", p->z ? p->z : "", p->by ? " --by " : "", p->by ? p->by : "",
                        p->where ? " --where " : "", p->where ? p->where : "",
                        flesh_study_store_words(&p->store, p->table, words),
                        p->by && strchr(p->by, ',') ? "; --by is one expression, as printf('%s, %s', nu, eta)" : "");
  else if (sqlite3_step(query) != SQLITE_DONE) status = flesh_study_store_fail(&p->store, "cannot be read");
  sqlite3_finalize(query);
  sqlite3_free(sql);
  return status;
}

/* Makes the tables `asked` and `drawn` of plot_ticks.sql. In results only complete cases have a value; the tables of
 * other commands have their own words for a status. */
static int make_tables(picture *p)
{
  const int of_cases = !strcmp(p->table, "results");
  const int status = flesh_study_store_execute(
      &p->store, "CREATE TEMP TABLE asked AS SELECT %Q AS x, %Q AS y, %Q AS z, %Q AS \"by\", %Q AS \"where\", %Q AS log, "
                 "%Q AS title, %Q AS name, %Q AS path",
      p->x, p->y, p->z, p->by, p->where, p->log, p->title, p->name, p->store.path);
  return status ? status : execute(p, sqlite3_mprintf(
      "CREATE TEMP TABLE drawn AS SELECT (%s) AS s, (%s) AS x, (%s) AS y, avg(drawn_value) AS mean, min(drawn_value) AS least, "
      "max(drawn_value) AS most, count(drawn_value) AS valued, count(*) - count(drawn_value) AS bare, max(%s) AS why FROM "
      "(SELECT *, %s(%s)%s AS drawn_value FROM %s WHERE (%s)) GROUP BY 1, 2, 3",
      p->by ? p->by : "0", p->x, p->z ? p->y : "0", of_cases ? "status" : "''",
      of_cases ? "CASE WHEN status = 'complete' THEN " : "",
      p->z ? p->z : p->y, of_cases ? " END" : "", p->table, p->where ? p->where : "1"));
}

static int draw(picture *p)
{
  flesh_plot_outcome outcome = {0};
  const flesh_results to = {.out = p->folder, .picture = p->name, .draw = flesh_plot_draw_noted, .data = &outcome};
  const char *const sql[] = {flesh_own_text("plot_ticks"),
                             flesh_own_text(p->z ? "plot_heat" : "plot_lines"), NULL};
  int status = make_tables(p);
  if (!status) status = flesh_results_make(p->store.database, p->store.path, sql, &to);
  return status ? status : flesh_plot_ended(&outcome);
}

/* Chooses the picture's file: --out, or beside the database with a name made of the columns that it shows. */
static int choose_file(picture *p, const char *database, const char *out)
{
  const char *path = out ? out : database, *slash = strrchr(path, '/');
  int folder = slash ? (int)(slash - path) : 0;
  if (folder >= (int)sizeof p->folder) return flesh_fail(FLESH_ERR_ARGUMENT, "%s: the name is too long", path);
  snprintf(p->folder, sizeof p->folder, "%.*s", slash ? folder + !folder : 1, slash ? path : ".");
  if (out) {
    const char *base = slash ? slash + 1 : out, *dot = strrchr(base, '.');
    if (!dot || strcmp(dot, ".png") || dot == base || dot - base >= NAME)
      return flesh_fail(FLESH_ERR_ARGUMENT, "--out is '%s'; it must be a file NAME.png", out);
    snprintf(p->name, sizeof p->name, "%.*s", (int)(dot - base), base);
  } else {
    snprintf(p->name, sizeof p->name, "%.30s_%.30s%s%.30s", p->z ? p->z : p->y, p->x, p->z ? "_" : "",
             p->z ? p->y : "");
    for (char *c = p->name; *c; c++)
      if (!isalnum((unsigned char)*c)) *c = '_';
  }
  return flesh_output_check_folder(path);
}

/* Fails if a file of the picture would replace the database. */
static int spare_database(const picture *p, const char *database)
{
  char files[3][NAME + 8];
  static const char *const suffixes[] = {".png", ".gp", ".dat"};
  const char *const names[] = {files[0], files[1], files[2], NULL};
  for (int k = 0; k < 3; k++) snprintf(files[k], sizeof files[k], "%.*s%s", NAME, p->name, suffixes[k]);
  flesh_inputs inputs = {0};
  flesh_inputs_add(&inputs, database);
  return flesh_inputs_spare_in(&inputs, p->folder, names, NULL);
}

int flesh_sweep_plot(int argc, char **argv)
{
  picture p = {.store = {.lock = -1}, .log = ""};
  const char *out = NULL;
  int table = 0;
  const flesh_option rows[] = {
      {"x", "COLUMN", FLESH_OPTION_TEXT, &p.x, "horizontal axis: a column, or SQLite's expression of columns"},
      {"y", "COLUMN", FLESH_OPTION_TEXT, &p.y, "vertical axis: the same"},
      {"z", "COLUMN", FLESH_OPTION_TEXT, &p.z, "a heat map: what is shown by colour over x and y"},
      {"by", "COLUMN", FLESH_OPTION_TEXT, &p.by,
       "a line, or with --z a map, for each of its values; of two columns, --by \"printf('%s, %s', nu, eta)\""},
      {"log", "xyz", FLESH_OPTION_TEXT, &p.log, "which of x, y and z are logarithmic, as in --log xy"},
      {"where", "CONDITION", FLESH_OPTION_TEXT, &p.where, "which cases, as in --where \"energy <> 'B'\""},
      {"table", "results|rows", FLESH_OPTION_CHOICE, &table, "as for export"},
      {"title", "TEXT", FLESH_OPTION_TEXT, &p.title, "above the picture"},
      {"out", "FILE.png", FLESH_OPTION_TEXT, &out, "the picture (default beside DB, named for what it shows)"},
      {0}};
  const flesh_usage usage = {"sweep plot", "DB", "Draws results of a sweep.",
                             "Where several cases fall on one point their mean is drawn. The script stays beside the "
                             "picture: `gnuplot NAME.gp` draws it again.\n",
                             1, 1, rows, NULL, 0};
  int count, code = flesh_options_read(&usage, argc, argv, &count), status = FLESH_OK;
  if (code != FLESH_OPTIONS_GO_ON) return code;
  p.table = tables[table];
  if (!p.x || !p.y) status = flesh_fail(FLESH_ERR_ARGUMENT, "--x and --y are needed: columns of the results");
  else if (strspn(p.log, "xyz") != strlen(p.log))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "--log is '%s'; it must be some of x, y and z", p.log);
  if (!status) status = flesh_study_store_read(argv[1], &p.store);
  if (!status) status = choose_file(&p, argv[1], out);
  if (!status) status = spare_database(&p, argv[1]);
  if (!status) status = draw(&p);
  if (!status) printf("%s/%s.png\n", p.folder, p.name);
  flesh_study_store_close(&p.store);
  return status ? flesh_command_fail("sweep plot", status) : 0;
}
