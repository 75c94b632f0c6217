/* wide.h: integers of 1536 bits and geometry with them, as an independent, slow check of predicates.
 *
 * Coordinates are multiples of 2^-320 and less than 2^126, so that products of three differences fit. */
#ifndef FLESH_TEST_WIDE_H
#define FLESH_TEST_WIDE_H

#include <math.h>
#include <stdint.h>
#include <string.h>

enum { WIDE_LIMBS = 48, WIDE_POINT = 320 };

typedef struct wide {
  uint32_t limb[WIDE_LIMBS]; /* two's complement, the lowest word first */
} wide;

static inline wide wide_negative(wide a)
{
  uint64_t carry = 1;
  for (int k = 0; k < WIDE_LIMBS; k++) {
    carry += (uint32_t)~a.limb[k];
    a.limb[k] = (uint32_t)carry;
    carry >>= 32;
  }
  return a;
}

static inline wide wide_plus(wide a, wide b)
{
  uint64_t carry = 0;
  for (int k = 0; k < WIDE_LIMBS; k++) {
    carry += (uint64_t)a.limb[k] + b.limb[k];
    a.limb[k] = (uint32_t)carry;
    carry >>= 32;
  }
  return a;
}

static inline wide wide_minus(wide a, wide b) { return wide_plus(a, wide_negative(b)); }

static inline wide wide_times(wide a, wide b)
{
  wide product = {{0}};
  for (int i = 0; i < WIDE_LIMBS; i++) {
    uint64_t carry = 0;
    for (int j = 0; i + j < WIDE_LIMBS && a.limb[i]; j++) {
      carry += (uint64_t)a.limb[i] * b.limb[j] + product.limb[i + j];
      product.limb[i + j] = (uint32_t)carry;
      carry >>= 32;
    }
  }
  return product;
}

static inline int wide_sign(wide a)
{
  if (a.limb[WIDE_LIMBS - 1] >> 31) return -1;
  for (int k = 0; k < WIDE_LIMBS; k++)
    if (a.limb[k]) return 1;
  return 0;
}

static inline wide wide_of(double value)
{
  wide a = {{0}};
  int exponent;
  const uint64_t digits = (uint64_t)ldexp(fabs(frexp(value, &exponent)), 53);
  const int shift = exponent - 53 + WIDE_POINT;
  if (digits == 0) return a;
  for (int bit = 0; bit < 53; bit++)
    if (digits >> bit & 1) a.limb[(shift + bit) / 32] |= (uint32_t)1 << (shift + bit) % 32;
  return value < 0 ? wide_negative(a) : a;
}

typedef struct wide_vector {
  wide c[3];
} wide_vector;

static inline wide_vector wide_between(const double a[3], const double b[3])
{
  wide_vector d;
  for (int c = 0; c < 3; c++) d.c[c] = wide_minus(wide_of(b[c]), wide_of(a[c]));
  return d;
}

static inline wide wide_determinant(const wide_vector *a, const wide_vector *b, const wide_vector *c)
{
  wide sum = {{0}};
  for (int k = 0; k < 3; k++) {
    const int u = (k + 1) % 3, v = (k + 2) % 3;
    const wide minor = wide_minus(wide_times(b->c[u], c->c[v]), wide_times(b->c[v], c->c[u]));
    sum = wide_plus(sum, wide_times(a->c[k], minor));
  }
  return sum;
}

static inline int wide_orient3d(const double a[3], const double b[3], const double c[3], const double d[3])
{
  const wide_vector u = wide_between(a, b), v = wide_between(a, c), w = wide_between(a, d);
  return wide_sign(wide_determinant(&u, &v, &w));
}

/* Whether the projections along an axis of the segment x[0] x[1] and the triangle x[2] x[3] x[4] are separated by the
 * side from i to j. */
static inline int wide_side_separates(int axis, const double *const x[5], int i, int j)
{
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const wide_vector e = wide_between(x[i], x[j]);
  wide h[5];
  for (int k = 0; k < 5; k++) {
    const wide_vector d = wide_between(x[i], x[k]);
    h[k] = wide_minus(wide_times(e.c[u], d.c[v]), wide_times(e.c[v], d.c[u]));
  }
  int below = 1, above = 1;
  for (int s = 0; s < 2; s++)
    for (int t = 2; t < 5; t++) {
      const int sign = wide_sign(wide_minus(h[s], h[t]));
      below &= sign < 0;
      above &= sign > 0;
    }
  return below || above;
}

/* Whether the closed segment pq meets the closed triangle abc, which has an area: by Cramer's rule for the intersection
 * of pq with the plane of abc, or by separating lines if they are coplanar. */
static inline int wide_segment_meets_triangle(const double p[3], const double q[3], const double a[3], const double b[3],
                                              const double c[3])
{
  /* solve a + s (b-a) + t (c-a) = p + r (q-p) */
  const wide_vector e = wide_between(a, b), f = wide_between(a, c), g = wide_between(q, p), d = wide_between(a, p);
  const wide zero = {{0}};
  wide whole = wide_determinant(&e, &f, &g), s = wide_determinant(&d, &f, &g), t = wide_determinant(&e, &d, &g),
       r = wide_determinant(&e, &f, &d);
  if (wide_sign(whole) != 0) {
    if (wide_sign(whole) < 0) {
      whole = wide_minus(zero, whole), s = wide_minus(zero, s), t = wide_minus(zero, t), r = wide_minus(zero, r);
    }
    return wide_sign(s) >= 0 && wide_sign(t) >= 0 && wide_sign(wide_minus(whole, wide_plus(s, t))) >= 0 &&
           wide_sign(r) >= 0 && wide_sign(wide_minus(whole, r)) >= 0;
  }
  if (wide_sign(r) != 0) return 0; /* parallel to the plane */
  const double *const x[5] = {p, q, a, b, c};
  for (int axis = 0; axis < 3; axis++) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (wide_sign(wide_minus(wide_times(e.c[u], f.c[v]), wide_times(e.c[v], f.c[u]))) == 0) continue;
    return !wide_side_separates(axis, x, 0, 1) && !wide_side_separates(axis, x, 2, 3) &&
           !wide_side_separates(axis, x, 3, 4) && !wide_side_separates(axis, x, 4, 2);
  }
  return -1; /* no area */
}

#endif
