/* slip.h: the law of friction over the speed y of a slip: f(y) = 2 y/e - (y/e)^2 below the slip speed e, 1 above, of the
 * largest friction there is.
 *
 * Its stiffness is f/y across the slip and f' along it, which is 0 above e. From a place that slips though it comes to
 * rest, Newton's iteration therefore leads to where it slips back, as fast as everything else pushes it, and a line search
 * cuts the step of the whole body for the sake of this one place. The secant to rest, f/y along the slip, too, is never
 * less than the stiffness on the way to rest, and a step by it never leads beyond (half-quadratic minimisation: Geman &
 * Reynolds 1992). It converges more slowly where places do slip. */
#ifndef FLESH_GEOMETRY_SLIP_H
#define FLESH_GEOMETRY_SLIP_H

/* The integral of f from rest. */
static inline double flesh_slip_potential(double y, double e)
{
  return y < e ? y * y / e * (1 - y / (3 * e)) : y - e / 3;
}

/* f/y. */
static inline double flesh_slip_ratio(double y, double e) { return y < e ? (2 - y / e) / e : 1 / y; }

/* f' - f/y <= 0: how much less stiff the law is along the slip than its secant to rest. */
static inline double flesh_slip_fall(double y, double e) { return y < e ? -y / (e * e) : -1 / y; }

#endif
