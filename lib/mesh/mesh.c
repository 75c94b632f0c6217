/* mesh.c: makes a mesh from arrays (with every check), gives access to it and frees it. */
#include "mesh/mesh.h"

#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/stop.h"
#include "mesh/bernstein.h"
#include "mesh/split_part.h"

/* Limit of 6V/(longest edge)^3 below which a tet is flat, that is, its volume cannot be distinguished from 0. The
 * determinant 6V of edges known to half a unit in the last place has an error of about 1e-15 (longest edge)^3, ten
 * times below this. A sliver of radius ratio 1e-4 has 6V >= 1e-8 (longest edge)^3, far above. */
static const double flat_limit = 1e-14;

long long flesh_mesh_tet_label(const flesh_mesh_origin *origin, int tet)
{
  return origin ? origin->tet_tag[tet] : tet;
}

long long flesh_mesh_node_label(const flesh_mesh_origin *origin, int node)
{
  if (!origin) return node;
  return origin->node_tag ? origin->node_tag[node] : (long long)node + origin->node_base;
}

int flesh_mesh_fail_at(const flesh_mesh_origin *origin, int tet, const char *format, ...)
{
  char text[512];
  va_list args;
  va_start(args, format);
  vsnprintf(text, sizeof text, format, args);
  va_end(args);
  if (!origin) return flesh_fail(FLESH_ERR_FILE, "%s", text);
  return flesh_fail(FLESH_ERR_FILE, origin->binary ? "%s: byte %lld: %s" : "%s:%lld: %s",
                    origin->path, (long long)origin->tet_where[tet], text);
}

static double longest_edge(const double *x, const int n[4])
{
  double longest = 0;
  for (int i = 0; i < 4; i++)
    for (int j = i + 1; j < 4; j++) {
      const double *p = x + 3 * (size_t)n[i], *q = x + 3 * (size_t)n[j];
      longest = fmax(longest, hypot(hypot(p[0] - q[0], p[1] - q[1]), p[2] - q[2]));
    }
  return longest;
}

static int check_nodes(const flesh_mesh *mesh)
{
  for (int n = 0; n < mesh->nodes; n++)
    for (int d = 0; d < 3; d++)
      if (!isfinite(mesh->positions[3 * (size_t)n + d]))
        return flesh_fail(FLESH_ERR_FILE, "node %d: %c is %g; it must be a finite number", n,
                          'x' + d, mesh->positions[3 * (size_t)n + d]);
  return FLESH_OK;
}

/* Checks the tets, flips the inverted ones, fills volumes and node_used. */
static int settle_tets(flesh_mesh *mesh, const flesh_mesh_origin *origin)
{
  for (int t = 0; t < mesh->tets; t++) {
    const int status = flesh_stop_ask_at((size_t)t);
    if (status) return status;
    int *n = mesh->tet_nodes + 4 * (size_t)t;
    long long label = flesh_mesh_tet_label(origin, t);
    for (int i = 0; i < 4; i++) {
      if (n[i] < 0 || n[i] >= mesh->nodes)
        return flesh_mesh_fail_at(origin, t, "tet %lld uses node %d; the nodes are 0 to %d", label,
                                  n[i], mesh->nodes - 1);
      for (int j = 0; j < i; j++)
        if (n[i] == n[j])
          return flesh_mesh_fail_at(origin, t,
                                    "tet %lld uses node %lld twice; it must have four nodes", label,
                                    flesh_mesh_node_label(origin, n[i]));
      mesh->node_used[n[i]] = 1;
    }
    double volume = flesh_tet_volume(mesh->positions, n);
    double edge = longest_edge(mesh->positions, n), cube = edge * edge * edge;
    if (!isfinite(volume) || !isfinite(cube))
      return flesh_mesh_fail_at(origin, t,
                                "tet %lld is too large (longest edge %g m) for its volume to be a "
                                "number",
                                label, edge);
    if (6 * fabs(volume) <= flat_limit * cube)
      return flesh_mesh_fail_at(
          origin, t,
          "tet %lld (nodes %lld %lld %lld %lld) is flat: 6 * volume is %.3g "
          "m^3, and must exceed %g * (longest edge)^3 = %.3g m^3",
          label, flesh_mesh_node_label(origin, n[0]), flesh_mesh_node_label(origin, n[1]),
          flesh_mesh_node_label(origin, n[2]), flesh_mesh_node_label(origin, n[3]),
          6 * fabs(volume), flat_limit, flat_limit * cube);
    if (volume < 0) {
      int last = n[3];
      n[3] = n[2], n[2] = last;
      if (flesh_mesh_is_quadratic(mesh, t)) flesh_mesh_flip_edge_nodes(mesh->edge_nodes + 6 * (size_t)t);
      volume = flesh_tet_volume(mesh->positions, n);
      mesh->flipped++;
    }
    mesh->volumes[t] = volume;
  }
  return FLESH_OK;
}

/* Allocates a mesh of the given sizes; returns 0 when out of memory. */
static int allocate(flesh_mesh *mesh, int order, int with_ends)
{
  size_t nodes = (size_t)mesh->nodes, tets = (size_t)mesh->tets;
  mesh->positions = flesh_malloc(3 * nodes * sizeof *mesh->positions);
  mesh->tet_nodes = flesh_malloc(4 * tets * sizeof *mesh->tet_nodes);
  mesh->regions = flesh_calloc(tets, sizeof *mesh->regions);
  mesh->volumes = flesh_malloc(tets * sizeof *mesh->volumes);
  mesh->node_used = flesh_calloc(nodes, sizeof *mesh->node_used);
  mesh->curved = flesh_calloc(tets, sizeof *mesh->curved);
  if (with_ends) mesh->ends = flesh_malloc(2 * nodes * sizeof *mesh->ends);
  if (order > 1) mesh->edge_nodes = flesh_malloc(6 * tets * sizeof *mesh->edge_nodes);
  if (order > 1) mesh->jacobians = flesh_malloc(FLESH_CUBIC * tets * sizeof *mesh->jacobians);
  return mesh->positions && mesh->tet_nodes && mesh->regions && mesh->volumes && mesh->node_used &&
         mesh->curved && (!with_ends || mesh->ends) && (order == 1 || (mesh->edge_nodes && mesh->jacobians));
}

/* Lists the pieces of a mesh that has both kinds of tets. */
static int list_pieces(flesh_mesh *mesh)
{
  mesh->pieces = flesh_malloc((8 * (size_t)mesh->tets) * sizeof *mesh->pieces);
  if (!mesh->pieces) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a mesh of %d tets", mesh->tets);
  for (int t = 0; t < mesh->tets; t++)
    for (int k = 0; k < (flesh_mesh_is_quadratic(mesh, t) ? 8 : 1); k++) mesh->pieces[mesh->piece_count++] = 8 * t + k;
  return FLESH_OK;
}

/* Checks the copied arrays, and computes the rest of the mesh from them. */
static int settle(flesh_mesh *mesh, const flesh_mesh_origin *origin)
{
  int status = check_nodes(mesh);
  if (!status) status = settle_tets(mesh, origin);
  if (!status && mesh->edge_nodes) {
    status = flesh_mesh_check_edge_nodes(mesh, origin);
    if (status) return status;
    for (size_t k = 0; k < 6 * (size_t)mesh->tets; k++)
      if (mesh->edge_nodes[k] >= 0) mesh->node_used[mesh->edge_nodes[k]] = 1;
    flesh_mesh_find_curved(mesh);
    status = flesh_mesh_find_jacobians(mesh, origin);
    if (!status && mesh->linear) status = list_pieces(mesh);
  }
  for (int n = 0; n < mesh->nodes && !status; n++) mesh->unused_nodes += !mesh->node_used[n];
  return status ? status : flesh_mesh_find_surface(mesh, origin);
}

int flesh_mesh_build(const flesh_mesh_lists *lists, const flesh_mesh_origin *origin, flesh_mesh **out)
{
  const int nodes = lists->nodes, tets = lists->tets, *edge_nodes = lists->edge_nodes;
  const char *path = origin ? origin->path : "", *colon = origin ? ": " : "";
  int linear = 0;
  *out = NULL;
  for (int t = 0; edge_nodes && t < tets; t++) linear += edge_nodes[6 * (size_t)t] == -1;
  if (linear && linear == tets) edge_nodes = NULL;
  if (nodes < 1 || tets < 1)
    return flesh_fail(FLESH_ERR_FILE,
                      "%s%sthe mesh is empty (%d nodes, %d tets); it must have at least one tet",
                      path, colon, nodes, tets);
  const int most = flesh_mesh_most_tets(edge_nodes ? 2 : 1);
  if (nodes > INT_MAX / 3 || tets > most)
    return flesh_fail(FLESH_ERR_FILE,
                      "%s%sthe mesh has %d nodes and %d tets; at most %d and %d are supported",
                      path, colon, nodes, tets, INT_MAX / 3, most);
  flesh_mesh *mesh = flesh_calloc(1, sizeof *mesh);
  if (!mesh) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a mesh");
  mesh->nodes = nodes;
  mesh->tets = tets;
  mesh->linear = edge_nodes ? linear : 0;
  int status = FLESH_OK;
  if (!allocate(mesh, edge_nodes ? 2 : 1, lists->ends != NULL))
    status = flesh_fail(FLESH_ERR_MEMORY, "out of memory for a mesh of %d nodes and %d tets", nodes,
                        tets);
  if (!status) {
    memcpy(mesh->positions, lists->positions, 3 * (size_t)nodes * sizeof *mesh->positions);
    memcpy(mesh->tet_nodes, lists->tet_nodes, 4 * (size_t)tets * sizeof *mesh->tet_nodes);
    if (edge_nodes) memcpy(mesh->edge_nodes, edge_nodes, 6 * (size_t)tets * sizeof *edge_nodes);
    if (lists->ends) memcpy(mesh->ends, lists->ends, 2 * (size_t)nodes * sizeof *mesh->ends);
    if (lists->regions) memcpy(mesh->regions, lists->regions, (size_t)tets * sizeof *mesh->regions);
    status = settle(mesh, origin);
    if (!status && lists->sets) status = flesh_mesh_sets_append(&mesh->sets, lists->sets, &(flesh_mesh_sets_map){0});
  }
  if (status) flesh_mesh_destroy(&mesh);
  *out = mesh;
  return status;
}

int *flesh_mesh_add_ends(const flesh_mesh *mesh, int edges, const int *on)
{
  const size_t given = 2 * (size_t)mesh->nodes, added = 2 * (size_t)edges;
  int *ends = flesh_malloc((given + added) * sizeof *ends);
  for (size_t k = 0; ends && k < given; k++) ends[k] = mesh->ends ? mesh->ends[k] : (int)(k / 2);
  if (ends) memcpy(ends + given, on, added * sizeof *ends);
  return ends;
}

int flesh_mesh_create(int nodes, const double *positions, int tets, const int *tet_nodes,
                      const int *regions, flesh_mesh **mesh)
{
  FLESH_NEED({mesh, "mesh"});
  *mesh = NULL;
  FLESH_NEED({positions, "positions"}, {tet_nodes, "tet_nodes"});
  const int status = flesh_mesh_build(&(flesh_mesh_lists){.nodes = nodes, .tets = tets, .positions = positions,
                                                          .tet_nodes = tet_nodes, .regions = regions}, NULL, mesh);
  return status == FLESH_ERR_FILE ? FLESH_ERR_ARGUMENT : status; /* no file was read */
}

void flesh_mesh_destroy(flesh_mesh **mesh)
{
  if (!mesh || !*mesh) return;
  flesh_free((*mesh)->positions);
  flesh_free((*mesh)->tet_nodes);
  flesh_free((*mesh)->regions);
  flesh_free((*mesh)->volumes);
  flesh_free((*mesh)->ends);
  flesh_free((*mesh)->edge_nodes);
  flesh_free((*mesh)->jacobians);
  flesh_free((*mesh)->curved);
  flesh_free((*mesh)->pieces);
  flesh_free((*mesh)->surface);
  flesh_free((*mesh)->surface_tets);
  flesh_free((*mesh)->node_used);
  flesh_free((*mesh)->marks);
  flesh_mesh_sets_clear(&(*mesh)->sets);
  flesh_split_part_destroy((*mesh)->split);
  flesh_free(*mesh);
  *mesh = NULL;
}

int flesh_mesh_check_counts(const flesh_mesh *mesh, const char *kind, const char *name, int nodes, int tets)
{
  return mesh->nodes == nodes && mesh->tets == tets
             ? FLESH_OK
             : flesh_fail(FLESH_ERR_ARGUMENT,
                          "%s%s%s is made for a mesh of %d nodes and %d tets; this mesh has %d nodes and %d tets", kind,
                          *name ? " " : "", name, nodes, tets, mesh->nodes, mesh->tets);
}

int flesh_mesh_node_count(const flesh_mesh *mesh) { return mesh->nodes; }
int flesh_mesh_tet_count(const flesh_mesh *mesh) { return mesh->tets; }
const double *flesh_mesh_positions(const flesh_mesh *mesh) { return mesh->positions; }
const int *flesh_mesh_tets(const flesh_mesh *mesh) { return mesh->tet_nodes; }
int flesh_mesh_order(const flesh_mesh *mesh) { return mesh->edge_nodes ? 2 : 1; }
const int *flesh_mesh_tet_edges(const flesh_mesh *mesh) { return mesh->edge_nodes; }
const uint8_t *flesh_mesh_tet_curved(const flesh_mesh *mesh) { return mesh->curved; }
const int *flesh_mesh_regions(const flesh_mesh *mesh) { return mesh->regions; }
const double *flesh_mesh_tet_volumes(const flesh_mesh *mesh) { return mesh->volumes; }
int flesh_mesh_set_count(const flesh_mesh *mesh) { return mesh->sets.count; }

flesh_named_set flesh_mesh_set_at(const flesh_mesh *mesh, int index)
{
  const flesh_mesh_set *set = &mesh->sets.sets[index];
  return (flesh_named_set){.name = set->name, .node_count = set->nodes.count, .tet_count = set->tets.count,
                           .nodes = set->nodes.values, .tets = set->tets.values};
}

const uint8_t *flesh_mesh_node_used(const flesh_mesh *mesh) { return mesh->node_used; }

void flesh_mesh_use_node(flesh_mesh *mesh, int node)
{
  mesh->unused_nodes -= !mesh->node_used[node];
  mesh->node_used[node] = 1;
}

const int *flesh_mesh_surface_tets(const flesh_mesh *mesh) { return mesh->surface_tets; }

const int *flesh_mesh_surface(const flesh_mesh *mesh, int *count)
{
  *count = mesh->triangles;
  return mesh->surface;
}
