/* drag.c: the resistance of air or water: its keys in a scene. */
#include <stdlib.h>

#include "scene/effect_rows.h"

typedef struct parameters {
  flesh_selection selection;
  double density, velocity[3], coefficient;
} parameters;

static const flesh_key keys[] = {
    FLESH_SELECTION_KEYS(parameters, selection),
    {.name = "density", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, density),
     .range = FLESH_RANGE_POSITIVE, .unit = "kg/m^3",
     .doc = "density of the fluid: 1.2 for air, 1000 for water; a surface triangle is chosen by all three of its "
            "nodes, or by the region of its tet"},
    {.name = "velocity", .type = FLESH_KEY_VECTOR, .offset = offsetof(parameters, velocity), .unit = "m/s",
     .default_value = "[0, 0, 0]", .doc = "velocity of the fluid: wind, current"},
    {.name = "coefficient", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, coefficient),
     .range = FLESH_RANGE_POSITIVE, .default_value = "1",
     .doc = "pressure over density s^2/2, s > 0 being the normal speed of the stream against the face: the drag "
            "coefficient of a plate across the stream; a sphere gets half of it"},
    {0}};

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
  flesh_effect *effect = NULL;
  int count, *triangles = NULL, status = flesh_selection_triangles(&p->selection, body, &count, &triangles);
  if (status) return status;
  status = flesh_effect_drag(body, count, triangles, p->density, p->velocity, p->coefficient, &effect);
  free(triangles);
  return flesh_effect_row_add(system, status, &effect);
}

const flesh_effect_row flesh_effect_row_drag = {
    .name = "drag",
    .doc = "The resistance of air or water: a pressure on faces that move against the stream, in proportion to the "
           "square of their normal speed. Faces in the lee have no drag, nor has flow along a face; faces do not "
           "shelter each other.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    .sample = "{box: [[0.9, -1, -1], [2, 2, 2]], density: 1.2, velocity: [-20, 3, 0]}",
    .add = add,
    .on_parts = FLESH_PARTS_NODES,
};
