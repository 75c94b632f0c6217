/* parameter.c: maps parameters to the variables of the search; computes residuals; words what the
 * measurements do not determine. */
#include <float.h>
#include <math.h>

#include "base/error.h"
#include "base/file.h"
#include "base/text.h"
#include "fit/fit.h"

double flesh_fit_q_of(const flesh_fit_parameter *parameter, double p)
{
  return parameter->spacing == FLESH_LOGARITHMIC ? log(p) : p / parameter->scale;
}

double flesh_fit_p_of(const flesh_fit_parameter *parameter, double q)
{
  return parameter->spacing == FLESH_LOGARITHMIC ? exp(q) : q * parameter->scale;
}

double flesh_fit_slope(const flesh_fit_parameter *parameter, double p)
{
  return parameter->spacing == FLESH_LOGARITHMIC ? p : parameter->scale;
}

double flesh_fit_clamp(const flesh_fit_parameter *p, double q)
{
  return fmin(fmax(q, flesh_fit_q_of(p, p->from)), flesh_fit_q_of(p, p->to));
}

double flesh_fit_value_at(const flesh_fit_parameter *p, double q)
{
  return fmin(fmax(flesh_fit_p_of(p, flesh_fit_clamp(p, q)), p->from), p->to);
}

/* Returns the number next to values[0] in the range from values[1] to values[2]; a key that takes whole numbers refuses
 * it. */
static double next_to(const double values[3])
{
  const double next = nextafter(values[0], values[0] < values[2] ? values[2] : values[1]);
  return values[0] != 0 ? next : copysign(DBL_MIN, next);
}

int flesh_fit_check_values(const flesh_fit_experiment *e, const char *key, const flesh_fit_parameter *parameter,
                           const char *start)
{
  const double values[] = {parameter->start, parameter->from, parameter->to};
  const char *const names[] = {start, "from", "to"};
  int status = FLESH_OK;
  for (int v = 0; v < 4 && !status; v++) {
    flesh_overrides set;
    char number[FLESH_NUMBER_SIZE];
    const double value = v < 3 ? values[v] : next_to(values);
    const flesh_node *node = flesh_node_find(parameter->node, names[v % 3]);
    if (!node || !isfinite(value)) continue;
    flesh_overrides_copy(&set, &e->set);
    flesh_overrides_add(&set, key, flesh_number_text(value, number));
    status = set.failed ? flesh_no_memory() : flesh_settings_check(node, e->scene, set.texts.count, set.texts.values);
    flesh_overrides_close(&set);
    if (v == 3 && status == FLESH_ERR_ARGUMENT)
      status = flesh_node_fail(node, "%s takes whole numbers only; a parameter must take any number", key);
  }
  return status;
}

int flesh_fit_check_numbers(flesh_fit_parameter *p)
{
  const flesh_node *start = flesh_node_find(p->node, "start");
  if (!(p->from < p->to))
    return flesh_node_fail(flesh_node_find(p->node, "to"), "to is %g; it must be above from, which is %g", p->to, p->from);
  if (!(p->start >= p->from && p->start <= p->to))
    return flesh_node_fail(start, "start is %g; it must lie from %g to %g, as from and to say", p->start, p->from, p->to);
  if (p->spacing == FLESH_LOGARITHMIC) {
    const flesh_node *scale = flesh_node_find(p->node, "scale");
    if (!(p->start > 0))
      return flesh_node_fail(start, "start is %g; it must be > 0 when spacing is logarithmic", p->start);
    if (isfinite(p->from) && !(p->from > 0))
      return flesh_node_fail(flesh_node_find(p->node, "from"), "from is %g; it must be > 0 when spacing is "
                                                                "logarithmic", p->from);
    if (scale) return flesh_node_fail(scale, "scale applies to linear parameters; leave it out with spacing: logarithmic");
    p->from = fmax(p->from, 0);
    p->scale = 1;
  } else if (isnan(p->scale)) {
    p->scale = fabs(p->start);
    if (!(p->scale > 0)) p->scale = (p->to - p->from) / 2;
    if (!isfinite(p->scale))
      return flesh_node_fail(p->node, "scale is missing; where start is 0 it must be a number > 0");
  }
  return FLESH_OK;
}

double flesh_fit_by_q(const flesh_fit *fit, const double *p, const double *jacobian, int i, int k)
{
  return jacobian[(size_t)i * (size_t)fit->key_count + (size_t)k] * flesh_fit_slope(&fit->parameters[k], p[k]) /
         fit->data[i]->deviation;
}

double flesh_fit_residual(const flesh_fit *fit, int i, const double *values)
{
  return (values[i] - fit->data[i]->value) / fit->data[i]->deviation;
}

double flesh_fit_squares(const flesh_fit *fit, int first, int count, const double *values)
{
  double sum = 0;
  for (int i = first; i < first + count; i++) sum += pow(flesh_fit_residual(fit, i, values), 2);
  return sum;
}

/* Shares that differ by at most this are taken as equal. */
static const double equal_share = 0.03;

void flesh_fit_say_null(flesh_fit_statistics *to, int n, const char *const *names, const double *shares)
{
  char text[600] = "";
  int list[FLESH_FIT_PARAMETERS + 1], count = 0;
  for (int c = 0; c < n; c++)
    if (fabs(shares[c]) > flesh_fit_small_share) list[count++] = c;
  if (count == 1)
    flesh_text_add(text, sizeof text, "%s is not determined: it changes none of the measured numbers.", names[list[0]]);
  else if (count == 2 && fabs(fabs(shares[list[0]] / shares[list[1]]) - 1) < equal_share)
    flesh_text_add(text, sizeof text, "%s and %s are not determined apart: the measured numbers depend on their %s alone.",
                   names[list[0]], names[list[1]], shares[list[0]] * shares[list[1]] < 0 ? "product" : "ratio");
  else {
    flesh_text_add(text, sizeof text, "These parameters are determined only together, as their change by these shares at once "
                   "changes none of the measured numbers:");
    for (int k = 0; k < count; k++)
      flesh_text_add(text, sizeof text, "%s %s %+.3g %%", k ? "," : "", names[list[k]], shares[list[k]]);
    flesh_text_add(text, sizeof text, ".");
  }
  json_array_append_new(to->sentences, json_string(text));
}
