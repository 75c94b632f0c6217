/* gmsh2.c: $Nodes and $Elements of Gmsh's format 2.2. */
#include <string.h>

#include "mesh/gmsh.h"

/* Reads the count at the beginning of a section, which is ASCII in binary files, too. */
static int read_count(flesh_gmsh *g, const char *item, int binary_bytes, int64_t *count)
{
  g->s->item = item, g->s->index = -1, g->s->form = "a count";
  flesh_scan_next(g->s);
  int status = flesh_scan_integer(g->s, count);
  if (!status) status = flesh_scan_row_end(g->s);
  if (status) return status;
  if (g->binary) flesh_scan_skip_line(g->s);
  return flesh_gmsh_check_count(g, item, *count, 1, 8, binary_bytes);
}

int flesh_gmsh2_nodes(flesh_gmsh *g)
{
  int64_t count, tag;
  int status = read_count(g, "nodes", 28, &count);
  if (!status) status = flesh_draft_set_tagged_nodes(g->draft, (int)count);
  for (int n = 0; n < count && !status; n++) {
    flesh_gmsh_row(g, "row", n + 1, "node x y z");
    status = flesh_gmsh_int(g, &tag);
    for (int d = 0; d < 3 && !status; d++)
      status = flesh_gmsh_real(g, &g->draft->positions[3 * (size_t)n + d]);
    if (!status) status = flesh_gmsh_row_end(g);
    if (!status) status = flesh_gmsh_add_node(g, n, tag);
  }
  return status;
}

/* Returns whether a tet repeats the last one, as Gmsh writes a tet once more for each further physical group. */
static int is_last_again(flesh_gmsh *g, int64_t group, const int64_t nodes[4])
{
  const int again = g->draft->tets && group && group != g->last_group && !memcmp(g->last_nodes, nodes, sizeof g->last_nodes);
  g->last_group = group;
  memcpy(g->last_nodes, nodes, sizeof g->last_nodes);
  return again;
}

/* Reads the tags and nodes of one element; its first two tags are the physical and the elementary one. */
static int read_element(flesh_gmsh *g, int64_t tag, int64_t type, int64_t tags, int64_t where)
{
  int64_t kind[2] = {0, 0}, ignored, nodes[10];
  int status = FLESH_OK;
  for (int64_t i = 0; i < tags && !status; i++)
    status = flesh_gmsh_int(g, i < 2 ? &kind[i] : &ignored);
  if (!status) status = flesh_gmsh_check_type(g, type, tag);
  if (status) return status;
  const int set = flesh_gmsh_named(g, flesh_gmsh_type_dimension(type), kind[0]);
  if (flesh_gmsh_is_tet(type)) {
    for (int i = 0; i < flesh_gmsh_type_nodes(type) && !status; i++) status = flesh_gmsh_int(g, &nodes[i]);
    if (!status) status = flesh_gmsh_row_end(g);
    const int again = !status && is_last_again(g, kind[0], nodes);
    if (!status && set >= 0) status = flesh_members_add(&g->draft->sets.sets[set].tets, g->draft->tets - again);
    if (!status && !again)
      status = flesh_gmsh_add_tet(g, type, tag, nodes, kind[0] ? kind[0] : kind[1], where);
    return status;
  }
  g->others++;
  g->draft->solids += flesh_gmsh_type_dimension(type) == 3;
  for (int i = flesh_gmsh_type_nodes(type); (g->binary || set >= 0) && i > 0 && !status; i--) {
    status = flesh_gmsh_int(g, &ignored);
    if (!status && set >= 0) status = flesh_gmsh_add_to_set(g, set, tag, ignored);
  }
  if (!g->binary && !status) flesh_scan_skip_line(g->s);
  return status;
}

/* Reads a binary block: type, number of elements, number of tags each; then the elements. */
static int read_block(flesh_gmsh *g, int64_t left, int64_t done, int64_t *count)
{
  int64_t type, tags, tag;
  flesh_gmsh_row(g, "element", done + 1, "");
  int status = flesh_gmsh_int(g, &type);
  if (!status) status = flesh_gmsh_int(g, count);
  if (!status) status = flesh_gmsh_int(g, &tags);
  if (status) return status;
  int nodes = flesh_gmsh_type_nodes(type);
  if (!nodes)
    return flesh_gmsh_fail(g, "the element type %lld is unknown; save the mesh as ASCII or as 4.1",
                           (long long)type);
  if (*count < 1 || *count > left)
    return flesh_gmsh_fail(g, "a block has %lld elements; it must be 1 to the remaining %lld",
                           (long long)*count, (long long)left);
  if (tags < 0 || tags > 1000000)
    return flesh_gmsh_fail(g, "the number of tags is %lld; it must not be negative",
                           (long long)tags);
  status = flesh_gmsh_check_count(g, "elements", *count, 1, 1, (int)(4 * (1 + tags + nodes)));
  for (int64_t e = 0; e < *count && !status; e++) {
    int64_t where = flesh_gmsh_where(g);
    g->s->index = done + e + 1;
    status = flesh_gmsh_int(g, &tag);
    if (!status) status = read_element(g, tag, type, tags, where);
  }
  return status;
}

int flesh_gmsh2_elements(flesh_gmsh *g)
{
  int64_t count, block, tag, type, tags;
  int status = read_count(g, "elements", 8, &count);
  for (int64_t e = 0; e < count && !status; e += block) {
    if (g->binary) {
      status = read_block(g, count - e, e, &block);
      continue;
    }
    block = 1;
    flesh_gmsh_row(g, "row", e + 1, "element type tags... nodes...");
    status = flesh_gmsh_int(g, &tag);
    if (!status) status = flesh_gmsh_int(g, &type);
    if (!status) status = flesh_gmsh_int(g, &tags);
    if (!status) status = read_element(g, tag, type, tags, g->s->line);
  }
  return status;
}
