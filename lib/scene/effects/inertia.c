/* inertia.c: inertia: its keys in a scene. */
#include "scene/effect_rows.h"

static const flesh_key keys[] = {{0}};

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  (void)values;
  flesh_effect *effect = NULL;
  return flesh_effect_row_add(system, flesh_effect_inertia(body, &effect), &effect);
}

const flesh_effect_row flesh_effect_row_inertia = {
    .name = "inertia",
    .doc = "The body's mass resists acceleration. Without it the scene is solved for equilibrium.",
    .keys = keys,
    .parameters_size = 0,
    .sample = "{}",
    .add = add,
    .on_parts = FLESH_PARTS_TETS,
    .once = 1,
};
