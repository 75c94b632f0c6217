/* longest_step.c: the step of a run that took most iterations, beside the median. */
#include "shared/longest_step.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { LEAST_STEPS = 3 }; /* of a median */

static int compare(const void *a, const void *b)
{
  const long p = *(const long *)a, q = *(const long *)b;
  return (p > q) - (p < q);
}

static double median_of(const flesh_run_trace *trace)
{
  long *sorted = malloc(sizeof *sorted * ((size_t)trace->count + 1));
  int count = 0;
  if (!sorted) return NAN;
  for (int k = 0; k < trace->count; k++)
    if (trace->rows[k].iterations > 0) sorted[count++] = trace->rows[k].iterations;
  qsort(sorted, (size_t)count, sizeof *sorted, compare);
  const double median = count < LEAST_STEPS ? NAN : 0.5 * (double)(sorted[(count - 1) / 2] + sorted[count / 2]);
  free(sorted);
  return median;
}

flesh_longest_step flesh_longest_step_find(const flesh_run_trace *trace, long unfinished)
{
  flesh_longest_step longest = {.t = NAN};
  for (int k = 0; k < trace->count; k++)
    if (trace->rows[k].iterations > longest.iterations) {
      longest.step = trace->rows[k].step;
      longest.t = trace->rows[k].t;
      longest.iterations = trace->rows[k].iterations;
    }
  if (unfinished > longest.iterations) {
    longest.step = trace->count ? trace->rows[trace->count - 1].step + 1 : 1;
    longest.t = NAN;
    longest.iterations = unfinished;
  }
  longest.median = median_of(trace);
  longest.ratio = (double)longest.iterations / longest.median;
  return longest;
}

int flesh_longest_step_tell(const flesh_longest_step *longest, size_t size, char *words)
{
  char place[48] = "not finished";
  if (size) *words = 0;
  if (!(longest->ratio > FLESH_LONG_STEP)) return 0;
  if (isfinite(longest->t)) snprintf(place, sizeof place, "to t = %.6g s", longest->t);
  snprintf(words, size, "step %ld (%s) took %ld iterations, Newton's and linear ones, %.3g times the median of %g",
           longest->step, place, longest->iterations, longest->ratio, longest->median);
  return 1;
}
