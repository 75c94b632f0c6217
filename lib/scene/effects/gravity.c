/* gravity.c: gravity: its keys in a scene. */
#include "scene/effect_rows.h"

typedef struct parameters {
  double acceleration[3];
} parameters;

static const flesh_key keys[] = {
    {.name = "acceleration", .type = FLESH_KEY_VECTOR,
     .offset = offsetof(parameters, acceleration), .unit = "m/s^2",
     .default_value = "[0, 0, -9.81]", .doc = "acceleration of free fall"},
    {0}};

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
  flesh_effect *effect = NULL;
  return flesh_effect_row_add(system, flesh_effect_gravity(body, p->acceleration, &effect), &effect);
}

const flesh_effect_row flesh_effect_row_gravity = {
    .name = "gravity",
    .doc = "A uniform acceleration pulls at the body's mass.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    .sample = "{acceleration: [1, 2, -9.81]}",
    .add = add,
    .on_parts = FLESH_PARTS_TETS,
};
