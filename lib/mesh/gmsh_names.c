/* gmsh_names.c: $PhysicalNames of Gmsh's formats: names of groups of points, curves, surfaces and volumes. */
#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "mesh/gmsh.h"

/* Returns one number for a dimension, 0 to 3, and a tag of 32 bits. */
static int64_t key_of(int64_t dimension, int64_t tag) { return 4 * tag + dimension; }

static int fits(int64_t dimension, int64_t tag)
{
  return dimension >= 0 && dimension <= 3 && tag >= INT_MIN && tag <= INT_MAX;
}

int flesh_gmsh_named(const flesh_gmsh *g, int dimension, int64_t tag)
{
  int set;
  return fits(dimension, tag) && flesh_tag_map_find(&g->names, key_of(dimension, tag), &set) ? set : -1;
}

int flesh_gmsh_group(const flesh_gmsh *g, int64_t dimension, int64_t entity)
{
  int group;
  return fits(dimension, entity) && flesh_tag_map_find(&g->entities, key_of(dimension, entity), &group) ? group : -1;
}

int flesh_gmsh_join_group(flesh_gmsh *g, int dimension, int64_t entity, int64_t tag)
{
  const int set = flesh_gmsh_named(g, dimension, tag);
  if (set < 0 || !fits(dimension, entity)) return FLESH_OK;
  if (!flesh_grow(&g->groups, sizeof *g->groups, g->group_count, &g->group_room))
    return flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory for more than %d groups", g->s->path, g->group_count);
  const int next = flesh_gmsh_group(g, dimension, entity);
  for (int k = next; k >= 0; k = g->groups[k].next)
    if (g->groups[k].set == set) return FLESH_OK; /* the entity is in this group already */
  g->groups[g->group_count] = (struct flesh_gmsh_group){set, next};
  const int there = flesh_tag_map_set(&g->entities, key_of(dimension, entity), g->group_count++);
  return there < 0 ? there : FLESH_OK;
}

int flesh_gmsh_add_to_set(flesh_gmsh *g, int set, int64_t element, int64_t node_tag)
{
  int node;
  if (!flesh_tag_map_find(&g->draft->tags, node_tag, &node))
    return flesh_gmsh_fail(g, "element %lld uses node %lld, which is not among the %d of $Nodes", (long long)element,
                           (long long)node_tag, g->draft->nodes);
  return flesh_members_add(&g->draft->sets.sets[set].nodes, node);
}

/* Reads a row `dimension tag "name"`. */
static int read_name(flesh_gmsh *g)
{
  flesh_scanner *s = g->s;
  int64_t dimension, tag = 0;
  int set, status = flesh_scan_integer(s, &dimension);
  if (!status) status = flesh_scan_integer(s, &tag);
  if (status) return status;
  if (!fits(dimension, tag))
    return flesh_scan_fail(s, "the physical group has dimension %lld and tag %lld; the dimension must be 0 to 3, the tag "
                              "must fit into 32 bits", (long long)dimension, (long long)tag);
  const char *line_end = memchr(s->at, '\n', (size_t)(s->end - s->at)), *end = line_end ? line_end : s->end;
  if (!flesh_scan_next_in_line(s) || *s->at != '"')
    return flesh_scan_fail(s, "a physical group has no name; `%s` is expected", s->form);
  const char *name = s->at + 1, *quote = memchr(name, '"', (size_t)(end - name));
  if (!quote || quote == name) return flesh_scan_fail(s, "the name of a physical group is empty or does not end with \"");
  status = flesh_mesh_sets_take(&g->draft->sets, name, (size_t)(quote - name), &set);
  if (status) return flesh_fail_within(status, "%s:%lld: ", s->path, (long long)s->line);
  s->at = quote + 1;
  const int there = flesh_tag_map_set(&g->names, key_of(dimension, tag), set);
  if (there > 0) return flesh_scan_fail(s, "the physical group %lld of dimension %lld is named twice", (long long)tag,
                                        (long long)dimension);
  return there ? there : flesh_scan_row_end(s);
}

int flesh_gmsh_physical_names(flesh_gmsh *g)
{
  flesh_scanner *s = g->s;
  int count;
  s->form = "a count";
  flesh_scan_next(s);
  int status = flesh_scan_count(s, "number of physical names", 0, 6, &count);
  if (!status) status = flesh_scan_row_end(s);
  for (int k = 0; k < count && !status; k++) {
    s->item = "physical name", s->index = k + 1, s->form = "dimension tag \"name\"";
    flesh_scan_next(s);
    status = read_name(g);
  }
  return status;
}

void flesh_gmsh_clear_names(flesh_gmsh *g)
{
  flesh_tag_map_clear(&g->names);
  flesh_tag_map_clear(&g->entities);
  free(g->groups);
}
