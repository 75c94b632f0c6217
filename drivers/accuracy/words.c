/* words.c: the answer in words. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "accuracy/accuracy.h"
#include "base/file.h"
#include "study/table.h"

/* The measured run of least CPU time of the method (-1: of any) that is good enough: of those that took the least time,
 * or no more than times scatter, the one with the least counts. NULL: none. */
static const flesh_accuracy_row *least_expensive(const flesh_accuracy_plan *plan, int method, double error)
{
  const flesh_accuracy_row *quickest = NULL, *best = NULL;
  for (int pass = 0; pass < 2; pass++)
    for (int k = 0; k < plan->row_count; k++) {
      const flesh_accuracy_row *row = &plan->rows[k];
      if ((method >= 0 && row->method != method) || !flesh_accuracy_reaches(plan, row, error)) continue;
      if (!pass && (!quickest || row->figures.cpu_s < quickest->figures.cpu_s)) quickest = row;
      if (!pass || flesh_accuracy_compare_times(row, quickest)) continue;
      if (!best || flesh_accuracy_compare_counts(row, best) < 0) best = row;
    }
  return best;
}

/* The most accurate run of the method; NULL: none. */
static const flesh_accuracy_row *most_accurate(const flesh_accuracy_plan *plan, int method)
{
  const flesh_accuracy_row *best = NULL;
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_accuracy_row *row = &plan->rows[k];
    if (row->method != method || !flesh_accuracy_is_complete(row) || isnan(row->figures.errors.position_rms)) continue;
    if (!best || row->figures.errors.position_rms < best->figures.errors.position_rms) best = row;
  }
  return best;
}

/* Seconds at which the method's measured curve passes the error, between two neighbouring settings
 * along straight lines in log-log; NaN where it does not. */
static double between(const flesh_accuracy_plan *plan, int method, double error)
{
  const flesh_accuracy_row *before = NULL;
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_accuracy_row *row = &plan->rows[k];
    if (row->method != method || !flesh_accuracy_is_complete(row) || isnan(row->figures.errors.position_rms)) continue;
    double e = row->figures.errors.position_rms;
    if (before && e <= error) {
      double eb = before->figures.errors.position_rms;
      double share = log(eb / error) / log(eb / e);
      return before->figures.cpu_s * pow(row->figures.cpu_s / before->figures.cpu_s, share);
    }
    if (e <= error) return NAN; /* its coarsest run is better already */
    before = row;
  }
  return NAN;
}

static void say_run(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row, FILE *stream)
{
  fprintf(stream, "%s in %.3g s, %ld steps, error ", row->setting, row->figures.cpu_s, row->figures.steps);
  if (row->figures.below) fprintf(stream, "below the reference's uncertainty");
  else fprintf(stream, "%.3g %%", 100 * row->figures.errors.position_rms / plan->reference.scale.motion);
  if (row->figures.gain > 0.01) fprintf(stream, ", gains energy");
}

static void say_command(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row,
                        FILE *stream)
{
  flesh_accuracy_print_command(stream, plan, row);
  fprintf(stream, "\n");
}

static void say_target(const flesh_accuracy_plan *plan, double share, FILE *stream)
{
  double error = share * plan->reference.scale.motion;
  fprintf(stream, "\nFor %g %% of the motion (%.3g m rms):\n", 100 * share, error);
  if (error <= plan->reference.uncertainty.position_rms) {
    fprintf(stream, "  the reference is not known that well.\n");
    return;
  }
  const flesh_accuracy_row *best = least_expensive(plan, -1, error);
  for (int m = 0; m < plan->method_count; m++) {
    const flesh_accuracy_row *row = least_expensive(plan, plan->methods[m], error);
    fprintf(stream, "  %-18s ", flesh_accuracy_methods[plan->methods[m]].name);
    if (row) {
      say_run(plan, row, stream);
      if (row == best) fprintf(stream, "  <- least CPU time");
      else if (flesh_accuracy_same_run(row, best)) fprintf(stream, "; a tie: the same steps and errors");
      else if (!flesh_accuracy_compare_times(row, best)) fprintf(stream, "; the same cost, within the noise of the clock");
      else fprintf(stream, "; %.3g times as much", row->figures.cpu_s / best->figures.cpu_s);
    } else if ((row = most_accurate(plan, plan->methods[m]))) {
      fprintf(stream, "not reached; its best: ");
      say_run(plan, row, stream);
    } else fprintf(stream, "no run to judge by");
    fprintf(stream, "\n");
  }
  if (!best) {
    fprintf(stream, "  no setting that was measured reaches it.\n");
    return;
  }
  int euler = flesh_accuracy_method_find("backward-euler");
  const flesh_accuracy_row *slow = least_expensive(plan, euler, error);
  double curve = between(plan, euler, error) / between(plan, best->method, error);
  if (slow && best->method != euler) {
    fprintf(stream, "  Backward Euler costs %.3g times as much in time and %.3g times the steps",
        slow->figures.cpu_s / best->figures.cpu_s,
        (double)slow->figures.steps / (double)best->figures.steps);
    if (isfinite(curve)) fprintf(stream, " (%.3g times in time, interpolated between settings)", curve);
    fprintf(stream, ".\n");
  } else if (best->method != euler && (slow = most_accurate(plan, euler))) {
    if (slow->figures.cpu_s > best->figures.cpu_s)
      fprintf(stream, "  Backward Euler costs more than %.3g times as much: that is what its best run took, which does not reach "
          "it.\n",
          slow->figures.cpu_s / best->figures.cpu_s);
    else fprintf(stream, "  Backward Euler does not reach it at any step that was measured.\n");
    slow = NULL;
  }
  fprintf(stream, "  to repeat: ");
  say_command(plan, best, stream);
  if (slow && best->method != euler) {
    fprintf(stream, "             ");
    say_command(plan, slow, stream);
  }
}

static void say_orders(const flesh_accuracy_plan *plan, FILE *stream)
{
  fprintf(stream, "\nOrders, fitted where they hold: over neighbouring runs whose slopes agree within 15 %%, with errors from ten "
      "times the reference's uncertainty to a tenth of the motion:\n");
  for (int m = 0; m < plan->method_count; m++) {
    const flesh_accuracy_method *method = &flesh_accuracy_methods[plan->methods[m]];
    flesh_accuracy_fit fit;
    flesh_accuracy_fit_order(plan, plan->methods[m], &fit);
    fprintf(stream, "  %-18s ", method->name);
    if (!fit.points && fit.candidates < 3) fprintf(stream, "too few runs (%d) in that range\n", fit.candidates);
    else if (!fit.points) fprintf(stream, "no order yet: the slopes between its %d runs in that range differ\n", fit.candidates);
    else
      fprintf(stream, "error ~ %s^%.3f ± %.3f (%d runs)\n", method->adaptive ? "tolerance" : "step", fit.slope, fit.slope_error,
          fit.points);
  }
}

/* Spurious energy is worse than energy that is lost: it can grow. Runs that it has ended count, too. */
static void say_gains(const flesh_accuracy_plan *plan, FILE *stream)
{
  for (int m = 0; m < plan->method_count; m++) {
    const flesh_accuracy_method *method = &flesh_accuracy_methods[plan->methods[m]];
    int count = 0;
    for (int k = 0; k < plan->row_count; k++) {
      const flesh_accuracy_row *row = &plan->rows[k];
      const double gain = row->figures.gain;
      if (row->method != plan->methods[m] || row->group != FLESH_ACCURACY_WORK || !row->done || !(gain > 0.01)) continue;
      if (!count++)
        fprintf(stream, "\nwarning: %s gains energy, in %% of the motion's:", method->name);
      fprintf(stream, "%s %.2g at %s", count > 1 ? "," : "", 100 * gain, row->setting);
    }
    if (!count) continue;
    fprintf(stream, ".\n");
    if (method->max_order > 2)
      fprintf(stream, "  Orders above 2 are not stable for fast oscillations, which grow: take order 2 (ida) or a "
              "tighter tolerance.\n");
  }
}

static void say_price(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row, FILE *stream)
{
  const flesh_accuracy_figures *f = &row->figures;
  fprintf(stream, "  %-32s ", row->setting);
  if (f->status || !row->done) {
    fprintf(stream, "%s\n", flesh_accuracy_status_word(row));
    return;
  }
  fprintf(stream, "%.3g s, %ld Hessians, %ld linear iterations", f->cpu_s, f->assemblies, f->linear);
  if (row->group == FLESH_ACCURACY_MESH)
    fprintf(stream, "; the tip elsewhere by %.2e m, the volume by %.2g %%", f->errors.tip,
        100 * f->errors.volume);
  else if (row->group == FLESH_ACCURACY_MASS && strcmp(row->extra, plan->mass))
    fprintf(stream, "; another body: %.2e m rms elsewhere (%.2g %% of the motion)", f->difference,
        100 * f->difference / plan->reference.scale.motion);
  else fprintf(stream, "; adds %.2e m rms", f->difference);
  fprintf(stream, "\n");
}

static void say_prices(const flesh_accuracy_plan *plan, FILE *stream)
{
  int any = 0;
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_accuracy_row *row = &plan->rows[k];
    if (row->group == FLESH_ACCURACY_WORK) continue;
    if (!any++)
      fprintf(stream, "\nOther prices, each alone, with %s at a step of %s s:\n",
          flesh_accuracy_methods[row->method].name, row->step.text);
    say_price(plan, row, stream);
  }
  if (!any) fprintf(stream, "\nOther prices are not measured: --methods names no method of fixed steps.\n");
  else if (!plan->finer)
    fprintf(stream, "  mesh refinement                  not measured: --finer names no scene with a finer "
        "mesh\n");
}

/* Wall times are those of a quiet machine or nobody's; flesh runs on one processor. */
static void say_times(const flesh_accuracy_plan *plan, FILE *stream)
{
  double wall = 0, cpu = 0;
  for (int k = 0; k < plan->row_count; k++)
    if (plan->rows[k].done && isfinite(plan->rows[k].figures.wall_s_min)) {
      wall += plan->rows[k].figures.wall_s_min;
      cpu += plan->rows[k].figures.cpu_s;
    }
  fprintf(stream, "times: CPU time of the integration alone; what differs by less than a tenth, or than repeats do, counts as "
      "equal");
  if (cpu > 0 && wall > 1.2 * cpu)
    fprintf(stream, ". The machine was busy: on the wall the runs took %.1f times that", wall / cpu);
  fprintf(stream, "\n");
}

static void say_reference(const flesh_accuracy_plan *plan, FILE *stream)
{
  const flesh_accuracy_reference *about = &plan->reference;
  fprintf(stream, "\nreference: %s; against %s\n", about->first, about->second);
  fprintf(stream, "  they differ by %.2e m rms, the last refinement changed the first by %.2e m, interpolation between its %d "
      "times adds %.2e m: errors below %.2e m (%.2g %% of the motion) are not reported\n",
      about->apart, about->change, plan->grid.count, about->between, about->uncertainty.position_rms,
      100 * about->uncertainty.position_rms / about->scale.motion);
  fprintf(stream, "  motion: %.3g m rms, node %d moves most, %.3g m", about->scale.motion, about->scale.tip,
      about->scale.tip_motion);
  if (isfinite(about->scale.period)) fprintf(stream, ", period %.3g s\n", about->scale.period);
  else fprintf(stream, "; too short to show a period\n");
  if (about->uncertainty.position_rms > 0.01 * about->scale.motion)
    fprintf(stream, "  warning: this motion cannot be followed that far by any method: nearby states part too "
        "fast. A "
        "shorter --set time.end, or more --reference-seconds, may help.\n");
}

static void say(const void *data, FILE *stream)
{
  static const double shares[] = {0.1, 0.01, 0.001, 0.0001};
  const flesh_accuracy_plan *plan = data;
  say_reference(plan, stream);
  say_times(plan, stream);
  for (size_t s = 0; s < sizeof shares / sizeof shares[0]; s++) say_target(plan, shares[s], stream);
  say_orders(plan, stream);
  say_gains(plan, stream);
  say_prices(plan, stream);
}

int flesh_accuracy_write_verdict(const void *plan)
{
  return flesh_table_say(((const flesh_accuracy_plan *)plan)->out, "verdict.txt", say, plan);
}
