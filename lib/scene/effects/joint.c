/* joint.c: balls, hinges and springs between points: their keys in a scene. */
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "flesh/effects.h"
#include "scene/effect_rows.h"

typedef struct side {
  flesh_selection selection;
} side;

static const flesh_key side_keys[] = {FLESH_SELECTION_KEYS(side, selection), {0}};

typedef struct parameters {
  side first, second;
  double point[3], axis[3], to[3], length, stiffness;
} parameters;

static const flesh_key keys[] = {
    {.name = "first", .type = FLESH_KEY_OBJECT, .offset = offsetof(parameters, first), .children = side_keys,
     .doc = "one group of nodes; each is coupled with every other one of the joint: choose few, near the point"},
    {.name = "second", .type = FLESH_KEY_OBJECT, .offset = offsetof(parameters, second), .children = side_keys,
     .doc = "the other group"},
    {.name = "point", .type = FLESH_KEY_VECTOR, .offset = offsetof(parameters, point), .unit = "m",
     .doc = "position of the joint at rest; for a spring, where the first group is attached"},
    {.name = "axis", .type = FLESH_KEY_VECTOR, .offset = offsetof(parameters, axis), .unit = "m", .default_value = "",
     .doc = "axis of a hinge at rest, as long as the hinge, with point in its middle; without axis and to the joint "
            "is a ball"},
    {.name = "to", .type = FLESH_KEY_VECTOR, .offset = offsetof(parameters, to), .unit = "m", .default_value = "",
     .doc = "for a spring that begins at point, its other end at rest, which the second group carries along"},
    {.name = "length", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, length),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "m", .default_value = "",
     .doc = "length of the spring without force. Default: the distance from point to to"},
    {.name = "stiffness", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, stiffness),
     .range = FLESH_RANGE_POSITIVE, .unit = "N/m",
     .doc = "force per separation; for a hinge, half of it at either end of the axis; for a spring, force per "
            "stretch"},
    {0}};

static int check(const parameters *p)
{
  const int to = !isnan(p->to[0]);
  if (to && !isnan(p->axis[0]))
    return flesh_fail(FLESH_ERR_ARGUMENT, "axis and to are both given; give axis for a hinge, or to for a spring");
  if (!to && !isnan(p->length))
    return flesh_fail(FLESH_ERR_ARGUMENT, "length is given without to; only a spring, from point to to, has one");
  return FLESH_OK;
}

static int make(const parameters *p, const flesh_body *body, const int count[2], int *const nodes[2],
                flesh_effect **effect)
{
  const flesh_nodes first = {count[0], nodes[0]}, second = {count[1], nodes[1]};
  if (isnan(p->to[0]))
    return flesh_effect_joint(body, first, second, p->point, isnan(p->axis[0]) ? NULL : p->axis, p->stiffness, effect);
  const flesh_carried_point ends[2] = {{first, {p->point[0], p->point[1], p->point[2]}},
                                       {second, {p->to[0], p->to[1], p->to[2]}}};
  return flesh_effect_joint_spring(body, &ends[0], &ends[1], p->stiffness, p->length, effect);
}

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
  flesh_effect *effect = NULL;
  int count[2], *nodes[2];
  int status = check(p);
  if (!status) status = flesh_selection_nodes(&p->first.selection, body, &count[0], &nodes[0]);
  if (status) return status;
  status = flesh_selection_nodes(&p->second.selection, body, &count[1], &nodes[1]);
  if (!status) {
    status = make(p, body, count, nodes, &effect);
    free(nodes[1]);
  }
  free(nodes[0]);
  return flesh_effect_row_add(system, status, &effect);
}

static int bearers(const void *values, const flesh_body *body, int *count, int **nodes)
{
  return flesh_selection_nodes(&((const parameters *)values)->first.selection, body, count, nodes);
}

const flesh_effect_row flesh_effect_row_joint = {
    .name = "joint",
    .doc = "Two groups of nodes that turn about a point (ball) or an axis (hinge), or a spring between them. Momentum "
           "and angular momentum are kept.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    .sample = "{first: {box: [[-1, -1, -1], [2, 2, 2]]}, second: {sphere: {centre: [1, 1, 1], radius: 1.2}}, "
              "point: [0.5, 0.4, 1], stiffness: 2000}",
    .add = add,
    .bearers = bearers,
};
