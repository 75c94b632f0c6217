/* draft.c: the growing arrays of a mesh that is being read. */
#include "mesh/draft.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/stop.h"

static int no_memory(const flesh_draft *draft, const char *what, int count)
{
  return flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory for %d %s", draft->path, count, what);
}

int flesh_draft_set_nodes(flesh_draft *draft, int nodes)
{
  draft->positions = malloc((3 * (size_t)nodes + 1) * sizeof *draft->positions);
  if (!draft->positions) return no_memory(draft, "nodes", nodes);
  draft->nodes = nodes;
  return FLESH_OK;
}

int flesh_draft_set_tagged_nodes(flesh_draft *draft, int nodes)
{
  int status = flesh_draft_set_nodes(draft, nodes);
  if (status) return status;
  draft->node_tag = calloc((size_t)nodes + 1, sizeof *draft->node_tag);
  return draft->node_tag ? FLESH_OK : no_memory(draft, "nodes", nodes);
}

int flesh_draft_tag_node(flesh_draft *draft, int index, int64_t tag)
{
  draft->node_tag[index] = tag;
  return flesh_tag_map_set(&draft->tags, tag, index);
}

static int grow(void **array, size_t bytes)
{
  void *grown = realloc(*array, bytes);
  if (grown) *array = grown;
  return grown != NULL;
}

int flesh_draft_reserve_tets(flesh_draft *draft, int size, int tets)
{
  size_t room = (size_t)tets;
  if (draft->tet_size && draft->tet_size != size)
    return flesh_fail(FLESH_ERR_FILE,
                      "%s: there are tets of %d nodes and tets of %d; all must have the same number",
                      draft->path, draft->tet_size, size);
  draft->tet_size = size;
  if (tets <= draft->tet_room) return FLESH_OK;
  if (!grow((void **)&draft->tet_nodes, 4 * room * sizeof *draft->tet_nodes) ||
      (size > 4 && !grow((void **)&draft->edge_nodes, 6 * room * sizeof *draft->edge_nodes)) ||
      !grow((void **)&draft->regions, room * sizeof *draft->regions) ||
      !grow((void **)&draft->tet_where, room * sizeof *draft->tet_where) ||
      !grow((void **)&draft->tet_tag, room * sizeof *draft->tet_tag))
    return no_memory(draft, "tets", tets);
  draft->tet_room = tets;
  return FLESH_OK;
}

int flesh_draft_add_tet(flesh_draft *draft, int size, const int *nodes, int region, int64_t where,
                        int64_t tag)
{
  int room = draft->tets + 1;
  if (draft->tets == draft->tet_room) {
    if (draft->tets > INT_MAX / 8) return no_memory(draft, "tets", draft->tets);
    room = draft->tets ? 2 * draft->tets : 64;
  }
  int status = flesh_draft_reserve_tets(draft, size, room);
  if (status) return status;
  int t = draft->tets++;
  memcpy(draft->tet_nodes + 4 * (size_t)t, nodes, 4 * sizeof *nodes);
  if (size > 4) memcpy(draft->edge_nodes + 6 * (size_t)t, nodes + 4, 6 * sizeof *nodes);
  draft->regions[t] = region;
  draft->tet_where[t] = where;
  draft->tet_tag[t] = tag;
  return flesh_stop_ask_at((size_t)t);
}

int flesh_draft_node(const flesh_draft *draft, int64_t number)
{
  if (number < draft->node_base || number - draft->node_base >= draft->nodes) return -1;
  return (int)(number - draft->node_base);
}

int flesh_draft_finish(flesh_draft *draft, flesh_mesh **mesh)
{
  flesh_mesh_origin origin = {.path = draft->path,
                              .binary = draft->binary,
                              .tet_where = draft->tet_where,
                              .tet_tag = draft->tet_tag,
                              .node_tag = draft->node_tag,
                              .node_base = draft->node_base};
  if (draft->solids)
    return flesh_fail(FLESH_ERR_FILE, "%s: solid elements that are not tets (hexahedra, prisms, pyramids): %lld; a body has "
                                      "only tets and would lack them: cut them into tets, or remove them",
                      draft->path, (long long)draft->solids);
  flesh_mesh_sets_settle(&draft->sets);
  return flesh_mesh_build(&(flesh_mesh_lists){.nodes = draft->nodes, .tets = draft->tets,
                                              .positions = draft->positions, .tet_nodes = draft->tet_nodes,
                                              .edge_nodes = draft->edge_nodes, .regions = draft->regions,
                                              .sets = &draft->sets},
                          &origin, mesh);
}

void flesh_draft_clear(flesh_draft *draft)
{
  free(draft->owned_path);
  free(draft->positions);
  free(draft->node_tag);
  flesh_tag_map_clear(&draft->tags);
  free(draft->tet_nodes);
  free(draft->edge_nodes);
  free(draft->regions);
  free(draft->tet_where);
  free(draft->tet_tag);
  flesh_mesh_sets_clear(&draft->sets);
}
