/* continuous_collision.h: how far points, edges and triangles can move along straight lines before they touch.
 *
 * Additive advancement (Li et al. 2021, "Codimensional Incremental Potential Contact", section 5) with steps as long as
 * a separating plane allows: from where the two are, a plane across their shortest connection moves with them, and until
 * a corner on one side comes nearer than what is to be kept to a corner on the other side, the distance of the two is
 * at least that. Corners move linearly, so that this time is a division; sliding along a plane takes one step. */
#ifndef FLESH_GEOMETRY_CONTINUOUS_COLLISION_H
#define FLESH_GEOMETRY_CONTINUOUS_COLLISION_H

/* The most steps of an advancement; what is not certain by then is not made. (Of 160 000 hard trajectories of
 * test_continuous_collision.c none needs as many.) */
enum { FLESH_ADVANCE_STEPS = 256 };

/* The largest fraction 0 <= t <= 1, up to what is said below, of the way from x0 to x1 on all of which the convex hulls
 * of the first `first` points and of the `second` points after them keep at least the part `keep` (0 < keep < 1) of
 * their distance at x0: point and triangle (1, 3), two edges (2, 2), point and edge (1, 2), two points (1, 1).
 *
 * Never late: rounding is accounted for, of the coordinates at t too, so that at every computed place
 * x0 + s (x1 - x0), s <= t, they are apart if they are at x0. Early only so far that at t, where t < 1, either their
 * distance is at most keep + 0.02 of that at x0, or FLESH_ADVANCE_STEPS are made. 0 where they touch at x0, to rounding,
 * and approach, and where a place is not finite. Never NaN. */
double flesh_feasible_fraction(int first, int second, const double *const x0[4], const double *const x1[4],
                               double keep);

/* Whether it can be told at once that this is 1: a plane that keeps its direction separates the hulls by enough at x0 and
 * at x1, and so in between. 0: it takes an advancement to tell. No coordinate is larger
 * than `place`, which is NaN where one is not finite. */
int flesh_hulls_move_little(int first, int second, const double *const x0[4], const double *const x1[4], double keep,
                            double place);

/* Whether one plane keeps the hulls of the nodes' places more than `distance` apart all the way from x0 to x1 [3*...],
 * or at x0 where x1 is NULL: 0 where they come nearer, where it takes more than a plane to tell, and where a place is
 * not finite. */
int flesh_hulls_stay_apart(int first, int second, const int nodes[4], const double *x0, const double *x1,
                           double distance);

/* The distance of the two hulls, to rounding of the points' distances from each other. unit [3]: from the second to the
 * first along the shortest connection, 0 where they touch. */
double flesh_hull_distance(int first, int second, const double *const x[4], double unit[3]);

#endif
