/* error_function.h: erf for flesh_real (lanes.h): the C library's for a double; for lanes an own one, within 1e-15 of
 * it.
 *
 * 1 - erf(x) = exp(-x^2) g(t)/(1 + 2x) for x >= 0, with t = (x - k)/(x + k) in [-1, 1] and a smooth g, which is a sum
 * of Chebyshev polynomials of t (the mapping: Shepherd & Laframboise 1981). The coefficients are from a discrete cosine
 * transform at 200 points in quadruple precision; omitted ones are below 2e-17. */
#ifndef FLESH_MATH_ERROR_FUNCTION_H
#define FLESH_MATH_ERROR_FUNCTION_H

#include "math/exponential.h"

#if FLESH_LANES == 1

static inline double flesh_erf(double x) { return erf(x); }

#else

static inline flesh_real flesh_erf(flesh_real x)
{
  static const double k = 3.75, largest = 6; /* beyond `largest`, erf is 1 to the last bit */
  enum { TERMS = 25 };
  static const double c[TERMS] = {
      1.177578934567401705,    -4.59005458064647761e-03, -8.42491333665179171e-02, 5.92099399981918934e-02,
      -2.66586684353057532e-02, 9.07499767070526521e-03, -2.41316354041760809e-03, 4.90775836525808628e-04,
      -6.91697330250120966e-05, 4.13902798607298054e-06, 7.74038306619828281e-07,  -2.18864010492352648e-07,
      1.07649994656756233e-08,  4.52195981123554908e-09, -7.75440020856205500e-10, -6.31808833766976061e-11,
      2.86879501414704924e-11,  1.94558712413298981e-13, -9.65469657410230597e-13, 3.25254866621253772e-14,
      3.34781116965864810e-14,  -1.86458223353101597e-15, -1.25082270581244468e-15, 7.41509839701153306e-17,
      5.06515440181632070e-17};
  flesh_real a = flesh_abs(x), last = flesh_all(0), before = flesh_all(0);
  a = flesh_select(a < largest, a, flesh_all(largest));
  const flesh_real t = (a - k) / (a + k);
  for (int n = TERMS - 1; n > 0; n--) { /* Clenshaw's recurrence */
    const flesh_real next = 2 * t * last - before + c[n];
    before = last;
    last = next;
  }
  const flesh_real erf = 1 - flesh_exp(-a * a) * (t * last - before + c[0]) / (1 + 2 * a);
  return flesh_select(x < 0, -erf, erf);
}

#endif
#endif
