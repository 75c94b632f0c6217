/* hermite.h: Hermite interpolation of a motion. */
#ifndef FLESH_MATH_HERMITE_H
#define FLESH_MATH_HERMITE_H

enum { FLESH_HERMITE_TIMES = 4 };

/* The weights at t of what is known at time j of times [count], s, count <= FLESH_HERMITE_TIMES: of the position and the
 * velocity there, in the interpolated position (w[0], w[1]) and in its velocity (w[2], w[3]). Velocities are known at all
 * times but, with `half`, the first: the polynomial has degree 2 count - 1, or less by one. Cannot fail. */
void flesh_hermite_weights(int count, const double *times, int half, int j, double t, double w[4]);

#endif
