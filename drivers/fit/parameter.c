/* parameter.c: parameters as the search sees them, and the list of all measured numbers. */
#include <math.h>

#include "fit/fit.h"

double flesh_fit_q_of(const flesh_fit_parameter *parameter, double p)
{
  return parameter->spacing == FLESH_FIT_LOGARITHMIC ? log(p) : p / parameter->scale;
}

double flesh_fit_p_of(const flesh_fit_parameter *parameter, double q)
{
  return parameter->spacing == FLESH_FIT_LOGARITHMIC ? exp(q) : q * parameter->scale;
}

double flesh_fit_slope(const flesh_fit_parameter *parameter, double p)
{
  return parameter->spacing == FLESH_FIT_LOGARITHMIC ? p : parameter->scale;
}

const flesh_fit_datum *flesh_fit_datum_at(const flesh_fit *fit, int i)
{
  for (int e = 0; e < fit->experiment_count; e++)
    for (int k = 0; k < fit->experiments[e].measured_count; k++) {
      const flesh_fit_measured *m = &fit->experiments[e].measured[k];
      if (i < m->count) return &m->data[i];
      i -= m->count;
    }
  return NULL;
}
