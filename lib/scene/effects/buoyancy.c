/* buoyancy.c: the lift of a fluid: its keys in a scene. */
#include "scene/effect_rows.h"

typedef struct parameters {
  double level, density, acceleration[3];
} parameters;

static const flesh_key keys[] = {
    {.name = "level", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, level), .unit = "m",
     .doc = "height of the fluid's surface above the origin, against the acceleration"},
    {.name = "density", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, density),
     .range = FLESH_RANGE_POSITIVE, .unit = "kg/m^3", .default_value = "1000", .doc = "density of the fluid"},
    {.name = "acceleration", .type = FLESH_KEY_VECTOR, .offset = offsetof(parameters, acceleration), .unit = "m/s^2",
     .default_value = "[0, 0, -9.81]", .doc = "acceleration of free fall; the body's own weight is the effect "
                                              "gravity"},
    {0}};

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
  flesh_effect *effect = NULL;
  return flesh_effect_row_add(system, flesh_effect_buoyancy(body, p->level, p->density, p->acceleration, &effect),
                              &effect);
}

const flesh_effect_row flesh_effect_row_buoyancy = {
    .name = "buoyancy",
    .doc = "The pressure of a fluid at rest on all surfaces below its level: the lift is the weight of the displaced "
           "fluid. Hollows within a body are filled, too.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    .sample = "{level: 0.6}",
    .add = add,
    .on_parts = FLESH_PARTS_NODES,
};
