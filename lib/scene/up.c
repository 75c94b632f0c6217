/* up.c: the direction that is up in pictures of a scene. */
#include <math.h>

#include "effect/effect.h"
#include "scene/scene.h"

int flesh_scene_direction(const double v[3], double unit[3])
{
  double largest = fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2]))), length = 0;
  if (!(largest > 0) || !isfinite(v[0] + v[1] + v[2])) return 0;
  for (int d = 0; d < 3; d++) length += (v[d] / largest) * (v[d] / largest);
  for (int d = 0; d < 3; d++) unit[d] = v[d] / largest / sqrt(length) + 0.0; /* no -0 */
  return 1;
}

flesh_up_origin flesh_scene_up(const flesh_scene *scene, double up[3])
{
  double against[3] = {0, 0, 0};
  const flesh_system *system = flesh_scene_system(scene);
  if (flesh_scene_direction(scene->keys.output.given.camera.up, up)) return FLESH_UP_GIVEN;
  for (int e = 0; e < flesh_system_effect_count(system); e++) {
    const double *acceleration = flesh_effect_acceleration(flesh_system_effect(system, e));
    for (int d = 0; acceleration && d < 3; d++) against[d] -= acceleration[d];
  }
  if (flesh_scene_direction(against, up)) return FLESH_UP_GRAVITY;
  up[0] = up[1] = 0;
  up[2] = 1;
  return FLESH_UP_Z;
}
