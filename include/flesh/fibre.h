/* fibre.h: force-stretch curves of muscle fibres. Functions that return no status cannot fail. */
#ifndef FLESH_FIBRE_H
#define FLESH_FIBRE_H

#include "flesh/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Force-stretch curves of a fibre, ROW(NAME, text, passive stress over peak stress, exponent, limit, source): with l =
 * stretch/optimal_stretch the fibre's tension per area of the rest shape is
 *
 *   (activation peak_stress a(l) + p(l))/optimal_stretch,
 *
 * the active plus the passive part. The passive part is 0 for l <= 1, passive_stress (exp(passive_exponent (l-1)) - 1)
 * up to l = 1 + passive_limit, and linear beyond. Over the first third of 1/passive_exponent a cubic rises from 0 to
 * this curve, so that the tension has no kink.
 *
 *   BLEMKER  a = 1 - 4(1-l)^2 where |1-l| <= 0.4, and 0 where |1-l| >= 0.6; between them a cubic with
 *            the slopes of both, at most 0.012 above the parabola 9(0.6-|1-l|)^2 of the source, which
 *            has kinks there
 *   THELEN   a = exp(-(l-1)^2/0.45); below l = 0.4 the odd polynomial of degree 5 that continues it
 *            with two derivatives, so that a fibre of no length has a tension that is smooth in F */
#define FLESH_FIBRE_CURVE_LIST(ROW)                                                                             \
  ROW(BLEMKER, "blemker", 0.05, 6.6, 0.4, "Blemker, Pinsky & Delp 2005")                                        \
  ROW(THELEN, "thelen", 0.0067836549063042311, 8.3333333333333333, 0.6, "Thelen 2003")

typedef enum flesh_fibre_curve {
#define FLESH_FIBRE_ENUM(NAME, ...) FLESH_FIBRE_##NAME,
  FLESH_FIBRE_CURVE_LIST(FLESH_FIBRE_ENUM)
#undef FLESH_FIBRE_ENUM
  FLESH_FIBRE_CURVE_COUNT
} flesh_fibre_curve;

typedef struct flesh_fibre {
  flesh_fibre_curve curve;
  double peak_stress;      /* Pa, in the deformed shape, fully active at the optimal stretch; not negative */
  double optimal_stretch;  /* stretch at which the active tension is largest; positive */
  double passive_stress;   /* Pa, not negative; 0: no passive part */
  double passive_exponent; /* positive */
  double passive_limit;    /* l - 1 from which the passive part is linear; positive */
  /* Largest speed of shortening at full activation, in optimal lengths per second, 1/s; not negative. 0: the tension
   * does not depend on the speed. Otherwise the active tension is multiplied by g(v), where v is the rate of l over
   * this speed times 0.25 + 0.75 activation (Thelen 2003, from Hill 1938): g = (1 + v)/(1 - 4 v) in shortening, 0 for
   * v < -1, and (0.4 + 14 v)/(0.4 + 10 v), at most 1.4, in lengthening. */
  double max_shortening_velocity;
} flesh_fibre;

/* Returns "blemker" or "thelen"; NULL for anything else. */
FLESH_API const char *flesh_fibre_curve_name(flesh_fibre_curve curve);

/* Fills *fibre with the curve's own passive part at this peak stress, and an optimal stretch of 1. Errors:
 * FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_fibre_default(flesh_fibre_curve curve, double peak_stress, flesh_fibre *fibre);

/* Computes a fibre's tension at a given stretch, not negative, and zero speed, for an activation from 0 to 1. tension
 * [3] = {energy per volume of the rest shape, J/m^3, which is 0 at stretch 0; its first derivative with respect to
 * the stretch, which is the tension per area of the rest shape, Pa; its second derivative, Pa}. Errors:
 * FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_fibre_tension(const flesh_fibre *fibre, double activation, double stretch, double tension[3]);

#ifdef __cplusplus
}
#endif
#endif
