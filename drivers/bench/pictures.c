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

static const char style[] = "set datafile separator ','\nset datafile missing NaN\n"
                            "set border 3 lc rgb '#606060'\nset tics nomirror out\n"
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

/* The row of the kernel's largest mesh; NULL where the row at `index` is not the kernel's first under the roof. */
static const flesh_bench_row *largest_of(const flesh_bench_plan *plan, int index)
{
  const flesh_bench_row *largest = NULL;
  for (int k = 0; k < plan->row_count && under_roof(plan, &plan->rows[index]); k++) {
    const flesh_bench_row *row = &plan->rows[k];
    if (!under_roof(plan, row) || strcmp(row->name, plan->rows[index].name)) continue;
    if (k < index) return NULL;
    if (!largest || row->tets > largest->tets) largest = row;
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
  double peak = 0;
  int count = 0;
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
  fprintf(stream,
          "under_roof(name) = strcol('group') eq 'kernel' && strcol('name') eq name && strcol('energy') eq '%s' && "
          "column('threads') == %d\n"
          "intensity = 'column(\"operations\")/column(\"bytes\")'\n"
          "speed = '1e-9*column(\"operations\")/column(\"%s\")'\nplot ",
          flesh_energy_name(plan->energies[0]), c->threads, c->threads == 1 ? "cpu_s" : "wall_s");
  write_roofs(c, peak, stream);
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_bench_row *largest = largest_of(plan, k);
    if (!largest) continue;
    const char *colour = colours[count % COLOURS];
    const int shape = count++ % SHAPES, at_peak = largest->operations / largest->floor_s > 0.999 * peak;
    fprintf(stream,
            "'bench.csv' using (under_roof('%s') ? @intensity : NaN):(@speed) with linespoints lw 1 pt %d ps 1.6 lc rgb '%s' "
            "notitle, \\\n  "
            "'bench.csv' using (under_roof('%s') && column('tets') == %d ? @intensity : NaN):(@speed) with points pt %d ps 1.6 "
            "lc rgb '%s' title '%s, %.0f %% of %s', \\\n  ",
            largest->name, hollow[shape], colour, largest->name, largest->tets, filled[shape], colour, largest->name,
            100 * largest->floor_s / flesh_bench_seconds(largest),
            at_peak ? "multiply-add" : flesh_bench_level_names[largest->level]);
  }
  fputs("1/0 notitle\n", stream);
  status = flesh_file_commit(&file);
  return status ? status : flesh_plot_draw(plan->out, "roofline");
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
static void write_curves(const flesh_bench_plan *plan, const int *cases, int count, int linear, FILE *stream)
{
  for (int k = 0; k < count; k++) {
    const flesh_bench_row *row = &plan->rows[cases[k]];
    if (linear && row->threads != plan->threads[0]) continue;
    fprintf(stream, "'bench.csv' using (is_case('%s', '%s', %.17g, %d) ? column('tets') : NaN):(", row->name,
            flesh_energy_name(row->energy), row->poisson, row->threads);
    if (linear) fputs("column('linear')/column('newton')) ", stream);
    else fprintf(stream, "1e3*column('%s')/column('steps')) ", row->threads == 1 ? "cpu_s" : "wall_s");
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
  fputs("is_case(name, energy, poisson, threads) = strcol('name') eq name && strcol('energy') eq energy && column('poisson') == "
        "poisson && column('threads') == threads && strcol('status') eq 'FLESH_OK'\n",
        stream);
  write_size_ticks(plan, low, high, stream);
  fprintf(stream,
          "set xlabel 'number of tets'\nset xrange [%g:%g]\nset key off\n"
          "set multiplot layout 1,3 margins 0.07,0.98,%.3f,%.3f spacing 0.09,0\n"
          "set title 'Exponents from %d 000 tets (*: over all sizes)'\n"
          "set lmargin at screen 0.07\nset rmargin at screen 0.48\nset ylabel 'time of a step [ms]'\n"
          "set format y '%%g'\nplot ",
          low, high, (100.0 + 17 * rows) / height, 1 - 40.0 / height, FLESH_BENCH_TIME_FROM / 1000);
  write_curves(plan, cases, count, 0, stream);
  fprintf(stream,
          "set title 'Exponents from %d 000 tets (*: over all sizes)'\n"
          "set lmargin at screen 0.57\nset rmargin at screen 0.98\n"
          "set ylabel 'linear iterations per Newton iteration'\nunset logscale y\nset yrange [0:*]\nplot ",
          FLESH_BENCH_LINEAR_FROM / 1000);
  write_curves(plan, cases, count, 1, stream);
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
