/* motion.h: motions in time by keyframes. */
#ifndef FLESH_MOTION_H
#define FLESH_MOTION_H

#include "flesh/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A keyframe of a motion, which is linear between keyframes (rotations are about one axis from one keyframe to the
 * next), and constant before the first and after the last. */
typedef struct flesh_keyframe {
  double t;              /* s, ascending */
  double translation[3]; /* m; for a spring, the target's position */
  double rotation[3];    /* rotation vector about the motion's centre, radians */
} flesh_keyframe;

typedef struct flesh_motion {
  int count; /* >= 1 */
  const flesh_keyframe *keyframes;
  double centre[3]; /* m, centre of the rotations */
  int smooth;       /* 0: linear between keyframes; 1: cubic easing, at rest at every keyframe */
} flesh_motion;

#ifdef __cplusplus
}
#endif
#endif
