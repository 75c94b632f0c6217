/* obstacles.c: the obstacles of a run as surfaces, for pictures. */
#include "output/obstacles.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "effect/contact.h"
#include "flesh/contact.h"
#include "geometry/obstacle.h"
#include "flesh/surface.h"

/* Makes the surface of an obstacle at time t. A plane is drawn around the box of the rest shape, four times as wide. */
static int make_surface(const double box[6], const flesh_obstacle *obstacle, double t, flesh_surface **surface)
{
  double centre[3], extent = 0;
  for (int c = 0; c < 3; c++) {
    centre[c] = (box[c] + box[3 + c]) / 2;
    extent = fmax(extent, 2 * (box[3 + c] - box[c]));
  }
  return flesh_obstacle_surface(obstacle, t, centre, extent, surface);
}

int flesh_obstacles_write(const char *directory, const flesh_step_record *record, const double box[6])
{
  int count = 0, status = FLESH_OK;
  for (int e = 0; e < flesh_system_effect_count(record->system) && !status; e++) {
    const flesh_obstacle *obstacle = flesh_effect_obstacle(flesh_system_effect(record->system, e));
    count += obstacle != NULL;
    if (!obstacle || (record->step > 0 && !flesh_obstacle_moves(obstacle))) continue;
    flesh_surface *surface;
    const size_t size = strlen(directory) + 64;
    char *path = malloc(size);
    if (!path) return flesh_no_memory_for(directory);
    if (flesh_obstacle_moves(obstacle))
      snprintf(path, size, "%s/obstacle_%d_%06d.obj", directory, count, record->step);
    else
      snprintf(path, size, "%s/obstacle_%d.obj", directory, count);
    status = make_surface(box, obstacle, record->state->t, &surface);
    if (!status) status = flesh_surface_write(surface, NULL, path);
    flesh_surface_destroy(&surface);
    free(path);
  }
  return status;
}
