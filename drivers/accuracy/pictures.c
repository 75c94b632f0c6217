/* pictures.c: work against precision, orders, energies, and the adaptive methods' steps.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "accuracy/accuracy.h"
#include "base/confine.h"
#include "picture/plot.h"
#include "picture/plot_text.h"

/* Opens the script of a picture with these labels; of an error where `y` is one. */
static int begin(const flesh_accuracy_plan *plan, const char *name, const char *title, const char *x, const char *y,
                 flesh_file *file)
{
  const int status = flesh_plot_open(plan->out, name, ".gp", file);
  if (status) return status;
  flesh_plot_begin(file->stream, name, 1040, 640);
  flesh_plot_style(file->stream, 1);
  flesh_plot_title(file->stream, title);
  flesh_plot_label(file->stream, "x", x);
  flesh_plot_label(file->stream, "y", y);
  fputs("set logscale xy\nset format xy '%g'\n", file->stream);
  return FLESH_OK;
}

/* A picture of no method is none. */
static int finish(const flesh_accuracy_plan *plan, const char *name, int count, flesh_file *file)
{
  if (!count) {
    flesh_file_abandon(file);
    return FLESH_OK;
  }
  const int status = flesh_file_commit(file);
  return status ? status : flesh_plot_draw(plan->out, name);
}

/* "bdf2: error ~ step^2.01 ± 0.02", as far as an order shows. */
static void legend(const flesh_accuracy_plan *plan, int method, char text[96])
{
  flesh_accuracy_fit fit;
  flesh_accuracy_fit_order(plan, method, &fit);
  const flesh_accuracy_method *m = &flesh_accuracy_methods[method];
  if (!fit.points) snprintf(text, 96, "%s", m->name);
  else
    snprintf(text, 96, "%s: error ~ %s^%.2f ± %.2f", m->name, m->adaptive ? "tolerance" : "step", fit.slope,
             fit.slope_error);
}

/* Whether the method has runs with a position error, with a difference of energy. */
static int has_runs(const flesh_accuracy_plan *plan, int method, int energy)
{
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_accuracy_row *row = &plan->rows[k];
    const flesh_accuracy_errors *errors = &row->figures.errors;
    double shown = energy ? errors->energy : errors->position_rms;
    if (row->group == FLESH_ACCURACY_WORK && row->method == method && row->done &&
        isfinite(shown) && shown != 0)
      return 1;
  }
  return 0;
}

/* The method's rows of accuracy.csv as "x:y" of two expressions. */
static void rows_of(FILE *stream, const char *method, const char *x, const char *y)
{
  fprintf(stream,
          "'accuracy.csv' using (strcol('method') eq '%s' && strcol('price') eq 'work' ? %s : NaN)"
          ":(%s)",
          method, x, y);
}

/* In % of the motion. */
static double least_error(const flesh_accuracy_plan *plan)
{
  double least = INFINITY;
  for (int k = 0; k < plan->row_count; k++)
    if (plan->rows[k].group == FLESH_ACCURACY_WORK)
      least = fmin(least, plan->rows[k].figures.errors.position_rms);
  return 100 * least / plan->reference.scale.motion;
}

/* Lines of the shares of the motion that the words are about. */
static void mark_shares(FILE *stream)
{
  static const double shares[] = {1, 0.1, 0.01};
  for (int s = 0; s < 3; s++)
    fprintf(
        stream,
        "set arrow %d from graph 0, first %g to graph 1, first %g nohead dt 3 lc rgb '#909090'\n",
        s + 1, shares[s], shares[s]);
}

static int draw_work(const flesh_accuracy_plan *plan, const char *name, const char *column,
                     const char *x_label, const char *front)
{
  flesh_file file;
  int count = 0, status = begin(plan, name, "What accuracy costs", x_label,
                                "error: mass-weighted rms, worst over time [% of the motion]", &file);
  if (status) return status;
  FILE *stream = file.stream;
  char x[64], text[96];
  fputs("set yrange [*:200]\n", stream);
  mark_shares(stream);
  snprintf(x, sizeof x, "column('%s')", column);
  fputs("plot ", stream);
  for (int m = 0; m < plan->method_count; m++) {
    const flesh_accuracy_method *method = &flesh_accuracy_methods[plan->methods[m]];
    if (!has_runs(plan, plan->methods[m], 0)) continue;
    legend(plan, plan->methods[m], text);
    rows_of(stream, method->name, x, "100*column('error_over_motion')");
    fprintf(stream, " with linespoints lw 2 pt %d ps 0.9 lc rgb '%s' title ", method->mark, method->colour);
    flesh_plot_quote(stream, text);
    fputs(", \\\n     ", stream);
    count++;
  }
  fprintf(
      stream,
      "'accuracy.csv' using (column('%s') == 1 ? %s : NaN):(100*column('error_over_motion')) "
      "with points pt 6 ps 2.4 lw 1.5 lc rgb '#202020' title 'nothing better for less', \\\n     ",
      front, x);
  /* Far below every run its line would only squeeze the picture. */
  double known = 100 * plan->reference.uncertainty.position_rms / plan->reference.scale.motion;
  if (known > least_error(plan) / 100) fprintf(stream, "%.17g", known);
  else fputs("NaN", stream);
  fprintf(stream, " with lines dt 2 lc rgb '#909090' title 'reference known to %.1g %%'\n", known);
  return finish(plan, name, count, &file);
}

/* Error against the step, with the fitted lines. */
static int draw_orders(const flesh_accuracy_plan *plan)
{
  static const char name[] = "orders";
  flesh_file file;
  int count = 0, status = begin(plan, name, "Error against step and tolerance, with orders where they hold",
                                "step [s], or tolerance (squares)", "error: mass-weighted rms, worst over time [m]", &file);
  if (status) return status;
  FILE *stream = file.stream;
  char text[96];
  fprintf(stream, "set yrange [*:%g]\nplot ", 2 * plan->reference.scale.motion);
  for (int m = 0; m < plan->method_count; m++) {
    const flesh_accuracy_method *method = &flesh_accuracy_methods[plan->methods[m]];
    flesh_accuracy_fit fit;
    if (!has_runs(plan, plan->methods[m], 0)) continue;
    legend(plan, plan->methods[m], text);
    if (count++) fputs(", \\\n     ", stream);
    rows_of(stream, method->name, "column('value')", "column('error_position_rms')");
    fprintf(stream, " with points pt %d ps 1.1 lc rgb '%s' title ", method->mark, method->colour);
    flesh_plot_quote(stream, text);
    flesh_accuracy_fit_order(plan, plan->methods[m], &fit);
    if (!fit.points) continue;
    fprintf(stream,
            ", \\\n     [%.17g:%.17g] exp(%.17g)*x**%.17g with lines lw 1.5 lc rgb '%s' notitle",
            fit.low, fit.high, fit.constant, fit.slope, method->colour);
  }
  putc('\n', stream);
  return finish(plan, name, count, &file);
}

static int draw_energy(const flesh_accuracy_plan *plan)
{
  static const char name[] = "energy";
  flesh_file file;
  int count = 0, status = begin(plan, name, "Energy lost (open) and gained (filled) against the time it takes",
                                "CPU time of the integration [s]",
                                "largest difference of energy [% of the largest kinetic energy]", &file);
  if (status) return status;
  FILE *stream = file.stream;
  fputs("set yrange [*:1000]\nplot ", stream);
  for (int m = 0; m < plan->method_count; m++) {
    const flesh_accuracy_method *method = &flesh_accuracy_methods[plan->methods[m]];
    if (!has_runs(plan, plan->methods[m], 1)) continue;
    if (count++) fputs(", \\\n     ", stream);
    rows_of(stream, method->name, "column('cpu_s')", "100*abs(column('energy_drift'))");
    fprintf(stream, " with lines lw 2 lc rgb '%s' title '%s', \\\n     ", method->colour,
            method->name);
    rows_of(stream, method->name, "column('cpu_s')",
            "column('energy_drift') > 0 ? 100*column('energy_drift') : NaN");
    fprintf(stream, " with points pt 7 ps 1.4 lc rgb '%s' notitle, \\\n     ", method->colour);
    rows_of(stream, method->name, "column('cpu_s')",
            "column('energy_drift') < 0 ? -100*column('energy_drift') : NaN");
    fprintf(stream, " with points pt 6 ps 1.4 lw 2 lc rgb '%s' notitle", method->colour);
  }
  putc('\n', stream);
  return finish(plan, name, count, &file);
}

/* The runs whose own steps were written. */
static int step_files(const flesh_accuracy_plan *plan, const flesh_accuracy_row **rows)
{
  int count = 0;
  for (int k = 0; k < plan->row_count; k++) {
    char path[1500];
    flesh_accuracy_steps_path(plan, &plan->rows[k], path, sizeof path);
    if (*path && plan->rows[k].done && !flesh_path_access(path, R_OK)) rows[count++] = &plan->rows[k];
  }
  return count;
}

/* One column of the files of a method's runs, the tighter the darker. */
static void plot_steps(FILE *stream, int count, const flesh_accuracy_row **rows, int method,
                       const char *column)
{
  char path[1500];
  int of_method = 0, seen = 0;
  for (int k = 0; k < count; k++) of_method += rows[k]->method == method;
  for (int k = 0; k < count; k++) {
    if (rows[k]->method != method) continue;
    flesh_accuracy_steps_path(NULL, rows[k], path, sizeof path);
    double share = of_method > 1 ? (double)seen / (of_method - 1) : 1;
    if (seen++) fputs(", \\\n     ", stream);
    flesh_plot_quote_file(stream, path, "");
    fprintf(stream, " using 't':'%s' with steps lw 1.6 lc rgb '#%02x%02x%02x' title ", column,
            (int)(0xf0 * (1 - share)), (int)(0xb0 - 0x80 * share), (int)(0x50 + 0x30 * share));
    flesh_plot_quote(stream, rows[k]->tolerance.text);
  }
}

/* The adaptive methods' own steps beside the motion's period, and their orders: a column each. */
static int draw_steps(const flesh_accuracy_plan *plan)
{
  static const char name[] = "steps";
  const flesh_accuracy_row **rows = calloc((size_t)plan->row_count + 1, sizeof *rows);
  int count = rows ? step_files(plan, rows) : 0, columns = 0, methods[FLESH_ACCURACY_LIMIT];
  for (int k = 0; k < count; k++)
    if (!k || rows[k]->method != rows[k - 1]->method) methods[columns++] = rows[k]->method;
  flesh_file file;
  if (!count || flesh_plot_open(plan->out, name, ".gp", &file)) {
    free(rows);
    return count ? FLESH_ERR_FILE : FLESH_OK;
  }
  FILE *stream = file.stream;
  const double period = plan->reference.scale.period;
  const int width = 350 * columns + 280;
  flesh_plot_begin(stream, name, width, 760);
  flesh_plot_style(stream, 1);
  fprintf(stream,
          "set multiplot layout 2,%d title 'Steps and orders that the adaptive methods chose, by "
          "tolerance' font ',13' margins screen %.4f,%.4f,0.08,0.88 spacing screen %.4f,0.1\n"
          "set xrange [%.17g:%.17g]\nset xlabel 't [s]'\nunset key\n"
          "set logscale y\nset format y '%%g'\nset ylabel 'step [s]'\n",
          columns, 100.0 / width, 1 - 190.0 / width, 110.0 / width, plan->grid.start, plan->grid.end);
  for (int c = 0; c < columns; c++) {
    if (c == columns - 1) /* the same for all, beside the last */
      fputs("set key at screen 0.99,0.88 right top vertical Left reverse noenhanced samplen 2\n",
            stream);
    fprintf(stream, "set title '%s' noenhanced\nplot ", flesh_accuracy_methods[methods[c]].name);
    plot_steps(stream, count, rows, methods[c], "h");
    if (isfinite(period))
      fprintf(stream,
              ", \\\n     %.17g with lines dt 2 lw 2 lc rgb '#202020' title 'motion''s period'"
              ", \\\n     %.17g with lines dt 3 lw 2 lc rgb '#202020' title 'a 20th of it'",
              period, period / 20);
    putc('\n', stream);
  }
  fputs("unset logscale y\nunset title\nset yrange [0.5:5.5]\nset ytics 1\nset ylabel 'order'\n"
        "unset key\n",
        stream);
  for (int c = 0; c < columns; c++) {
    fputs("plot ", stream);
    plot_steps(stream, count, rows, methods[c], "order");
    putc('\n', stream);
  }
  fputs("unset multiplot\n", stream);
  free(rows);
  return finish(plan, name, columns, &file);
}

/* Removes the pictures of an older comparison that this one does not draw again. */
static void drop_pictures(const flesh_accuracy_plan *plan)
{
  static const char *const names[] = {"work_time", "work_residuals", "orders", "energy", "steps"};
  char path[1500];
  for (size_t k = 0; k < sizeof names / sizeof names[0]; k++) {
    snprintf(path, sizeof path, "%s/%s.png", plan->out, names[k]);
    flesh_path_unlink(path);
    snprintf(path, sizeof path, "%s/%s.gp", plan->out, names[k]);
    flesh_path_unlink(path);
  }
}

int flesh_accuracy_draw(const void *data)
{
  const flesh_accuracy_plan *plan = data;
  drop_pictures(plan);
  flesh_plot_outcome outcome = {0};
  flesh_plot_note(&outcome,
                  draw_work(plan, "work_time", "cpu_s", "CPU time of the integration [s]", "front_time"));
  flesh_plot_note(&outcome, draw_work(plan, "work_residuals", "residual_evaluations",
                                      "number of residual evaluations", "front_residuals"));
  flesh_plot_note(&outcome, draw_orders(plan));
  flesh_plot_note(&outcome, draw_energy(plan));
  flesh_plot_note(&outcome, draw_steps(plan));
  return flesh_plot_ended(&outcome);
}
