/* evaluate.c: computes the measured quantities and their derivatives by the parameters, at given parameters. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "fit/fit.h"

/* Step of central differences in q. Their error is proportional to its square, and that of the solves is divided by
 * it. */
static const double difference = 1e-3;

/* Computes a column of the Jacobian by a central difference, or by a one-sided one at a bound and if a run fails. `p` is
 * changed meanwhile; `values` holds those of two runs. */
static int differentiate(flesh_fit *fit, flesh_fit_experiment *e, double *p, int k, double *values, double *jacobian)
{
  const flesh_fit_parameter *parameter = &fit->parameters[k];
  const double middle = p[k], q = flesh_fit_q_of(parameter, middle);
  double ends[] = {fmax(flesh_fit_p_of(parameter, q - difference), parameter->from),
                   fmin(flesh_fit_p_of(parameter, q + difference), parameter->to)};
  int status = FLESH_OK;
  for (int s = 0; s < 2 && !status; s++) {
    p[k] = ends[s];
    status = flesh_fit_values_at(fit, e, p, values + s * e->count);
    if (status != FLESH_FIT_RUN_FAILED || ends[s] == middle) continue;
    p[k] = ends[s] = middle;
    status = flesh_fit_values_at(fit, e, p, values + s * e->count);
    if (!status && ends[0] == ends[1]) status = FLESH_FIT_RUN_FAILED;
  }
  p[k] = middle;
  const double h = (flesh_fit_q_of(parameter, ends[1]) - flesh_fit_q_of(parameter, ends[0])) * flesh_fit_slope(parameter, middle);
  for (int i = 0; i < e->count && !status; i++)
    jacobian[(size_t)i * (size_t)fit->key_count + (size_t)k] = (values[e->count + i] - values[i]) / h;
  return status;
}

static int differentiate_all(flesh_fit *fit, flesh_fit_experiment *e, const double *given, double *jacobian)
{
  double *values = malloc((2 * (size_t)e->count + (size_t)fit->parameter_count) * sizeof *values), *p = values + 2 * e->count;
  int status = values ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "out of memory for derivatives");
  if (!status) memcpy(p, given, (size_t)fit->parameter_count * sizeof *p);
  for (int k = 0; k < fit->key_count && !status; k++)
    if (e->acts[k]) status = differentiate(fit, e, p, k, values, jacobian);
  free(values);
  return status == FLESH_FIT_RUN_FAILED
             ? flesh_fail(status, "the experiment %.60s cannot be run with parameters a little larger or smaller", e->name)
             : status;
}

int flesh_fit_evaluate(flesh_fit *fit, const double *p, double *values, double *jacobian)
{
  int status = FLESH_OK;
  if (jacobian) memset(jacobian, 0, (size_t)fit->count * (size_t)fit->key_count * sizeof *jacobian);
  for (int k = 0; k < fit->experiment_count && !status; k++) {
    flesh_fit_experiment *e = &fit->experiments[k];
    double *rows = jacobian ? jacobian + (size_t)e->first * (size_t)fit->key_count : NULL;
    status = flesh_fit_values_at(fit, e, p, values + e->first);
    if (status == FLESH_FIT_RUN_FAILED) flesh_fail_within(status, "the experiment %.60s: ", e->name);
    if (!status && rows && !*e->differences) status = flesh_fit_tangents_at(fit, e, p, rows);
    if (!status && rows && *e->differences) status = differentiate_all(fit, e, p, rows);
  }
  return status;
}

int flesh_fit_evaluate_accepted(flesh_fit *fit, const double *p, double *values, double *jacobian)
{
  const int status = flesh_fit_evaluate(fit, p, values, jacobian);
  return status == FLESH_FIT_RUN_FAILED ? FLESH_ERR_SOLVE : status;
}

int flesh_fit_found_open(flesh_fit *fit, flesh_fit_found *found)
{
  const size_t m = (size_t)fit->count, n = (size_t)fit->parameter_count, keys = (size_t)fit->key_count;
  flesh_arena *arena = &fit->arena;
  *found = (flesh_fit_found){.p = flesh_arena_take(arena, n * sizeof(double)),
                             .values = flesh_arena_take(arena, m * sizeof(double)),
                             .jacobian = flesh_arena_take(arena, m * keys * sizeof(double)),
                             .at_bound = flesh_arena_take(arena, n), .determined = NAN, .median = NAN, .largest = NAN};
  if (!found->p || !found->values || !found->jacobian || !found->at_bound)
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a fit");
  for (int k = 0; k < fit->parameter_count; k++)
    found->p[k] = flesh_fit_value_at(&fit->parameters[k], flesh_fit_q_of(&fit->parameters[k], fit->parameters[k].start));
  const int status = flesh_fit_evaluate(fit, found->p, found->values, NULL);
  if (status == FLESH_FIT_RUN_FAILED) return flesh_fail_within(FLESH_ERR_SOLVE, "the start cannot be run: ");
  if (status || isfinite(flesh_fit_squares(fit, 0, fit->count, found->values))) return status;
  return flesh_fail(FLESH_ERR_NONFINITE, "the sum of squares at the start is not finite: deviations are far too small");
}
