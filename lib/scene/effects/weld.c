/* weld.c: tied surfaces: their keys in a scene. */
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "scene/effect_rows.h"
#include "scene/node.h"

typedef struct side {
  flesh_selection selection;
} side;

static const flesh_key side_keys[] = {FLESH_SELECTION_KEYS(side, selection), {0}};

typedef struct parameters {
  const flesh_node *bodies; /* NULL: first and second are used */
  side first, second;
  double distance, stiffness, breaks_at;
} parameters;

static const flesh_key keys[] = {
    {.name = "bodies", .type = FLESH_KEY_TREE, .offset = offsetof(parameters, bodies), .default_value = "",
     .doc = "names of two bodies, [a, b], which are tied where their surfaces face each other within the distance; "
            "the weld is integrated over the surface of a, which should be the finer one"},
    {.name = "first", .type = FLESH_KEY_OBJECT, .offset = offsetof(parameters, first), .children = side_keys,
     .default_value = "",
     .doc = "in place of bodies, one surface: triangles chosen by all three of their nodes, by region or body; the "
            "weld is integrated over it, so it should be the finer or the smaller one"},
    {.name = "second", .type = FLESH_KEY_OBJECT, .offset = offsetof(parameters, second), .children = side_keys,
     .default_value = "", .doc = "the other surface"},
    {.name = "distance", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, distance),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "m", .default_value = "1e-6",
     .doc = "distance within which surfaces that face each other are tied at rest, apart or overlapping"},
    {.name = "stiffness", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, stiffness),
     .range = FLESH_RANGE_POSITIVE, .unit = "Pa/m", .default_value = "",
     .doc = "traction over the gap that it opens. Default: 90 mu over the edge length, of the softer side"},
    {.name = "breaks_at", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, breaks_at),
     .range = FLESH_RANGE_POSITIVE, .unit = "Pa", .default_value = "",
     .doc = "each common part of two triangles breaks when sqrt(tension^2 + shear^2) exceeds this at the end of a step; "
            "compression is ignored. Without it nothing breaks. time.method: ida refuses it"},
    {0}};

/* Makes the two surfaces into selections, which borrow from the parameters. */
static int read_sides(const parameters *p, flesh_selection sides[2])
{
  const flesh_node *bodies = p->bodies;
  char shown[FLESH_SHOW_SIZE];
  const int given = flesh_selection_is_given(&p->first.selection) + flesh_selection_is_given(&p->second.selection);
  if (given != (bodies ? 0 : 2))
    return flesh_fail(FLESH_ERR_ARGUMENT, bodies ? "bodies is given beside first or second; give either bodies, or first "
                                                   "and second"
                                                 : "give bodies: [a, b], the names of two bodies, or first and second");
  sides[0] = p->first.selection;
  sides[1] = p->second.selection;
  if (!bodies) return FLESH_OK;
  if (bodies->kind != FLESH_NODE_LIST || bodies->count != 2)
    return flesh_fail(FLESH_ERR_ARGUMENT, "bodies is %s; it must be the names of two bodies, [a, b]",
                      flesh_node_show(bodies, shown));
  for (int s = 0; s < 2; s++) {
    const flesh_node *name = flesh_node_item(bodies, s);
    if (name->kind != FLESH_NODE_SCALAR)
      return flesh_fail(FLESH_ERR_ARGUMENT, "bodies has %s; it must be the name of a body", flesh_node_show(name, shown));
    sides[s].body = (char *)name->text; /* the selection is only read */
  }
  if (!strcmp(sides[0].body, sides[1].body))
    return flesh_fail(FLESH_ERR_ARGUMENT, "bodies is [%s, %s]; a weld ties two different bodies", sides[0].body,
                      sides[1].body);
  return FLESH_OK;
}

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
  flesh_effect *effect = NULL;
  flesh_selection sides[2];
  int count[2], *triangles[2] = {NULL, NULL}, status = read_sides(p, sides);
  for (int s = 0; s < 2 && !status; s++) status = flesh_selection_triangles(&sides[s], body, &count[s], &triangles[s]);
  if (!status) {
    status = flesh_effect_weld(body, (flesh_triangles){count[0], triangles[0]}, (flesh_triangles){count[1], triangles[1]},
                               p->distance, p->stiffness, p->breaks_at, &effect);
    if (status && p->bodies) flesh_fail_within(status, "%s and %s: ", sides[0].body, sides[1].body);
  }
  for (int s = 0; s < 2; s++) free(triangles[s]);
  return flesh_effect_row_add(system, status, &effect);
}

static int bearers(const void *values, const flesh_body *body, int *count, int **nodes)
{
  flesh_selection sides[2];
  const int status = read_sides(values, sides);
  return status ? status : flesh_selection_nodes(&sides[0], body, count, nodes);
}

const flesh_effect_row flesh_effect_row_weld = {
    .name = "weld",
    .doc = "Ties two surfaces that lie on each other; their meshes need not match. Momentum, angular momentum and "
           "constant stress pass from one to the other.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    .sample = "{first: {box: [[-1, -1, 0.9], [2, 2, 2]]}, second: {box: [[-1, -1, -1], [2, 2, 0.1]]}, distance: 2}",
    .add = add,
    .bearers = bearers,
};
