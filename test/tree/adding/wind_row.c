/* wind.c: wind as a scene names it. */
#include <stdlib.h>

#include "effect/wind.h"
#include "scene/effect_rows.h"

typedef struct parameters {
  flesh_selection selection;
  double velocity[3], density, coefficient;
  flesh_amplitude_parameters amplitude;
} parameters;

static const flesh_key keys[] = {
    FLESH_SELECTION_KEYS(parameters, selection),
    {.name = "velocity", .type = FLESH_KEY_VECTOR, .offset = offsetof(parameters, velocity), .unit = "m/s",
     .doc = "of the air; a surface triangle is chosen by all three of its nodes, or by the region of its tet"},
    {.name = "air_density", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, density),
     .range = FLESH_RANGE_POSITIVE, .unit = "kg/m^3", .default_value = "1.2", .doc = "of the air"},
    {.name = "coefficient", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, coefficient),
     .range = FLESH_RANGE_POSITIVE, .default_value = "1", .doc = "pressure over density (v.n)^2 / 2"},
    FLESH_AMPLITUDE_KEYS(parameters, amplitude),
    {0}};

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
  const flesh_amplitude amplitude = flesh_amplitude_read(&p->amplitude);
  flesh_effect *effect = NULL;
  int count, *triangles = NULL, status = flesh_selection_triangles(&p->selection, body, &count, &triangles);
  if (status) return status;
  status = flesh_effect_wind(body, count, triangles, p->velocity, p->density, p->coefficient, &amplitude, &effect);
  free(triangles);
  return flesh_effect_row_add(system, status, &effect);
}

const flesh_effect_row flesh_effect_row_wind = {
    .name = "wind",
    .doc = "Moving air presses on the surface by the square of its normal velocity relative to the body.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    .sample = "{box: [[0.9, -1, -1], [2, 2, 2]], velocity: [20, 3, 0]}",
    .add = add,
};
