/* motion.c: keyframed motions of handles and drag targets. */
#include "effect/motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"

const flesh_key flesh_keyframe_keys[] = {
    {.name = "time", .type = FLESH_KEY_NUMBER, .offset = offsetof(flesh_keyframe, t), .unit = "s",
     .doc = "when; keyframes ascend in time"},
    {.name = "translation", .type = FLESH_KEY_VECTOR, .offset = offsetof(flesh_keyframe, translation),
     .unit = "m", .default_value = "[0, 0, 0]", .doc = "from the rest position"},
    {.name = "rotation", .type = FLESH_KEY_VECTOR, .offset = offsetof(flesh_keyframe, rotation),
     .unit = "rad", .default_value = "[0, 0, 0]",
     .doc = "rotation vector (axis times angle) about the motion's centre"},
    {0}};

int flesh_motion_copy(const flesh_motion *motion, flesh_motion *copy)
{
  if (motion->count < 1)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a motion needs at least one keyframe");
  for (int k = 0; k < motion->count; k++) {
    const flesh_keyframe *key = &motion->keyframes[k];
    double sum = fabs(key->t);
    for (int c = 0; c < 3; c++)
      sum += fabs(key->translation[c]) + fabs(key->rotation[c]) + fabs(motion->centre[c]);
    if (!(sum < INFINITY))
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "keyframe %d at t = %g s or the motion's centre holds a number that is not finite", k,
                        key->t);
  }
  for (int k = 1; k < motion->count; k++)
    if (!(motion->keyframes[k].t > motion->keyframes[k - 1].t))
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "keyframe %d is at t = %g s, not after keyframe %d at %g s; times must ascend", k,
                        motion->keyframes[k].t, k - 1, motion->keyframes[k - 1].t);
  flesh_keyframe *keyframes = malloc((size_t)motion->count * sizeof *keyframes);
  if (!keyframes) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d keyframes", motion->count);
  memcpy(keyframes, motion->keyframes, (size_t)motion->count * sizeof *keyframes);
  *copy = *motion;
  copy->keyframes = keyframes;
  return FLESH_OK;
}

void flesh_motion_clear(flesh_motion *motion)
{
  free((void *)motion->keyframes);
  motion->keyframes = NULL;
  motion->count = 0;
}

void flesh_motion_at(const flesh_motion *motion, double t, double translation[3],
                     double rotation[3])
{
  const flesh_keyframe *keys = motion->keyframes;
  int next = 0;
  while (next < motion->count && keys[next].t <= t) next++;
  const flesh_keyframe *a = &keys[next > 0 ? next - 1 : 0];
  const flesh_keyframe *b = &keys[next < motion->count ? next : motion->count - 1];
  double s = b->t > a->t ? (t - a->t) / (b->t - a->t) : 0;
  if (motion->smooth) s = s * s * (3 - 2 * s);
  for (int c = 0; c < 3; c++) {
    if (translation) translation[c] = (1 - s) * a->translation[c] + s * b->translation[c];
    if (rotation) rotation[c] = (1 - s) * a->rotation[c] + s * b->rotation[c];
  }
}

void flesh_motion_apply(const flesh_motion *motion, double t, const double X[3], double y[3])
{
  double translation[3], w[3];
  flesh_motion_at(motion, t, translation, w);
  double angle = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
  if (angle == 0) {
    for (int c = 0; c < 3; c++) y[c] = X[c] + translation[c];
    return;
  }
  /* Rodrigues' formula. */
  double axis[3] = {w[0] / angle, w[1] / angle, w[2] / angle};
  double d[3] = {X[0] - motion->centre[0], X[1] - motion->centre[1], X[2] - motion->centre[2]};
  double along = axis[0] * d[0] + axis[1] * d[1] + axis[2] * d[2];
  double across[3] = {axis[1] * d[2] - axis[2] * d[1], axis[2] * d[0] - axis[0] * d[2],
                      axis[0] * d[1] - axis[1] * d[0]};
  double cosine = cos(angle), sine = sin(angle);
  for (int c = 0; c < 3; c++)
    y[c] = motion->centre[c] + cosine * d[c] + sine * across[c] + (1 - cosine) * along * axis[c] +
           translation[c];
}

double flesh_motion_next_event(const flesh_motion *motion, double t)
{
  /* A single keyframe is a motionless target. */
  for (int k = 0; motion->count > 1 && k < motion->count; k++)
    if (motion->keyframes[k].t > t) return motion->keyframes[k].t;
  return INFINITY;
}
