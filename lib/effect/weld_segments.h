/* weld_segments.h: where two surfaces lie on each other: the common parts of their triangles. */
#ifndef FLESH_EFFECT_WELD_SEGMENTS_H
#define FLESH_EFFECT_WELD_SEGMENTS_H

/* Largest number of corners of the common part of two triangles. */
enum { FLESH_SEGMENT_CORNERS = 9 };

/* Computes the part of triangle A (corners A[3]) that triangle B covers, seen along A's normal: a convex polygon, in
 * A's barycentric coordinates L. Returns the number of its corners; 0 if B does not face A (their normals are less than
 * 120 degrees apart), or if the polygon is smaller than rounding. *gap: distance of the planes at the polygon's middle,
 * along A's normal, m; > 0 if apart, < 0 if the bodies overlap. */
int flesh_weld_segment(const double *const A[3], const double *const B[3], double L[FLESH_SEGMENT_CORNERS][3],
                       double *gap);

/* Calls visit for the pairs (a, b) of overlapping boxes, boxes[k] = {low, high}; the first count_a boxes belong to one
 * surface, the others to another, and b is numbered from 0. The order depends only on the boxes. Returns
 * FLESH_ERR_MEMORY, or the first result of `visit` other than 0, at which it stops. */
int flesh_weld_pairs(int count_a, int count_b, const double (*boxes)[6], int (*visit)(void *data, int a, int b),
                     void *data);

#endif
