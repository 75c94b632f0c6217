/* weld_segments.h: where two surfaces lie on each other: the common parts of their triangles. */
#ifndef FLESH_EFFECT_WELD_SEGMENTS_H
#define FLESH_EFFECT_WELD_SEGMENTS_H

/* Common parts of two triangles have at most this many corners. */
enum { FLESH_SEGMENT_CORNERS = 9 };

/* The part of triangle A (corners A[3]) that triangle B covers, seen along A's normal: a convex polygon in A's
 * barycentric coordinates, into L. Returns the number of its corners; 0 where B does not face A (their normals are
 * less than 120 degrees apart), or the polygon is smaller than rounding. *gap: the distance of the planes at the
 * polygon's middle, along A's normal, > 0 apart and < 0 where the bodies overlap, m. */
int flesh_weld_segment(const double *const A[3], const double *const B[3], double L[FLESH_SEGMENT_CORNERS][3],
                       double *gap);

/* Pairs (a, b) of boxes that overlap, boxes[k] = {low, high}, of which the first count_a are of one surface and the
 * others of another; called in an order that depends on the boxes alone. Returns FLESH_ERR_MEMORY or what `visit`
 * returns other than 0, at which it stops. */
int flesh_weld_pairs(int count_a, int count_b, const double (*boxes)[6], int (*visit)(void *data, int a, int b),
                     void *data);

#endif
