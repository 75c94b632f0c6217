/* accuracy_analysis.c: the orders of the methods by fit, and the runs that nothing beats. */
#include <gsl/gsl_fit.h>
#include <math.h>

#include "accuracy.h"

static int judged(const flesh_accuracy_row *row)
{
  return row->group == FLESH_ACCURACY_WORK && row->done && !row->figures.status &&
         isfinite(row->figures.errors.position_rms);
}

void flesh_accuracy_find_fronts(flesh_accuracy_plan *plan)
{
  for (int kind = 0; kind < 2; kind++)
    for (int a = 0; a < plan->row_count; a++) {
      flesh_accuracy_row *row = &plan->rows[a];
      /* What is off by more than the motion is no answer at any price. */
      row->on_front[kind] =
          judged(row) && row->figures.errors.position_rms < plan->reference.scale.motion;
      for (int b = 0; b < plan->row_count && row->on_front[kind]; b++) {
        const flesh_accuracy_row *other = &plan->rows[b];
        if (a == b || !judged(other)) continue;
        const flesh_accuracy_figures *f = &row->figures, *g = &other->figures;
        double mine = kind ? (double)f->residuals : f->cpu_s;
        double its = kind ? (double)g->residuals : g->cpu_s;
        int no_worse = its <= mine && g->errors.position_rms <= f->errors.position_rms;
        int better = its < mine || g->errors.position_rms < f->errors.position_rms;
        /* Of two that are alike in everything the first stays. */
        row->on_front[kind] = !(no_worse && (better || b < a));
      }
    }
}

void flesh_accuracy_fit_order(const flesh_accuracy_plan *plan, int method, flesh_accuracy_fit *fit)
{
  double x[FLESH_ACCURACY_LIMIT], y[FLESH_ACCURACY_LIMIT];
  const flesh_accuracy_reference *about = &plan->reference;
  *fit = (flesh_accuracy_fit){.slope = NAN, .slope_error = NAN, .constant = NAN, .low = INFINITY};
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_accuracy_row *row = &plan->rows[k];
    double error = row->figures.errors.position_rms;
    if (row->method != method || !judged(row) || fit->points == FLESH_ACCURACY_LIMIT) continue;
    if (error > 0.1 * about->scale.motion || error < 10 * about->uncertainty.position_rms) continue;
    x[fit->points] = log(row->value);
    y[fit->points++] = log(error);
    fit->low = fmin(fit->low, row->value);
    fit->high = fmax(fit->high, row->value);
  }
  if (fit->points < 2) return;
  double constant_variance, covariance, slope_variance, squares;
  gsl_fit_linear(x, 1, y, 1, (size_t)fit->points, &fit->constant, &fit->slope, &constant_variance,
                 &covariance, &slope_variance, &squares);
  if (fit->points > 2) fit->slope_error = sqrt(slope_variance);
}
