/* rest_box.c: the box around a body at rest. */
#include "output/rest_box.h"

#include <math.h>
#include <stddef.h>

void flesh_rest_box(const flesh_mesh *mesh, const flesh_team *team, double box[6])
{
  const double *X = flesh_mesh_positions(mesh);
  const uint8_t *used = flesh_mesh_node_used(mesh);
  for (int c = 0; c < 6; c++) box[c] = -INFINITY;
  for (int i = 0; i < flesh_mesh_node_count(mesh); i++)
    for (int c = 0; c < 3 && used[i]; c++) {
      box[c] = fmax(box[c], -X[3 * (size_t)i + (size_t)c]);
      box[3 + c] = fmax(box[3 + c], X[3 * (size_t)i + (size_t)c]);
    }
  flesh_team_largest(team, 6, box);
  for (int c = 0; c < 3; c++) box[c] = -box[c];
}
