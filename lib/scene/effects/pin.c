/* pin.c: pins: their keys in a scene. */
#include <stdlib.h>

#include "scene/effect_rows.h"

typedef struct parameters {
  flesh_selection selection;
  unsigned axes;
  double from, until;
} parameters;

static const flesh_key keys[] = {FLESH_SELECTION_KEYS(parameters, selection),
                                     FLESH_AXES_KEY(parameters),
                                     FLESH_INTERVAL_KEYS(parameters),
                                     {0}};

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
  int count, *nodes, status = flesh_selection_nodes(&p->selection, body, &count, &nodes);
  if (status) return status;
  status = flesh_system_add_pin(system, count, nodes, p->axes, p->from, p->until);
  free(nodes);
  return status;
}

const flesh_effect_row flesh_effect_row_pin = {
    .name = "pin",
    .doc = "Nodes, or single components of them, constrained to their rest positions. If several pins and prescribed "
           "motions constrain a component at the same time, the last of them applies.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    .sample = "{box: [[-1, -1, -1], [0.1, 2, 2]], axes: [x, z]}",
    .add = add,
    .on_parts = FLESH_PARTS_NODES,
};
