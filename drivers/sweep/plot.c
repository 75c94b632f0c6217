/* plot.c: `flesh sweep plot DB`: a figure against an axis as lines, or over two axes as a heat map. */
#include <ctype.h>
#include <stdio.h>

#include "base/error.h"
#include "cli/inputs.h"
#include "cli/options.h"
#include "cli/output.h"
#include "picture/plot.h"
#include "study/embedded.h"
#include "study/results.h"
#include "sweep/sweep.h"

enum { NAME = 120 };

/* The options; x, y, z and by are columns or SQLite's expressions. */
typedef struct picture {
  flesh_study_store store;
  const char *x, *y, *z, *by, *where, *table, *log, *title;
  char folder[1024], name[NAME];
} picture;

/* Executes the statement, which is freed. FLESH_ERR_ARGUMENT with the options where SQLite does not take it. */
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

/* The tables `asked` and `drawn` of plot_ticks.sql. Only complete cases have a value; the tables of other commands have words
 * of their own. */
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

/* Chooses the picture's file: --out, else beside the database, named for the columns that it shows. */
static int place(picture *p, const char *database, const char *out)
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

/* The picture's files must not take the database's place. */
static int spare_database(const picture *p, const char *database)
{
  char files[3][NAME + 8];
  static const char *const suffixes[] = {".png", ".gp", ".dat"};
  const char *const names[] = {files[0], files[1], files[2], NULL};
  for (int k = 0; k < 3; k++) snprintf(files[k], sizeof files[k], "%.*s%s", NAME, p->name, suffixes[k]);
  flesh_inputs inputs = {0};
  flesh_inputs_add(&inputs, database);
  int status = flesh_inputs_spare_in(&inputs, p->folder, names, NULL);
  flesh_inputs_close(&inputs);
  return status;
}

int flesh_sweep_plot(int argc, char **argv)
{
  picture p = {.store = {.lock = -1}, .table = "results", .log = ""};
  const char *out = NULL;
  const flesh_option rows[] = {
      {"x", "COLUMN", FLESH_OPTION_TEXT, &p.x, "horizontal axis: a column, or SQLite's expression of columns"},
      {"y", "COLUMN", FLESH_OPTION_TEXT, &p.y, "vertical axis: the same"},
      {"z", "COLUMN", FLESH_OPTION_TEXT, &p.z, "a heat map: what is shown by colour over x and y"},
      {"by", "COLUMN", FLESH_OPTION_TEXT, &p.by,
       "a line, or with --z a map, for each of its values; of two columns, --by \"printf('%s, %s', nu, eta)\""},
      {"log", "xyz", FLESH_OPTION_TEXT, &p.log, "which of x, y and z are logarithmic, as in --log xy"},
      {"where", "CONDITION", FLESH_OPTION_TEXT, &p.where, "which cases, as in --where \"energy <> 'B'\""},
      {"table", "results|rows", FLESH_OPTION_TEXT, &p.table, "as for export"},
      {"title", "TEXT", FLESH_OPTION_TEXT, &p.title, "above the picture"},
      {"out", "FILE.png", FLESH_OPTION_TEXT, &out, "the picture (default beside DB, named for what it shows)"},
      {0}};
  const flesh_usage usage = {"sweep plot", "DB", "Draws results of a sweep.",
                             "Where several cases fall on one point their mean is drawn. The script stays beside the "
                             "picture: `gnuplot NAME.gp` draws it again.\n",
                             1, 1, rows, NULL, 0};
  int count, code = flesh_options_read(&usage, argc, argv, &count), status = FLESH_OK;
  if (code != FLESH_OPTIONS_GO_ON) return code;
  if (!p.x || !p.y) status = flesh_fail(FLESH_ERR_ARGUMENT, "--x and --y are needed: columns of the results");
  else if (strspn(p.log, "xyz") != strlen(p.log))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "--log is '%s'; it must be some of x, y and z", p.log);
  else if (strcmp(p.table, "results") && strcmp(p.table, "rows"))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "--table is '%s'; it must be results or rows", p.table);
  if (!status) status = flesh_study_store_read(argv[1], &p.store);
  if (!status) status = place(&p, argv[1], out);
  if (!status) status = spare_database(&p, argv[1]);
  if (!status) status = draw(&p);
  if (!status) printf("%s/%s.png\n", p.folder, p.name);
  flesh_study_store_close(&p.store);
  return status ? flesh_command_fail("sweep plot", status) : 0;
}
