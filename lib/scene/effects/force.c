/* force.c: a dead force: its keys in a scene. */
#include "scene/effect_rows.h"

static const flesh_key keys[] = {
    FLESH_SELECTION_KEYS(flesh_load_parameters, selection),
    {.name = "force", .type = FLESH_KEY_VECTOR, .offset = offsetof(flesh_load_parameters, vector), .unit = "N",
     .doc = "total force, shared evenly by the nodes"},
    FLESH_AMPLITUDE_KEYS(flesh_load_parameters, amplitude),
    {0}};

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  return flesh_effect_row_add_load(values, body, system, flesh_selection_nodes, flesh_effect_force);
}

const flesh_effect_row flesh_effect_row_force = {
    .name = "force",
    .doc = "A force in a fixed direction, shared by nodes: a dead load.",
    .keys = keys,
    .parameters_size = sizeof(flesh_load_parameters),
    .sample = "{box: [[0.9, -1, -1], [2, 2, 2]], force: [100, 0, -50], amplitude: [{time: 0, value: 0}, "
     "{time: 1, value: 1}]}",
    .add = add,
    .on_parts = FLESH_PARTS_NODES,
};
