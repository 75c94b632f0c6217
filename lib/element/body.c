/* body.c: cells of tets, and checks of a body. */
#include "element/body.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "element/element.h"
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

static int check_parts(const flesh_body *body)
{
  const int tets = flesh_mesh_tet_count(body->mesh);
  if (body->part_count < 0 || (body->part_count && !body->parts))
    return flesh_fail(FLESH_ERR_ARGUMENT, "part_count is %d; parts must be an array of as many", body->part_count);
  for (int k = 0; k < body->part_count; k++) {
    const flesh_body_part *part = &body->parts[k];
    if (part->first_tet < 0 || part->tets < 0 || part->tets > tets - part->first_tet)
      return flesh_fail(FLESH_ERR_ARGUMENT, "part %d has %d tets from tet %d on; the mesh has the tets 0 to %d", k, part->tets,
                        part->first_tet, tets - 1);
    for (int i = 0; i < k; i++)
      if (part->first_tet < body->parts[i].first_tet + body->parts[i].tets &&
          body->parts[i].first_tet < part->first_tet + part->tets)
        return flesh_fail(FLESH_ERR_ARGUMENT, "the parts %d and %d have tets in common; a tet must be in one part", i, k);
  }
  return FLESH_OK;
}

int flesh_body_check(const flesh_body *body)
{
  if (!body->mesh) return flesh_fail(FLESH_ERR_ARGUMENT, "the body has no mesh");
  if (body->mass != FLESH_MASS_LUMPED && body->mass != FLESH_MASS_CONSISTENT)
    return flesh_fail(FLESH_ERR_ARGUMENT, "there is no mass number %d", (int)body->mass);
  for (int e = 0; body->materials && e < (body->tet_material ? flesh_mesh_tet_count(body->mesh) : 1); e++) {
    const int material = body->tet_material ? body->tet_material[e] : 0;
    if (material < 0) return flesh_fail(FLESH_ERR_ARGUMENT, "tet %d has material %d; materials count from 0", e, material);
    const flesh_material *m = &body->materials[material];
    if (!m->psi)
      return flesh_fail(FLESH_ERR_ARGUMENT, "material %d has no psi; it must be made by a flesh_material_from_ function", material);
    if (m->energy != FLESH_ENERGY_USER && !(m->mu > 0 && m->mu < INFINITY && fabs(m->lambda) < INFINITY))
      return flesh_fail(FLESH_ERR_ARGUMENT, "material %d has mu %g and lambda %g Pa; mu must be positive, and both finite",
                        material, m->mu, m->lambda);
  }
  const int status = flesh_body_check_element(body);
  return status ? status : check_parts(body);
}

int flesh_body_check_density(const flesh_body *body)
{
  if (!body->density) return flesh_fail(FLESH_ERR_ARGUMENT, "the body has no density");
  for (int e = 0; e < flesh_mesh_tet_count(body->mesh); e++)
    if (!(body->density[e] > 0 && body->density[e] < INFINITY))
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "the density of tet %d is %g kg/m^3; it must be positive", e,
                        body->density[e]);
  return FLESH_OK;
}
