/* motion.h: evaluates keyframed motions. */
#ifndef FLESH_GEOMETRY_MOTION_H
#define FLESH_GEOMETRY_MOTION_H

#include "base/key.h"
#include "flesh/motion.h"

/* Checks and copies `motion` with its keyframes. Free the copy with flesh_motion_clear. FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY. */
int flesh_motion_copy(const flesh_motion *motion, flesh_motion *copy);
void flesh_motion_clear(flesh_motion *motion);

/* Computes the translation [3] at time t. */
void flesh_motion_at(const flesh_motion *motion, double t, double translation[3]);

/* Computes y = centre + R(t)(X - centre) + translation(t). Between keyframes R turns about one axis, at the rate of the
 * interpolation (spherical linear interpolation). If the rotation vectors of both keyframes share an axis, the angle is
 * their difference. Otherwise the rotation leads from one to the other; of the rotation vectors that differ by full
 * turns, the one nearest to their difference is taken. */
void flesh_motion_apply(const flesh_motion *motion, double t, const double X[3], double y[3]);

/* Computes the first and second time derivatives v and a [3] of the y above; at a keyframe, those of the interval after
 * it. */
void flesh_motion_rates(const flesh_motion *motion, double t, const double X[3], double v[3],
                        double a[3]);

/* Returns the time of the first keyframe after t, INFINITY if there is none. */
double flesh_motion_next_event(const flesh_motion *motion, double t);

/* Names in a scene of flesh_motion.smooth = 0 and 1. */
extern const char *const flesh_interpolation_names[];

/* Keys of a motion in a scene: a list of keyframes {time, translation, rotation}. */
extern const flesh_key flesh_keyframe_keys[];

#endif
