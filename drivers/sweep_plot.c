/* sweep_plot.c: `flesh sweep plot DB`: a figure against an axis as lines, or over two axes as a heat map. */
#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/error.h"
#include "options.h"
#include "plot.h"
#include "plot_text.h"
#include "sweep.h"
#include "sweep_tables.h"

enum { TICKS = 2000, PANELS = 36, NAME = 120 };

typedef struct picture {
  flesh_sweep_store store;
  const char *x, *y, *z, *by, *where, *table, *log, *title;
  char folder[1024], name[NAME];
} picture;

/* Distinct values of a column in order: what stands along an axis, or tells series apart. */
typedef struct ticks {
  int count, words; /* words: some are no numbers */
  char text[TICKS][48];
  double value[TICKS];
} ticks;

static int prepare(picture *p, sqlite3_stmt **query, char *sql)
{
  if (!sql) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  int status = FLESH_OK;
  if (sqlite3_prepare_v2(p->store.database, sql, -1, query, NULL))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: --x %s --y %s%s%s%s%s --where %s: %s", p->store.path, p->x, p->y,
                        p->z ? " --z " : "", p->z ? p->z : "", p->by ? " --by " : "", p->by ? p->by : "", p->where,
                        sqlite3_errmsg(p->store.database));
  sqlite3_free(sql);
  return status;
}

/* A value as a label: numbers short. */
static void label(sqlite3_stmt *query, int column, char text[48])
{
  int type = sqlite3_column_type(query, column);
  if (type == SQLITE_FLOAT || type == SQLITE_INTEGER) snprintf(text, 48, "%.4g", sqlite3_column_double(query, column));
  else if (type == SQLITE_NULL) snprintf(text, 48, "none");
  else snprintf(text, 48, "%.46s", (const char *)sqlite3_column_text(query, column));
}

static int read_ticks(picture *p, const char *column, ticks *t)
{
  sqlite3_stmt *query = NULL;
  *t = (ticks){0};
  if (!column) {
    t->count = 1;
    return FLESH_OK;
  }
  int status = prepare(
      p, &query, sqlite3_mprintf("SELECT DISTINCT (%s) FROM %s WHERE (%s) ORDER BY 1", column, p->table, p->where));
  while (!status && sqlite3_step(query) == SQLITE_ROW) {
    if (t->count == TICKS)
      status = flesh_fail(FLESH_ERR_ARGUMENT, "%s has more than %d values; narrow it by --where", column, TICKS);
    else {
      t->words |= sqlite3_column_type(query, 0) == SQLITE_TEXT;
      t->value[t->count] = sqlite3_column_double(query, 0);
      label(query, 0, t->text[t->count++]);
    }
  }
  sqlite3_finalize(query);
  if (!status && !t->count)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: no case fits --where %s", p->store.path, p->where);
  return status;
}

/* Only complete cases have a value; the tables of other commands have words of their own. */
static char *value_of(const picture *p, const char *figure)
{
  return sqlite3_mprintf(strcmp(p->table, "results") ? "(%s)" : "CASE WHEN status = 'complete' THEN (%s) END", figure);
}

static void write_ticks(FILE *stream, char axis, const ticks *t)
{
  fprintf(stream, "set %ctics noenhanced (", axis);
  for (int k = 0; k < t->count; k++) {
    if (k) fputs(", ", stream);
    flesh_plot_quote(stream, t->text[k]);
    fprintf(stream, " %d", k);
  }
  fputs(")\n", stream);
}

static void write_labels(FILE *stream, const picture *p)
{
  fputs("set xlabel noenhanced\nset ylabel noenhanced\nset xlabel ", stream);
  flesh_plot_quote(stream, p->x);
  fputs("\nset ylabel ", stream);
  flesh_plot_quote(stream, p->y);
  putc('\n', stream);
}

/* One block of data per series: x, mean, least and largest y of the cases there. */
static int write_series(picture *p, const ticks *series, const ticks *along, FILE *stream, int *spread, int *hidden)
{
  sqlite3_stmt *query = NULL;
  char *value = value_of(p, p->y);
  int status = prepare(p, &query,
                       sqlite3_mprintf("SELECT (%s), (%s), avg(v), min(v), max(v), count(v), count(*) - count(v) FROM "
                                       "(SELECT *, %s AS v FROM %s WHERE (%s)) GROUP BY 1, 2 ORDER BY 1, 2",
                                       p->by ? p->by : "0", p->x, value, p->table, p->where));
  sqlite3_free(value);
  int current = -1;
  while (!status && sqlite3_step(query) == SQLITE_ROW) {
    char by[48], x[48];
    int s = 0, at = 0;
    label(query, 0, by);
    label(query, 1, x);
    while (p->by && s < series->count - 1 && strcmp(by, series->text[s])) s++;
    while (at < along->count - 1 && strcmp(x, along->text[at])) at++;
    while (current < s) {
      current++;
      fprintf(stream, "%s# %s\n", current ? "\n\n" : "", series->text[current]);
    }
    *hidden += sqlite3_column_int(query, 6);
    if (!sqlite3_column_int(query, 5)) continue;
    if (sqlite3_column_int(query, 5) > 1) *spread = 1;
    fprintf(stream, "%.17g %.17g %.17g %.17g\n", along->words ? at : sqlite3_column_double(query, 1),
            sqlite3_column_double(query, 2), sqlite3_column_double(query, 3), sqlite3_column_double(query, 4));
  }
  sqlite3_finalize(query);
  return status;
}

static int draw_lines(picture *p)
{
  static const char *const colours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                        "#56b4e9", "#e69f00", "#000000", "#999999"};
  ticks *series = malloc(2 * sizeof *series), *along = series + 1;
  flesh_file file = {0}, data = {0};
  int spread = 0, hidden = 0,
      status = series ? read_ticks(p, p->by, series) : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  if (!status) status = read_ticks(p, p->x, along);
  if (!status) status = flesh_plot_open(p->folder, p->name, ".dat", &data);
  if (!status) status = write_series(p, series, along, data.stream, &spread, &hidden);
  if (!status) status = flesh_file_commit(&data);
  if (!status) status = flesh_plot_open(p->folder, p->name, ".gp", &file);
  if (!status) {
    FILE *stream = file.stream;
    flesh_plot_begin(stream, p->name, 960, 600);
    fputs(
        "set border 3 lc rgb '#606060'\nset tics nomirror out textcolor rgb '#303030'\nset grid lc rgb '#e4e4e4' lw 1\n"
        "set key outside right top Left reverse noenhanced spacing 1.2\nset title noenhanced font ',13'\nset title ",
        stream);
    char title[400];
    if (p->title) snprintf(title, sizeof title, "%.390s", p->title);
    else
      snprintf(title, sizeof title, "%.120s against %.120s%s%s%s", p->y, p->x, p->by ? ", by " : "", p->by ? p->by : "",
               spread ? " (mean; bars: least and largest)" : "");
    flesh_plot_quote(stream, title);
    putc('\n', stream);
    write_labels(stream, p);
    if (strchr(p->log, 'x') && !along->words) fputs("set logscale x\nset format x '%g'\n", stream);
    if (strchr(p->log, 'y')) fputs("set logscale y\nset format y '%g'\n", stream);
    if (along->words) write_ticks(stream, 'x', along);
    /* Many places along x are a sample's, where a line from one to the next would say nothing. */
    const char *style = along->count > 40 ? "points" : "linespoints";
    fputs("set autoscale xfix\nset offsets graph 0.03, graph 0.03, 0, 0\nplot ", stream);
    for (int s = 0; s < series->count; s++) {
      const char *colour = colours[s % 8];
      fprintf(stream, "%s'%s.dat' index %d using 1:2 with %s pt 7 ps 0.7 lw 2 dt %d lc rgb '%s' ",
              s ? ", \\\n     " : "", p->name, s, style, 1 + s / 8, colour);
      fputs(p->by ? "title " : "notitle", stream);
      if (p->by) flesh_plot_quote(stream, series->text[s]);
      if (spread)
        fprintf(stream,
                ", \\\n     '%s.dat' index %d using 1:2:3:4 with yerrorbars pt 7 ps 0.7 lw 1 lc rgb '%s' notitle",
                p->name, s, colour);
    }
    putc('\n', stream);
    status = flesh_file_commit(&file);
  }
  flesh_file_abandon(&data);
  flesh_file_abandon(&file);
  free(series);
  if (!status && hidden) printf("%d cases without a value are not in the picture\n", hidden);
  return status ? status : flesh_plot_draw(p->folder, p->name);
}

/* Panel `s`: rectangles by value, and grey ones that say why there is none. */
static int write_panel(picture *p, const ticks *series, int s, const ticks *x, const ticks *y, double range[2],
                       FILE *stream)
{
  sqlite3_stmt *query = NULL;
  char *value = value_of(p, p->z);
  const char *why = strcmp(p->table, "results") ? "''" : "status";
  int status =
      prepare(p, &query,
              sqlite3_mprintf("SELECT (%s), (%s), (%s), avg(v), count(v), max(%s) FROM (SELECT *, %s AS v FROM %s "
                              "WHERE (%s)) GROUP BY 1, 2, 3",
                              p->by ? p->by : "0", p->x, p->y, why, value, p->table, p->where));
  sqlite3_free(value);
  fprintf(stream, "$panel%d << end_of_data\n", s);
  while (!status && sqlite3_step(query) == SQLITE_ROW) {
    char text[48];
    int column = 0, row = 0;
    label(query, 0, text);
    if (p->by && strcmp(text, series->text[s])) continue;
    label(query, 1, text);
    while (column < x->count - 1 && strcmp(text, x->text[column])) column++;
    label(query, 2, text);
    while (row < y->count - 1 && strcmp(text, y->text[row])) row++;
    double number = sqlite3_column_double(query, 3);
    if (sqlite3_column_int(query, 4) && isfinite(number)) {
      fprintf(stream, "%d %d %.17g \"%.3g\"\n", column, row, number, number);
      range[0] = fmin(range[0], number);
      range[1] = fmax(range[1], number);
    } else {
      const char *words = (const char *)sqlite3_column_text(query, 5);
      fprintf(stream, "%d %d NaN \"%s\"\n", column, row, words && strcmp(words, "complete") ? words : "none");
    }
  }
  fputs("end_of_data\n", stream);
  sqlite3_finalize(query);
  return status;
}

/* Panels side by side, and below one another where they are many; sizes in pixels. */
typedef struct layout {
  int columns, rows, panel_width, panel_height, width, height;
} layout;
enum { LEFT = 90, RIGHT = 110, TOP = 40, BOTTOM = 60, BESIDE = 24, ABOVE = 34 };

static layout lay_out(int panels, int cells_along, int cells_up)
{
  layout l = {.columns = panels <= 3 ? panels : 2};
  while (panels > 3 && l.columns * l.columns < panels) l.columns++;
  l.rows = (panels + l.columns - 1) / l.columns;
  l.panel_width = 54 * (cells_along > 40 ? 40 : cells_along);
  l.panel_height = 34 * (cells_up > 30 ? 30 : cells_up);
  if (l.panel_width < 220) l.panel_width = 220;
  if (l.panel_height < 180) l.panel_height = 180;
  l.width = LEFT + l.columns * l.panel_width + (l.columns - 1) * BESIDE + RIGHT;
  l.height = TOP + l.rows * (l.panel_height + ABOVE) + BOTTOM;
  return l;
}

static void write_frame(FILE *stream, const picture *p, const layout *l, const char *title)
{
  const double width = l->width, height = l->height, right = 1 - RIGHT / width, low = BOTTOM / height;
  const double high = 1 - (TOP + ABOVE) / height;
  fprintf(stream, "set multiplot layout %d,%d margins %.5f,%.5f,%.5f,%.5f spacing %.5f,%.5f title ", l->rows,
          l->columns, LEFT / width, right, low, high, BESIDE / width, ABOVE / height);
  flesh_plot_quote(stream, title);
  fprintf(stream, " noenhanced font ',13'\nset colorbox user origin %.5f,%.5f size %.5f,%.5f\n", right + 20 / width,
          low, 16 / width, high - low);
  /* What x and y are is told once for all panels. */
  fputs("set label 1 ", stream);
  flesh_plot_quote(stream, p->x);
  fprintf(stream, " at screen %.5f,%.5f center noenhanced\nset label 2 ", (LEFT / width + right) / 2, 16 / height);
  flesh_plot_quote(stream, p->y);
  fprintf(stream, " at screen %.5f,%.5f center rotate noenhanced\n", 18 / width, (low + high) / 2);
}

/* Tics of panel `s` stand at the left and below only. */
static void write_edges(FILE *stream, const layout *l, int s, int panels, const ticks *x, const ticks *y)
{
  if (s % l->columns == 0) write_ticks(stream, 'y', y);
  else fputs("set ytics ('' 0)\n", stream);
  if (s + l->columns >= panels) write_ticks(stream, 'x', x);
  else fputs("set xtics ('' 0)\n", stream);
  if (s + l->columns >= panels && x->count > 12) fputs("set xtics rotate by 60 right\n", stream);
}

/* A column by its name and value; expressions speak for themselves. */
static void write_panel_title(FILE *stream, const picture *p, const char *value)
{
  char name[200];
  int is_column = 1;
  for (const char *c = p->by; *c; c++) is_column &= isalnum((unsigned char)*c) || *c == '_';
  while (!is_column && *value == ' ') value++; /* which serve the order */
  snprintf(name, sizeof name, "%.100s%s%s", is_column ? p->by : "", is_column ? " = " : "", value);
  fputs("set title ", stream);
  flesh_plot_quote(stream, name);
  putc('\n', stream);
}

static void write_heat(picture *p, const ticks *series, const ticks *x, const ticks *y, const layout *l,
                       double range[2], FILE *stream)
{
  int logarithmic = strchr(p->log, 'z') && range[0] > 0, panels = series->count;
  int cells = x->count * y->count <= 150; /* numbers are readable */
  if (!(range[1] > range[0])) range[1] = range[0] + 1;
  fputs("set style fill solid noborder\nset border 0\nset tics scale 0 textcolor rgb '#303030'\nunset key\n"
        "set palette defined (0 '#fff7ec', 0.2 '#fdd49e', 0.45 '#fc8d59', 0.7 '#d7301f', 1 '#6a0000')\n",
        stream);
  if (logarithmic) fputs("set logscale cb\nset format cb '%g'\n", stream);
  fprintf(stream, "set cbrange [%.17g:%.17g]\nset cblabel noenhanced\nset cblabel ", range[0], range[1]);
  flesh_plot_quote(stream, p->z);
  fprintf(stream, "\nset xrange [-0.5:%g]\nset yrange [-0.5:%g]\n",
          x->count - 0.5, y->count - 0.5);
  /* Dark cells get light numbers. */
  double dark =
      logarithmic ? exp(log(range[0]) + 0.6 * log(range[1] / range[0])) : range[0] + 0.6 * (range[1] - range[0]);
  fprintf(stream, "dark = %.17g\nset title noenhanced\n", dark);
  char title[400];
  if (p->title) snprintf(title, sizeof title, "%.390s", p->title);
  else snprintf(title, sizeof title, "%.120s over %.100s and %.100s", p->z, p->x, p->y);
  write_frame(stream, p, l, title);
  for (int s = 0; s < panels; s++) {
    if (p->by) write_panel_title(stream, p, series->text[s]);
    write_edges(stream, l, s, panels, x, y);
    if (s == 1) fputs("unset colorbox\nunset label\n", stream);
    fprintf(stream,
            "plot $panel%d using 1:2:(0.49):(0.49) with boxxyerror lc rgb '#d8d8d8', \\\n"
            "     $panel%d using 1:2:(0.49):(0.49):3 with boxxyerror lc palette",
            s, s);
    if (cells)
      fprintf(
          stream,
          ", \\\n     $panel%d using 1:2:(stringcolumn(4)):($3 > dark ? 0xffffff : 0x202020) with labels noenhanced "
          "font ',9' tc rgb variable",
          s);
    putc('\n', stream);
  }
  fputs("unset multiplot\n", stream);
}

static int draw_heat(picture *p)
{
  ticks *series = malloc(3 * sizeof *series), *x = series + 1, *y = series + 2;
  flesh_file file = {0};
  layout l = {0};
  double range[2] = {INFINITY, -INFINITY};
  int status = series ? read_ticks(p, p->by, series) : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  if (!status) status = read_ticks(p, p->x, x);
  if (!status) status = read_ticks(p, p->y, y);
  if (!status && series->count > PANELS)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "--by %s has %d values; there is room for %d maps; narrow it by --where",
                        p->by, series->count, PANELS);
  if (!status) status = flesh_plot_open(p->folder, p->name, ".gp", &file);
  if (!status) {
    l = lay_out(series->count, x->count, y->count);
    flesh_plot_begin(file.stream, p->name, l.width, l.height);
    for (int s = 0; !status && s < series->count; s++) status = write_panel(p, series, s, x, y, range, file.stream);
    if (!status && !(range[1] >= range[0]))
      status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: no complete case has a value of %s", p->store.path, p->z);
  }
  if (!status) {
    write_heat(p, series, x, y, &l, range, file.stream);
    status = flesh_file_commit(&file);
  }
  flesh_file_abandon(&file);
  free(series);
  return status ? status : flesh_plot_draw(p->folder, p->name);
}

/* Where the picture goes: beside the database, named for what it shows, unless told. */
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
  return FLESH_OK;
}

int flesh_sweep_plot(int argc, char **argv)
{
  picture p = {.store = {.lock = -1}, .where = "1", .table = "results", .log = ""};
  const char *out = NULL;
  const flesh_option rows[] = {
      {"x", "COLUMN", FLESH_OPTION_TEXT, &p.x, "what goes to the right: a column or SQLite's expression of some"},
      {"y", "COLUMN", FLESH_OPTION_TEXT, &p.y, "what goes upwards"},
      {"z", "COLUMN", FLESH_OPTION_TEXT, &p.z, "a heat map: what the colours over x and y show"},
      {"by", "COLUMN", FLESH_OPTION_TEXT, &p.by, "a line, or with --z a map, for each of its values"},
      {"log", "xyz", FLESH_OPTION_TEXT, &p.log, "which of x, y and z are logarithmic, as in --log xy"},
      {"where", "CONDITION", FLESH_OPTION_TEXT, &p.where, "which cases, as in --where \"energy <> 'B'\""},
      {"table", "results|rows", FLESH_OPTION_TEXT, &p.table, "as for export"},
      {"title", "TEXT", FLESH_OPTION_TEXT, &p.title, "above the picture"},
      {"out", "FILE.png", FLESH_OPTION_TEXT, &out, "the picture (default beside DB, named for what it shows)"},
      {0}};
  const flesh_usage usage = {"sweep plot", "DB", "Draws results of a sweep.",
                             "Where several cases fall on one point their mean is drawn. The script stays beside the "
                             "picture: `gnuplot NAME.gp` draws it again.\n",
                             1, 1, rows};
  int count, code = flesh_options_read(&usage, argc, argv, &count), status = FLESH_OK;
  if (code != FLESH_OPTIONS_GO_ON) return code;
  if (!p.x || !p.y) status = flesh_fail(FLESH_ERR_ARGUMENT, "--x and --y are needed: columns of the results");
  else if (strspn(p.log, "xyz") != strlen(p.log))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "--log is '%s'; it must be some of x, y and z", p.log);
  else if (strcmp(p.table, "results") && strcmp(p.table, "rows"))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "--table is '%s'; it must be results or rows", p.table);
  if (!status) status = flesh_sweep_store_read(argv[1], &p.store);
  if (!status) status = place(&p, argv[1], out);
  if (!status) status = p.z ? draw_heat(&p) : draw_lines(&p);
  if (!status) printf("%s/%s.png\n", p.folder, p.name);
  flesh_sweep_store_close(&p.store);
  return status ? flesh_command_fail("sweep plot", status) : 0;
}
