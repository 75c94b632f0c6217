/* evaluate.c: computes the measured quantities and their derivatives by the parameters, at given parameters. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "fit/fit.h"

/* Step of central differences in q. Their error is proportional to its square, and that of the solves is divided by
 * it. */
static const double difference = 1e-3;

/* Finds the two ends of a central difference at p, within the bounds. */
static void place_difference(const flesh_fit_parameter *parameter, double p, double *low, double *high)
{
  const double q = flesh_fit_q_of(parameter, p);
  *low = fmax(flesh_fit_p_of(parameter, q - difference), parameter->from);
  *high = fmin(flesh_fit_p_of(parameter, q + difference), parameter->to);
}

static int run_changed(flesh_fit *fit, int experiment, double *p, int k, double value, double *values, int *good)
{
  char why[FLESH_FIT_WORDS];
  const double kept = p[k];
  p[k] = value;
  const int status = flesh_fit_values_at(fit, experiment, p, values, why);
  p[k] = kept;
  *good = !status && !*why;
  return status;
}

/* Computes a column of the Jacobian by a central difference, or by a one-sided one at a bound and if a run fails.
 * `room` holds the values of two runs. */
static int differentiate(flesh_fit *fit, int experiment, double *p, int k, double *room, double *jacobian, int *good)
{
  const flesh_fit_experiment *e = &fit->experiments[experiment];
  const flesh_fit_parameter *parameter = &fit->parameters[k];
  double ends[2];
  place_difference(parameter, p[k], &ends[0], &ends[1]);
  int whole = 1;
  for (int s = 0; s < 2; s++) {
    int fine, status = run_changed(fit, experiment, p, k, ends[s], room + s * e->count, &fine);
    if (!status && !fine && ends[s] != p[k]) {
      whole = 0;
      ends[s] = p[k];
      status = run_changed(fit, experiment, p, k, p[k], room + s * e->count, &fine);
    }
    if (status) return status;
    *good &= fine;
  }
  *good &= whole || ends[0] != ends[1];
  const double h = (flesh_fit_q_of(parameter, ends[1]) - flesh_fit_q_of(parameter, ends[0])) * flesh_fit_slope(parameter, p[k]);
  for (int i = 0; i < e->count && *good; i++)
    jacobian[(size_t)(e->first + i) * (size_t)fit->key_count + (size_t)k] = (room[e->count + i] - room[i]) / h;
  return FLESH_OK;
}

static int differentiate_all(flesh_fit *fit, int experiment, const double *given, double *jacobian, int *good)
{
  const flesh_fit_experiment *e = &fit->experiments[experiment];
  double *room = malloc(2 * (size_t)e->count * sizeof *room), *p = malloc((size_t)fit->parameter_count * sizeof *p);
  int status = room && p ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "out of memory for derivatives");
  if (!status) memcpy(p, given, (size_t)fit->parameter_count * sizeof *p);
  for (int k = 0; k < fit->key_count && !status && *good; k++)
    if (e->acts[k]) status = differentiate(fit, experiment, p, k, room, jacobian, good);
  free(room);
  free(p);
  return status;
}

int flesh_fit_evaluate(flesh_fit *fit, const double *p, double *values, double *jacobian, int *good,
                       char why[FLESH_FIT_WORDS])
{
  int status = FLESH_OK;
  *good = 1;
  if (jacobian) memset(jacobian, 0, (size_t)fit->count * (size_t)fit->key_count * sizeof *jacobian);
  for (int k = 0; k < fit->experiment_count && !status && *good; k++) {
    const flesh_fit_experiment *e = &fit->experiments[k];
    double *rows = jacobian ? jacobian + (size_t)e->first * (size_t)fit->key_count : NULL;
    char words[FLESH_FIT_WORDS];
    status = flesh_fit_values_at(fit, k, p, values + e->first, words);
    *good = !status && !*words;
    if (!status && !*good) snprintf(why, FLESH_FIT_WORDS, "the experiment %.60s: %.300s", e->name, words);
    if (!*good || !jacobian) continue;
    if (!*e->differences) status = flesh_fit_tangents_at(fit, k, p, rows);
    if (!status && *e->differences) status = differentiate_all(fit, k, p, jacobian, good);
    if (!status && !*good)
      snprintf(why, FLESH_FIT_WORDS, "the experiment %.60s cannot be run with parameters a little larger or smaller", e->name);
  }
  return status;
}

int flesh_fit_found_open(flesh_fit *fit, flesh_fit_found *found)
{
  const size_t m = (size_t)fit->count, n = (size_t)fit->parameter_count, keys = (size_t)fit->key_count;
  char why[FLESH_FIT_WORDS];
  int good;
  flesh_arena *arena = &fit->arena;
  *found = (flesh_fit_found){.p = flesh_arena_take(arena, n * sizeof(double)),
                             .values = flesh_arena_take(arena, m * sizeof(double)),
                             .jacobian = flesh_arena_take(arena, m * keys * sizeof(double)),
                             .at_bound = flesh_arena_take(arena, n), .determined = NAN};
  if (!found->p || !found->values || !found->jacobian || !found->at_bound)
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a fit");
  for (int k = 0; k < fit->parameter_count; k++)
    found->p[k] = flesh_fit_value_at(&fit->parameters[k], flesh_fit_q_of(&fit->parameters[k], fit->parameters[k].start));
  const int status = flesh_fit_evaluate(fit, found->p, found->values, NULL, &good, why);
  if (status) return status;
  if (!good) return flesh_fail(FLESH_ERR_SOLVE, "the start cannot be run: %s", why);
  if (isfinite(flesh_fit_squares(fit, 0, fit->count, found->values))) return FLESH_OK;
  return flesh_fail(FLESH_ERR_NONFINITE, "the sum of squares at the start is not finite: deviations are far too small");
}
