/* plot.c: `flesh sweep plot DB`: a figure against an axis as lines, or over two axes as a heat map. */
#include "sweep/plot.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "cli/inputs.h"
#include "cli/options.h"
#include "picture/plot.h"
#include "picture/plot_text.h"

/* Counts of the cases by whether the picture shows them. */
typedef struct shown {
  int points, spread; /* spread: several cases on one point */
  int bare, beyond_log; /* without a value; not positive on a logarithmic axis */
  double least, most;   /* of y */
} shown;

/* No block is empty: gnuplot would count the next in its place. */
static void begin_block(int number, FILE *stream)
{
  fprintf(stream, "%sNaN NaN NaN NaN\n", number ? "\n\n" : "");
}

/* One block of data per series: x, mean, least and largest y of the cases there. */
static int write_series(flesh_sweep_picture *p, const flesh_sweep_ticks *series, const flesh_sweep_ticks *along,
                        FILE *stream, shown *what)
{
  sqlite3_stmt *query = NULL;
  char *value = flesh_sweep_plot_value(p, p->y);
  int status = flesh_sweep_plot_prepare(
      p, &query,
      sqlite3_mprintf("SELECT dense_rank() OVER (ORDER BY s) - 1, dense_rank() OVER (ORDER BY x) - 1, x, mean, least, "
                      "most, valued, bare FROM (SELECT (%s) AS s, (%s) AS x, avg(drawn_value) AS mean, "
                      "min(drawn_value) AS least, max(drawn_value) AS most, count(drawn_value) AS valued, "
                      "count(*) - count(drawn_value) AS bare FROM (SELECT *, %s AS drawn_value FROM %s WHERE (%s)) "
                      "GROUP BY 1, 2) ORDER BY 1, 2",
                      p->by ? p->by : "0", p->x, value, p->table, flesh_sweep_condition(p)));
  sqlite3_free(value);
  int log_x = strchr(p->log, 'x') && !along->words, log_y = strchr(p->log, 'y') != NULL, current = -1;
  while (!status && flesh_sweep_plot_next(p, query, &status)) {
    int s = sqlite3_column_int(query, 0), valued = sqlite3_column_int(query, 6);
    while (current < s) begin_block(++current, stream);
    double x = along->words ? sqlite3_column_int(query, 1) : sqlite3_column_double(query, 2);
    what->bare += sqlite3_column_int(query, 7);
    if (!valued) continue;
    if ((log_x && !(x > 0)) || (log_y && !(sqlite3_column_double(query, 4) > 0))) {
      what->beyond_log += valued;
      continue;
    }
    if (!what->points++) what->least = what->most = sqlite3_column_double(query, 4);
    what->least = fmin(what->least, sqlite3_column_double(query, 4));
    what->most = fmax(what->most, sqlite3_column_double(query, 5));
    if (valued > 1) what->spread = 1;
    fprintf(stream, "%.17g %.17g %.17g %.17g\n", x, sqlite3_column_double(query, 3), sqlite3_column_double(query, 4),
            sqlite3_column_double(query, 5));
  }
  while (current < series->count - 1) begin_block(++current, stream);
  sqlite3_finalize(query);
  return status;
}

static void write_lines(const flesh_sweep_picture *p, const flesh_sweep_ticks *series, const flesh_sweep_ticks *along,
                        const shown *what, FILE *stream)
{
  char title[400];
  flesh_plot_begin(stream, p->name, 960, 600);
  flesh_plot_style(stream, 0);
  if (p->title) snprintf(title, sizeof title, "%.390s", p->title);
  else
    snprintf(title, sizeof title, "%.120s against %.120s%s%s%s", p->y, p->x, p->by ? ", by " : "", p->by ? p->by : "",
             what->spread ? " (mean; bars: least and largest)" : "");
  flesh_plot_title(stream, title);
  flesh_plot_label(stream, "x", p->x);
  flesh_plot_label(stream, "y", p->y);
  if (strchr(p->log, 'x') && !along->words) {
    fputs("set logscale x\nset format x '%g'\n", stream);
    int first = 0; /* they are in order */
    while (first < along->count - 1 && !(along->value[first] > 0)) first++;
    flesh_plot_log_ticks(stream, "x", along->value[first], along->value[along->count - 1]);
  }
  if (strchr(p->log, 'y')) fputs("set logscale y\nset format y '%g'\n", stream);
  if (strchr(p->log, 'y')) flesh_plot_log_ticks(stream, "y", what->least, what->most);
  if (along->words) flesh_sweep_ticks_write(stream, 'x', along);
  /* Many places along x are a sample's, where a line from one to the next would say nothing. */
  const char *style = along->count > 40 ? "points" : "linespoints";
  fputs("set autoscale xfix\nset offsets graph 0.03, graph 0.03, 0, 0\nplot ", stream);
  for (int s = 0; s < series->count; s++) {
    const char *colour = flesh_plot_colour(s);
    if (s) fputs(", \\\n     ", stream);
    flesh_plot_quote_file(stream, p->name, ".dat");
    fprintf(stream, " index %d using 1:2 with %s pt 7 ps 0.7 lw 2 dt %d lc rgb '%s' ", s, style, 1 + s / 8, colour);
    fputs(p->by ? "title " : "notitle", stream);
    if (p->by) flesh_plot_quote(stream, series->label[s]);
    if (!what->spread) continue;
    fputs(", \\\n     ", stream);
    flesh_plot_quote_file(stream, p->name, ".dat");
    fprintf(stream, " index %d using 1:2:3:4 with yerrorbars pt 7 ps 0.7 lw 1 lc rgb '%s' notitle", s, colour);
  }
  putc('\n', stream);
}

static int draw_lines(flesh_sweep_picture *p)
{
  flesh_sweep_ticks *series = malloc(2 * sizeof *series), *along = series + 1;
  flesh_file file = {0}, data = {0};
  shown what = {0};
  int status = series ? flesh_sweep_ticks_read(p, p->by, series) : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  if (!status) status = flesh_sweep_ticks_read(p, p->x, along);
  if (!status) status = flesh_plot_open(p->folder, p->name, ".dat", &data);
  if (!status) status = write_series(p, series, along, data.stream, &what);
  if (!status && !what.points)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: no case has a value of %s that could be drawn", p->store.path, p->y);
  if (!status) status = flesh_file_commit(&data);
  if (!status) status = flesh_plot_open(p->folder, p->name, ".gp", &file);
  if (!status) {
    write_lines(p, series, along, &what, file.stream);
    status = flesh_file_commit(&file);
  }
  flesh_file_abandon(&data);
  flesh_file_abandon(&file);
  free(series);
  if (!status && what.bare) printf("%d cases without a value are not in the picture\n", what.bare);
  if (!status && what.beyond_log)
    printf("%d cases are not in the picture: a logarithmic axis shows positive values only\n", what.beyond_log);
  return status ? status : flesh_plot_draw(p->folder, p->name);
}

/* Chooses the picture's file: --out, else beside the database, named for the columns that it shows. */
static int place(flesh_sweep_picture *p, const char *database, const char *out)
{
  const char *path = out ? out : database, *slash = strrchr(path, '/');
  int folder = slash ? (int)(slash - path) : 0;
  if (folder >= (int)sizeof p->folder) return flesh_fail(FLESH_ERR_ARGUMENT, "%s: the name is too long", path);
  snprintf(p->folder, sizeof p->folder, "%.*s", slash ? folder + !folder : 1, slash ? path : ".");
  if (out) {
    const char *base = slash ? slash + 1 : out, *dot = strrchr(base, '.');
    if (!dot || strcmp(dot, ".png") || dot == base || dot - base >= FLESH_SWEEP_NAME)
      return flesh_fail(FLESH_ERR_ARGUMENT, "--out is '%s'; it must be a file NAME.png", out);
    snprintf(p->name, sizeof p->name, "%.*s", (int)(dot - base), base);
  } else {
    snprintf(p->name, sizeof p->name, "%.30s_%.30s%s%.30s", p->z ? p->z : p->y, p->x, p->z ? "_" : "",
             p->z ? p->y : "");
    for (char *c = p->name; *c; c++)
      if (!isalnum((unsigned char)*c)) *c = '_';
  }
  return FLESH_OK;
}

/* The picture's files must not take the database's place. */
static int spare_database(const flesh_sweep_picture *p, const char *database)
{
  char files[3][FLESH_SWEEP_NAME + 8];
  static const char *const suffixes[] = {".png", ".gp", ".dat"};
  const char *const names[] = {files[0], files[1], files[2], NULL};
  for (int k = 0; k < 3; k++) snprintf(files[k], sizeof files[k], "%.*s%s", FLESH_SWEEP_NAME, p->name, suffixes[k]);
  flesh_inputs inputs = {0};
  flesh_inputs_add(&inputs, database);
  int status = flesh_inputs_spare_in(&inputs, p->folder, names, NULL);
  flesh_inputs_close(&inputs);
  return status;
}

int flesh_sweep_plot(int argc, char **argv)
{
  flesh_sweep_picture p = {.store = {.lock = -1}, .table = "results", .log = ""};
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
  if (!status) status = p.z ? flesh_sweep_plot_heat(&p) : draw_lines(&p);
  if (!status) printf("%s/%s.png\n", p.folder, p.name);
  flesh_study_store_close(&p.store);
  return status ? flesh_command_fail("sweep plot", status) : 0;
}
