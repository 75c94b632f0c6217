/* obstacle.h: distances to obstacles and feasible steps past them, in the obstacle's own frame. */
#ifndef FLESH_GEOMETRY_OBSTACLE_H
#define FLESH_GEOMETRY_OBSTACLE_H

#include <stddef.h>

#include "flesh/obstacle.h"
#include "geometry/barrier.h"

/* The frame of a moving obstacle: x = origin + R (y - centre) for a point y of its rest place. */
typedef struct flesh_frame {
  int moved; /* 0: x = y */
  double R[9], origin[3], centre[3];
} flesh_frame;

void flesh_obstacle_frame(const flesh_obstacle *obstacle, double t, flesh_frame *frame);
void flesh_frame_enter(const flesh_frame *frame, const double x[3], double y[3]);
void flesh_frame_leave(const flesh_frame *frame, const double y[3], double x[3]);
/* Whether the obstacle has a motion of more than one keyframe. */
int flesh_obstacle_moves(const flesh_obstacle *obstacle);
/* Velocity at time t of the obstacle's point that rests at y. */
void flesh_obstacle_velocity(const flesh_obstacle *obstacle, double t, const double y[3],
                             double v[3]);
/* Its mean from begin to end at the place x, of what is there. */
void flesh_obstacle_mean_velocity(const flesh_obstacle *obstacle, double begin, double end, const double x[3], double v[3]);
double flesh_obstacle_next_event(const flesh_obstacle *obstacle, double t);
/* Bytes it holds. */
size_t flesh_obstacle_memory(const flesh_obstacle *obstacle);
/* "plane", "sphere", ... */
const char *flesh_obstacle_name(const flesh_obstacle *obstacle);

/* The barrier of thickness w at y; distance <= 0, and nothing else, within the obstacle. */
void flesh_obstacle_barrier(const flesh_obstacle *obstacle, const double y[3], double w,
                            flesh_barrier *barrier);

/* Balls of half an obstacle's radius in its midst, which no face of a body may enter: their centres
 * into points [3*their number] (may be NULL), overlapping along a capsule; returns their number, 0 for
 * planes and meshes. */
int flesh_obstacle_core(const flesh_obstacle *obstacle, double *radius, double *points);

/* How far into a plane, sphere or capsule y lies; 0 outside and for meshes. */
double flesh_obstacle_depth(const flesh_obstacle *obstacle, const double y[3]);

/* The fraction of the straight step from y0, outside, to y1 that is feasible: before the obstacle is
 * met; 1: all. */
double flesh_obstacle_max_feasible_step(const flesh_obstacle *obstacle, const double y0[3], const double y1[3]);

#endif
