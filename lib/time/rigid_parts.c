/* rigid_parts.c: finds connected nodes, also over ranks, and their masses. */
#include <stdlib.h>
#include <string.h>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "effect/effect.h"
#include "mesh/pieces.h"
#include "parallel/connected.h"
#include "system/one_effect.h"
#include "system/ranks.h"
#include "time/rigid_guess.h"

/* Finds the mass of every node as the force that a unit acceleration takes; 1 without inertia. `room` [6*nodes] is
 * zeros. */
static void weigh(const flesh_system *system, double *room, double *mass)
{
  const flesh_mesh *mesh = flesh_system_mesh(system);
  const int nodes = flesh_mesh_node_count(mesh);
  double *a = room, *r = room + 3 * (size_t)nodes;
  for (int i = 0; i < nodes; i++) a[3 * i] = mass[i] = 1;
  const flesh_point point = flesh_point_at(0, flesh_mesh_positions(mesh), a, a);
  const unsigned inertia = FLESH_ROLE_BIT(FLESH_ROLE_INERTIA);
  if (flesh_system_has_role(system, FLESH_ROLE_INERTIA) && !flesh_system_roles_residual(system, inertia, &point, r))
    for (int i = 0; i < nodes; i++) mass[i] = r[3 * i];
}

/* Numbers the parts of this mesh in the order of their least nodes; nodes of no tet get -1. Returns the number of
 * parts. `parent` [nodes] is room. */
static int number_parts(const flesh_mesh *mesh, int *parent, int *part)
{
  const int nodes = flesh_mesh_node_count(mesh);
  int count = 0;
  for (int i = 0; i < nodes; i++) parent[i] = i, part[i] = -1;
  for (int e = 0; e < flesh_mesh_tet_count(mesh); e++) {
    int tet[10], size = flesh_mesh_tet_nodes(mesh, e, tet);
    for (int a = 0; a < size; a++) part[tet[a]] = 0;
    for (int a = 1; a < size; a++) flesh_sets_join(parent, tet[0], tet[a]);
  }
  for (int i = 0; i < nodes; i++) /* the least of a set stands for it */
    if (part[i] >= 0) part[i] = flesh_set_of(parent, i) == i ? count++ : part[flesh_set_of(parent, i)];
  return count;
}

/* Lists the nodes of each part, ascending. */
static void list_nodes(int nodes, flesh_rigid_parts *parts)
{
  for (int i = 0; i < nodes; i++)
    if (parts->part[i] >= 0) parts->first[parts->part[i] + 2]++;
  for (int k = 0; k < parts->count; k++) parts->first[k + 2] += parts->first[k + 1];
  for (int i = 0; i < nodes; i++)
    if (parts->part[i] >= 0) parts->nodes[parts->first[parts->part[i] + 1]++] = i;
}

static int no_memory(size_t nodes)
{
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for the parts of %zu nodes", nodes);
}

int flesh_rigid_parts_create(const flesh_system *system, int status, flesh_rigid_parts *parts)
{
  const flesh_mesh *mesh = flesh_system_mesh(system);
  const flesh_team *team = flesh_system_team(system);
  const size_t nodes = (size_t)flesh_mesh_node_count(mesh);
  int *parent = malloc((nodes + 1) * sizeof *parent);
  double *room = calloc(7 * nodes + (size_t)(team ? team->ranks : 0) + 1, sizeof *room);
  *parts = (flesh_rigid_parts){.nodes = malloc((nodes + 1) * sizeof(int)),
                               .mass = malloc((nodes + 1) * sizeof(double)),
                               .mesh = mesh,
                               .team = team,
                               .own = team ? team->own : (int)nodes,
                               .part = malloc((nodes + 1) * sizeof(int))};
  const int enough = parent && room && parts->nodes && parts->mass && parts->part;
  if (!status && !enough) status = no_memory(nodes);
  status = flesh_team_agree(team, status);
  if (!status) parts->count = number_parts(mesh, parent, parts->part);
  if (!status && team) parts->count = flesh_connected_unite(team, parts->count, room + 6 * nodes, parts->part);
  if (parts->count < 0) status = no_memory(nodes);
  if (!status) {
    parts->first = calloc((size_t)parts->count + 2, sizeof *parts->first);
    parts->extent = malloc(((size_t)parts->count + 1) * sizeof *parts->extent);
    parts->constrained = calloc(3 * nodes + 1, 1);
    if (!parts->first || !parts->extent || !parts->constrained) status = no_memory(nodes);
    status = flesh_team_agree(team, status);
  }
  if (!status) {
    list_nodes((int)nodes, parts);
    weigh(system, room, parts->mass);
    double centre[3];
    for (int p = 0; p < parts->count; p++)
      parts->extent[p] = flesh_rigid_parts_extent(parts, p, flesh_mesh_positions(mesh), centre);
  } else {
    flesh_rigid_parts_clear(parts);
  }
  free(parent);
  free(room);
  return status;
}

void flesh_rigid_parts_clear(flesh_rigid_parts *parts)
{
  free(parts->first);
  free(parts->nodes);
  free(parts->mass);
  free(parts->part);
  free(parts->extent);
  free(parts->constrained);
  *parts = (flesh_rigid_parts){0};
}
