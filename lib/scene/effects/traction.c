/* traction.c: a dead traction: its keys in a scene. */
#include "scene/effect_rows.h"

static const flesh_key keys[] = {
    FLESH_SELECTION_KEYS(flesh_load_parameters, selection),
    {.name = "traction", .type = FLESH_KEY_VECTOR, .offset = offsetof(flesh_load_parameters, vector), .unit = "Pa",
     .doc = "force per area of the rest shape; a surface triangle is chosen by all three of its nodes, or by the "
            "region of its tet"},
    FLESH_AMPLITUDE_KEYS(flesh_load_parameters, amplitude),
    {0}};

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  return flesh_effect_row_add_load(values, body, system, flesh_selection_triangles, flesh_effect_traction);
}

const flesh_effect_row flesh_effect_row_traction = {
    .name = "traction",
    .doc = "A force per area of the rest shape's surface, in a fixed direction: a dead load.",
    .keys = keys,
    .parameters_size = sizeof(flesh_load_parameters),
    .sample = "{box: [[0.9, -1, -1], [2, 2, 2]], traction: [0, 300, 100]}",
    .add = add,
    .on_parts = FLESH_PARTS_NODES,
};
