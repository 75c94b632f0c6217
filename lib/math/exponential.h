/* exponential.h: exp for flesh_real (lanes.h): the C library's for a double; for lanes an own one, accurate to about 2
 * units in the last place within +-FLESH_EXPONENTIAL_LARGEST and arbitrary for other arguments. */
#ifndef FLESH_MATH_EXPONENTIAL_H
#define FLESH_MATH_EXPONENTIAL_H

#include "math/lanes.h"

#define FLESH_EXPONENTIAL_LARGEST 700

#if FLESH_LANES == 1

static inline double flesh_exp(double x) { return exp(x); }

#else

/* Splits x = k log 2 + r, |r| <= log(2)/2, and computes exp r by its series, whose next term is below 2^-57 there. */
static inline flesh_real flesh_exp(flesh_real x)
{
  typedef uint64_t integers __attribute__((vector_size(8 * FLESH_LANES)));
  /* Adding it rounds a number to an integer, which is then in the last bits. */
  const double shift = 0x1.8p52;
  flesh_real shifted = x * 0x1.71547652b82fep0 + shift, k = shifted - shift;
  /* log 2 in two parts, the first short enough for exact products with k */
  flesh_real r = (x - k * 0x1.62e42feep-1) - k * 0x1.a39ef35793c76p-33, sum = flesh_all(0);
  static const double inverse[14] = {1,           1,          1. / 2,      1. / 6,        1. / 24,
                                     1. / 120,    1. / 720,   1. / 5040,   1. / 40320,    1. / 362880,
                                     1. / 3628800, 1. / 39916800, 1. / 479001600, 1. / 6227020800};
  for (int n = 13; n >= 2; n--) sum = sum * r + inverse[n];
  sum = 1 + (r + r * r * sum);
  return sum * (flesh_real)(((integers)shifted + 1023) << 52);
}

#endif
#endif
