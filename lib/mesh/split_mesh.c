/* split_mesh.c: splits a mesh into the files of its parts. */
#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "base/archive.h"
#include "base/error.h"
#include "base/memory.h"
#include "mesh/inspect.h"
#include "mesh/split.h"

/* A part being cut out: the tets and nodes that it has. */
typedef struct cut {
  const flesh_mesh *mesh;
  const int *owners;
  uint8_t *has_tet; /* [tets] */
  int *number;      /* [nodes] number in the part; -1: none */
  int *tet_number;  /* [tets] number in the part; -1: none */
} cut;

static void mark_nodes(const cut *c, int tet)
{
  const int *corners = flesh_mesh_tets(c->mesh) + 4 * (size_t)tet, *edges = flesh_mesh_tet_edges(c->mesh);
  for (int k = 0; k < 4; k++) c->number[corners[k]] = 0;
  for (int k = 0; k < 6 && edges; k++)
    if (edges[6 * (size_t)tet + (size_t)k] >= 0) c->number[edges[6 * (size_t)tet + (size_t)k]] = 0;
}

/* Returns whether the tet has a node of the part. Corners suffice, as tets that share a node on an edge share the
 * edge's corners. */
static int touches(const cut *c, int tet)
{
  const int *corners = flesh_mesh_tets(c->mesh) + 4 * (size_t)tet;
  for (int k = 0; k < 4; k++)
    if (c->number[corners[k]] >= 0) return 1;
  return 0;
}

/* Chooses the part's own tets and two more layers; counts these tets and their nodes. */
static void choose(const cut *c, int part, int *tet_count, int *node_count)
{
  const int tets = flesh_mesh_tet_count(c->mesh), nodes = flesh_mesh_node_count(c->mesh);
  for (int i = 0; i < nodes; i++) c->number[i] = -1;
  for (int t = 0; t < tets; t++) c->has_tet[t] = c->owners[t] == part;
  for (int layer = 0; layer <= FLESH_SPLIT_LAYERS; layer++) {
    for (int t = 0; t < tets; t++)
      if (c->has_tet[t]) mark_nodes(c, t);
    for (int t = 0; t < tets && layer < FLESH_SPLIT_LAYERS; t++) c->has_tet[t] |= (uint8_t)touches(c, t);
  }
  *tet_count = *node_count = 0;
  for (int t = 0; t < tets; t++) c->tet_number[t] = c->has_tet[t] ? (*tet_count)++ : -1;
  for (int i = 0; i < nodes; i++)
    if (c->number[i] >= 0) c->number[i] = (*node_count)++;
}

static void fill(const cut *c, const flesh_split_arrays *a)
{
  const flesh_mesh *mesh = c->mesh;
  const int *corners = flesh_mesh_tets(mesh), *edges = flesh_mesh_tet_edges(mesh);
  for (size_t i = 0; i < (size_t)flesh_mesh_node_count(mesh); i++) {
    if (c->number[i] < 0) continue;
    a->node_numbers[c->number[i]] = (int)i;
    memcpy(a->positions + 3 * (size_t)c->number[i], flesh_mesh_positions(mesh) + 3 * i, 3 * sizeof *a->positions);
  }
  size_t to = 0;
  for (size_t t = 0; t < (size_t)flesh_mesh_tet_count(mesh); t++) {
    if (!c->has_tet[t]) continue;
    for (size_t k = 0; k < 4; k++) a->tet_nodes[4 * to + k] = c->number[corners[4 * t + k]];
    for (size_t k = 0; k < 6 && edges; k++)
      a->edge_nodes[6 * to + k] = edges[6 * t + k] < 0 ? -1 : c->number[edges[6 * t + k]];
    a->regions[to] = flesh_mesh_regions(mesh)[t];
    a->tet_numbers[to] = (int)t;
    a->owners[to++] = c->owners[t];
  }
}

static int write_part(const cut *c, flesh_split *split, const char *folder, int part)
{
  flesh_split_arrays arrays;
  flesh_split_row counts = {0};
  choose(c, part, &counts.tets, &counts.nodes);
  const int64_t members = flesh_split_count_members(&c->mesh->sets, c->number, c->tet_number);
  if (members > INT_MAX / 4) return flesh_fail(FLESH_ERR_ARGUMENT, "the sets have more than %d members", INT_MAX / 4);
  counts.members = (int)members;
  int status = flesh_split_arrays_take(&arrays, &counts, split->order);
  if (!status) {
    fill(c, &arrays);
    flesh_split_list_members(&c->mesh->sets, c->number, c->tet_number, arrays.members);
    status = flesh_split_write_part(split, folder, part, &arrays);
  }
  flesh_split_arrays_clear(&arrays);
  return status;
}

/* Returns a hash of the mesh and its parts, which distinguishes splits. */
static int64_t mark_of(const flesh_mesh *mesh, const int *owners, int parts)
{
  const size_t tets = (size_t)flesh_mesh_tet_count(mesh), nodes = (size_t)flesh_mesh_node_count(mesh);
  uint64_t sum = flesh_archive_sum(0, &parts, sizeof parts);
  sum = flesh_archive_sum(sum, owners, tets * sizeof *owners);
  sum = flesh_archive_sum(sum, flesh_mesh_tets(mesh), 4 * tets * sizeof(int));
  sum = flesh_archive_sum(sum, flesh_mesh_positions(mesh), 3 * nodes * sizeof(double));
  return (int64_t)(sum >> 1);
}

/* Fills the index except for its rows. */
static int describe(const flesh_mesh *mesh, int parts, const int *owners, flesh_split *split)
{
  int *regions = NULL;
  *split = (flesh_split){.mark = mark_of(mesh, owners, parts), .order = flesh_mesh_order(mesh),
                         .nodes = flesh_mesh_node_count(mesh), .tets = flesh_mesh_tet_count(mesh), .parts = parts};
  split->region_count = flesh_mesh_region_list(mesh, &regions);
  split->regions = flesh_malloc(((size_t)split->region_count + 1) * sizeof *split->regions);
  split->rows = flesh_calloc((size_t)parts, sizeof *split->rows);
  const int failed = !regions || !split->regions || !split->rows;
  if (!failed) memcpy(split->regions, regions, (size_t)split->region_count * sizeof *regions);
  free(regions);
  int set, status = FLESH_OK;
  for (int k = 0; k < mesh->sets.count && !status; k++)
    status = flesh_mesh_sets_take(&split->sets, mesh->sets.sets[k].name, strlen(mesh->sets.sets[k].name), &set);
  if (status) return status;
  return failed ? flesh_fail(FLESH_ERR_MEMORY, "out of memory to split a mesh of %d tets", split->tets) : FLESH_OK;
}

static int check(const flesh_mesh *mesh)
{
  int first = 0;
  if (!mesh->unused_nodes) return FLESH_OK;
  while (mesh->node_used[first]) first++;
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "the mesh has nodes that no tet uses (%d, the first is %d); a mesh that is split must have none",
                    mesh->unused_nodes, first);
}

int flesh_split_mesh(const flesh_mesh *mesh, int parts, const int *owners, const char *folder)
{
  flesh_split split = {0};
  int status = check(mesh);
  if (status) return status;
  cut c = {mesh, owners, flesh_malloc((size_t)flesh_mesh_tet_count(mesh)),
           flesh_malloc((size_t)flesh_mesh_node_count(mesh) * sizeof(int)),
           flesh_malloc((size_t)flesh_mesh_tet_count(mesh) * sizeof(int))};
  if (!c.has_tet || !c.number || !c.tet_number) status = flesh_fail(FLESH_ERR_MEMORY, "out of memory to split a mesh");
  if (!status) status = describe(mesh, parts, owners, &split);
  if (!status) status = flesh_split_begin(folder);
  for (int part = 0; part < parts && !status; part++) status = write_part(&c, &split, folder, part);
  if (!status) status = flesh_split_write_index(&split, folder);
  flesh_split_close(&split);
  flesh_free(c.has_tet);
  flesh_free(c.number);
  flesh_free(c.tet_number);
  return status;
}
