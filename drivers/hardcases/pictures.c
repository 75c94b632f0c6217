/* pictures.c: the matrix (cases x settings, coloured by outcome), and what else is drawn of the battery. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "picture/plot.h"
#include "picture/plot_text.h"
#include "hardcases/hardcases.h"

#define COLOUR(id, name, colour) colour,
static const char *const colours[] = {FLESH_HARDCASES_OUTCOME_LIST(COLOUR)};

/* Pixels. */
enum { CELL_WIDTH = 62, CELL_HEIGHT = 18, LEFT = 190, TOP = 230, BOTTOM = 70, RIGHT = 110 };

/* The text of a cell. */
static void cell_text(const flesh_hardcases_run *r, char text[32])
{
  const flesh_hardcases_figures *f = &r->figures;
  const char *mark = f->end == FLESH_HARDCASES_END_MINIMUM     ? " min"
                     : f->end == FLESH_HARDCASES_END_SADDLE    ? " saddle"
                     : f->end == FLESH_HARDCASES_END_UNTANGLES ? " untan."
                                                            : "";
  static const char *const ranks[] = {"point", "line", "plane", "body"};
  *text = 0;
  if (r->outcome == FLESH_HARDCASES_EQUILIBRIUM && f->rank >= 0)
    snprintf(text, 32, "%s%s", ranks[f->rank], mark);
  if (r->outcome <= FLESH_HARDCASES_UNTANGLED && r->row->flags & FLESH_HARDCASES_STATIC)
    snprintf(text, 32, "%ld it.", f->newton);
  else if (r->outcome <= FLESH_HARDCASES_UNTANGLED && isfinite(f->recovered_at))
    snprintf(text, 32, "%.2g s", f->recovered_at);
  const int not_back = r->outcome == FLESH_HARDCASES_NOT_RECOVERED || r->outcome == FLESH_HARDCASES_AT_REST;
  if (r->outcome == FLESH_HARDCASES_NOT_RECOVERED && isnan(f->distance)) snprintf(text, 32, "no rest");
  else if (not_back && f->inverted_end)
    snprintf(text, 32, "%d inv%s", f->inverted_end, mark);
  else if (not_back)
    snprintf(text, 32, "%.2g%s", f->distance, mark);
  if (r->outcome == FLESH_HARDCASES_UNCONVERGED)
    snprintf(text, 32, "%ld%s", f->rises ? f->rises : f->unconverged,
             f->rises ? " rises" : " unconv.");
  if (r->outcome == FLESH_HARDCASES_STOPPED) snprintf(text, 32, "exit %d", f->exit_code);
}

/* The worst of the cell's seeds, which stand side by side; *good of them came back. NULL: not run.
 */
static const flesh_hardcases_run *find(const flesh_hardcases_plan *plan, int c, int s, int *good,
                                       int *count)
{
  const flesh_hardcases_run *worst = NULL;
  *good = *count = 0;
  for (int k = 0; k < plan->run_count; k++) {
    const flesh_hardcases_run *r = &plan->runs[k];
    if (r->row != plan->cases[c] || r->setting != &plan->settings[s]) continue;
    ++*count;
    *good += flesh_hardcases_passes(r);
    if (!worst || r->outcome > worst->outcome) worst = r;
  }
  return worst;
}

static void draw_cell(FILE *stream, const flesh_hardcases_plan *plan, int c, int s)
{
  char text[32] = "";
  int good, count;
  const flesh_hardcases_run *r = find(plan, c, s, &good, &count);
  flesh_hardcases_outcome outcome = r ? r->outcome : FLESH_HARDCASES_NOT_RUN;
  fprintf(stream,
          "set object rectangle from %d,%d to %d,%d fc rgb '%s' fs solid border lc rgb '#ffffff'\n",
          s, c, s + 1, c + 1, colours[outcome]);
  if (!r) return;
  if (count > 1) snprintf(text, sizeof text, "%d of %d", good, count);
  else cell_text(r, text);
  int dark = outcome == FLESH_HARDCASES_BUDGET || outcome == FLESH_HARDCASES_NONFINITE ||
             outcome == FLESH_HARDCASES_CRASHED;
  fprintf(stream, "set label ");
  flesh_plot_quote(stream, text);
  fprintf(stream, " at %g,%g center noenhanced font ',7' textcolor rgb '%s' front\n", s + 0.5,
          c + 0.5, dark ? "#ffffff" : "#404040");
}

static void draw_legend(FILE *stream, double width, double height)
{
  double x = LEFT;
  for (int o = 0; o <= FLESH_HARDCASES_NOT_RUN; o++) {
    const char *name = flesh_hardcases_outcome_name((flesh_hardcases_outcome)o);
    fprintf(
        stream,
        "set object rectangle from screen %.5f,%.5f to screen %.5f,%.5f fc rgb '%s' fs solid "
        "noborder\n"
        "set label ",
        (x - 170) / width, 22 / height, (x - 156) / width, 36 / height, colours[o]);
    flesh_plot_quote(stream, name);
    fprintf(stream, " at screen %.5f,%.5f left noenhanced font ',9' textcolor rgb '#303030'\n", (x - 150) / width,
            29 / height);
    x += 34 + 7.2 * (double)strlen(name);
  }
}

static int draw_matrix(const flesh_hardcases_plan *plan)
{
  flesh_file file;
  int status = flesh_plot_open(plan->out, "matrix", ".gp", &file);
  if (status) return status;
  FILE *stream = file.stream;
  double width = LEFT + RIGHT + CELL_WIDTH * plan->setting_count,
         height = TOP + BOTTOM + CELL_HEIGHT * plan->case_count;
  width = fmax(width, 1180); /* that of the legend */
  double right = LEFT + CELL_WIDTH * plan->setting_count;
  flesh_plot_begin(stream, "matrix", (int)width, (int)height);
  fprintf(stream,
          "set lmargin at screen %.6f\nset rmargin at screen %.6f\nset tmargin at screen %.6f\n"
          "set bmargin at screen %.6f\nset xrange [0:%d]\nset yrange [%d:0]\nunset tics\nunset "
          "border\nunset key\n",
          LEFT / width, right / width, 1 - TOP / height, BOTTOM / height, plan->setting_count,
          plan->case_count);
  for (int c = 0; c < plan->case_count; c++) {
    for (int s = 0; s < plan->setting_count; s++) draw_cell(stream, plan, c, s);
    char own[32] = "";
    if (plan->cases[c]->poisson > 0) snprintf(own, sizeof own, " (%g)", plan->cases[c]->poisson);
    char name[128];
    snprintf(name, sizeof name, "%.90s%s", plan->cases[c]->name, own);
    fputs("set label ", stream);
    flesh_plot_quote(stream, name);
    fprintf(stream, " at screen %.6f, first %g right noenhanced font ',9' textcolor rgb '#303030'\n",
            (LEFT - 8) / width, c + 0.5);
    if (c && strcmp(plan->cases[c]->group, plan->cases[c - 1]->group))
      fprintf(stream,
              "set arrow from screen %.6f, first %d to screen %.6f, first %d nohead lc rgb "
              "'#606060' front\n",
              10 / width, c, right / width, c);
  }
  for (int s = 0; s < plan->setting_count; s++) {
    char title[112];
    flesh_hardcases_setting_title(&plan->settings[s], title);
    fputs("set label ", stream);
    flesh_plot_quote(stream, title);
    fprintf(stream, " at first %g, screen %.6f left rotate by 55 noenhanced font ',9' textcolor rgb '#303030'\n",
            s + 0.4, 1 - (TOP - 8) / height);
  }
  fprintf(stream,
          "set label 'Hard cases: what became of them' at screen %.6f,%.6f left font ',13'\n",
          10 / width, 1 - 20 / height);
  fprintf(stream,
          "set label \"Recovered: simulated time until at rest for good (statics: Newton "
          "iterations); untangled: after "
          "tangles in equilibrium were left through softer materials.\\nNot recovered: "
          "distance from rest in body lengths, or inverted tets;\\nmin: the end is a true local "
          "minimum. Several seeds: "
          "how many recovered.\\nColumns: energy, Poisson's ratio, solver.\" at screen %.6f,%.6f left noenhanced "
          "font ',9' textcolor rgb '#606060'\n",
          10 / width, 1 - 44 / height);
  draw_legend(stream, width, height);
  fputs("plot NaN\n", stream);
  status = flesh_file_commit(&file);
  return status ? status : flesh_plot_draw(plan->out, "matrix");
}

int flesh_hardcases_draw(const void *data)
{
  const flesh_hardcases_plan *plan = data;
  flesh_plot_outcome outcome = {0};
  flesh_plot_note(&outcome, draw_matrix(plan));
  for (int c = 0; c < plan->case_count; c++) {
    int first = 1;
    for (int b = 0; b < c; b++) first &= strcmp(plan->cases[b]->group, plan->cases[c]->group) != 0;
    if (first) flesh_plot_note(&outcome, flesh_hardcases_draw_frames(plan, plan->cases[c]->group));
  }
  for (int s = 0; s < plan->setting_count; s++) flesh_plot_note(&outcome, flesh_hardcases_draw_sheet(plan, s));
  return flesh_plot_ended(&outcome);
}
