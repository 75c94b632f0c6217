/* continuous_collision.h: how far points, edges and triangles can move along straight lines before they touch.
 *
 * Additive advancement (Li et al. 2021, "Codimensional Incremental Potential Contact", section 5) with steps as long as
 * a separating plane allows. A plane normal to the shortest connection of the two hulls moves with them. Until a corner
 * on one side comes nearer, across the plane, than the distance to keep to a corner on the other side, the hulls are at
 * least that distance apart. Corners move linearly, so each step takes one division; sliding along a plane takes one
 * step. */
#ifndef FLESH_GEOMETRY_CONTINUOUS_COLLISION_H
#define FLESH_GEOMETRY_CONTINUOUS_COLLISION_H

/* Largest number of steps of an advancement; a motion beyond the last step is rejected. (None of the 160 000 hard
 * trajectories of test_continuous_collision.c needs as many.) */
enum { FLESH_ADVANCE_STEPS = 256 };

/* Returns the largest fraction 0 <= t <= 1, up to the tolerance below, of the path from x0 to x1 along which the convex
 * hulls of the first `first` points and of the `second` points after them stay at least `keep` (0 < keep < 1) times
 * their distance at x0 apart: point and triangle (1, 3), two edges (2, 2), point and edge (1, 2), two points (1, 1).
 *
 * Never too large: rounding is accounted for, including that of the coordinates at t, so at every computed position x0
 * + s (x1 - x0), s <= t, the hulls are apart if they are at x0. If t < 1, either the distance at t is at most keep +
 * 0.02 times that at x0, or FLESH_ADVANCE_STEPS steps were made. Returns 0 if the hulls touch at x0, up to rounding,
 * and approach, and if a position is not finite. Never NaN. */
double flesh_feasible_fraction(int first, int second, const double *const x0[4], const double *const x1[4],
                               double keep);

/* A fast sufficient test for a fraction of 1: a plane with a fixed direction separates the hulls by enough at x0 and at
 * x1, and therefore in between. Returns 0 if that requires an advancement. `place` bounds the magnitude of all
 * coordinates; it is NaN if one is not finite. */
int flesh_hulls_move_little(int first, int second, const double *const x0[4], const double *const x1[4], double keep,
                            double place);

/* Whether one plane keeps the hulls of the nodes more than `distance` apart on the straight paths from x0 to x1
 * [3*...], or at x0 if x1 is NULL. Returns 0 if they come nearer, if one plane cannot tell, and if a position is not
 * finite. */
int flesh_hulls_stay_apart(int first, int second, const int nodes[4], const double *x0, const double *x1,
                           double distance);

/* Returns the distance of the two hulls, up to rounding of the differences of their points. `unit` [3] is the direction
 * of the shortest connection from the second to the first, 0 if they touch. */
double flesh_hull_distance(int first, int second, const double *const x[4], double unit[3]);

#endif
