/* orient.h: on which side of a plane or line a point lies, and whether a segment meets a triangle, without rounding
 * errors.
 *
 * Signs are those of the exact determinants of the stored coordinates: computed in double precision if an error bound
 * settles the sign, else by exact sums and products (Shewchuk 1997, "Adaptive Precision Floating-Point Arithmetic and
 * Fast Robust Geometric Predicates"). Exact if the non-zero coordinates lie within a factor of 1e80 of the largest; if
 * one is not finite the sign is unknown and 0 is returned. */
#ifndef FLESH_GEOMETRY_ORIENT_H
#define FLESH_GEOMETRY_ORIENT_H

/* Returns the sign of (b-a) x (c-a) . (d-a): 1 if d is on the side from which the triangle abc appears anticlockwise,
 * -1 on the other, 0 in its plane or if abc has no area. */
int flesh_orient3d(const double a[3], const double b[3], const double c[3], const double d[3]);

/* Returns the sign of twice the area of abc, seen along the given axis (0 to 2): 1 anticlockwise. */
int flesh_orient2d(int axis, const double a[3], const double b[3], const double c[3]);

/* Whether two closed segments have a point in common; either may be a point. */
int flesh_segment_meets_segment(const double p[3], const double q[3], const double a[3], const double b[3]);

/* Whether the closed segment pq and the closed triangle abc have a point in common, including coplanar and degenerate
 * ones. */
int flesh_segment_meets_triangle(const double p[3], const double q[3], const double a[3], const double b[3],
                                 const double c[3]);

#endif
