/* pressure.c: pressure: its keys in a scene. */
#include <stdlib.h>

#include "scene/effect_rows.h"

typedef struct parameters {
  flesh_selection selection;
  double pressure;
  flesh_amplitude_parameters amplitude;
} parameters;

static const flesh_key keys[] = {
    FLESH_SELECTION_KEYS(parameters, selection),
    {.name = "pressure", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, pressure),
     .unit = "Pa",
     .doc = "pressure on the deformed surface, > 0 pushes into the body; a surface triangle is chosen by all three "
            "of its nodes, or by the region of its tet"},
    FLESH_AMPLITUDE_KEYS(parameters, amplitude),
    {0}};

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
  const flesh_amplitude amplitude = flesh_amplitude_read(&p->amplitude);
  flesh_effect *effect = NULL;
  int count, *triangles = NULL, status = flesh_selection_triangles(&p->selection, body, &count, &triangles);
  if (status) return status;
  status = flesh_effect_pressure(body, count, triangles, p->pressure, &amplitude, &effect);
  free(triangles);
  return status ? status : flesh_system_add_effect(system, &effect);
}

const flesh_effect_row flesh_effect_row_pressure = {
    .name = "pressure",
    .doc = "A pressure that follows the deformed surface. On a closed surface (also one that encloses a hollow) it "
           "is conservative. On an open surface the terms of its rim are lagged: backward Euler takes them from the "
           "previous state, methods of order 2 solve every step twice for them and keep their order; statics and ida "
           "do not lag them. The work of these terms is not part of any energy.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    .sample = "{box: [[0.9, -1, -1], [2, 2, 2]], pressure: 2000, amplitude: [{time: 0, value: 0.5}, {time: 1, value: 1}], "
     "interpolation: smooth}",
    .add = add,
    .on_parts = FLESH_PARTS_NODES,
};
