/* loads.c: dead loads as a scene names them: force and traction. */
#include <stdlib.h>

#include "scene/effect_rows.h"

typedef struct parameters {
  flesh_selection selection;
  double vector[3]; /* N, Pa */
  flesh_amplitude_parameters amplitude;
} parameters;

static const flesh_key force_keys[] = {
    FLESH_SELECTION_KEYS(parameters, selection),
    {.name = "force", .type = FLESH_KEY_VECTOR, .offset = offsetof(parameters, vector), .unit = "N",
     .doc = "in all, shared evenly by the nodes"},
    FLESH_AMPLITUDE_KEYS(parameters, amplitude),
    {0}};

/* Either load, on what `select` finds of the selection. */
static int add(const parameters *p, const flesh_body *body, flesh_system *system,
               int (*select)(const flesh_selection *, const flesh_body *, int *, int **),
               int (*create)(const flesh_body *, int, const int *, const double[3], const flesh_amplitude *,
                             flesh_effect **))
{
  const flesh_amplitude amplitude = flesh_amplitude_read(&p->amplitude);
  flesh_effect *effect = NULL;
  int count, *items = NULL, status = select(&p->selection, body, &count, &items);
  if (status) return status;
  status = create(body, count, items, p->vector, &amplitude, &effect);
  free(items);
  return status ? status : flesh_system_add_effect(system, &effect);
}

static int add_force(const void *values, const flesh_body *body, flesh_system *system)
{
  return add(values, body, system, flesh_selection_nodes, flesh_effect_force);
}

static const flesh_key traction_keys[] = {
    FLESH_SELECTION_KEYS(parameters, selection),
    {.name = "traction", .type = FLESH_KEY_VECTOR, .offset = offsetof(parameters, vector), .unit = "Pa",
     .doc = "force per area of the rest shape; a surface triangle is chosen by all three of its nodes, or by the "
            "region of its tet"},
    FLESH_AMPLITUDE_KEYS(parameters, amplitude),
    {0}};

static int add_traction(const void *values, const flesh_body *body, flesh_system *system)
{
  return add(values, body, system, flesh_selection_triangles, flesh_effect_traction);
}

const flesh_effect_row flesh_effect_row_force = {
    .name = "force",
    .doc = "A force in a fixed direction, shared by nodes: a dead load.",
    .keys = force_keys,
    .parameters_size = sizeof(parameters),
    .sample = "{box: [[0.9, -1, -1], [2, 2, 2]], force: [100, 0, -50], amplitude: [{time: 0, value: 0}, "
     "{time: 1, value: 1}]}",
    .add = add_force,
};

const flesh_effect_row flesh_effect_row_traction = {
    .name = "traction",
    .doc = "A force per area of the rest shape's surface, in a fixed direction: a dead load.",
    .keys = traction_keys,
    .parameters_size = sizeof(parameters),
    .sample = "{box: [[0.9, -1, -1], [2, 2, 2]], traction: [0, 300, 100]}",
    .add = add_traction,
};
