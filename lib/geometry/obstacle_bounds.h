/* obstacle_bounds.h: boxes around nodes, and whether an obstacle is far from all of a box. A far obstacle thus costs
 * one test for many nodes instead of a distance for each. */
#ifndef FLESH_GEOMETRY_OBSTACLE_BOUNDS_H
#define FLESH_GEOMETRY_OBSTACLE_BOUNDS_H

#include "geometry/obstacle.h"

typedef struct flesh_bounds {
  double low[3], high[3]; /* NaN if a position in it is not finite; then nothing is far from it */
} flesh_bounds;

/* Returns the box around the positions x [3*...] of `nodes` [count >= 1]. */
flesh_bounds flesh_bounds_of(int count, const int *nodes, const double *x);
/* Returns the box in the obstacle's frame around `bounds`. */
flesh_bounds flesh_bounds_enter(const flesh_frame *frame, const flesh_bounds *bounds);
/* Returns the box around both. */
flesh_bounds flesh_bounds_join(const flesh_bounds *a, const flesh_bounds *b);
/* Whether a point is at least `reach` away from the box. */
int flesh_bounds_are_far(const flesh_bounds *bounds, const double p[3], double reach);

/* Whether the obstacle is at least `reach` away from the whole box, given in the obstacle's frame. A cheap test that
 * may return 0 although it is. */
int flesh_obstacle_is_far(const flesh_obstacle *obstacle, const flesh_bounds *bounds, double reach);

/* Returns a lower bound of the obstacle's distance from the box, given in the obstacle's frame; 0 if they may meet. */
double flesh_obstacle_clearance(const flesh_obstacle *obstacle, const flesh_bounds *bounds);

#endif
