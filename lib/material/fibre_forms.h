/* fibre_forms.h: the energy W of a muscle fibre and its derivatives, for one fibre or several side by side (lanes.h).
 *
 * W is a function of the fibre's stretch L = |F a|, where a is its direction at rest, hence of the invariant
 * I = a.F^T F a (I_5 of Kim, de Goes & Iben 2019). With f = F a, T = W_L/L and D = (W_LL - T)/I,
 *
 *   dW/dF = T f a^T,     d2W/dF2 = (T 1 + D f f^T) (x) a a^T :
 *
 * its eigenvalues are W_LL for f a^T and, twice, T for n a^T with n orthogonal to f; the other six are 0. T and D are
 * finite and smooth at every F, also at f = 0, where both curves are a power series in I, or 0. */
#ifndef FLESH_MATERIAL_FIBRE_FORMS_H
#define FLESH_MATERIAL_FIBRE_FORMS_H

#include "flesh/material.h"
#include "material/fibre.h"
#include "math/error_function.h"
#include "math/logarithm.h"

/* One part of the energy over its stress: W, W_l, W_l/l, W_ll and (W_ll - W_l/l)/l^2. */
typedef struct flesh_fibre_part {
  flesh_real value, first, over, second, bend;
} flesh_fibre_part;

/* Curve of Blemker et al.: the middle parabola ends 0.4 from the peak, the support 0.6 from it. */
static inline void flesh_fibre_blemker(flesh_real l, flesh_fibre_part *p)
{
  static const double tail = 0.2, tail_energy = 0.2 * (0.44 / 3 - 0.08 / 4), half = 0.34;
  const flesh_real one = flesh_all(1), s = flesh_abs(l - 1), inverse = 1 / flesh_select(l > 0.3, l, one);
  flesh_real t = (0.6 - s) / tail;
  t = flesh_select(t > 0, t, flesh_all(0));
  const flesh_mask middle = s < 0.4, falls = l > 1;
  const flesh_real outer = tail * t * t * t * (0.44 / 3 - 0.02 * t);
  const flesh_real inner = tail_energy + (0.4 - s) - 4. / 3 * (0.064 - s * s * s);
  const flesh_real below = flesh_select(middle, inner, outer); /* the area from the nearer end of the support */
  const flesh_real slope = flesh_select(middle, 8 * s, t * (0.88 - 0.24 * t) / tail);
  p->value = flesh_select(falls, 2 * half - below, below);
  p->first = flesh_select(middle, 1 - 4 * s * s, t * t * (0.44 - 0.08 * t));
  p->second = flesh_select(falls, -slope, slope);
  p->over = p->first * inverse;
  p->bend = (p->second - p->over) * inverse * inverse;
}

/* Curve of Thelen. Below l = 0.4 it is the polynomial c_1 u + c_3 u^3 + c_5 u^5 of u = l/0.4 with the Gaussian's value
 * and first two derivatives at u = 1. */
static inline void flesh_fibre_thelen(flesh_real l, flesh_fibre_part *p)
{
  static const double width = 0.45, root = 0.67082039324993691, foot = 0.4;
  static const double c_1 = 0.44708231929663548, c_3 = -0.010484342496068504, c_5 = 0.012730987316654612;
  static const double area = 0.59449909464090165; /* root sqrt(pi)/2 */
  static const double offset = 0.56130658437452948; /* area erf(0.6/root), and the area under the polynomial */
  const flesh_mask below = l < foot;
  const flesh_real s = flesh_select(l < 10, l - 1, flesh_all(9)), x = s * (1 / root); /* beyond, it is 1e-78 */
  const flesh_real gauss = flesh_exp(-x * x), slope = -2 / width * s * gauss;
  const flesh_real inverse = 1 / flesh_select(below, flesh_all(foot), l);
  const flesh_real u = flesh_select(below, l * (1 / foot), flesh_all(1)), uu = u * u;
  p->value = flesh_select(below, foot * uu * (c_1 / 2 + uu * (c_3 / 4 + uu * (c_5 / 6))), offset + area * flesh_erf(x));
  p->first = flesh_select(below, u * (c_1 + uu * (c_3 + uu * c_5)), gauss);
  p->over = flesh_select(below, (c_1 + uu * (c_3 + uu * c_5)) / foot, gauss * inverse);
  p->second = flesh_select(below, (c_1 + uu * (3 * c_3 + uu * (5 * c_5))) / foot, slope);
  p->bend = flesh_select(below, (2 * c_3 + uu * (4 * c_5)) / (foot * foot * foot),
                         (slope - gauss * inverse) * inverse * inverse);
}

static inline void flesh_fibre_active(flesh_fibre_curve curve, flesh_real l, flesh_fibre_part *p)
{
  if (curve == FLESH_FIBRE_THELEN) flesh_fibre_thelen(l, p);
  else flesh_fibre_blemker(l, p);
}

static inline void flesh_fibre_passive(const flesh_fibre_constants *c, flesh_real l, flesh_fibre_part *p)
{
  const flesh_real z = flesh_select(l > 1, l - 1, flesh_all(0)), inverse = 1 / flesh_select(l > 1, l, flesh_all(1));
  const flesh_mask at_toe = z < c->toe, straight = z > c->limit;
  const flesh_real t = z * (1 / c->toe), past = z - c->limit;
  const double rise = c->toe * c->toe_slope, value = c->toe_value;
  const flesh_real power = flesh_exp(c->exponent * flesh_select(straight, flesh_all(c->limit), z));
  const flesh_real curved = c->toe_energy + (power - 1 - c->toe_value) / c->exponent - (z - c->toe);
  p->value = flesh_select(straight, c->limit_energy + past * (c->limit_value + 0.5 * c->limit_slope * past), curved);
  p->first = flesh_select(straight, c->limit_value + c->limit_slope * past, power - 1);
  p->second = flesh_select(straight, flesh_all(c->limit_slope), c->exponent * power);
  p->value = flesh_select(at_toe, c->toe * t * t * t * (value - rise / 3 + t * (0.25 * rise - 0.5 * value)), p->value);
  p->first = flesh_select(at_toe, t * t * (3 * value - rise + t * (rise - 2 * value)), p->first);
  p->second = flesh_select(at_toe, t * (6 * value - 2 * rise + t * (3 * rise - 6 * value)) / c->toe, p->second);
  p->over = p->first * inverse;
  p->bend = (p->second - p->over) * inverse * inverse;
  p->bend = flesh_select(l > 1, p->bend, flesh_all(0));
}

/* W, T, D and W_LL. */
typedef struct flesh_fibre_real {
  flesh_real value, T, D, stiffness;
} flesh_fibre_real;

/* Computes the energy and its derivatives at I = L^2 for `activation` from 0 to 1. */
static inline void flesh_fibre_form(const flesh_fibre_constants *c, double activation, flesh_real I,
                                    flesh_fibre_real *fibre)
{
  const flesh_real l = flesh_sqrt(I) * c->inverse_optimal;
  const double square = c->inverse_optimal * c->inverse_optimal;
  const double stress[2] = {activation * c->peak_stress, c->passive_stress};
  *fibre = (flesh_fibre_real){0};
  for (int k = 0; k < 2; k++) {
    flesh_fibre_part part;
    if (stress[k] == 0 || (k == 1 && !flesh_any(l > 1))) continue; /* slack fibres add 0 */
    if (k == 0) flesh_fibre_active(c->curve, l, &part);
    else flesh_fibre_passive(c, l, &part);
    fibre->value += stress[k] * part.value;
    fibre->T += stress[k] * square * part.over;
    fibre->D += stress[k] * square * square * part.bend;
    fibre->stiffness += stress[k] * square * part.second;
  }
}

/* Adds the effect of speed to `fibre`, which has the rest: the active tension a(l) becomes a(l) g(v), with g of
 * flesh_fibre.max_shortening_velocity. With l_0 of the frozen state, the rate e of I/2, and the rate of l taken as
 * e/l_0 times the square of inverse_optimal, this is done by a brake (1 - g) a(l_0) l/l_0. Its potential is a(l_0)
 * times the integral of g - 1 over that rate; it is convex and not negative, and there is no force where nothing moves.
 * The error is of the order of the step, because a(l_0) is used for a(l). `ratio` is the change of e when I/2 changes
 * by 1 in a step, 1/s; 0: energy and D stay unchanged. */
static inline void flesh_fibre_add_speed(const flesh_fibre_constants *c, double activation, flesh_real I, flesh_real I_0,
                                         flesh_real e, double ratio, flesh_fibre_real *fibre)
{
  static const double hill = 0.25, stretched = 0.04, most = 1.4, least_length = 0.1;
  const double stress = activation * c->peak_stress, square = c->inverse_optimal * c->inverse_optimal,
               fastest = c->max_shortening_velocity * (0.25 + 0.75 * activation);
  const flesh_real zero = flesh_all(0), one = flesh_all(1), l = flesh_sqrt(I_0) * c->inverse_optimal;
  flesh_fibre_part part;
  if (stress == 0 || fastest == 0) return;
  flesh_fibre_active(c->curve, l, &part);
  const flesh_real turn = square / flesh_select(l > least_length, l, flesh_all(least_length)); /* rate of l over e */
  const flesh_real v = e * turn * (1 / fastest), s = flesh_abs(v), active = stress * part.first;
  const flesh_mask shortens = v < 0, slack = v < -1;
  const flesh_real shape = flesh_select(shortens, flesh_all(hill), flesh_all(stretched)),
                   size = flesh_select(shortens, flesh_all(1 + hill), flesh_all(most - 1)),
                   u = flesh_select(slack, one, s), below = 1 / (shape + u);
  const flesh_real change = size * u * below, beyond = flesh_select(slack, s - 1, zero);
  const flesh_real slope = flesh_select(slack, zero, size * shape * below * below);
  const flesh_real area = size * (u - shape * flesh_log1p(u / shape)) + beyond;
  const flesh_real T = active * turn * flesh_select(shortens, -change, change);
  const flesh_real D = ratio * active * slope * turn * turn * (1 / fastest);
  fibre->T += T;
  fibre->D += D;
  fibre->stiffness += T + D * I;
  if (ratio > 0) fibre->value += active * area * (fastest / ratio);
}

/* Filters the two eigenvalues of `fibre`, T and its stiffness, so that neither is negative; `filter` is not
 * FLESH_FILTER_NONE. If neither was negative, D is unchanged, so that I = 0 is not divided by. */
static inline void flesh_fibre_filter(flesh_eigenvalue_filter filter, flesh_real I, flesh_fibre_real *fibre)
{
  const int absolute = filter == FLESH_FILTER_ABSOLUTE;
  const flesh_mask negative = (fibre->T < 0) | (fibre->stiffness < 0);
  const flesh_real zero = flesh_all(0);
  const flesh_real T = flesh_select(fibre->T < 0, absolute ? -fibre->T : zero, fibre->T);
  const flesh_real stiffness = flesh_select(fibre->stiffness < 0, absolute ? -fibre->stiffness : zero, fibre->stiffness);
  fibre->D = flesh_select(negative, (stiffness - T) / flesh_select(negative, I, flesh_all(1)), fibre->D);
  fibre->T = T;
  fibre->stiffness = stiffness;
}

#endif
