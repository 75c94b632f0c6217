/* amplitude.c: the factor of a load as a function of time. */
#include "effect/amplitude.h"

#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "effect/effect.h"
#include "geometry/motion.h"

int flesh_amplitude_take(const flesh_amplitude *amplitude, flesh_amplitude_copy *copy)
{
  *copy = (flesh_amplitude_copy){.from = -INFINITY, .until = INFINITY};
  if (!amplitude) return FLESH_OK;
  copy->from = amplitude->from;
  copy->until = amplitude->until;
  if (!(copy->until > copy->from))
    return flesh_fail(FLESH_ERR_ARGUMENT, "until is %g s; it must be after from, %g s", copy->until, copy->from);
  if (!amplitude->count) return FLESH_OK;
  if (amplitude->count < 0 || !amplitude->points)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a curve of %d points must have an array of as many", amplitude->count);
  flesh_keyframe *keyframes = calloc((size_t)amplitude->count, sizeof *keyframes);
  if (!keyframes) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d points of a curve", amplitude->count);
  for (int k = 0; k < amplitude->count; k++) {
    keyframes[k].t = amplitude->points[k].t;
    keyframes[k].translation[0] = amplitude->points[k].value;
  }
  int status = flesh_motion_copy(&(flesh_motion){amplitude->count, keyframes, {0}, amplitude->smooth}, &copy->curve);
  free(keyframes);
  return status;
}

int flesh_amplitude_copy_of(const flesh_amplitude_copy *amplitude, flesh_amplitude_copy *copy)
{
  *copy = *amplitude;
  copy->curve = (flesh_motion){0};
  return amplitude->curve.count ? flesh_motion_copy(&amplitude->curve, &copy->curve) : FLESH_OK;
}

void flesh_amplitude_clear(flesh_amplitude_copy *amplitude) { flesh_motion_clear(&amplitude->curve); }

size_t flesh_amplitude_memory(const flesh_amplitude_copy *amplitude)
{
  return (size_t)amplitude->curve.count * sizeof *amplitude->curve.keyframes;
}

double flesh_amplitude_at(const flesh_amplitude_copy *amplitude, double t)
{
  double value[3] = {1, 0, 0};
  if (!(amplitude->from <= t && t < amplitude->until)) return 0;
  if (amplitude->curve.count) flesh_motion_at(&amplitude->curve, t, value);
  return value[0];
}

double flesh_amplitude_next_event(const flesh_amplitude_copy *amplitude, double t)
{
  return fmin(flesh_interval_next_event(amplitude->from, amplitude->until, t),
              flesh_motion_next_event(&amplitude->curve, t));
}
