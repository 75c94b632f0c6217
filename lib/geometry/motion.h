/* motion.h: evaluates keyframed motions. */
#ifndef FLESH_GEOMETRY_MOTION_H
#define FLESH_GEOMETRY_MOTION_H

#include "base/key.h"
#include "flesh/motion.h"

/* Checks and copies `motion` with its keyframes; free with flesh_motion_clear. */
int flesh_motion_copy(const flesh_motion *motion, flesh_motion *copy);
void flesh_motion_clear(flesh_motion *motion);

/* Translation [3] at time t. */
void flesh_motion_at(const flesh_motion *motion, double t, double translation[3]);

/* y = centre + R(t)(X - centre) + translation(t). Between keyframes R turns about one axis at the rate of the
 * interpolation (spherical linear): where both rotation vectors have one axis by their difference, else by the rotation
 * from the one to the other, of the many by full turns the one nearest to their difference. */
void flesh_motion_apply(const flesh_motion *motion, double t, const double X[3], double y[3]);

/* First and second derivative in time of the y above, v and a [3]; at a keyframe those that follow it. */
void flesh_motion_rates(const flesh_motion *motion, double t, const double X[3], double v[3],
                        double a[3]);

/* First keyframe after t, INFINITY if none. */
double flesh_motion_next_event(const flesh_motion *motion, double t);

/* Names of flesh_motion.smooth = 0 and 1 in a scene. */
extern const char *const flesh_interpolation_names[];

/* A motion as a scene writes it: a list of keyframes {time, translation, rotation}. */
extern const flesh_key flesh_keyframe_keys[];

#endif
