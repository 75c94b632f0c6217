/* ablation.c: what each technique of the solver is worth, from runs with and without it. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "hardcases/hardcases.h"
#include "study/table.h"

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

/* The run of the same problem by another solver; NULL where it was not run. */
static const flesh_hardcases_run *counterpart(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run,
                                              flesh_hardcases_solver solver)
{
  for (int k = 0; k < plan->run_count; k++) {
    const flesh_hardcases_run *r = &plan->runs[k];
    if (r->setting->solver == solver && r->outcome != FLESH_HARDCASES_NOT_RUN && flesh_hardcases_same_problem(r, run)) return r;
  }
  return NULL;
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

/* NULL for `s`: all runs. */
static sums sums_of(const flesh_hardcases_plan *plan, const set *s, flesh_hardcases_solver solver)
{
  sums total = {0};
  for (int k = 0; k < plan->run_count; k++) {
    const flesh_hardcases_run *r = &plan->runs[k];
    if (r->setting->solver != FLESH_HARDCASES_DEFAULT || r->outcome == FLESH_HARDCASES_NOT_RUN) continue;
    if (s && !is_of(r, s)) continue;
    const flesh_hardcases_run *without = counterpart(plan, r, solver);
    if (without) add(&total, r, without);
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
static void say_technique(const flesh_hardcases_plan *plan, const set *sets, int count, flesh_hardcases_solver solver,
                          FILE *stream)
{
  const sums all = sums_of(plan, NULL, solver);
  double most = -INFINITY;
  int best = -1;
  if (!all.runs) return;
  for (int s = 0; s < count; s++) {
    const sums part = sums_of(plan, &sets[s], solver);
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

static int write_sets(const flesh_hardcases_plan *plan, const set *sets, int count)
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
      const sums t = sums_of(plan, &sets[s], (flesh_hardcases_solver)k);
      if (!t.runs) continue;
      fprintf(stream, "%s,%s,%g,%s,%d,%d,%d,%.0f,%.0f,%.0f,%.0f,%.3f,%.3f\n",
              flesh_technique_name(flesh_hardcases_left_out((flesh_hardcases_solver)k)), flesh_element_name(sets[s].element),
              sets[s].poisson, sets[s].group, t.runs, t.failed[0], t.failed[1], t.newton[0], t.newton[1], t.linear[0],
              t.linear[1], t.cpu[0], t.cpu[1]);
    }
  return flesh_file_commit(&file);
}

/* Data of the words. */
typedef struct told {
  const flesh_hardcases_plan *plan;
  const set *sets;
  int count;
} told;

static void say(const void *data, FILE *stream)
{
  const told *t = data;
  const sums all = sums_of(t->plan, NULL, FLESH_HARDCASES_DEFAULT);
  fprintf(stream, "\nThe default: %d runs, %d of them do not come back, %.0f Newton and %.0f linear iterations, %.1f s of CPU\n\n",
      all.runs, all.failed[0], all.newton[0], all.linear[0], all.cpu[0]);
  fprintf(stream, "Changes without each technique, over the runs that come back with and without it. A technique earns its place\n"
      "where it saves a run, or %.0f %% of the Newton iterations of a set (an element, a Poisson's ratio, a group of\n"
      "cases), or of its CPU time where that is %g s or more.\n\n",
      100 * worth, least_seconds);
  fprintf(stream, "| without | failed with, without | Newton | linear | CPU | most, in a set | earns its place |\n");
  fprintf(stream, "|---|---|---|---|---|---|---|\n");
  for (int k = FLESH_HARDCASES_WITHOUT; flesh_hardcases_left_out((flesh_hardcases_solver)k); k++)
    say_technique(t->plan, t->sets, t->count, (flesh_hardcases_solver)k, stream);
}

int flesh_hardcases_write_ablation(const void *data)
{
  const flesh_hardcases_plan *plan = data;
  int count;
  set *sets = find_sets(plan, &count);
  if (!sets) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  int status = write_sets(plan, sets, count);
  const told all = {plan, sets, count};
  if (!status) status = flesh_table_say(plan->out, "verdict.txt", say, &all);
  free(sets);
  return status;
}
