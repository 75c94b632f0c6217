/* weld.c: tied surfaces as a scene names them. */
#include <math.h>
#include <stdlib.h>

#include "scene/effect_rows.h"

typedef struct side {
  flesh_selection selection;
} side;

static const flesh_key side_keys[] = {FLESH_SELECTION_KEYS(side, selection), {0}};

typedef struct parameters {
  side first, second;
  double distance, stiffness;
} parameters;

static const flesh_key keys[] = {
    {.name = "first", .type = FLESH_KEY_OBJECT, .offset = offsetof(parameters, first), .children = side_keys,
     .doc = "one surface: its triangles, chosen by all three of their nodes, by region or body; the weld is integrated "
            "over it, so that it should be the finer or the smaller one"},
    {.name = "second", .type = FLESH_KEY_OBJECT, .offset = offsetof(parameters, second), .children = side_keys,
     .doc = "the other surface"},
    {.name = "distance", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, distance),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "m", .default_value = "1e-6",
     .doc = "within which surfaces that face each other are tied at rest, apart or overlapping"},
    {.name = "stiffness", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, stiffness),
     .range = FLESH_RANGE_POSITIVE, .unit = "Pa/m", .default_value = "",
     .doc = "the surfaces part by traction over stiffness; without it 30 times 3 mu over an edge of the softer side"},
    {0}};

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
  flesh_effect *effect = NULL;
  int count[2], *triangles[2] = {NULL, NULL};
  int status = flesh_selection_triangles(&p->first.selection, body, &count[0], &triangles[0]);
  if (status) return status;
  status = flesh_selection_triangles(&p->second.selection, body, &count[1], &triangles[1]);
  if (!status) {
    status = flesh_effect_weld(body, count[0], triangles[0], count[1], triangles[1], p->distance, p->stiffness, &effect);
    free(triangles[1]);
  }
  free(triangles[0]);
  return flesh_effect_row_add(system, status, &effect);
}

static int bearers(const void *values, const flesh_body *body, int *count, int **nodes)
{
  return flesh_selection_nodes(&((const parameters *)values)->first.selection, body, count, nodes);
}

const flesh_effect_row flesh_effect_row_weld = {
    .name = "weld",
    .doc = "Ties two surfaces that lie on each other, of meshes that need not match. Momentum, angular momentum and "
           "constant stress pass from one to the other.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    .sample = "{first: {box: [[-1, -1, 0.9], [2, 2, 2]]}, second: {box: [[-1, -1, -1], [2, 2, 0.1]]}, distance: 2}",
    .add = add,
    .bearers = bearers,
};
