/* differences.h: numerical derivatives by differences of fourth order. */
#ifndef FLESH_MATH_DIFFERENCES_H
#define FLESH_MATH_DIFFERENCES_H

enum { FLESH_DIFFERENCES = 4 };
/* Points at which a function is evaluated, in steps from the middle, and the weights of its values, times the step. */
static const double flesh_difference_at[FLESH_DIFFERENCES] = {-2, -1, 1, 2};
static const double flesh_difference_weight[FLESH_DIFFERENCES] = {1. / 12, -2. / 3, 2. / 3, -1. / 12};

/* Returns the derivative; equal values give exactly 0. */
static inline double flesh_difference_of(double v0, double v1, double v2, double v3, double step)
{
  return (v0 - v3 + 8 * (v2 - v1)) / (12 * step);
}

#endif
