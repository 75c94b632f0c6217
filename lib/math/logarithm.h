/* logarithm.h: log and the cube root for flesh_real (lanes.h): the C library's for a double; for
 * lanes our own, accurate to some 2 units in the last place for arguments that are positive,
 * finite and normal (1e-290 to 1e290); anything for others. */
#ifndef FLESH_MATH_LOGARITHM_H
#define FLESH_MATH_LOGARITHM_H

#include "math/lanes.h"

#if FLESH_LANES == 1

static inline double flesh_log(double x) { return log(x); }
static inline double flesh_log1p(double x) { return log1p(x); }
static inline double flesh_inverse_cbrt(double x) { return 1 / cbrt(x); }

#else

typedef uint64_t flesh_unsigned __attribute__((vector_size(8 * FLESH_LANES)));

/* x = 2^e m with m within sqrt(1/2) and sqrt(2); log m = 2 artanh s, s = (m-1)/(m+1), by its
 * series, whose next term is below 2^-55 there. */
static inline flesh_real flesh_log(flesh_real x)
{
  /* Added to the bits of x, what lies between sqrt(1/2) and 1 carries into the exponent. */
  flesh_unsigned bits = (flesh_unsigned)x;
  flesh_unsigned exponent = (bits + (0x3ff0000000000000 - 0x3fe6a09e667f3bcc)) >> 52; /* e + 1023 */
  flesh_real m = (flesh_real)(bits - ((exponent - 1023) << 52));
  flesh_real e = (flesh_real)(exponent | 0x4330000000000000) - (0x1p52 + 1023);
  flesh_real s = (m - 1) / (m + 1), z = s * s, sum = flesh_all(2.0 / 19);
  for (int k = 17; k >= 3; k -= 2) sum = sum * z + 2.0 / k;
  /* log 2 in two parts, the first short enough for exact products with e */
  return e * 0x1.62e42feep-1 + (2 * s + (s * z * sum + e * 0x1.a39ef35793c76p-33));
}

static inline flesh_real flesh_log1p(flesh_real x) { return flesh_log(1 + x); }

/* y = x^(-1/3): a third of the exponent, some 3 % off, then twice (1-r)^(-1/3), r = 1 - x y^3, by
 * its series. */
static inline flesh_real flesh_inverse_cbrt(flesh_real x)
{
  flesh_unsigned third = ((flesh_unsigned)x >> 32) * 0x55555556 >> 32;
  flesh_real y = (flesh_real)((0x553ee800 - third) << 32);
  for (int k = 0; k < 2; k++) {
    flesh_real r = 1 - x * y * y * y;
    y += y * r * (1.0 / 3 + r * (2.0 / 9 + r * (14.0 / 81)));
  }
  return y;
}

#endif
#endif
