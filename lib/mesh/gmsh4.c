/* gmsh4.c: $Entities, $Nodes and $Elements of Gmsh's format 4.1. */
#include <limits.h>

#include "base/error.h"
#include "mesh/gmsh.h"

/* Reads a list: its length, then as many ints, of which only the first is returned. */
static int read_list(flesh_gmsh *g, const char *item, int64_t *count, int64_t *first)
{
  int64_t ignored;
  int status = flesh_gmsh_size(g, count);
  if (!status) status = flesh_gmsh_check_count(g, item, *count, 0, 2, 4);
  for (int64_t i = 0; i < *count && !status; i++) status = flesh_gmsh_int(g, i ? &ignored : first);
  return status;
}

/* Records the region of a volume: its first physical tag, or else, for a part of a partitioned mesh, the tag of its
 * parent volume. */
static int read_entity(flesh_gmsh *g, int dimension, int partitioned)
{
  int64_t tag, parent[2] = {0, 0}, physicals = 0, physical = 0, region = 0, count, ignored;
  double corner;
  int status = flesh_gmsh_int(g, &tag);
  for (int i = 0; i < 2 && partitioned && !status; i++) status = flesh_gmsh_int(g, &parent[i]);
  if (partitioned && !status) status = read_list(g, "partitions of an entity", &count, &ignored);
  for (int i = 0; i < (dimension ? 6 : 3) && !status; i++) status = flesh_gmsh_real(g, &corner);
  if (!status) status = flesh_gmsh_size(g, &physicals);
  if (!status) status = flesh_gmsh_check_count(g, "physical tags of an entity", physicals, 0, 2, 4);
  for (int64_t i = 0; i < physicals && !status; i++) {
    status = flesh_gmsh_int(g, &physical);
    if (physical >= -INT_MAX && flesh_gmsh_named(g, dimension, -physical) >= 0)
      physical = -physical; /* a negative tag is the named group with reversed orientation */
    if (!i) region = physical;
    if (!status) status = flesh_gmsh_join_group(g, dimension, tag, physical);
  }
  if (dimension && !status) status = read_list(g, "boundaries of an entity", &count, &ignored);
  if (status || dimension < 3) return status;
  if (!physicals && parent[0] != 3) return FLESH_OK;
  if (!physicals) region = parent[1];
  if (region < INT_MIN || region > INT_MAX)
    return flesh_gmsh_fail(g, "the physical tag %lld of volume %lld does not fit into 32 bits",
                           (long long)region, (long long)tag);
  status = flesh_tag_map_set(&g->volumes, tag, (int)region);
  return status < 0 ? status : FLESH_OK;
}

int flesh_gmsh4_entities(flesh_gmsh *g, int partitioned)
{
  int64_t count[4], ignored;
  int status = FLESH_OK;
  g->s->free_rows = 1;
  flesh_gmsh_row(g, "entity", 0, "points curves surfaces volumes");
  if (partitioned) {
    status = flesh_gmsh_size(g, &ignored);
    if (!status) status = flesh_gmsh_size(g, &count[0]);
    if (!status) status = flesh_gmsh_check_count(g, "ghost entities", count[0], 0, 4, 8);
    for (int64_t i = 0; !status && i < 2 * count[0]; i++) status = flesh_gmsh_int(g, &ignored);
  }
  for (int d = 0; d < 4 && !status; d++) {
    status = flesh_gmsh_size(g, &count[d]);
    if (!status)
      status = flesh_gmsh_check_count(g, "entities", count[d], 0, d ? 18 : 10, d ? 68 : 36);
  }
  int64_t index = 0;
  for (int d = 0; d < 4 && !status; d++)
    for (int64_t e = 0; e < count[d] && !status; e++) {
      flesh_gmsh_row(g, "entity", ++index, "tag box physical-tags boundary");
      status = read_entity(g, d, partitioned);
    }
  g->s->free_rows = 0;
  return status;
}

/* Reads the four sizes before the blocks: blocks, items, smallest and largest tag. */
static int read_head(flesh_gmsh *g, const char *item, int64_t *blocks, int64_t *count)
{
  int64_t ignored;
  flesh_gmsh_row(g, item, 0, "blocks count smallest-tag largest-tag");
  int status = flesh_gmsh_size(g, blocks);
  if (!status) status = flesh_gmsh_size(g, count);
  for (int i = 0; i < 2 && !status; i++) status = flesh_gmsh_size(g, &ignored);
  if (!status) status = flesh_gmsh_row_end(g);
  if (!status) status = flesh_gmsh_check_count(g, "blocks", *blocks, 1, 8, 20);
  return status;
}

/* Reads the line of a block: dimension, entity, a third int, number of items. */
static int read_block_head(flesh_gmsh *g, const char *item, int64_t done, int64_t left,
                           int64_t head[3], int64_t *count)
{
  flesh_gmsh_row(g, item, done + 1, "dimension entity kind count");
  int status = FLESH_OK;
  for (int i = 0; i < 3 && !status; i++) status = flesh_gmsh_int(g, &head[i]);
  if (!status) status = flesh_gmsh_size(g, count);
  if (!status) status = flesh_gmsh_row_end(g);
  if (!status && (*count < 0 || *count > left))
    status = flesh_gmsh_fail(g, "a block has %lld %ss; it must be 0 to the remaining %lld",
                             (long long)*count, item, (long long)left);
  return status;
}

int flesh_gmsh4_nodes(flesh_gmsh *g)
{
  int64_t blocks, nodes, head[3], count, tag, done = 0;
  double ignored;
  int status = read_head(g, "node", &blocks, &nodes);
  if (!status) status = flesh_gmsh_check_count(g, "nodes", nodes, 1, 8, 32);
  if (!status) status = flesh_draft_set_tagged_nodes(g->draft, (int)nodes);
  for (int64_t b = 0; b < blocks && !status; b++, done += count) {
    status = read_block_head(g, "node", done, nodes - done, head, &count);
    if (!status && (head[0] < 0 || head[0] > 3))
      status = flesh_gmsh_fail(g, "a block of nodes has dimension %lld; it must be 0 to 3",
                               (long long)head[0]);
    for (int64_t n = done; !status && n < done + count; n++) {
      flesh_gmsh_row(g, "node", n + 1, "tag");
      status = flesh_gmsh_size(g, &tag);
      if (!status) status = flesh_gmsh_row_end(g);
      if (!status) status = flesh_gmsh_add_node(g, (int)n, tag);
    }
    for (int64_t n = done; !status && n < done + count; n++) {
      flesh_gmsh_row(g, "node", g->draft->node_tag[n], "x y z");
      for (int d = 0; d < 3 && !status; d++)
        status = flesh_gmsh_real(g, &g->draft->positions[3 * n + d]);
      for (int d = 0; head[2] && d < head[0] && !status; d++) status = flesh_gmsh_real(g, &ignored);
      if (!status) status = flesh_gmsh_row_end(g);
    }
  }
  if (!status && done != nodes)
    status = flesh_gmsh_fail(g, "the blocks hold %lld nodes, but $Nodes says %lld", (long long)done,
                             (long long)nodes);
  return status;
}

/* Adds the nodes of a block's elements to the sets of its entity. */
static int read_members(flesh_gmsh *g, int64_t type, int64_t count, int group)
{
  const int size = flesh_gmsh_type_nodes(type);
  if (!size)
    return flesh_gmsh_fail(g, "the element type %lld is unknown; its nodes cannot be put into the set '%s'",
                           (long long)type, g->draft->sets.sets[g->groups[group].set].name);
  int status = flesh_gmsh_check_count(g, "elements", count, 0, 2 + 2 * size, 8 * (1 + size));
  for (int64_t e = 0; e < count && !status; e++) {
    int64_t tag, node;
    flesh_gmsh_row(g, "element", e + 1, "tag nodes...");
    status = flesh_gmsh_size(g, &tag);
    for (int i = 0; i < size && !status; i++) {
      status = flesh_gmsh_size(g, &node);
      for (int k = group; k >= 0 && !status; k = g->groups[k].next)
        status = flesh_gmsh_add_to_set(g, g->groups[k].set, tag, node);
    }
    if (!status) status = flesh_gmsh_row_end(g);
  }
  return status;
}

static int skip_elements(flesh_gmsh *g, int64_t type, int64_t count, int group)
{
  g->others += count;
  if (group >= 0) return read_members(g, type, count, group);
  if (!g->binary) {
    for (int64_t e = 0; e < count && flesh_scan_next(g->s); e++) flesh_scan_skip_line(g->s);
    return FLESH_OK;
  }
  int bytes = 8 * (1 + flesh_gmsh_type_nodes(type));
  if (bytes == 8)
    return flesh_gmsh_fail(g, "the element type %lld is unknown; save the mesh as ASCII",
                           (long long)type);
  int status = flesh_gmsh_check_count(g, "elements", count, 0, 1, bytes);
  if (!status) flesh_gmsh_skip_bytes(g, count * bytes);
  return status;
}

/* Adds the next tet to the sets of its entity. */
static int add_to_sets(flesh_gmsh *g, int group)
{
  int status = FLESH_OK;
  for (int k = group; k >= 0 && !status; k = g->groups[k].next)
    status = flesh_members_add(&g->draft->sets.sets[g->groups[k].set].tets, g->draft->tets);
  return status;
}

/* Reads a block of tets; `kind` is its region. */
static int read_tets(flesh_gmsh *g, int64_t type, int64_t count, int64_t done, int64_t kind, int group)
{
  const int size = flesh_gmsh_type_nodes(type);
  int64_t tag, nodes[10];
  int status = flesh_gmsh_check_count(g, "tets", count, 0, 2 + 2 * size, 8 * (1 + size));
  if (!status && !g->draft->tets && count) status = flesh_draft_reserve_tets(g->draft, size, (int)count);
  for (int64_t e = 0; e < count && !status; e++) {
    flesh_gmsh_row(g, "element", done + e + 1, size == 4 ? "tag a b c d" : "tag a b c d ab bc ac ad cd bd");
    int64_t where = flesh_gmsh_where(g);
    status = flesh_gmsh_size(g, &tag);
    for (int i = 0; i < size && !status; i++) status = flesh_gmsh_size(g, &nodes[i]);
    if (!status) status = flesh_gmsh_row_end(g);
    if (!status) status = add_to_sets(g, group);
    if (!status) status = flesh_gmsh_add_tet(g, type, tag, nodes, kind, where);
  }
  return status;
}

int flesh_gmsh4_elements(flesh_gmsh *g)
{
  int64_t blocks, elements, head[3], count, done = 0;
  int status = read_head(g, "element", &blocks, &elements);
  if (!status) status = flesh_gmsh_check_count(g, "elements", elements, 1, 4, 16);
  for (int64_t b = 0; b < blocks && !status; b++, done += count) {
    status = read_block_head(g, "element", done, elements - done, head, &count);
    if (!status && count) status = flesh_gmsh_check_type(g, head[2], done + 1);
    if (status) return status;
    const int group = flesh_gmsh_group(g, head[0], head[1]);
    if (!flesh_gmsh_is_tet(head[2])) {
      status = skip_elements(g, head[2], count, group);
      g->draft->solids += head[0] == 3 ? count : 0;
      continue;
    }
    int region;
    int64_t kind = flesh_tag_map_find(&g->volumes, head[1], &region) ? region : head[1];
    status = read_tets(g, head[2], count, done, kind, group);
  }
  if (!status && done != elements)
    status = flesh_gmsh_fail(g, "the blocks hold %lld elements, but $Elements says %lld",
                             (long long)done, (long long)elements);
  return status;
}
