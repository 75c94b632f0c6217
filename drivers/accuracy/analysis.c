/* analysis.c: the orders of the methods by fit, and the runs that nothing beats. */
#include <gsl/gsl_fit.h>
#include <math.h>

#include "accuracy/accuracy.h"

int flesh_accuracy_is_complete(const flesh_accuracy_row *row)
{
  return row->group == FLESH_ACCURACY_WORK && row->done && !row->figures.status;
}

static int judged(const flesh_accuracy_row *row)
{
  return flesh_accuracy_is_complete(row) && isfinite(row->figures.errors.position_rms);
}

int flesh_accuracy_same_run(const flesh_accuracy_row *a, const flesh_accuracy_row *b)
{
  const flesh_accuracy_figures *f = &a->figures, *g = &b->figures;
  double e = f->errors.position_rms, apart = fabs(e - g->errors.position_rms);
  return f->steps == g->steps && f->rejected == g->rejected && (apart <= 1e-9 * e || (f->below && g->below));
}

int flesh_accuracy_compare_counts(const flesh_accuracy_row *a, const flesh_accuracy_row *b)
{
  const flesh_accuracy_figures *f = &a->figures, *g = &b->figures;
  const long one[] = {f->residuals, f->linear, f->assemblies, f->steps};
  const long two[] = {g->residuals, g->linear, g->assemblies, g->steps};
  for (int c = 0; c < 4; c++)
    if (one[c] != two[c]) return one[c] < two[c] ? -1 : 1;
  return 0;
}

/* How far apart two times must be to distinguish runs: a tenth, or as far as their own repeats. */
static double noise(const flesh_accuracy_row *row)
{
  const flesh_accuracy_figures *f = &row->figures;
  return fmin(fmax(0.1, f->wall_s_min > 0 ? f->wall_s_median / f->wall_s_min - 1 : 0), 0.3);
}

int flesh_accuracy_compare_times(const flesh_accuracy_row *a, const flesh_accuracy_row *b)
{
  double least = 1 + fmax(noise(a), noise(b)), ratio = a->figures.cpu_s / b->figures.cpu_s;
  if (flesh_accuracy_same_run(a, b)) return 0;
  return ratio > least ? 1 : ratio * least < 1 ? -1 : 0;
}

/* -1: a costs less, 1: b does, 0: they cost the same. In residuals, or in time, where counts part those that time does
 * not. */
static int compare_costs(const flesh_accuracy_row *a, const flesh_accuracy_row *b, int in_residuals)
{
  long residuals = a->figures.residuals - b->figures.residuals;
  if (in_residuals) return residuals < 0 ? -1 : residuals > 0;
  int times = flesh_accuracy_compare_times(a, b);
  return times ? times : flesh_accuracy_compare_counts(a, b);
}

/* Whether the other is as good for no more, and better in one; of two that are alike the first stays. An error that is
 * smaller by less than a twentieth is worth nothing more. */
static int beats(const flesh_accuracy_row *other, const flesh_accuracy_row *row, int in_residuals)
{
  double mine = row->figures.errors.position_rms, its = other->figures.errors.position_rms;
  const double as_good = 1.05;
  int same_errors = flesh_accuracy_same_run(other, row) || its == mine;
  int costs = compare_costs(other, row, in_residuals);
  if (same_errors) return costs < 0 || (costs == 0 && other < row);
  int no_more = costs <= 0 || (!in_residuals && !flesh_accuracy_compare_times(other, row));
  int less = in_residuals ? costs < 0 : flesh_accuracy_compare_times(other, row) < 0;
  return (its < mine && no_more) || (its <= as_good * mine && less);
}

static int is_within(const flesh_accuracy_row *row, double error)
{
  return flesh_accuracy_is_complete(row) && (row->figures.below || row->figures.errors.position_rms <= error);
}

int flesh_accuracy_reaches(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row, double error)
{
  int reaches = is_within(row, error);
  for (int k = 0; k < plan->row_count && reaches; k++) {
    const flesh_accuracy_row *other = &plan->rows[k];
    const int finer = other->method == row->method && other->value < row->value;
    if (finer && flesh_accuracy_is_complete(other)) reaches = is_within(other, error);
  }
  return reaches;
}

void flesh_accuracy_find_fronts(flesh_accuracy_plan *plan)
{
  for (int kind = 0; kind < 2; kind++)
    for (int a = 0; a < plan->row_count; a++) {
      flesh_accuracy_row *row = &plan->rows[a];
      /* A run whose error exceeds the motion is no answer at any price. */
      row->on_front[kind] =
          judged(row) && row->figures.errors.position_rms < plan->reference.scale.motion;
      for (int b = 0; b < plan->row_count && row->on_front[kind]; b++)
        if (a != b && judged(&plan->rows[b])) row->on_front[kind] = !beats(&plan->rows[b], row, kind);
    }
}

/* The longest row of neighbouring points along which the local slope stays what it is, within 15 %: there the error is
 * that of its leading term. Of equally long ones that of the smallest values; points go from large values to small
 * ones. Returns its length, 0 where fewer than three points agree. */
static int asymptotic(int count, const double *x, const double *y, int *from)
{
  const double change = 0.15, least = 0.25; /* a smaller slope is a floor */
  int longest = 0;
  for (int first = 0; first + 2 < count; first++) {
    double low = INFINITY, high = -INFINITY;
    for (int last = first + 1; last < count; last++) {
      double slope = (y[last] - y[last - 1]) / (x[last] - x[last - 1]);
      low = fmin(low, slope), high = fmax(high, slope);
      if (!(low > least) || !(high - low <= change * high)) break;
      if (last - first >= 2 && last - first + 1 >= longest) longest = last - first + 1, *from = first;
    }
  }
  return longest;
}

void flesh_accuracy_fit_order(const flesh_accuracy_plan *plan, int method, flesh_accuracy_fit *fit)
{
  double value[FLESH_ACCURACY_LIMIT], x[FLESH_ACCURACY_LIMIT], y[FLESH_ACCURACY_LIMIT];
  const flesh_accuracy_reference *about = &plan->reference;
  int count = 0, from = 0;
  *fit = (flesh_accuracy_fit){.slope = NAN, .slope_error = NAN, .constant = NAN, .low = NAN, .high = NAN};
  for (int k = 0; k < plan->row_count; k++) { /* in order from the largest step or tolerance */
    const flesh_accuracy_row *row = &plan->rows[k];
    double error = row->figures.errors.position_rms;
    if (row->method != method || !judged(row) || count == FLESH_ACCURACY_LIMIT) continue;
    if (error > 0.1 * about->scale.motion || error < 10 * about->uncertainty.position_rms) continue;
    value[count] = row->value;
    x[count] = log(row->value);
    y[count++] = log(error);
  }
  fit->candidates = count;
  fit->points = asymptotic(count, x, y, &from);
  if (!fit->points) return;
  double constant_variance, covariance, slope_variance, squares;
  gsl_fit_linear(x + from, 1, y + from, 1, (size_t)fit->points, &fit->constant, &fit->slope, &constant_variance,
                 &covariance, &slope_variance, &squares);
  fit->slope_error = sqrt(slope_variance);
  fit->high = value[from];
  fit->low = value[from + fit->points - 1];
}
