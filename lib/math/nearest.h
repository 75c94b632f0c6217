/* nearest.h: distances, and nearest points on segments and triangles. */
#ifndef FLESH_MATH_NEAREST_H
#define FLESH_MATH_NEAREST_H

#include <math.h>

static inline double flesh_distance(const double a[3], const double b[3])
{
  const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

/* Computes the weights of the point nearest to p on the segment from A to B, exactly 0 or 1 at its ends; returns the
 * squared distance. */
double flesh_nearest_on_segment(const double A[3], const double B[3], const double p[3],
                                double weights[2]);

/* Computes the weights of the point nearest to p on the triangle with the corners X: the foot of the perpendicular, or
 * a point on the edges, where at least one weight is exactly 0. Returns the squared distance. */
double flesh_nearest_on_triangle(const double *const X[3], const double p[3], double weights[3]);

#endif
