/* bench_pictures.c: the roofline of Williams, Waterman & Patterson 2009 with the kernels under it,
 * and how whole steps grow with the mesh. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "bench.h"
#include "io/file.h"
#include "plot.h"
#include "plot_text.h"

static const char style[] = "set border 3 lc rgb '#606060'\nset tics nomirror out\n"
                            "set grid lc rgb '#e4e4e4' lw 1\nset logscale xy\n"
                            "set key outside right top Left reverse noenhanced spacing 1.2\n"
                            "set title noenhanced font ',13'\n";

static int draw_roofline(const flesh_bench_plan *plan)
{
  flesh_file file;
  int status = flesh_plot_open(plan->out, "roofline", ".gp", &file);
  if (status) return status;
  const flesh_bench_ceilings *c = &plan->ceilings[0];
  FILE *stream = file.stream;
  double peak = 0;
  for (int k = 0; k < FLESH_INSTRUCTIONS_COUNT; k++) peak = fmax(peak, c->multiply_add[k]);
  flesh_plot_begin(stream, "roofline", 1100, 640);
  fputs(style, stream);
  fprintf(stream,
          "set title 'What the kernels take of the machine, %d thread%s'\n"
          "set xlabel 'operations per byte that must be moved'\nset ylabel 'Gflop/s'\n"
          "set xrange [0.05:40]\nset yrange [0.5:%g]\nset dummy i\n$points << E\n",
          c->threads, c->threads == 1 ? "" : "s", 2e-9 * peak);
  int count = 0, largest = 0;
  for (int k = 0; k < plan->row_count; k++)
    if (plan->rows[k].tets > largest) largest = plan->rows[k].tets;
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_bench_row *row = &plan->rows[k];
    if (strcmp(row->group, "kernel") || row->threads != c->threads || !(row->operations > 0))
      continue;
    /* Names only once. */
    fprintf(stream, "%g %g \"%s\" %d\n", row->operations / row->bytes,
            1e-9 * row->operations / flesh_bench_seconds(row),
            row->tets == largest ? row->name : "", row->tets);
    count++;
  }
  fputs("E\nplot ", stream);
  static const char *const levels[] = {"L2", "L3", "memory"};
  for (int l = 0; l < FLESH_BENCH_LEVELS; l++)
    fprintf(stream, "(i*%g < %g ? i*%g : %g) with lines lw 2 title '%s %.0f GB/s', \\\n  ",
            1e-9 * c->read[l], 1e-9 * peak, 1e-9 * c->read[l], 1e-9 * peak, levels[l],
            1e-9 * c->read[l]);
  for (int k = FLESH_INSTRUCTIONS_PORTABLE; k < FLESH_INSTRUCTIONS_COUNT; k++)
    if (c->multiply_add[k] > 0)
      fprintf(stream, "%g with lines lw 1 dt 2 lc rgb '#909090' title '%s %.0f Gflop/s', \\\n  ",
              1e-9 * c->multiply_add[k], flesh_instructions_name((flesh_instructions)k),
              1e-9 * c->multiply_add[k]);
  fputs(count ? "$points using 1:2 with points pt 7 ps 1.2 lc rgb '#303030' title 'kernels', \\\n"
                "  $points using 1:2:3 with labels offset 1,0.6 left font ',9' notitle\n"
              : "1/0 notitle\n",
        stream);
  status = flesh_file_commit(&file);
  return status ? status : flesh_plot_draw(plan->out, "roofline");
}

/* The rows of a case as a data block; returns whether `index` is the first of them. */
static int write_case(const flesh_bench_plan *plan, int index, FILE *stream)
{
  const flesh_bench_row *like = &plan->rows[index];
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_bench_row *row = &plan->rows[k];
    if (!flesh_bench_same_case(row, like)) continue;
    if (k < index) return 0;
    if (k == index) fprintf(stream, "$case%d << E\n", index);
    if (!row->status)
      fprintf(stream, "%d %g\n", row->tets, 1e3 * flesh_bench_seconds(row) / row->steps);
  }
  fputs("E\n", stream);
  return 1;
}

static int draw_growth(const flesh_bench_plan *plan)
{
  flesh_file file;
  int cases[128], count = 0, status = flesh_plot_open(plan->out, "growth", ".gp", &file);
  if (status) return status;
  FILE *stream = file.stream;
  flesh_plot_begin(stream, "growth", 1100, 640);
  fputs(style, stream);
  fputs("set title 'Whole steps'\nset xlabel 'tets'\nset ylabel 'ms per step'\n", stream);
  for (int k = 0; k < plan->row_count && count < 128; k++)
    if (strcmp(plan->rows[k].group, "kernel") && write_case(plan, k, stream)) cases[count++] = k;
  fputs("plot ", stream);
  for (int k = 0; k < count; k++) {
    const flesh_bench_row *row = &plan->rows[cases[k]];
    double growth = flesh_bench_growth(plan, row, 0, 0);
    fprintf(stream, "%s$case%d with linespoints lw 2 pt 7 title '%s %s %g, %d thread%s",
            k ? ", \\\n  " : "", cases[k], row->name, flesh_energy_name(row->energy), row->poisson,
            row->threads, row->threads == 1 ? "" : "s");
    if (!isnan(growth)) fprintf(stream, ": exponent %.2f", growth);
    fputs("'", stream);
  }
  fputs(count ? "\n" : "1/0 notitle\n", stream);
  status = flesh_file_commit(&file);
  return status || !count ? status : flesh_plot_draw(plan->out, "growth");
}

int flesh_bench_draw(const flesh_bench_plan *plan)
{
  int status = draw_roofline(plan);
  return status ? status : draw_growth(plan);
}
