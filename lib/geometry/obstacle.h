/* obstacle.h: distances to obstacles and feasible steps past them, in the obstacle's own frame. */
#ifndef FLESH_GEOMETRY_OBSTACLE_H
#define FLESH_GEOMETRY_OBSTACLE_H

#include <stddef.h>

#include "flesh/obstacle.h"
#include "geometry/barrier.h"

/* Frame of a moving obstacle: a point y at rest is now at x = origin + R (y - centre). */
typedef struct flesh_frame {
  int moved; /* 0: no motion, x = y */
  double R[9], origin[3], centre[3];
} flesh_frame;

void flesh_obstacle_frame(const flesh_obstacle *obstacle, double t, flesh_frame *frame);
void flesh_frame_enter(const flesh_frame *frame, const double x[3], double y[3]);
void flesh_frame_leave(const flesh_frame *frame, const double y[3], double x[3]);
/* Whether the obstacle's motion has more than one keyframe. */
int flesh_obstacle_moves(const flesh_obstacle *obstacle);
/* Computes the velocity at time t of the obstacle's point that is at y at rest. */
void flesh_obstacle_velocity(const flesh_obstacle *obstacle, double t, const double y[3],
                             double v[3]);
/* Computes the mean velocity, from `begin` to `end`, of the obstacle's points that pass the position x. */
void flesh_obstacle_mean_velocity(const flesh_obstacle *obstacle, double begin, double end, const double x[3], double v[3]);
double flesh_obstacle_next_event(const flesh_obstacle *obstacle, double t);
/* Returns the bytes of memory that the obstacle uses. */
size_t flesh_obstacle_memory(const flesh_obstacle *obstacle);
/* Returns the name of the shape: "plane", "sphere", ... */
const char *flesh_obstacle_name(const flesh_obstacle *obstacle);

/* Computes the barrier of thickness w at y. Inside the obstacle only a distance <= 0 is set. */
void flesh_obstacle_barrier(const flesh_obstacle *obstacle, const double y[3], double w,
                            flesh_barrier *barrier);

/* Computes the core: overlapping balls of half the obstacle's radius along its middle, which no face of a body may
 * enter. Returns their number, 0 for planes and meshes, and their centres in points [3*number] unless that is NULL. */
int flesh_obstacle_core(const flesh_obstacle *obstacle, double *radius, double *points);

/* Returns how far inside a plane, sphere or capsule y is; 0 outside and for meshes. */
double flesh_obstacle_depth(const flesh_obstacle *obstacle, const double y[3]);

/* Returns the fraction of the straight step from y0, outside, to y1 before the obstacle is met; 1 if it is not. */
double flesh_obstacle_max_feasible_step(const flesh_obstacle *obstacle, const double y0[3], const double y1[3]);

#endif
