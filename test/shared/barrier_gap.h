/* barrier_gap.h: the gap that remains between flat faces pressed together. */
#ifndef FLESH_TEST_BARRIER_GAP_H
#define FLESH_TEST_BARRIER_GAP_H

#include "geometry/barrier.h"

/* Returns the gap, m, at which the stiffness times |B'(gap/thickness)| equals the pressure, by bisection. */
static inline double barrier_gap(double pressure, double stiffness, double thickness)
{
  double low = 0, high = 1;
  for (int k = 0; k < 60; k++) {
    const double s = (low + high) / 2;
    double value, first, second;
    flesh_barrier_law(s, &value, &first, &second);
    *(-stiffness * first > pressure ? &low : &high) = s;
  }
  return thickness * low;
}

#endif
