/* filters.c: what eigenvalue filters cost on the runs of `flesh hardcases --filters`: performance profiles as a table,
 * a picture and words. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "hardcases/hardcases.h"
#include "hardcases/profile.h"
#include "picture/plot.h"
#include "picture/plot_text.h"
#include "study/table.h"

typedef enum measure { NEWTON, LINEAR, CPU, MEASURES } measure;
static const char *const measure_names[MEASURES] = {"newton", "linear", "cpu"};
static const char *const measure_titles[MEASURES] = {"Newton iterations", "linear iterations", "CPU time"};
static const char *const colours[] = {"#1b6ca8", "#d1602f", "#3a8f4d", "#8c6bb1", "#111111", "#c2185b",
                                      "#8a7a2b", "#5f9ea0", "#777777", "#e0a030", "#2e3f8f", "#9acd32"};
enum { COLOURS = sizeof colours / sizeof *colours };
/* Shares are given up to 32 times the least cost, 16 to an octave. */
enum { OCTAVES = 5, PER_OCTAVE = 16 };

/* The runs of an element as a table of problems by filters. */
typedef struct table {
  int problems, ways;
  flesh_hardcases_solver solvers[FLESH_HARDCASES_SOLVER_LIMIT];
  const char *names[FLESH_HARDCASES_SOLVER_LIMIT];
  const flesh_hardcases_run **first; /* [problems] a run of each */
  const flesh_hardcases_run **runs;  /* [problems*ways], NULL: none */
  double *cost;                      /* [problems*ways] of a measure and the problems that are looked at */
} table;

static void table_close(table *t)
{
  free(t->first), free(t->runs), free(t->cost);
  *t = (table){0};
}

static int way_of(table *t, flesh_hardcases_solver solver)
{
  int way = 0;
  while (way < t->ways && t->solvers[way] != solver) way++;
  if (way == t->ways) {
    t->solvers[way] = solver;
    t->names[t->ways++] = flesh_hardcases_solver_name(solver);
  }
  return way;
}

static int table_open(table *t, const flesh_hardcases_plan *plan, flesh_element element)
{
  enum { WAYS = FLESH_HARDCASES_SOLVER_LIMIT };
  const size_t runs = (size_t)plan->run_count;
  *t = (table){.first = calloc(runs, sizeof *t->first),
               .runs = calloc(runs * WAYS, sizeof *t->runs),
               .cost = calloc(runs * WAYS, sizeof *t->cost)};
  if (!t->first || !t->runs || !t->cost) {
    table_close(t);
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  }
  for (int s = 0; s < plan->setting_count; s++) way_of(t, plan->settings[s].solver);
  for (int k = 0; k < plan->run_count; k++) {
    const flesh_hardcases_run *r = &plan->runs[k];
    if (r->setting->element != element) continue;
    int problem = 0;
    while (problem < t->problems && !flesh_hardcases_same_problem(t->first[problem], r)) problem++;
    if (problem == t->problems) t->first[t->problems++] = r;
    t->runs[problem * t->ways + way_of(t, r->setting->solver)] = r;
  }
  return FLESH_OK;
}

/* The cost of a run; INFINITY if it did not recover by the filter alone, NaN if it was not run. */
static double cost_of(const flesh_hardcases_run *r, measure m)
{
  if (!r || r->outcome == FLESH_HARDCASES_NOT_RUN) return NAN;
  if (r->outcome != FLESH_HARDCASES_RECOVERED) return INFINITY;
  const flesh_hardcases_figures *f = &r->figures;
  return fmax(1e-6, m == NEWTON ? (double)f->newton : m == LINEAR ? (double)f->linear : f->cpu_s);
}

/* The costs of the problems with this Poisson's ratio; NaN: with any. */
static flesh_profile profile_of(table *t, measure m, double poisson)
{
  int count = 0;
  for (int k = 0; k < t->problems; k++) {
    if (!isnan(poisson) && t->first[k]->setting->poisson != poisson) continue;
    for (int w = 0; w < t->ways; w++) t->cost[count * t->ways + w] = cost_of(t->runs[k * t->ways + w], m);
    count++;
  }
  return (flesh_profile){count, t->ways, t->cost, t->names};
}

/* Calls `take` with the table of each element, in the order of the settings. */
static int each_element(const flesh_hardcases_plan *plan, FILE *stream,
                        void (*take)(const flesh_hardcases_plan *plan, flesh_element element, table *t, FILE *stream))
{
  for (int s = 0; s < plan->setting_count; s++) {
    const flesh_element element = plan->settings[s].element;
    table t;
    if (s && plan->settings[s - 1].element == element) continue; /* settings go element by element */
    const int status = table_open(&t, plan, element);
    if (status) return status;
    take(plan, element, &t, stream);
    table_close(&t);
  }
  return FLESH_OK;
}

static void write_shares(const flesh_hardcases_plan *plan, flesh_element element, table *t, FILE *stream)
{
  (void)plan;
  for (int m = 0; m < MEASURES; m++) {
    const flesh_profile p = profile_of(t, (measure)m, NAN);
    for (int w = 0; w < t->ways; w++)
      for (int k = 0; k <= OCTAVES * PER_OCTAVE; k++) {
        const double tau = exp2((double)k / PER_OCTAVE);
        fprintf(stream, "%s,%s,%s", flesh_element_name(element), measure_names[m], t->names[w]);
        flesh_table_field(stream, tau);
        flesh_table_field(stream, flesh_profile_share(&p, w, tau));
        putc('\n', stream);
      }
  }
}

/* A row for each filter: how many problems it solved at each Poisson's ratio. */
static void say_solved(const flesh_hardcases_plan *plan, table *t, FILE *stream)
{
  fprintf(stream, "  solved of        ");
  for (int pass = -1; pass < t->ways; pass++) {
    if (pass >= 0) fprintf(stream, "\n    %-22s", t->names[pass]);
    int count = 0;
    for (int s = 0; s < plan->setting_count; s++) {
      const double nu = plan->settings[s].poisson;
      int again = 0;
      for (int b = 0; b < s; b++) again |= plan->settings[b].poisson == nu;
      if (again) continue;
      const flesh_profile p = profile_of(t, NEWTON, nu);
      if (pass < 0) fprintf(stream, "%s nu %g: %d", count ? "," : "", nu, flesh_profile_problems(&p, NULL));
      else fprintf(stream, " %7d", flesh_profile_solved(&p, pass));
      count++;
    }
  }
  fprintf(stream, "\n");
}

static void say_element(const flesh_hardcases_plan *plan, flesh_element element, table *t, FILE *stream)
{
  int unsolved;
  char text[4096];
  flesh_profile p = profile_of(t, NEWTON, NAN);
  const int problems = flesh_profile_problems(&p, &unsolved);
  fprintf(stream, "\n%s: %d of %d problems run with all filters; %d solved by none\n", flesh_element_name(element), problems,
      t->problems, unsolved);
  say_solved(plan, t, stream);
  for (int m = 0; m < MEASURES; m++) {
    p = profile_of(t, (measure)m, NAN);
    fprintf(stream, "  %-24s solved    least   within 2 times   cost over %s's\n", measure_titles[m], t->names[0]);
    for (int w = 0; w < t->ways; w++) {
      fprintf(stream, "    %-22s %6d   %5.1f %%          %5.1f %%", t->names[w], flesh_profile_solved(&p, w),
          100 * flesh_profile_share(&p, w, 1), 100 * flesh_profile_share(&p, w, 2));
      const double ratio = flesh_profile_ratio(&p, w, 0);
      if (isfinite(ratio)) fprintf(stream, "   %12.3f", ratio);
      fprintf(stream, "\n");
    }
    flesh_profile_verdict(&p, text, sizeof text);
    fprintf(stream, "    %s\n", text);
  }
}

static void say(const void *plan, FILE *stream) { each_element(plan, stream, say_element); }

int flesh_hardcases_write_filters(const void *data)
{
  const flesh_hardcases_plan *plan = data;
  flesh_file file;
  int status = flesh_table_open(plan->out, "profiles.csv", &file);
  if (status) return status;
  fputs("element,measure,filter,tau,share\n", file.stream);
  status = each_element(plan, file.stream, write_shares);
  if (status) flesh_file_abandon(&file);
  else status = flesh_file_commit(&file);
  return status ? status : flesh_table_say(plan->out, "verdict.txt", say, plan);
}

static void draw_panel(FILE *stream, flesh_element element, const table *t, measure m, int has_key)
{
  char title[96];
  snprintf(title, sizeof title, "%s: %s", flesh_element_name(element), measure_titles[m]);
  fputs("set title ", stream);
  flesh_plot_quote(stream, title);
  fprintf(stream, "\n%s\nplot ", has_key ? "set key right bottom noenhanced font ',8' spacing 0.9" : "unset key");
  for (int w = 0; w < t->ways; w++) {
    fprintf(stream,
            "%s'profiles.csv' using (strcol('element') eq '%s' && strcol('measure') eq '%s' && strcol('filter') eq '%s' "
            "? column('tau') : NaN):(100*column('share')) with steps lw 2%s lc rgb '%s' title ",
            w ? ", \\\n  " : "", flesh_element_name(element), measure_names[m], t->names[w],
            strstr(t->names[w], "always") ? " dt 2" : "", colours[w % COLOURS]);
    flesh_plot_quote(stream, t->names[w]);
  }
  putc('\n', stream);
}

static void draw_element(const flesh_hardcases_plan *plan, flesh_element element, table *t, FILE *stream)
{
  for (int m = 0; m < MEASURES; m++)
    draw_panel(stream, element, t, (measure)m, m == 0 && element == plan->settings[0].element);
}

int flesh_hardcases_draw_filters(const void *data)
{
  const flesh_hardcases_plan *plan = data;
  flesh_file file;
  int elements = 0, status = flesh_plot_open(plan->out, "profiles", ".gp", &file);
  if (status) return status;
  for (int s = 0; s < plan->setting_count; s++)
    elements += s == 0 || plan->settings[s].element != plan->settings[s - 1].element;
  flesh_plot_begin(file.stream, "profiles", 1200, 40 + 330 * elements);
  flesh_plot_style(file.stream, 1);
  fprintf(file.stream,
          "set key default\nset title noenhanced font ',11'\nset logscale x 2\nset xrange [1:%d]\nset yrange [0:102]\n"
          "set xlabel 'times the least cost' font ',9'\nset ylabel 'problems solved [%%]' font ',9'\n"
          "set multiplot layout %d,%d\n",
          1 << OCTAVES, elements, (int)MEASURES);
  status = each_element(plan, file.stream, draw_element);
  fputs("unset multiplot\n", file.stream);
  if (status) {
    flesh_file_abandon(&file);
    return status;
  }
  status = flesh_file_commit(&file);
  return status ? status : flesh_plot_draw(plan->out, "profiles");
}
