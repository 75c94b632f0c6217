/* split_read.c: reads a split mesh: the mesh of a part, or the whole. */
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "mesh/split.h"

/* Moves the arrays' numbers in the whole to the part's mesh. */
static int attach(const flesh_split *split, int part, flesh_split_arrays *a, flesh_mesh *mesh)
{
  flesh_split_part *self = flesh_calloc(1, sizeof *self);
  int *regions = flesh_malloc((size_t)split->region_count * sizeof *regions);
  if (!self || !regions) {
    flesh_free(self);
    flesh_free(regions);
    return flesh_no_memory_for(split->path);
  }
  memcpy(regions, split->regions, (size_t)split->region_count * sizeof *regions);
  *self = (flesh_split_part){.parts = split->parts, .part = part, .whole_nodes = split->nodes, .whole_tets = split->tets,
                             .nodes = a->node_numbers, .tets = a->tet_numbers, .owners = a->owners,
                             .region_count = split->region_count, .regions = regions, .found = -1};
  a->node_numbers = a->tet_numbers = a->owners = NULL;
  mesh->split = self;
  return FLESH_OK;
}

int flesh_split_read_part(const flesh_split *split, int part, flesh_mesh **mesh)
{
  flesh_split_arrays a;
  flesh_mesh_sets sets = {0};
  *mesh = NULL;
  int status = flesh_split_load_part(split, part, &a);
  if (!status) status = flesh_split_take_sets(split, part, &a, &sets);
  if (!status) {
    status = flesh_mesh_build(&(flesh_mesh_lists){.nodes = a.nodes, .tets = a.tets, .positions = a.positions,
                                                  .tet_nodes = a.tet_nodes, .edge_nodes = a.edge_nodes,
                                                  .regions = a.regions, .sets = &sets}, NULL, mesh);
    if (status) flesh_fail_within(status, "%s: part %d: ", split->path, part);
  }
  if (!status && ((*mesh)->flipped || (*mesh)->unused_nodes))
    status = flesh_fail(FLESH_ERR_FILE, "%s: part %d is inconsistent; split the mesh again", split->path, part);
  if (!status) status = attach(split, part, &a, *mesh);
  flesh_split_arrays_clear(&a);
  flesh_mesh_sets_clear(&sets);
  if (status) flesh_mesh_destroy(mesh);
  return status;
}

/* The whole mesh while its parts are read, with the numbers of the whole. */
typedef struct whole {
  double *positions;
  int *tet_nodes, *edge_nodes, *regions; /* tet_nodes[4 t] is -1 until a part has tet t */
  uint8_t *node_known;
  int tets, nodes; /* tets and nodes read so far */
  flesh_mesh_sets sets;
} whole;

static int open_whole(const flesh_split *split, whole *w)
{
  const size_t nodes = (size_t)split->nodes, tets = (size_t)split->tets;
  *w = (whole){.positions = flesh_malloc(3 * nodes * sizeof *w->positions),
               .tet_nodes = flesh_malloc(4 * tets * sizeof *w->tet_nodes),
               .edge_nodes = split->order == 2 ? flesh_malloc(6 * tets * sizeof *w->edge_nodes) : NULL,
               .regions = flesh_malloc(tets * sizeof *w->regions),
               .node_known = flesh_calloc(nodes, 1)};
  if (!w->positions || !w->tet_nodes || (split->order == 2 && !w->edge_nodes) || !w->regions || !w->node_known)
    return flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory for a mesh of %d nodes and %d tets", split->path, split->nodes,
                      split->tets);
  for (size_t t = 0; t < tets; t++) w->tet_nodes[4 * t] = -1;
  return FLESH_OK;
}

static void close_whole(whole *w)
{
  flesh_free(w->positions);
  flesh_free(w->tet_nodes);
  flesh_free(w->edge_nodes);
  flesh_free(w->regions);
  flesh_free(w->node_known);
  flesh_mesh_sets_clear(&w->sets);
}

static int number_of(whole *w, const flesh_split_arrays *a, int local)
{
  const int node = local < 0 ? -1 : a->node_numbers[local];
  if (node < 0 || w->node_known[node]) return node;
  memcpy(w->positions + 3 * (size_t)node, a->positions + 3 * (size_t)local, 3 * sizeof *a->positions);
  w->node_known[node] = 1;
  w->nodes++;
  return node;
}

static int add_part(const flesh_split *split, int part, whole *w)
{
  flesh_split_arrays a;
  flesh_mesh_sets sets = {0};
  int status = flesh_split_load_part(split, part, &a);
  for (size_t t = 0; !status && t < (size_t)a.tets; t++) {
    const size_t tet = (size_t)a.tet_numbers[t];
    if (a.owners[t] != part) continue;
    if (w->tet_nodes[4 * tet] >= 0) {
      status = flesh_fail(FLESH_ERR_FILE, "%s: part %d has tet %zu, which is another's already; split the mesh again",
                          split->path, part, tet);
      break;
    }
    for (size_t k = 0; k < 4; k++) w->tet_nodes[4 * tet + k] = number_of(w, &a, a.tet_nodes[4 * t + k]);
    for (size_t k = 0; k < 6 && a.edge_nodes; k++)
      w->edge_nodes[6 * tet + k] = number_of(w, &a, a.edge_nodes[6 * t + k]);
    w->regions[tet] = a.regions[t];
    w->tets++;
  }
  if (!status) status = flesh_split_take_sets(split, part, &a, &sets);
  if (!status)
    status = flesh_mesh_sets_append(&w->sets, &sets, &(flesh_mesh_sets_map){.nodes = a.node_numbers, .tets = a.tet_numbers});
  flesh_mesh_sets_clear(&sets);
  flesh_split_arrays_clear(&a);
  return status;
}

int flesh_split_read_whole(const flesh_split *split, flesh_mesh **mesh)
{
  whole w = {0};
  *mesh = NULL;
  int status = flesh_split_check_files(split); /* wrong counts in the index must not take memory */
  if (!status) status = open_whole(split, &w);
  for (int part = 0; part < split->parts && !status; part++) status = add_part(split, part, &w);
  if (!status && (w.nodes != split->nodes || w.tets != split->tets))
    status = flesh_fail(FLESH_ERR_FILE, "%s: the parts have %d of %d nodes and %d of %d tets; split the mesh again",
                        split->path, w.nodes, split->nodes, w.tets, split->tets);
  flesh_mesh_sets_settle(&w.sets);
  if (!status) {
    status = flesh_mesh_build(&(flesh_mesh_lists){.nodes = split->nodes, .tets = split->tets, .positions = w.positions,
                                                  .tet_nodes = w.tet_nodes, .edge_nodes = w.edge_nodes,
                                                  .regions = w.regions, .sets = &w.sets}, NULL, mesh);
    if (status) flesh_fail_within(status, "%s: ", split->path);
  }
  close_whole(&w);
  return status;
}
