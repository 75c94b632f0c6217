/* parents.c: transfers fields and sets of nodes to a mesh that was made from another. */
#include "mesh/parents.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "mesh/pieces.h"
#include "mesh/shape.h"

void flesh_mesh_interpolate(const flesh_mesh *mesh, int tet, const double place[4], int components, const double *field,
                            double *value)
{
  int nodes[10];
  double N[10];
  const int count = flesh_mesh_tet_nodes(mesh, tet, nodes);
  memcpy(N, place, 4 * sizeof *N);
  if (count == 10) flesh_tet10_shape(place, N);
  for (int c = 0; c < components; c++) {
    value[c] = 0;
    for (int a = 0; a < count; a++) value[c] += N[a] * field[(size_t)components * (size_t)nodes[a] + (size_t)c];
  }
}

int flesh_mesh_transfer(const flesh_mesh *mesh, const flesh_mesh_parents *parents, int components, const double *field,
                        double *finer)
{
  FLESH_NEED({mesh, "mesh"}, {parents, "parents"}, {field, "field"}, {finer, "finer"});
  if (components < 1)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the field has %d components; it must have 1 or more", components);
  int most = -1;
  for (int n = 0; n < parents->nodes; n++) most = parents->node_tet[n] > most ? parents->node_tet[n] : most;
  if (parents->nodes < mesh->nodes || most >= mesh->tets)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the parents of %d nodes are not in this mesh of %d nodes and %d tets",
                      parents->nodes, mesh->nodes, mesh->tets);
  const size_t size = (size_t)components;
  memcpy(finer, field, size * (size_t)mesh->nodes * sizeof *finer);
  for (size_t n = (size_t)mesh->nodes; n < (size_t)parents->nodes; n++)
    flesh_mesh_interpolate(mesh, parents->node_tet[n], parents->place + 4 * n, components, field, finer + size * n);
  return FLESH_OK;
}

/* Returns whether all nodes of the edge, face or tet that contains the place are chosen. */
static int is_within(const flesh_mesh *mesh, int tet, const double place[4], const uint8_t *chosen)
{
  int nodes[10], within = 1;
  const int count = flesh_mesh_tet_nodes(mesh, tet, nodes);
  for (int a = 0; a < count; a++) {
    const int *ends = flesh_edge_corners[a < 4 ? 0 : a - 4];
    const int touched = a < 4 ? place[a] > 0 : place[ends[0]] > 0 && place[ends[1]] > 0;
    within &= !touched || chosen[nodes[a]];
  }
  return within;
}

int flesh_mesh_parents_carry(const flesh_mesh *mesh, const flesh_mesh_parents *parents, flesh_mesh_sets *sets)
{
  int status = FLESH_OK;
  uint8_t *chosen = sets->count ? flesh_calloc((size_t)mesh->nodes, 1) : NULL;
  if (sets->count && !chosen) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for the sets of a mesh");
  for (int k = 0; k < sets->count; k++) {
    flesh_members *members = &sets->sets[k].nodes;
    const int own = members->count;
    for (int m = 0; m < own; m++) chosen[members->values[m]] = 1;
    for (int n = mesh->nodes; n < parents->nodes && own && !status; n++)
      if (is_within(mesh, parents->node_tet[n], parents->place + 4 * (size_t)n, chosen))
        status = flesh_members_add(members, n);
    for (int m = 0; m < own; m++) chosen[members->values[m]] = 0;
  }
  flesh_free(chosen);
  return status;
}

void flesh_mesh_parents_clear(flesh_mesh_parents *parents)
{
  if (!parents) return;
  flesh_free(parents->tet);
  flesh_free(parents->node_tet);
  flesh_free(parents->place);
  *parents = (flesh_mesh_parents){0};
}
