/* area.h: area vectors of triangles: normal to the triangle, outwards by its winding, with twice its area as length. */
#ifndef FLESH_MATH_AREA_H
#define FLESH_MATH_AREA_H

#include <stddef.h>

#include "math/mat3.h"

static inline void flesh_area_vector(const double a[3], const double b[3], const double c[3], double n[3])
{
  double e[3], f[3];
  for (int i = 0; i < 3; i++) e[i] = b[i] - a[i], f[i] = c[i] - a[i];
  flesh_vec3_cross(e, f, n);
}

/* Computes the area vector of the triangle whose corners are these nodes of x. */
static inline void flesh_area_vector_at(const double *x, const int corners[3], double n[3])
{
  flesh_area_vector(x + 3 * (size_t)corners[0], x + 3 * (size_t)corners[1], x + 3 * (size_t)corners[2], n);
}

#endif
