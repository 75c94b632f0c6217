/* prescribed_motion.c: prescribed motions: their keys in a scene. */
#include <stdlib.h>

#include "scene/effect_rows.h"

typedef struct parameters {
  flesh_selection selection;
  unsigned axes;
  double from, until, centre[3];
  int interpolation;
  flesh_objects motion;
} parameters;

static const flesh_key keys[] = {
    FLESH_SELECTION_KEYS(parameters, selection),
    FLESH_AXES_KEY(parameters),
    {.name = "motion", .type = FLESH_KEY_OBJECTS, .offset = offsetof(parameters, motion),
     .children = flesh_keyframe_keys, .child_size = sizeof(flesh_keyframe),
     .doc = "keyframes; before the first and after the last the nodes rest"},
    {.name = "centre", .type = FLESH_KEY_VECTOR, .offset = offsetof(parameters, centre),
     .unit = "m", .default_value = "[0, 0, 0]", .doc = "centre of the rotations"},
    FLESH_INTERPOLATION_KEY(offsetof(parameters, interpolation), "keyframes", "keyframe"),
    FLESH_INTERVAL_KEYS(parameters),
    {0}};

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
  flesh_motion motion = {p->motion.count, p->motion.values,
                         {p->centre[0], p->centre[1], p->centre[2]},
                         p->interpolation};
  int count, *nodes, status = flesh_selection_nodes(&p->selection, body, &count, &nodes);
  if (status) return status;
  status = flesh_system_add_prescribed_motion(system, count, nodes, p->axes, &motion, p->from, p->until);
  free(nodes);
  return status;
}

const flesh_effect_row flesh_effect_row_prescribed_motion = {
    .name = "prescribed_motion",
    .doc = "Nodes that follow a keyframed motion.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    .sample = "{sphere: {centre: [1, 1, 1], radius: 0.1}, motion: [{time: 0}, {time: 1, translation: "
     "[0.1, 0, 0], rotation: [0, 0, 0.5]}]}",
    .add = add,
    .on_parts = FLESH_PARTS_NODES,
};
