/* heat.c: a figure of a sweep over two axes as heat maps; queries for its pictures, and the distinct values along axes. */
#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "cli/safe_text.h"
#include "picture/plot.h"
#include "picture/plot_text.h"
#include "study/table.h"
#include "sweep/plot.h"

int flesh_sweep_plot_prepare(flesh_sweep_picture *p, sqlite3_stmt **query, char *sql)
{
  if (!sql) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  int status = FLESH_OK;
  if (sqlite3_prepare_v2(p->store.database, sql, -1, query, NULL))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: --x %s --y %s%s%s%s%s%s%s: %s%s", p->store.path, p->x, p->y,
                        p->z ? " --z " : "", p->z ? p->z : "", p->by ? " --by " : "", p->by ? p->by : "",
                        p->where ? " --where " : "", p->where ? p->where : "", sqlite3_errmsg(p->store.database),
                        p->by && strchr(p->by, ',') ? "; --by is one expression, as printf('%s, %s', nu, eta)" : "");
  sqlite3_free(sql);
  return status;
}

int flesh_sweep_plot_next(const flesh_sweep_picture *p, sqlite3_stmt *query, int *status)
{
  const int code = sqlite3_step(query);
  if (code != SQLITE_ROW && code != SQLITE_DONE) *status = flesh_study_store_fail(&p->store, "cannot be read");
  return code == SQLITE_ROW;
}

/* A word as a label: cut between letters where it is long. */
static void label_word(const char *word, char label[FLESH_SWEEP_LABEL])
{
  static const char more[] = "...";
  size_t room = FLESH_SWEEP_LABEL - sizeof more, length = 0;
  while (word[length]) {
    int size = flesh_text_letter(word + length);
    if (length + (size_t)(size ? size : 1) > room) break;
    length += (size_t)(size ? size : 1);
  }
  snprintf(label, FLESH_SWEEP_LABEL, "%.*s%s", (int)length, word, word[length] ? more : "");
}

/* Numbers with as many digits as distinguish them, four at least. */
static void label_numbers(flesh_sweep_ticks *t)
{
  for (int k = 0; k < t->count; k++) {
    if (!t->is_number[k]) continue;
    for (int digits = 4; digits <= 17; digits++) {
      int distinct = 1;
      snprintf(t->label[k], FLESH_SWEEP_LABEL, "%.*g", digits, t->value[k]);
      for (int other = k - 1; other <= k + 1 && distinct; other += 2) { /* they are in order */
        char text[FLESH_SWEEP_LABEL];
        if (other < 0 || other >= t->count || !t->is_number[other]) continue;
        snprintf(text, sizeof text, "%.*g", digits, t->value[other]);
        distinct = strcmp(text, t->label[k]) != 0;
      }
      if (distinct) break;
    }
  }
}

int flesh_sweep_ticks_read(flesh_sweep_picture *p, const char *column, flesh_sweep_ticks *t)
{
  sqlite3_stmt *query = NULL;
  *t = (flesh_sweep_ticks){0};
  if (!column) {
    t->count = 1;
    return FLESH_OK;
  }
  int status = flesh_sweep_plot_prepare(
      p, &query, sqlite3_mprintf("SELECT DISTINCT (%s) FROM %s WHERE (%s) ORDER BY 1", column, p->table,
                                 flesh_sweep_condition(p)));
  while (!status && flesh_sweep_plot_next(p, query, &status)) {
    int k = t->count, type = sqlite3_column_type(query, 0);
    if (k == FLESH_SWEEP_TICKS) {
      status = flesh_fail(FLESH_ERR_ARGUMENT, "%s has more than %d values; narrow it by --where", column, k);
      continue;
    }
    t->is_number[k] = type == SQLITE_FLOAT || type == SQLITE_INTEGER;
    t->words |= !t->is_number[k];
    t->value[k] = sqlite3_column_double(query, 0);
    const char *word = (const char *)sqlite3_column_text(query, 0);
    if (!t->is_number[k]) label_word(word ? word : "none", t->label[k]);
    t->count++;
  }
  sqlite3_finalize(query);
  label_numbers(t);
  if (!status && !t->count)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: %s%s", p->store.path,
                        p->where ? "no case fits --where " : "there are no cases", p->where ? p->where : "");
  return status;
}

/* Only complete cases have a value; the tables of other commands have words of their own. */
char *flesh_sweep_plot_value(const flesh_sweep_picture *p, const char *figure)
{
  return sqlite3_mprintf(strcmp(p->table, "results") ? "(%s)" : "CASE WHEN status = 'complete' THEN (%s) END", figure);
}

void flesh_sweep_ticks_write(FILE *stream, char axis, const flesh_sweep_ticks *t)
{
  fprintf(stream, "set %ctics noenhanced (", axis);
  for (int k = 0; k < t->count; k++) {
    if (k) fputs(", ", stream);
    flesh_plot_quote_tick(stream, t->label[k]);
    fprintf(stream, " %d", k);
  }
  fputs(")\n", stream);
}

enum { PANELS = 36 };

/* Panel `s`: rectangles by value, and grey ones that say why there is none. */
static int write_panel(flesh_sweep_picture *p, int s, double range[2], int *letters, FILE *stream)
{
  sqlite3_stmt *query = NULL;
  char *value = flesh_sweep_plot_value(p, p->z);
  const char *why = strcmp(p->table, "results") ? "''" : "status";
  int status =
      flesh_sweep_plot_prepare(
          p, &query,
          sqlite3_mprintf("SELECT dense_rank() OVER (ORDER BY s) - 1, dense_rank() OVER (ORDER BY x) - 1, "
                          "dense_rank() OVER (ORDER BY y) - 1, mean, valued, why FROM (SELECT (%s) AS s, (%s) AS x, "
                          "(%s) AS y, avg(drawn_value) AS mean, count(drawn_value) AS valued, max(%s) AS why FROM "
                          "(SELECT *, %s AS drawn_value FROM %s WHERE (%s)) GROUP BY 1, 2, 3)",
                          p->by ? p->by : "0", p->x, p->y, why, value, p->table, flesh_sweep_condition(p)));
  sqlite3_free(value);
  fprintf(stream, "$panel%d << end_of_data\n", s);
  while (!status && flesh_sweep_plot_next(p, query, &status)) {
    if (sqlite3_column_int(query, 0) != s) continue;
    int column = sqlite3_column_int(query, 1), row = sqlite3_column_int(query, 2);
    double number = sqlite3_column_double(query, 3);
    if (sqlite3_column_int(query, 4) && isfinite(number)) {
      char text[FLESH_TABLE_TEXT];
      size_t length = strlen(flesh_table_text(text, "%.3g", number));
      if ((int)length > *letters) *letters = (int)length;
      fprintf(stream, "%d %d %.17g \"%s\"\n", column, row, number, text);
      range[0] = fmin(range[0], number);
      range[1] = fmax(range[1], number);
    } else {
      const char *words = (const char *)sqlite3_column_text(query, 5);
      fprintf(stream, "%d %d NaN ", column, row);
      flesh_plot_quote(stream, words && strcmp(words, "complete") ? words : "none");
      putc('\n', stream);
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
enum { LEFT = 90, RIGHT = 135, TOP = 40, BOTTOM = 60, BESIDE = 24, ABOVE = 34 };

static layout lay_out(int panels, int cells_along, int cells_up, int letters)
{
  layout l = {.columns = panels <= 3 ? panels : 2};
  while (panels > 3 && l.columns * l.columns < panels) l.columns++;
  l.rows = (panels + l.columns - 1) / l.columns;
  int cell = letters > 6 ? 54 + 7 * (letters - 6) : 54; /* as wide as its number */
  l.panel_width = cell * (cells_along > 40 ? 40 : cells_along);
  l.panel_height = 34 * (cells_up > 30 ? 30 : cells_up);
  if (l.panel_width < 220) l.panel_width = 220;
  if (l.panel_height < 180) l.panel_height = 180;
  l.width = LEFT + l.columns * l.panel_width + (l.columns - 1) * BESIDE + RIGHT;
  l.height = TOP + l.rows * (l.panel_height + ABOVE) + BOTTOM;
  return l;
}

static void write_frame(FILE *stream, const flesh_sweep_picture *p, const layout *l, const char *title)
{
  const double width = l->width, height = l->height, right = 1 - RIGHT / width, low = BOTTOM / height;
  const double high = 1 - (TOP + ABOVE) / height;
  fprintf(stream, "set multiplot layout %d,%d margins %.5f,%.5f,%.5f,%.5f spacing %.5f,%.5f title ", l->rows,
          l->columns, LEFT / width, right, low, high, BESIDE / width, ABOVE / height);
  flesh_plot_quote(stream, title);
  fprintf(stream, " noenhanced font ',13'\nset colorbox user origin %.5f,%.5f size %.5f,%.5f\n", right + 20 / width,
          low, 16 / width, high - low);
  /* The labels of x and y are written once for all panels. */
  fputs("set label 1 ", stream);
  flesh_plot_quote(stream, p->x);
  fprintf(stream, " at screen %.5f,%.5f center noenhanced\nset label 2 ", (LEFT / width + right) / 2, 16 / height);
  flesh_plot_quote(stream, p->y);
  fprintf(stream, " at screen %.5f,%.5f center rotate noenhanced\n", 18 / width, (low + high) / 2);
}

/* Tics of panel `s` stand at the left and below only. */
static void write_edges(FILE *stream, const layout *l, int s, int panels, const flesh_sweep_ticks *x,
                        const flesh_sweep_ticks *y)
{
  if (s % l->columns == 0) flesh_sweep_ticks_write(stream, 'y', y);
  else fputs("set ytics ('' 0)\n", stream);
  if (s + l->columns >= panels) flesh_sweep_ticks_write(stream, 'x', x);
  else fputs("set xtics ('' 0)\n", stream);
  if (s + l->columns >= panels && x->count > 12) fputs("set xtics rotate by 60 right\n", stream);
}

/* A column by its name and value; expressions speak for themselves. */
static void write_panel_title(FILE *stream, const flesh_sweep_picture *p, const char *value)
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

static void write_heat(flesh_sweep_picture *p, const flesh_sweep_ticks *series, const flesh_sweep_ticks *x,
                       const flesh_sweep_ticks *y, const layout *l, double range[2], FILE *stream)
{
  int logarithmic = strchr(p->log, 'z') && range[0] > 0, panels = series->count;
  int cells = x->count * y->count <= 150; /* numbers are readable */
  if (!(range[1] > range[0])) range[1] = range[0] + 1;
  fputs("set style fill solid noborder\nset border 0\nset tics scale 0 textcolor rgb '#303030'\nunset key\n"
        "set palette defined (0 '#fff7ec', 0.2 '#fdd49e', 0.45 '#fc8d59', 0.7 '#d7301f', 1 '#6a0000')\n",
        stream);
  if (logarithmic) fputs("set logscale cb\nset format cb '%g'\n", stream);
  if (logarithmic) flesh_plot_log_ticks(stream, "cb", range[0], range[1]);
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
    if (p->by) write_panel_title(stream, p, series->label[s]);
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

int flesh_sweep_plot_heat(flesh_sweep_picture *p)
{
  flesh_sweep_ticks *series = malloc(3 * sizeof *series), *x = series + 1, *y = series + 2;
  flesh_file file = {0};
  layout l = {0};
  double range[2] = {INFINITY, -INFINITY};
  int status = series ? flesh_sweep_ticks_read(p, p->by, series) : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  if (!status) status = flesh_sweep_ticks_read(p, p->x, x);
  if (!status) status = flesh_sweep_ticks_read(p, p->y, y);
  if (!status && series->count > PANELS)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "--by %s has %d values; there is room for %d maps; narrow it by --where",
                        p->by, series->count, PANELS);
  if (!status) status = flesh_plot_open(p->folder, p->name, ".gp", &file);
  if (!status) {
    int letters = 0;
    for (int s = 0; !status && s < series->count; s++) status = write_panel(p, s, range, &letters, file.stream);
    l = lay_out(series->count, x->count, y->count, letters);
    flesh_plot_begin(file.stream, p->name, l.width, l.height);
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
