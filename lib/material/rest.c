/* rest.c: the rest state according to psi: its linearisation at F = I, and the uniform scale at which a free body has
 * no stress. */
#include <float.h>
#include <math.h>
#include <stddef.h>

#include "base/error.h"
#include "material/form.h"
#include "material/psi.h"
#include "material/stretch.h"

int flesh_material_small_strain(const flesh_material *material, double *mu, double *lambda,
                                double *rest_stress)
{
  FLESH_NEED({material, "material"});
  static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  if (flesh_form_of_stretches(material->energy)) {
    flesh_stretch_real stretch;
    int undefined = flesh_stretch_at(material, identity, &stretch, NULL, NULL);
    if (undefined) return undefined;
    if (mu) *mu = 0.5 * stretch.spectrum.flip[0];
    if (lambda) *lambda = stretch.spectrum.A[1];
    if (rest_stress) *rest_stress = stretch.p[0];
    return FLESH_OK;
  }
  flesh_psi at;
  int status = flesh_psi_at(material, identity, &at);
  if (status) return status;
  if (material->incompressible) { /* its pressure makes rest free of stress */
    if (mu) *mu = 2 * at.I;
    if (lambda) *lambda = INFINITY;
    if (rest_stress) *rest_stress = 0;
    return FLESH_OK;
  }
  if (mu) *mu = at.I - 0.5 * at.J;
  if (lambda) *lambda = at.J + 4 * at.II + 4 * at.IJ + at.JJ;
  if (rest_stress) *rest_stress = 2 * at.I + at.J;
  return FLESH_OK;
}

int flesh_material_is_stressed_at_rest(const flesh_material *material)
{
  double mu, stress;
  return flesh_material_small_strain(material, &mu, NULL, &stress) || fabs(stress) > 1e-9 * fabs(mu);
}

/* Computes g(s) = 2 psi_I + psi_J s, the stress at F = s I over s: its sign tells whether the body shrinks (> 0) or
 * swells; the zero at s = 0, which all forms of I_C and J have, is divided out. */
static int tension(const flesh_material *material, double s, double *g, double *slope)
{
  double F[9] = {s, 0, 0, 0, s, 0, 0, 0, s};
  if (flesh_form_of_stretches(material->energy)) {
    flesh_stretch_real stretch;
    int undefined = flesh_stretch_at(material, F, &stretch, NULL, NULL);
    if (undefined) return undefined;
    *g = stretch.p[0] / s;
    *slope = (stretch.spectrum.A[0] + 2 * stretch.spectrum.A[1] - *g) / s;
    return FLESH_OK;
  }
  flesh_psi at;
  int status = flesh_psi_at(material, F, &at);
  if (status) return status;
  double s2 = s * s;
  *g = 2 * at.I + at.J * s;
  *slope = 12 * at.II * s + 6 * at.IJ * s2 + at.J + 6 * at.IJ * s2 + 3 * at.JJ * s2 * s;
  return FLESH_OK;
}

/* Finds the root of g in [low, high], where g(low) < 0 <= g(high), by Newton's method safeguarded by bisection. */
static int polish(const flesh_material *material, double low, double high, double *root)
{
  double s = 0.5 * (low + high);
  for (int k = 0; k < 200; k++) {
    double g, slope;
    int status = tension(material, s, &g, &slope);
    if (status) return status;
    if (g < 0) low = s;
    else high = s;
    double next = s - g / slope;
    if (!(next > low && next < high)) {
      if (fabs(next - s) <= DBL_EPSILON * s || g == 0) break;
      next = 0.5 * (low + high);
    }
    if (fabs(next - s) <= DBL_EPSILON * s || next <= low || next >= high) break;
    s = next;
  }
  *root = s;
  return FLESH_OK;
}

/* Searches (low, high), where sign * g is positive at both ends and dips between, for a point where it is not positive,
 * by golden section, so that two close roots are not stepped over. */
static int dips(const flesh_material *material, double sign, double low, double high, double *where,
                int *found)
{
  const double ratio = 0.61803398874989485;
  double x = high - ratio * (high - low), y = low + ratio * (high - low), gx, gy, slope;
  int status = tension(material, x, &gx, &slope);
  if (!status) status = tension(material, y, &gy, &slope);
  *found = 0;
  for (int k = 0; !status && k < 60; k++) {
    if (sign * gx < 0 || sign * gy < 0) {
      *where = sign * gx < 0 ? x : y;
      *found = 1;
      break;
    }
    if (sign * gx < sign * gy) {
      high = y, y = x, gy = gx;
      x = high - ratio * (high - low);
      status = tension(material, x, &gx, &slope);
    } else {
      low = x, x = y, gx = gy;
      y = low + ratio * (high - low);
      status = tension(material, y, &gy, &slope);
    }
  }
  return status;
}

int flesh_material_rest_ratio(const flesh_material *material, double *volume_ratio)
{
  FLESH_NEED({material, "material"}, {volume_ratio, "volume_ratio"});
  if (material->incompressible) {
    *volume_ratio = 1;
    return FLESH_OK;
  }
  double g, slope, mu, lambda, stress;
  int status = tension(material, 1, &g, &slope);
  if (!status) status = flesh_material_small_strain(material, &mu, &lambda, &stress);
  if (status) return status;
  double rounding = 1e-14 * (fabs(mu) + fabs(lambda));
  int stress_free = fabs(stress) <= rounding;
  if (stress_free && slope > -10 * rounding) { /* stable, or indifferent to volume */
    *volume_ratio = 1;
    return FLESH_OK;
  }

  /* From F = I a body in tension shrinks and one in compression swells until g changes sign; a body without stress that
   * is not stable swells. */
  const double step = 1.0442737824274138; /* 2^(1/16) */
  double sign = !stress_free && g > 0 ? 1 : -1;
  double s = 1, before = 1, g_before = 0;
  while (s > 1e-4 && s < 1e4) {
    double next = sign > 0 ? s / step : s * step, g_next, start = s, end = next;
    status = tension(material, next, &g_next, &slope);
    if (status == FLESH_UNDEFINED || status == FLESH_NONFINITE) break;
    if (status) return status;
    int found = sign * g_next < 0;
    if (!found && sign * g < sign * g_before && sign * g <= sign * g_next) {
      start = before;
      status = dips(material, sign, fmin(before, next), fmax(before, next), &end, &found);
      if (status) return status;
    }
    if (found) {
      double root;
      status = polish(material, fmin(start, end), fmax(start, end), &root);
      if (status == FLESH_OK) *volume_ratio = root * root * root;
      return status;
    }
    before = s, g_before = g;
    s = next, g = g_next;
  }
  return flesh_fail(FLESH_UNDEFINED,
                    "no uniform scale leaves this material stress-free: a free body has "
                    "no rest volume");
}
