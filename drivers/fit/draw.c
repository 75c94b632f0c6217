/* draw.c: fit.png: a row for each file of measurements, with the fit at the left and the residuals at the right. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/text.h"
#include "fit/fit.h"
#include "picture/plot.h"
#include "picture/plot_text.h"
#include "study/table.h"

/* Rows of the picture, and quantities of a row, that are drawn. */
enum { ROWS = 6, QUANTITIES = 8, WIDTH = 1200, HEIGHT = 340 };

typedef struct row {
  const flesh_fit_experiment *experiment;
  const flesh_fit_measured *measured;
  int first; /* of its numbers among all */
} row;

static int list_rows(const flesh_fit *fit, row rows[ROWS])
{
  int count = 0, first = 0;
  for (int e = 0; e < fit->experiment_count; e++)
    for (int k = 0; k < fit->experiments[e].measured_count; k++) {
      if (count < ROWS) rows[count++] = (row){&fit->experiments[e], &fit->experiments[e].measured[k], first};
      first += fit->experiments[e].measured[k].count;
    }
  return count;
}

static int drawn_quantities(const row *r)
{
  return r->measured->quantity_count < QUANTITIES ? r->measured->quantity_count : QUANTITIES;
}

static int has_times(const row *r)
{
  for (int d = 0; d < r->measured->count; d++)
    if (isnan(r->measured->data[d].t)) return 0;
  return 1;
}

/* A block for each quantity of each row: abscissa, measured, deviation, fitted, residual. */
static int write_data(const flesh_fit *fit, const double *values, int count, const row *rows)
{
  flesh_file file;
  const int status = flesh_table_open(fit->out, "fit.dat", &file);
  if (status) return status;
  for (int k = 0; k < count; k++)
    for (int q = 0; q < drawn_quantities(&rows[k]); q++) {
      for (int d = 0; d < rows[k].measured->count; d++) {
        const flesh_fit_datum *datum = &rows[k].measured->data[d];
        const double fitted = values[rows[k].first + d], x = has_times(&rows[k]) ? datum->t : datum->row + 1;
        if (datum->quantity == q)
          fprintf(file.stream, "%.9g %.9g %.9g %.9g %.9g\n", x, datum->value, datum->deviation, fitted,
                  flesh_fit_residual(fit, rows[k].first + d, values));
      }
      fputs("\n\n", file.stream);
    }
  return flesh_file_commit(&file);
}

static void label_values(FILE *stream, const row *r)
{
  char text[2 * FLESH_CSV_NAME + 8];
  const flesh_fit_quantity *q = r->measured->quantities;
  int same = 1;
  for (int k = 1; k < drawn_quantities(r); k++) same &= !strcmp(q[k].unit, q->unit);
  snprintf(text, sizeof text, "%s%s%s%s", r->measured->quantity_count == 1 ? q->name : "", same && *q->unit ? " [" : "",
           same ? q->unit : "", same && *q->unit ? "]" : "");
  flesh_plot_label(stream, "y", text);
}

static void draw_row(FILE *stream, const row *r, int block)
{
  const int count = drawn_quantities(r);
  char title[200];
  snprintf(title, sizeof title, "%.80s: measured (points) and fitted (lines)", r->experiment->name);
  flesh_plot_title(stream, title);
  flesh_plot_label(stream, "x", has_times(r) ? "t [s]" : "row");
  label_values(stream, r);
  fputs("plot ", stream);
  for (int q = 0; q < count; q++) {
    fprintf(stream, "%s'fit.dat' index %d using 1:2:3 with yerrorbars pt 7 ps 0.6 lc rgb '%s' title ", q ? ", " : "", block + q,
            flesh_plot_colour(q));
    flesh_plot_quote(stream, r->measured->quantities[q].name);
    fprintf(stream, ", '' index %d using 1:4 with %s lc rgb '%s' notitle", block + q,
            has_times(r) ? "lines lw 2" : "points pt 4 ps 1", flesh_plot_colour(q));
  }
  fputc('\n', stream);
  flesh_plot_title(stream, "residuals");
  flesh_plot_label(stream, "y", "(fitted - measured) / deviation");
  fputs("plot 0 lc rgb '#606060' notitle", stream);
  for (int q = 0; q < count; q++)
    fprintf(stream, ", 'fit.dat' index %d using 1:5 with points pt 7 ps 0.6 lc rgb '%s' notitle", block + q,
            flesh_plot_colour(q));
  fputc('\n', stream);
}

int flesh_fit_draw(const flesh_fit *fit, const double *values)
{
  row rows[ROWS];
  flesh_file file;
  const int count = list_rows(fit, rows);
  int block = 0, status = write_data(fit, values, count, rows);
  if (!status) status = flesh_plot_open(fit->out, "fit", ".gp", &file);
  if (status) return status;
  flesh_plot_begin(file.stream, "fit", WIDTH, HEIGHT * count);
  flesh_plot_style(file.stream, 0);
  fprintf(file.stream, "set multiplot layout %d,2\n", count);
  for (int k = 0; k < count; k++) {
    draw_row(file.stream, &rows[k], block);
    block += drawn_quantities(&rows[k]);
  }
  fputs("unset multiplot\n", file.stream);
  status = flesh_file_commit(&file);
  return status ? status : flesh_plot_draw(fit->out, "fit");
}
