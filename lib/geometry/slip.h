/* slip.h: the law of friction as a function of the slip's speed y, as a fraction of the largest friction: f(y) = 2 y/e
 * - (y/e)^2 below the slip speed e, 1 above.
 *
 * Its stiffness is f/y across the slip and f' along it, which is 0 above e. If a point slips in the iterate but sticks
 * in the solution, Newton's iteration therefore moves it to where it slips backwards, as fast as all other forces push
 * it, and a line search cuts the step of the whole body because of this one point. The secant to rest, f/y also along
 * the slip, is never less than the stiffness on the way to rest, and a step with it never overshoots (half-quadratic
 * minimisation: Geman & Reynolds 1992). It converges more slowly if points do slip. */
#ifndef FLESH_GEOMETRY_SLIP_H
#define FLESH_GEOMETRY_SLIP_H

/* Returns the integral of f from rest. */
static inline double flesh_slip_potential(double y, double e)
{
  return y < e ? y * y / e * (1 - y / (3 * e)) : y - e / 3;
}

/* Returns f/y. */
static inline double flesh_slip_ratio(double y, double e) { return y < e ? (2 - y / e) / e : 1 / y; }

/* Returns f' - f/y <= 0: the stiffness along the slip minus its secant to rest. */
static inline double flesh_slip_fall(double y, double e) { return y < e ? -y / (e * e) : -1 / y; }

#endif
