/* table.c: the battery's result as hardcases.csv and in words. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "flesh/status.h"
#include "base/file.h"
#include "hardcases/hardcases.h"
#include "run/run_trace.h"
#include "study/table.h"

static void quoted(FILE *stream, const char *text)
{
  fputs(",\"", stream);
  for (; *text; text++) {
    if (*text == '"') putc('"', stream);
    putc(*text == '\n' ? ' ' : *text, stream);
  }
  putc('"', stream);
}

int flesh_hardcases_write_csv(const void *data)
{
  const flesh_hardcases_plan *plan = data;
  static const char *const ranks[] = {"point", "line", "plane", "body"};
  char folder[256];
  flesh_file file;
  int status = flesh_table_open(plan->out, "hardcases.csv", &file);
  if (status) return status;
  FILE *stream = file.stream;
  fputs("case,group,seed,energy,constants,poisson,step,solver,tets,outcome,status,exit_code,steps,"
        "solves,"
        "retried,unconverged,at_rounding,untanglings,untangled_nodes,potential_rises,potential_"
        "checked,worst_rise,finite,max_inverted,"
        "inverted_end,distance_from_rest,volume_error,recovered_at,end_shape,end_is,gradient,"
        "smallest_eigenvalue,negative_eigenvalues,newton,linear,direct,projections,backtracks,"
        "newton_worst_over_median,time_worst_over_median,wall_s,cpu_s,simulated_s,stressed_rest_J,"
        "longest_step,longest_step_newton,longest_step_linear,longest_step_over_median,element,mesh,folder,message\n",
        stream);
  for (int k = 0; k < plan->run_count; k++) {
    const flesh_hardcases_run *r = &plan->runs[k];
    const flesh_hardcases_figures *f = &r->figures;
    const flesh_hardcases_setting *s = r->setting;
    flesh_hardcases_run_folder(r, folder);
    fprintf(stream, "%s,%s,%d,%s,%s,%g", r->row->name, r->row->group, r->seed,
            flesh_energy_name(s->energy), flesh_constants_name(s->constants),
            flesh_hardcases_poisson(r));
    flesh_table_field(stream, r->row->flags & FLESH_HARDCASES_STATIC ? NAN
                  : r->row->step > 0                  ? r->row->step
                                                      : s->step);
    fprintf(stream, ",%s,%d,%s,%s,%d", flesh_hardcases_solver_name(s->solver), f->tets,
            flesh_hardcases_outcome_name(r->outcome), flesh_status_name(f->status), f->exit_code);
    flesh_fields_print(stream, flesh_hardcases_fields, "steps", "recovered_at", f);
    fprintf(stream, ",%s,%s", f->rank >= 0 ? ranks[f->rank] : "", flesh_hardcases_end_name(f->end));
    flesh_fields_print(stream, flesh_hardcases_fields, "gradient", "longest_ratio", f);
    fprintf(stream, ",%s,%s,%s", flesh_element_name(s->element), s->body ? s->body->name : "", folder);
    quoted(stream, f->message);
    putc('\n', stream);
  }
  return flesh_file_commit(&file);
}

/* Whether this run should come back with S and E (see `flesh hardcases --help`). */
static int is_expected(const flesh_hardcases_run *r)
{
  const flesh_hardcases_setting *s = r->setting;
  double poisson = flesh_hardcases_poisson(r);
  if (s->energy != FLESH_ENERGY_S && s->energy != FLESH_ENERGY_E) return 0;
  if (s->element != FLESH_ELEMENT_TET4) return 0;
  if (s->solver != FLESH_HARDCASES_DEFAULT) return 0;
  return poisson < 0.4951 || !(r->row->flags & FLESH_HARDCASES_HARDEST);
}

static int is_failed(const flesh_hardcases_run *r)
{
  return !flesh_hardcases_passes(r) && r->outcome != FLESH_HARDCASES_NOT_RUN;
}

static void say_setting(const flesh_hardcases_plan *plan, int setting, FILE *stream)
{
  int counts[FLESH_HARDCASES_OUTCOMES] = {0}, total = 0;
  long newton = 0, retried = 0, rises = 0;
  double seconds = 0;
  char title[112];
  for (int k = 0; k < plan->run_count; k++) {
    const flesh_hardcases_run *r = &plan->runs[k];
    if (r->setting != &plan->settings[setting]) continue;
    counts[r->outcome]++;
    total++;
    newton += r->figures.newton;
    retried += r->figures.retried;
    rises += r->figures.rises;
    seconds += isnan(r->figures.wall_s) ? 0 : r->figures.cpu_s;
  }
  flesh_hardcases_setting_title(&plan->settings[setting], title);
  fprintf(stream, "  %-28s %3d of %d", title,
      counts[FLESH_HARDCASES_RECOVERED] + counts[FLESH_HARDCASES_UNTANGLED] +
          counts[FLESH_HARDCASES_EQUILIBRIUM],
      total);
  if (counts[FLESH_HARDCASES_UNTANGLED]) fprintf(stream, " (%d of them untangled)", counts[FLESH_HARDCASES_UNTANGLED]);
  for (int o = FLESH_HARDCASES_AT_REST; o < FLESH_HARDCASES_OUTCOMES; o++)
    if (counts[o]) fprintf(stream, ", %d %s", counts[o], flesh_hardcases_outcome_name((flesh_hardcases_outcome)o));
  fprintf(stream, "; %ld Newton iterations, %ld solves retried, %.1f s of CPU", newton, retried, seconds);
  if (rises) fprintf(stream, "; the incremental potential rose %ld times", rises);
  fprintf(stream, "\n");
}

static void say_run(const flesh_hardcases_plan *plan, const flesh_hardcases_run *r, FILE *stream)
{
  const flesh_hardcases_figures *f = &r->figures;
  char folder[256], title[112];
  flesh_hardcases_run_folder(r, folder);
  flesh_hardcases_setting_title(r->setting, title);
  fprintf(stream, "  %s, %s", r->row->name, title);
  if (r->row->flags & FLESH_HARDCASES_RANDOM) fprintf(stream, ", seed %d", r->seed);
  fprintf(stream, ": %s", flesh_hardcases_outcome_name(r->outcome));
  if (r->outcome == FLESH_HARDCASES_UNCONVERGED)
    fprintf(stream, " (%ld solves; the potential rose %ld times, by %.2g of its size)", f->unconverged,
        f->rises, f->worst_rise);
  if (f->stressed_rest > 0) fprintf(stream, ", %.4g J of strain energy that no load holds", f->stressed_rest);
  if (r->outcome == FLESH_HARDCASES_AT_REST || r->outcome == FLESH_HARDCASES_NOT_RECOVERED ||
      r->outcome == FLESH_HARDCASES_UNCONVERGED) {
    if (isnan(f->distance)) fprintf(stream, ", this form has no rest shape");
    else
      fprintf(stream, ", %.2g of the length from rest, volume off by %.2g, %d tets inverted", f->distance,
          f->volume_error, f->inverted_end);
    if (f->end == FLESH_HARDCASES_END_MINIMUM)
      fprintf(stream, "; a true local minimum (smallest eigenvalue %.2g N/m)", f->smallest_eigenvalue);
    else if (f->end == FLESH_HARDCASES_END_SADDLE)
      fprintf(stream, "; a saddle (%d negative eigenvalues)", f->negative_eigenvalues);
    else if (f->end == FLESH_HARDCASES_END_UNTANGLES)
      fprintf(stream, "; a static solve from there leads back to rest");
    else if (f->end) fprintf(stream, "; %s", flesh_hardcases_end_name(f->end));
  }
  if (*f->message) fprintf(stream, ": %s", f->message);
  fprintf(stream, "\n      flesh run %s/%s/scene.yaml\n", plan->out, folder);
}

static int compare_cost(const void *a, const void *b)
{
  double p = (*(const flesh_hardcases_run *const *)a)->figures.cpu_s;
  double q = (*(const flesh_hardcases_run *const *)b)->figures.cpu_s;
  return (p < q) - (p > q);
}

/* The runs that took longest, and the worst single steps. */
static void say_slowest(const flesh_hardcases_plan *plan, FILE *stream)
{
  const flesh_hardcases_run **order = malloc(sizeof *order * (size_t)(plan->run_count + 1));
  int count = 0;
  if (!order) return;
  for (int k = 0; k < plan->run_count; k++) order[count++] = &plan->runs[k];
  qsort(order, (size_t)count, sizeof *order, compare_cost);
  fprintf(stream, "\nThe slowest runs (CPU)\n");
  for (int k = 0; k < count && k < 10; k++) {
    const flesh_hardcases_figures *f = &order[k]->figures;
    char title[112];
    flesh_hardcases_setting_title(order[k]->setting, title);
    fprintf(stream, "  %6.2f s  %-18s %-24s %6ld Newton %8ld linear", f->cpu_s, order[k]->row->name, title, f->newton, f->linear);
    if (isfinite(f->newton_ratio)) fprintf(stream, ", worst step %.3g times the median", f->newton_ratio);
    fprintf(stream, "\n");
  }
  free(order);
}

/* Steps that stand far out from the others of their run. */
static void say_long_steps(const flesh_hardcases_plan *plan, FILE *stream)
{
  int count = 0;
  for (int k = 0; k < plan->run_count; k++) count += plan->runs[k].figures.longest.ratio > FLESH_LONG_STEP;
  fprintf(stream, "\nRuns with a step that took more than %d times the iterations of their median step: %d\n", FLESH_LONG_STEP, count);
  for (int k = 0; k < plan->run_count; k++) {
    const flesh_hardcases_run *r = &plan->runs[k];
    char folder[256], words[240];
    if (!flesh_longest_step_tell(&r->figures.longest, sizeof words, words)) continue;
    flesh_hardcases_run_folder(r, folder);
    fprintf(stream, "  %s: %s\n", folder, words);
  }
}

static void say(const void *data, FILE *stream)
{
  const flesh_hardcases_plan *plan = data;
  fprintf(stream, "\nBack at rest, or the equilibrium that was to be kept\n");
  for (int s = 0; s < plan->setting_count; s++) say_setting(plan, s, stream);
  int expected = 0, broken = 0;
  for (int k = 0; k < plan->run_count; k++) {
    expected += is_expected(&plan->runs[k]) && plan->runs[k].outcome != FLESH_HARDCASES_NOT_RUN;
    broken += is_expected(&plan->runs[k]) && is_failed(&plan->runs[k]);
  }
  fprintf(stream, "\nPromised to come back (S and E, tet4, default solver; above nu = 0.495 not from scramble or "
      "point): %d of %d "
      "do%s\n",
      expected - broken, expected, broken ? "; these do not:" : ".");
  for (int k = 0; k < plan->run_count; k++)
    if (is_expected(&plan->runs[k]) && is_failed(&plan->runs[k]))
      say_run(plan, &plan->runs[k], stream);
  int others = 0;
  for (int k = 0; k < plan->run_count; k++)
    others += !is_expected(&plan->runs[k]) && is_failed(&plan->runs[k]);
  if (others) fprintf(stream, "\nThe others that do not: %d\n", others);
  for (int k = 0; k < plan->run_count; k++)
    if (!is_expected(&plan->runs[k]) && is_failed(&plan->runs[k]))
      say_run(plan, &plan->runs[k], stream);
  say_slowest(plan, stream);
  say_long_steps(plan, stream);
}

int flesh_hardcases_write_verdict(const void *plan)
{
  return flesh_table_say(((const flesh_hardcases_plan *)plan)->out, "verdict.txt", say, plan);
}
