/* fibre.c: the curves of a muscle fibre and the constants of its tension. */
#include "material/fibre.h"

#include <math.h>

#include "base/error.h"

typedef struct curve {
  const char *name;
  double passive, exponent, limit;
} curve;

static const curve curves[FLESH_FIBRE_CURVE_COUNT] = {
#define CURVE(NAME, text, passive, exponent, limit, source) [FLESH_FIBRE_##NAME] = {text, passive, exponent, limit},
    FLESH_FIBRE_CURVE_LIST(CURVE)
#undef CURVE
};

static int is_curve(flesh_fibre_curve curve) { return (unsigned)curve < FLESH_FIBRE_CURVE_COUNT; }

const char *flesh_fibre_curve_name(flesh_fibre_curve curve) { return is_curve(curve) ? curves[curve].name : NULL; }

static int check_peak(double stress)
{
  if (stress >= 0 && stress < INFINITY) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "peak_stress is %g Pa; it must be finite and not negative", stress);
}

int flesh_fibre_default(flesh_fibre_curve curve, double peak_stress, flesh_fibre *fibre)
{
  FLESH_NEED({fibre, "fibre"});
  if (!is_curve(curve))
    return flesh_fail(FLESH_ERR_ARGUMENT, "curve %d of a fibre does not exist; it must be below %d", (int)curve,
                      (int)FLESH_FIBRE_CURVE_COUNT);
  const int status = check_peak(peak_stress);
  if (status) return status;
  *fibre = (flesh_fibre){.curve = curve,
                         .peak_stress = peak_stress,
                         .optimal_stretch = 1,
                         .passive_stress = curves[curve].passive * peak_stress,
                         .passive_exponent = curves[curve].exponent,
                         .passive_limit = curves[curve].limit};
  return FLESH_OK;
}

static int check(const flesh_fibre *fibre)
{
  if (!is_curve(fibre->curve))
    return flesh_fail(FLESH_ERR_ARGUMENT, "curve %d of a fibre does not exist; it must be below %d", (int)fibre->curve,
                      (int)FLESH_FIBRE_CURVE_COUNT);
  const int status = check_peak(fibre->peak_stress);
  if (status) return status;
  if (!(fibre->optimal_stretch > 0 && fibre->optimal_stretch < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "optimal_stretch is %g; it must be positive", fibre->optimal_stretch);
  if (!(fibre->passive_stress >= 0 && fibre->passive_stress < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the passive stress c1 is %g Pa; it must not be negative",
                      fibre->passive_stress);
  if (!(fibre->max_shortening_velocity >= 0 && fibre->max_shortening_velocity < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "max_shortening_velocity is %g 1/s; it must not be negative",
                      fibre->max_shortening_velocity);
  if (fibre->passive_stress == 0) return FLESH_OK;
  if (!(fibre->passive_exponent > 0 && fibre->passive_exponent < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the passive exponent c2 is %g; it must be positive", fibre->passive_exponent);
  if (!(fibre->passive_limit > 0 && fibre->passive_exponent * fibre->passive_limit <= 100))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "the passive limit is %g; it must be positive and, at the exponent c2 = %g, at most %g",
                      fibre->passive_limit, fibre->passive_exponent, 100 / fibre->passive_exponent);
  return FLESH_OK;
}

int flesh_fibre_constants_of(const flesh_fibre *fibre, flesh_fibre_constants *c)
{
  int status = check(fibre);
  if (status) return status;
  *c = (flesh_fibre_constants){.curve = fibre->curve,
                               .peak_stress = fibre->peak_stress,
                               .inverse_optimal = 1 / fibre->optimal_stretch,
                               .passive_stress = fibre->passive_stress,
                               .max_shortening_velocity = fibre->max_shortening_velocity};
  if (fibre->passive_stress == 0) return FLESH_OK;
  const double b = c->exponent = fibre->passive_exponent;
  c->limit = fibre->passive_limit;
  c->toe = fmin(1 / (3 * b), c->limit);
  c->toe_value = expm1(b * c->toe);
  c->toe_slope = b * exp(b * c->toe);
  c->toe_energy = c->toe * (c->toe_value / 2 - c->toe * c->toe_slope / 12);
  c->limit_value = expm1(b * c->limit);
  c->limit_slope = b * exp(b * c->limit);
  c->limit_energy = c->toe_energy + (c->limit_value - c->toe_value) / b - (c->limit - c->toe);
  return FLESH_OK;
}
