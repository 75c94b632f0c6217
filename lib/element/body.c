/* body.c: cells of tets, and what a body must have. */
#include "element/body.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"

int flesh_cells_of_tets(const flesh_mesh *mesh, flesh_cells *cells)
{
  FLESH_NEED({mesh, "mesh"}, {cells, "cells"});
  int count = flesh_mesh_tet_count(mesh);
  int *nodes = flesh_malloc((size_t)count * 4 * sizeof *nodes);
  if (!nodes) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the nodes of %d tets", count);
  memcpy(nodes, flesh_mesh_tets(mesh), (size_t)count * 4 * sizeof *nodes);
  for (int e = 0; e < count; e++) {
    int *tet = nodes + 4 * e;
    for (int i = 1; i < 4; i++)
      for (int j = i; j > 0 && tet[j] < tet[j - 1]; j--) {
        int swap = tet[j];
        tet[j] = tet[j - 1];
        tet[j - 1] = swap;
      }
  }
  *cells = (flesh_cells){.count = count, .nodes_per_cell = 4, .nodes = nodes};
  return FLESH_OK;
}

void flesh_cells_clear(flesh_cells *cells)
{
  flesh_free((void *)cells->nodes);
  *cells = (flesh_cells){0};
}

int flesh_body_check_density(const flesh_body *body)
{
  for (int e = 0; e < flesh_mesh_tet_count(body->mesh); e++)
    if (!(body->density[e] > 0 && body->density[e] < INFINITY))
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "the density of tet %d is %g kg/m^3; it must be positive", e,
                        body->density[e]);
  return FLESH_OK;
}
