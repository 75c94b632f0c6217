/* filters.c: runs of the same problems by several solvers, compared: what eigenvalue filters cost (--filters), as
 * performance profiles in a table, a picture and words; and what each technique of the solver is worth (--ablation). */
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

/* The runs as a table of problems by solvers. */
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

/* The solver's column; t->ways: it has none. */
static int way_of(const table *t, flesh_hardcases_solver solver)
{
  int way = 0;
  while (way < t->ways && t->solvers[way] != solver) way++;
  return way;
}

/* Fills the table from the runs of an element; FLESH_ELEMENT_AUTO: of all. */
static int table_open(table *t, const flesh_hardcases_plan *plan, flesh_element element)
{
  *t = (table){0};
  for (int s = 0; s < plan->setting_count; s++) {
    const flesh_hardcases_solver solver = plan->settings[s].solver;
    if (way_of(t, solver) < t->ways) continue;
    t->solvers[t->ways] = solver;
    t->names[t->ways++] = flesh_hardcases_solver_name(solver);
  }
  const size_t runs = (size_t)plan->run_count + 1, all = runs * (size_t)t->ways;
  t->first = calloc(runs, sizeof *t->first);
  t->runs = calloc(all, sizeof *t->runs);
  t->cost = calloc(all, sizeof *t->cost);
  if (!t->first || !t->runs || !t->cost) {
    table_close(t);
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  }
  for (int k = 0; k < plan->run_count; k++) {
    const flesh_hardcases_run *r = &plan->runs[k];
    if (element != FLESH_ELEMENT_AUTO && r->setting->element != element) continue;
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

/* A technique earns its place where it saves a run, or this part of a set's Newton iterations or of its CPU time. Times
 * of sets of few seconds say nothing. */
static const double worth = 0.05, least_seconds = 2;

/* Runs that are compared with each other: an element, a Poisson's ratio and a group of cases. */
typedef struct set {
  flesh_element element;
  double poisson;
  const char *group;
} set;

/* Sums over the runs of a set that pass both with the default and without the technique, and the runs that do not. */
typedef struct sums {
  int runs, failed[2]; /* by the default; without the technique */
  double newton[2], linear[2], cpu[2];
} sums;

static int is_of(const flesh_hardcases_run *r, const set *s)
{
  return r->setting->element == s->element && flesh_hardcases_poisson(r) == s->poisson && !strcmp(r->row->group, s->group);
}

static void add(sums *total, const flesh_hardcases_run *with, const flesh_hardcases_run *without)
{
  const flesh_hardcases_run *both[] = {with, without};
  total->runs++;
  for (int w = 0; w < 2; w++) total->failed[w] += !flesh_hardcases_passes(both[w]);
  for (int w = 0; w < 2 && flesh_hardcases_passes(with) && flesh_hardcases_passes(without); w++) {
    total->newton[w] += (double)both[w]->figures.newton;
    total->linear[w] += (double)both[w]->figures.linear;
    total->cpu[w] += both[w]->figures.cpu_s;
  }
}

/* Over the problems of a set, NULL for `s`: of all. */
static sums sums_of(const table *t, const set *s, flesh_hardcases_solver solver)
{
  const int by_default = way_of(t, FLESH_HARDCASES_DEFAULT), way = way_of(t, solver);
  sums total = {0};
  for (int k = 0; k < t->problems && by_default < t->ways && way < t->ways; k++) {
    const flesh_hardcases_run *with = t->runs[k * t->ways + by_default], *without = t->runs[k * t->ways + way];
    if (!with || !without || (s && !is_of(with, s))) continue;
    if (with->outcome != FLESH_HARDCASES_NOT_RUN && without->outcome != FLESH_HARDCASES_NOT_RUN) add(&total, with, without);
  }
  return total;
}

/* The sets that the plan has, in the order of its runs. Returns new; NULL: no memory. */
static set *find_sets(const flesh_hardcases_plan *plan, int *count)
{
  set *sets = malloc(sizeof *sets * (size_t)(plan->run_count + 1));
  *count = 0;
  for (int k = 0; sets && k < plan->run_count; k++) {
    const flesh_hardcases_run *r = &plan->runs[k];
    int known = 0;
    for (int s = 0; s < *count && !known; s++) known = is_of(r, &sets[s]);
    if (!known) sets[(*count)++] = (set){r->setting->element, flesh_hardcases_poisson(r), r->row->group};
  }
  return sets;
}

/* Relative excess of the sum without the technique; NaN if there is none. */
static double excess(const double sums[2]) { return sums[0] > 0 ? sums[1] / sums[0] - 1 : NAN; }

static void percent(double value, char text[16])
{
  if (isnan(value)) snprintf(text, 16, "-");
  else snprintf(text, 16, "%+.1f %%", 100 * value);
}

/* A row of the table, where the technique was left out at all: the changes over all runs, and the set in which it saves
 * most. */
static void say_technique(const table *t, const set *sets, int count, flesh_hardcases_solver solver,
                          FILE *stream)
{
  const sums all = sums_of(t, NULL, solver);
  double most = -INFINITY;
  int best = -1;
  if (!all.runs) return;
  for (int s = 0; s < count; s++) {
    const sums part = sums_of(t, &sets[s], solver);
    const double saved = fmax(excess(part.newton), part.cpu[0] >= least_seconds ? excess(part.cpu) : NAN);
    if (saved > most) most = saved, best = s;
  }
  char newton[16], linear[16], cpu[16];
  percent(excess(all.newton), newton);
  percent(excess(all.linear), linear);
  percent(excess(all.cpu), cpu);
  fprintf(stream, "| %s | %d, %d | %s | %s | %s |", flesh_technique_name(flesh_hardcases_left_out(solver)), all.failed[0],
      all.failed[1], newton, linear, cpu);
  if (best >= 0) {
    percent(most, cpu);
    fprintf(stream, " %s (%s, %g, %s) |", cpu, flesh_element_name(sets[best].element), sets[best].poisson, sets[best].group);
  } else {
    fprintf(stream, " - |");
  }
  fprintf(stream, " %s |\n", all.failed[1] > all.failed[0] || most >= worth ? "yes" : "no");
}

static int write_sets(const flesh_hardcases_plan *plan, const table *t, const set *sets, int count)
{
  flesh_file file;
  int status = flesh_table_open(plan->out, "ablation.csv", &file);
  if (status) return status;
  FILE *stream = file.stream;
  fputs("technique,element,poisson,group,runs,failed_default,failed_without,newton_default,newton_without,"
        "linear_default,linear_without,cpu_s_default,cpu_s_without\n",
        stream);
  for (int k = FLESH_HARDCASES_WITHOUT; flesh_hardcases_left_out((flesh_hardcases_solver)k); k++)
    for (int s = 0; s < count; s++) {
      const sums part = sums_of(t, &sets[s], (flesh_hardcases_solver)k);
      if (!part.runs) continue;
      fprintf(stream, "%s,%s,%g,%s,%d,%d,%d,%.0f,%.0f,%.0f,%.0f,%.3f,%.3f\n",
              flesh_technique_name(flesh_hardcases_left_out((flesh_hardcases_solver)k)), flesh_element_name(sets[s].element),
              sets[s].poisson, sets[s].group, part.runs, part.failed[0], part.failed[1], part.newton[0], part.newton[1],
              part.linear[0], part.linear[1], part.cpu[0], part.cpu[1]);
    }
  return flesh_file_commit(&file);
}

/* Data of the words. */
typedef struct told {
  const table *table;
  const set *sets;
  int count;
} told;

static void say_worth(const void *data, FILE *stream)
{
  const told *t = data;
  const sums all = sums_of(t->table, NULL, FLESH_HARDCASES_DEFAULT);
  fprintf(stream, "\nThe default: %d runs, %d of them do not come back, %.0f Newton and %.0f linear iterations, %.1f s of CPU\n\n",
      all.runs, all.failed[0], all.newton[0], all.linear[0], all.cpu[0]);
  fprintf(stream, "Changes without each technique, over the runs that come back with and without it. A technique earns its place\n"
      "where it saves a run, or %.0f %% of the Newton iterations of a set (an element, a Poisson's ratio, a group of\n"
      "cases), or of its CPU time where that is %g s or more.\n\n",
      100 * worth, least_seconds);
  fprintf(stream, "| without | failed with, without | Newton | linear | CPU | most, in a set | earns its place |\n");
  fprintf(stream, "|---|---|---|---|---|---|---|\n");
  for (int k = FLESH_HARDCASES_WITHOUT; flesh_hardcases_left_out((flesh_hardcases_solver)k); k++)
    say_technique(t->table, t->sets, t->count, (flesh_hardcases_solver)k, stream);
}

int flesh_hardcases_write_ablation(const void *data)
{
  const flesh_hardcases_plan *plan = data;
  int count;
  set *sets = find_sets(plan, &count);
  if (!sets) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  table t;
  int status = table_open(&t, plan, FLESH_ELEMENT_AUTO);
  const told all = {&t, sets, count};
  if (!status) status = write_sets(plan, &t, sets, count);
  if (!status) status = flesh_table_say(plan->out, "verdict.txt", say_worth, &all);
  table_close(&t);
  free(sets);
  return status;
}
