/* obstacle_bounds.h: boxes around nodes, and whether an obstacle is far from all that is in one: what is far costs a
 * box for many nodes in place of a distance for each. */
#ifndef FLESH_GEOMETRY_OBSTACLE_BOUNDS_H
#define FLESH_GEOMETRY_OBSTACLE_BOUNDS_H

#include "geometry/obstacle.h"

typedef struct flesh_bounds {
  double low[3], high[3]; /* NaN where a place in it is not finite: then nothing is far */
} flesh_bounds;

/* Around the places x [3*...] of `nodes` [count >= 1]. */
flesh_bounds flesh_bounds_of(int count, const int *nodes, const double *x);
/* The box in the obstacle's frame around what is in `bounds`. */
flesh_bounds flesh_bounds_enter(const flesh_frame *frame, const flesh_bounds *bounds);
/* Around both. */
flesh_bounds flesh_bounds_join(const flesh_bounds *a, const flesh_bounds *b);
/* Whether a point is at least `reach` away from all that is in them. */
int flesh_bounds_are_far(const flesh_bounds *bounds, const double p[3], double reach);

/* Whether everything in the bounds, which are in the obstacle's frame, is out of it and at least `reach` away; 0 also
 * where that takes more to find out. */
int flesh_obstacle_is_far(const flesh_obstacle *obstacle, const flesh_bounds *bounds, double reach);

/* How far the obstacle is from all that is in the bounds, which are in its frame, at least; 0: it is not, or that takes
 * more to tell. */
double flesh_obstacle_clearance(const flesh_obstacle *obstacle, const flesh_bounds *bounds);

#endif
