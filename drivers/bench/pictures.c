/* pictures.c: the roofline of Williams, Waterman & Patterson 2009 with the kernels under it,
 * and how whole steps grow with the mesh. */
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "bench/bench.h"
#include "base/file.h"
#include "picture/plot.h"
#include "picture/plot_text.h"
#include "study/table.h"

static const char style[] = "set border 3 lc rgb '#606060'\nset tics nomirror out\n"
                            "set grid lc rgb '#e4e4e4' lw 1\nset logscale xy\n"
                            "set key noenhanced Left reverse spacing 1.15\n"
                            "set title noenhanced font ',13'\n";
static const char *const colours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00",
                                      "#56b4e9", "#7f4f24", "#8f2d9c", "#000000"};
enum { COLOURS = sizeof colours / sizeof colours[0] };
/* gnuplot's point types, filled and hollow. */
static const int filled[] = {7, 5, 9, 13, 11, 15}, hollow[] = {6, 4, 8, 12, 10, 14};
enum { SHAPES = sizeof filled / sizeof filled[0] };

static const char *plural(int count) { return count == 1 ? "" : "s"; }

/* Whether a kernel's row has a place under the roof that is drawn. */
static int under_roof(const flesh_bench_plan *plan, const flesh_bench_row *row)
{
  return !strcmp(row->group, "kernel") && row->threads == plan->ceilings[0].threads &&
         row->energy == plan->energies[0] && row->operations > 0;
}

/* The points of a kernel, the largest mesh in a block of its own; returns its row, or NULL where
 * the row at `index` is not the kernel's first. */
static const flesh_bench_row *write_kernel(const flesh_bench_plan *plan, int index, FILE *stream)
{
  const flesh_bench_row *first = &plan->rows[index], *largest = first;
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_bench_row *row = &plan->rows[k];
    if (!under_roof(plan, row) || strcmp(row->name, first->name)) continue;
    if (k < index) return NULL;
    if (row->tets > largest->tets) largest = row;
  }
  for (int part = 0; part < 2; part++) {
    fprintf(stream, "$%s%d << E\n", part ? "largest" : "kernel", index);
    for (int k = index; k < plan->row_count; k++) {
      const flesh_bench_row *row = &plan->rows[k];
      if (under_roof(plan, row) && !strcmp(row->name, first->name) && (!part || row == largest))
        fprintf(stream, "%g %g %d\n", row->operations / row->bytes,
                1e-9 * row->operations / flesh_bench_seconds(row), row->tets);
    }
    fputs("E\n", stream);
  }
  return largest;
}

/* The roofs: bandwidths, each up to the multiply-adds; further instruction sets below. */
static void write_roofs(const flesh_bench_ceilings *c, double peak, FILE *stream)
{
  static const char *const levels[] = {"L2", "L3", "memory"};
  static const char *const greys[] = {"#b0b0b0", "#707070", "#202020"};
  static const int widths[] = {5, 3, 1};
  for (int l = 0; l < FLESH_BENCH_LEVELS; l++)
    fprintf(stream,
            "(i*%g < %g ? i*%g : %g) with lines lw %d lc rgb '%s' title 'read from %s, %.0f GB/s', \\\n  ",
            1e-9 * c->read[l], 1e-9 * peak, 1e-9 * c->read[l], 1e-9 * peak, widths[l], greys[l],
            levels[l], 1e-9 * c->read[l]);
  for (int k = FLESH_INSTRUCTIONS_PORTABLE, dash = 2; k < FLESH_INSTRUCTIONS_COUNT; k++)
    if (c->multiply_add[k] > 0)
      fprintf(stream, "%g with lines lw 1 dt %d lc rgb '#909090' title 'multiply-add %s, %.0f Gflop/s', \\\n  ",
              1e-9 * c->multiply_add[k], dash++, flesh_instructions_name((flesh_instructions)k),
              1e-9 * c->multiply_add[k]);
}

static int draw_roofline(const flesh_bench_plan *plan)
{
  flesh_file file;
  int status = flesh_plot_open(plan->out, "roofline", ".gp", &file);
  if (status) return status;
  const flesh_bench_ceilings *c = &plan->ceilings[0];
  FILE *stream = file.stream;
  const flesh_bench_row *kernels[32];
  double peak = 0;
  int firsts[32], count = 0;
  for (int k = 0; k < FLESH_INSTRUCTIONS_COUNT; k++) peak = fmax(peak, c->multiply_add[k]);
  flesh_plot_begin(stream, "roofline", 1200, 640);
  fputs(style, stream);
  fprintf(stream,
          "set title 'What the kernels take of the machine, %d thread%s (filled: the largest mesh)'\n"
          "set xlabel 'operations per byte that must be moved [flop/B]'\nset ylabel 'speed [Gflop/s]'\nset format xy "
          "'%%g'\n"
          "set key outside right top\nset samples 1000\n"
          "set xrange [0.05:10]\nset yrange [1:%g]\nset dummy i\n",
          c->threads, plural(c->threads), 2e-9 * peak);
  for (int k = 0; k < plan->row_count && count < 32; k++)
    if (under_roof(plan, &plan->rows[k]) && (kernels[count] = write_kernel(plan, k, stream)))
      firsts[count++] = k;
  fputs("plot ", stream);
  write_roofs(c, peak, stream);
  for (int k = 0; k < count; k++) {
    const char *colour = colours[k % COLOURS];
    double share = kernels[k]->floor_s / flesh_bench_seconds(kernels[k]);
    fprintf(stream,
            "$kernel%d using 1:2 with linespoints lw 1 pt %d ps 1.6 lc rgb '%s' notitle, \\\n  "
            "$largest%d using 1:2 with points pt %d ps 1.6 lc rgb '%s' title '%s, %.0f %% of %s', \\\n  ",
            firsts[k], hollow[k % SHAPES], colour, firsts[k], filled[k % SHAPES], colour,
            kernels[k]->name, 100 * share,
            kernels[k]->operations / kernels[k]->floor_s > 0.999 * peak
                ? "multiply-add"
                : flesh_bench_level_names[kernels[k]->level]);
  }
  fputs("1/0 notitle\n", stream);
  status = flesh_file_commit(&file);
  return status ? status : flesh_plot_draw(plan->out, "roofline");
}

/* The rows of a case as a data block (tets, ms per step, linear per Newton iteration); returns
 * whether `index` is the first of them. */
static int write_case(const flesh_bench_plan *plan, int index, FILE *stream)
{
  const flesh_bench_row *like = &plan->rows[index];
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_bench_row *row = &plan->rows[k];
    if (!flesh_bench_same_case(row, like)) continue;
    if (k < index) return 0;
    if (k == index) fprintf(stream, "$case%d << E\n", index);
    if (!row->status)
      fprintf(stream, "%d %g %g\n", row->tets, 1e3 * flesh_bench_seconds(row) / row->steps,
              row->newton ? (double)row->linear / row->newton : NAN);
  }
  fputs("E\n", stream);
  return 1;
}

/* Colour by case and energy, shape by ratio, dashes by threads. */
static void write_style(const flesh_bench_plan *plan, const flesh_bench_row *row, FILE *stream)
{
  int c = 0, e = 0, r = 0, t = 0;
  while (strcmp(plan->cases[c], row->name)) c++;
  while (plan->energies[e] != row->energy) e++;
  while (plan->poissons[r] != row->poisson) r++;
  while (plan->threads[t] != row->threads) t++;
  fprintf(stream, "with linespoints lw 1.5 dt %d pt %d ps 1.4 lc rgb '%s'", t + 1,
          (e % 2 ? hollow : filled)[r % SHAPES], colours[(c + e * plan->case_count) % COLOURS]);
}

/* Iterations are the same for any number of threads: drawn for the first. */
static void write_curves(const flesh_bench_plan *plan, const int *cases, int count, int column, FILE *stream)
{
  for (int k = 0; k < count; k++) {
    const flesh_bench_row *row = &plan->rows[cases[k]];
    if (column == 3 && row->threads != plan->threads[0]) continue;
    fprintf(stream, "$case%d using 1:%d ", cases[k], column);
    write_style(plan, row, stream);
    fputs(" notitle, \\\n  ", stream);
  }
  fputs("1/0 notitle\n", stream);
}

/* "0.35", with a star where too few sizes are large enough. */
static void exponent(const flesh_bench_plan *plan, const flesh_bench_row *row, int smallest, int linear, char text[64])
{
  char number[FLESH_TABLE_TEXT];
  double growth = flesh_bench_growth(plan, row, smallest, linear);
  int all = isnan(growth);
  if (all) growth = flesh_bench_growth(plan, row, 0, linear);
  snprintf(text, 64, "%s%s", isnan(growth) ? "?" : flesh_table_text(number, "%.2f", growth), all ? "*" : "");
}

/* One legend for both panels, below them. */
static void write_legend(const flesh_bench_plan *plan, const int *cases, int count, int rows, FILE *stream)
{
  fprintf(stream,
          "unset border\nunset tics\nunset grid\nunset xlabel\nunset ylabel\nunset title\nunset logscale\n"
          "set lmargin at screen 0.01\nset rmargin at screen 0.99\nset xrange [0:1]\nset yrange [0:1]\n"
          "set key on at screen 0.52,0.005 center bottom vertical maxrows %d font ',10'\n"
          "plot 1/0 notitle",
          rows);
  for (int k = 0; k < count; k++) {
    const flesh_bench_row *row = &plan->rows[cases[k]];
    char title[200], time[64], linear[64];
    exponent(plan, row, FLESH_BENCH_TIME_FROM, 0, time);
    exponent(plan, row, FLESH_BENCH_LINEAR_FROM, 1, linear);
    snprintf(title, sizeof title, "%s %s %g, %d thread%s: time ~ tets^%s, iterations ~ tets^%s", row->name,
             flesh_energy_name(row->energy), row->poisson, row->threads, plural(row->threads), time, linear);
    fputs(", \\\n  keyentry ", stream);
    write_style(plan, row, stream);
    fputs(" title ", stream);
    flesh_plot_quote(stream, title);
  }
  putc('\n', stream);
}

/* A tick at every size, as long as they leave each other room. */
static void write_size_ticks(const flesh_bench_plan *plan, double low, double high, FILE *stream)
{
  double last = 0, labelled = 0;
  fputs("set xtics (", stream);
  for (int more = 1; more;) {
    int next = INT_MAX;
    for (int k = 0; k < plan->row_count; k++)
      if (plan->rows[k].tets > last && plan->rows[k].tets < next) next = plan->rows[k].tets;
    more = next < INT_MAX;
    if (!more) break;
    if (labelled == 0 || log(next / labelled) > 0.1 * log(high / low)) {
      fprintf(stream, "%s'", labelled > 0 ? ", " : "");
      if (next < 10000) fprintf(stream, "%d' %d", next, next);
      else fprintf(stream, "%.3g k' %d", next / 1000., next);
      labelled = next;
    }
    last = next;
  }
  fputs(")\n", stream);
}

static int draw_growth(const flesh_bench_plan *plan)
{
  flesh_file file;
  int cases[128] = {0}, count = 0, status = flesh_plot_open(plan->out, "growth", ".gp", &file);
  if (status) return status;
  FILE *stream = file.stream;
  for (int k = 0; k < plan->row_count && count < 128; k++) {
    int first = strcmp(plan->rows[k].group, "kernel") != 0;
    for (int j = 0; j < k && first; j++)
      first = !flesh_bench_same_case(&plan->rows[j], &plan->rows[k]);
    if (first) cases[count++] = k;
  }
  /* The legend stands below the panels in two columns, a row of 17 pixels for each curve. */
  int rows = (count + 1) / 2, height = 540 + 17 * rows, smallest = INT_MAX, largest = 1;
  for (int k = 0; k < plan->row_count; k++) {
    if (plan->rows[k].tets < smallest) smallest = plan->rows[k].tets;
    if (plan->rows[k].tets > largest) largest = plan->rows[k].tets;
  }
  double low = 0.8 * smallest, high = 1.25 * largest;
  flesh_plot_begin(stream, "growth", 1200, height);
  fputs(style, stream);
  for (int k = 0; k < count; k++) write_case(plan, cases[k], stream);
  write_size_ticks(plan, low, high, stream);
  fprintf(stream,
          "set xlabel 'number of tets'\nset xrange [%g:%g]\nset key off\n"
          "set multiplot layout 1,3 margins 0.07,0.98,%.3f,%.3f spacing 0.09,0\n"
          "set title 'Exponents from %d 000 tets (*: over all sizes)'\n"
          "set lmargin at screen 0.07\nset rmargin at screen 0.48\nset ylabel 'time of a step [ms]'\n"
          "set format y '%%g'\nplot ",
          low, high, (100.0 + 17 * rows) / height, 1 - 40.0 / height, FLESH_BENCH_TIME_FROM / 1000);
  write_curves(plan, cases, count, 2, stream);
  fprintf(stream,
          "set title 'Exponents from %d 000 tets (*: over all sizes)'\n"
          "set lmargin at screen 0.57\nset rmargin at screen 0.98\n"
          "set ylabel 'linear iterations per Newton iteration'\nunset logscale y\nset yrange [0:*]\nplot ",
          FLESH_BENCH_LINEAR_FROM / 1000);
  write_curves(plan, cases, count, 3, stream);
  write_legend(plan, cases, count, rows, stream);
  fputs("unset multiplot\n", stream);
  status = flesh_file_commit(&file);
  return status || !count ? status : flesh_plot_draw(plan->out, "growth");
}

int flesh_bench_draw(const flesh_bench_plan *plan)
{
  flesh_plot_outcome outcome = {0};
  flesh_plot_note(&outcome, draw_roofline(plan));
  flesh_plot_note(&outcome, draw_growth(plan));
  return flesh_plot_ended(&outcome);
}
