/* logarithm.h: log and the inverse cube root for flesh_real (lanes.h): the C library's for a double; for lanes own
 * ones, accurate to about 2 units in the last place for positive, finite and normal arguments (1e-290 to 1e290) and
 * arbitrary for others. */
#ifndef FLESH_MATH_LOGARITHM_H
#define FLESH_MATH_LOGARITHM_H

#include "math/lanes.h"

#if FLESH_LANES == 1

static inline double flesh_log(double x) { return log(x); }
static inline double flesh_log1p(double x) { return log1p(x); }
static inline double flesh_inverse_cbrt(double x) { return 1 / cbrt(x); }

#else

typedef uint64_t flesh_unsigned __attribute__((vector_size(8 * FLESH_LANES)));

/* Splits x = 2^e m with m between sqrt(1/2) and sqrt(2); log m = 2 artanh s, s = (m-1)/(m+1), by its series, whose next
 * term is below 2^-55 there. */
static inline flesh_real flesh_log(flesh_real x)
{
  /* The number added to the bits of x carries into the exponent if the mantissa is that of a number above sqrt(1/2). */
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

/* Computes y = x^(-1/3): dividing the exponent by three gives it to 3 %; two steps multiply by the series of
 * (1-r)^(-1/3), r = 1 - x y^3. */
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
