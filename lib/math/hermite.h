/* hermite.h: Hermite interpolation of a motion. */
#ifndef FLESH_MATH_HERMITE_H
#define FLESH_MATH_HERMITE_H

enum { FLESH_HERMITE_TIMES = 4 };

/* Computes the weights at t of the position and velocity known at time j of times [count], s, count <=
 * FLESH_HERMITE_TIMES: in the interpolated position w[0] and w[1], in its velocity w[2] and w[3]. Velocities are known
 * at all times except, with `half`, the first: the polynomial has degree 2 count - 1, or one less. Cannot fail. */
void flesh_hermite_weights(int count, const double *times, int half, int j, double t, double w[4]);

#endif
