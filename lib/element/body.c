/* body.c: cells of tets, and what a body must have. */
#include "element/body.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "mesh/pieces.h"

static void sort(int *nodes, int count)
{
  for (int i = 1; i < count; i++)
    for (int j = i; j > 0 && nodes[j] < nodes[j - 1]; j--) {
      int swap = nodes[j];
      nodes[j] = nodes[j - 1];
      nodes[j - 1] = swap;
    }
}

int flesh_cells_of_tets(const flesh_mesh *mesh, flesh_cells *cells)
{
  FLESH_NEED({mesh, "mesh"}, {cells, "cells"});
  const int count = flesh_mesh_tet_count(mesh), per_cell = flesh_mesh_order(mesh) == 2 ? 10 : 4;
  int *nodes = flesh_malloc((size_t)count * (size_t)per_cell * sizeof *nodes);
  if (!nodes) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the nodes of %d tets", count);
  for (int e = 0; e < count; e++) {
    int *tet = nodes + (size_t)per_cell * (size_t)e, own[10], size = flesh_mesh_tet_nodes(mesh, e, own);
    memcpy(tet, own, (size_t)size * sizeof *tet);
    sort(tet, size);
    for (int a = size; a < per_cell; a++) tet[a] = tet[size - 1];
  }
  *cells = (flesh_cells){.count = count, .nodes_per_cell = per_cell, .nodes = nodes, .padded = mesh->linear > 0};
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
