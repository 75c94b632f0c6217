/* orient.h: on which side a point lies, and whether a segment meets a triangle, without rounding.
 *
 * Signs are those of the exact determinants of the coordinates as they are stored: a sum in double precision where an
 * error bound settles the sign, else sums and products without rounding (Shewchuk 1997, "Adaptive Precision
 * Floating-Point Arithmetic and Fast Robust Geometric Predicates"). Exact where the coordinates that are not 0 lie
 * within a factor of 1e80 of the largest; with one that is not finite no sign is known, and 0 is returned. */
#ifndef FLESH_GEOMETRY_ORIENT_H
#define FLESH_GEOMETRY_ORIENT_H

/* The sign of (b-a) x (c-a) . (d-a): 1 where d is on the side to which the triangle abc shows anticlockwise, -1 on the
 * other, 0 in its plane or where abc has no area. */
int flesh_orient3d(const double a[3], const double b[3], const double c[3], const double d[3]);

/* The sign of twice the area of abc, seen along the given axis (0 to 2): 1 anticlockwise. */
int flesh_orient2d(int axis, const double a[3], const double b[3], const double c[3]);

/* Whether two closed segments have a point in common; either may be a point. */
int flesh_segment_meets_segment(const double p[3], const double q[3], const double a[3], const double b[3]);

/* Whether the closed segment pq and the closed triangle abc have a point in common, also where they lie in one plane and
 * where one of them is shrunk to a segment or a point. */
int flesh_segment_meets_triangle(const double p[3], const double q[3], const double a[3], const double b[3],
                                 const double c[3]);

#endif
