/* selection.c: which nodes a pin or handle holds. */
#include "effect/selection.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "base/error.h"

const flesh_key flesh_sphere_keys[] = {
    {.name = "centre", .type = FLESH_KEY_VECTOR, .offset = 0, .unit = "m", .doc = "of the sphere"},
    {.name = "radius", .type = FLESH_KEY_NUMBER, .offset = 3 * sizeof(double),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "m", .doc = "of the sphere"},
    {0}};

int flesh_selection_nodes(const flesh_selection *selection, const flesh_mesh *mesh, int *count,
                          int **nodes)
{
  const double *box = selection->box, *centre = selection->sphere.centre,
               radius = selection->sphere.radius, *X = flesh_mesh_positions(mesh);
  int total = flesh_mesh_node_count(mesh), has_box = !isnan(box[0]), has_sphere = !isnan(radius);
  if (!has_box && !has_sphere && !selection->nodes.count)
    return flesh_fail(FLESH_ERR_ARGUMENT, "no nodes are named; give box, sphere or nodes");
  if (has_box)
    for (int c = 0; c < 3; c++)
      if (box[c] > box[3 + c])
        return flesh_fail(FLESH_ERR_ARGUMENT,
                          "box has low %c = %g above high %c = %g; it must be [[low], [high]]",
                          'x' + c, box[c], 'x' + c, box[3 + c]);
  uint8_t *chosen = calloc((size_t)total, 1);
  if (!chosen) return flesh_fail(FLESH_ERR_MEMORY, "no memory to choose among %d nodes", total);
  for (int k = 0; k < selection->nodes.count; k++) {
    int node = selection->nodes.values[k];
    if (node < 0 || node >= total) {
      free(chosen);
      return flesh_fail(FLESH_ERR_ARGUMENT, "nodes[%d] is %d; the mesh has the nodes 0 to %d", k,
                        node, total - 1);
    }
    chosen[node] = 1;
  }
  int found = 0;
  for (int i = 0; i < total; i++) {
    const double *p = X + 3 * i;
    if (has_box && p[0] >= box[0] && p[1] >= box[1] && p[2] >= box[2] && p[0] <= box[3] &&
        p[1] <= box[4] && p[2] <= box[5])
      chosen[i] = 1;
    if (has_sphere) {
      double d[3] = {p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]};
      if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= radius * radius) chosen[i] = 1;
    }
    found += chosen[i];
  }
  if (!found) {
    free(chosen);
    return flesh_fail(FLESH_ERR_ARGUMENT, "no node of the mesh lies in the given %s",
                      has_box && has_sphere ? "box or sphere" : has_box ? "box" : "sphere");
  }
  *nodes = malloc((size_t)found * sizeof **nodes);
  if (!*nodes) {
    free(chosen);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d chosen nodes", found);
  }
  *count = 0;
  for (int i = 0; i < total; i++)
    if (chosen[i]) (*nodes)[(*count)++] = i;
  free(chosen);
  return FLESH_OK;
}
