/* run_trace.c: what is kept of every step of a run, and the step of it that took most iterations, beside the median. */
#include "run/run_trace.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"
#include "system/one_effect.h"

int flesh_run_trace_observe(void *data, const flesh_step_record *record)
{
  flesh_run_trace *trace = data;
  if (!flesh_grow(&trace->rows, sizeof *trace->rows, trace->count, &trace->room)) return flesh_no_memory();
  const flesh_system *system = record->system;
  const double strain = flesh_system_role_energy(system, FLESH_ROLE_ELASTICITY, record->energies) -
                        flesh_system_role_energy(system, FLESH_ROLE_ELASTICITY, record->rest_energies);
  trace->rows[trace->count++] = (flesh_run_trace_row){
      .t = record->state->t, .step = record->step, .strain = strain,
      .kinetic = flesh_system_role_energy(system, FLESH_ROLE_INERTIA, record->energies),
      .newton = record->step ? record->stats->newton : 0, .linear = record->step ? record->stats->linear : 0,
      .cuts = record->step ? record->stats->rejected + record->stats->convergence_failures : 0};
  return FLESH_OK;
}

void flesh_run_trace_clear(flesh_run_trace *trace)
{
  free(trace->rows);
  *trace = (flesh_run_trace){0};
}

enum { LEAST_STEPS = 3 }; /* of a median */

/* Median over the steps of the Newton iterations, plus the linear ones if `all`. NaN: too few steps, or no memory. */
static double median_of(const flesh_run_trace *trace, int all)
{
  long *sorted = malloc(sizeof *sorted * ((size_t)trace->count + 1));
  int count = 0;
  if (!sorted) return NAN;
  for (int k = 0; k < trace->count; k++)
    if (trace->rows[k].newton > 0) sorted[count++] = trace->rows[k].newton + (all ? trace->rows[k].linear : 0);
  qsort(sorted, (size_t)count, sizeof *sorted, flesh_compare_long);
  const double median = count < LEAST_STEPS ? NAN : 0.5 * (double)(sorted[(count - 1) / 2] + sorted[count / 2]);
  free(sorted);
  return median;
}

flesh_longest_step flesh_longest_step_find(const flesh_run_trace *trace, long newton, long linear)
{
  const double of_newton = median_of(trace, 0), of_all = median_of(trace, 1);
  flesh_longest_step longest = {.t = NAN, .ratio = NAN};
  for (int k = 0; k <= trace->count; k++) {
    const int finished = k < trace->count;
    const long n = finished ? trace->rows[k].newton : newton, l = finished ? trace->rows[k].linear : linear;
    const double ratio = fmax((double)n / of_newton, (double)(n + l) / of_all);
    if (n <= 0 || !(ratio > longest.ratio || (isnan(longest.ratio) && isfinite(ratio)))) continue;
    const long before = k > 0 ? trace->rows[k - 1].step : 0;
    longest = (flesh_longest_step){finished ? trace->rows[k].step : before + 1, finished ? trace->rows[k].t : NAN,
                                   n, l, finished ? trace->rows[k].cuts : 0, ratio};
  }
  return longest;
}

int flesh_longest_step_tell(const flesh_longest_step *longest, size_t size, char *words)
{
  char place[48] = "not finished", cuts[48] = "";
  if (size) *words = 0;
  if (!(longest->ratio > FLESH_LONG_STEP)) return 0;
  if (isfinite(longest->t)) snprintf(place, sizeof place, "to t = %.6g s", longest->t);
  if (longest->cuts) snprintf(cuts, sizeof cuts, ", with cuts: %ld", longest->cuts);
  snprintf(words, size, "step %ld (%s) took %ld Newton and %ld linear iterations, %.4g times the median step%s",
           longest->step, place, longest->newton, longest->linear, longest->ratio, cuts);
  return 1;
}
