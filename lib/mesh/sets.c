/* sets.c: the named sets of a mesh, read from a file or made from those of another mesh. */
#include "mesh/sets.h"

#include <stdint.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"
#include "base/text.h"

static int no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory for the sets of a mesh"); }

int flesh_mesh_sets_find(const flesh_mesh_sets *sets, const char *name, size_t length)
{
  for (int k = 0; k < sets->count; k++)
    if (strlen(sets->sets[k].name) == length && !memcmp(sets->sets[k].name, name, length)) return k;
  return -1;
}

int flesh_mesh_sets_take(flesh_mesh_sets *sets, const char *name, size_t length, int *set)
{
  *set = flesh_mesh_sets_find(sets, name, length);
  if (*set >= 0) return FLESH_OK;
  for (size_t k = 0; k < length; k++)
    if ((unsigned char)name[k] < ' ' || name[k] == 0x7f)
      return flesh_fail(FLESH_ERR_FILE, "the name of a set has a control character (%d); letters are expected", name[k]);
  if (sets->count == FLESH_MOST_SETS)
    return flesh_fail(FLESH_ERR_FILE, "there are more than %d named sets; at most as many are supported", FLESH_MOST_SETS);
  if (!flesh_grow(&sets->sets, sizeof *sets->sets, sets->count, &sets->room)) return no_memory();
  char *copy = flesh_malloc(length + 1);
  if (!copy) return no_memory();
  memcpy(copy, name, length);
  copy[length] = 0;
  *set = sets->count++;
  sets->sets[*set] = (flesh_mesh_set){.name = copy};
  return FLESH_OK;
}

int flesh_members_add(flesh_members *members, int value)
{
  if (!flesh_grow(&members->values, sizeof *members->values, members->count, &members->room)) return no_memory();
  members->values[members->count++] = value;
  return FLESH_OK;
}

void flesh_members_settle(flesh_members *members)
{
  int kept = 0, *values = members->values, rising = 1;
  for (int k = 1; k < members->count; k++) rising &= values[k] > values[k - 1];
  if (rising) return;
  flesh_sort(values, (size_t)members->count, sizeof *values, flesh_compare_int);
  for (int k = 0; k < members->count; k++)
    if (!kept || values[k] != values[kept - 1]) values[kept++] = values[k];
  members->count = kept;
}

void flesh_mesh_sets_settle(flesh_mesh_sets *sets)
{
  for (int k = 0; k < sets->count; k++) {
    flesh_members_settle(&sets->sets[k].nodes);
    flesh_members_settle(&sets->sets[k].tets);
  }
}

void flesh_mesh_sets_clear(flesh_mesh_sets *sets)
{
  for (int k = 0; k < sets->count; k++) {
    flesh_free(sets->sets[k].name);
    flesh_free(sets->sets[k].nodes.values);
    flesh_free(sets->sets[k].tets.values);
  }
  flesh_free(sets->sets);
  *sets = (flesh_mesh_sets){0};
}

/* Appends the children of the tets in a set. */
static int append_children(flesh_members *to, const flesh_members *from, const int *first)
{
  int status = FLESH_OK;
  for (int k = 0; k < from->count; k++)
    for (int child = first[from->values[k]]; child < first[from->values[k] + 1] && !status; child++)
      status = flesh_members_add(to, child);
  return status;
}

/* Appends for each member the numbers from `first` + children * its new number on, `children` of them. */
static int append(flesh_members *to, const flesh_members *from, const int *numbers, int first, int children)
{
  int status = FLESH_OK;
  for (int k = 0; k < from->count && !status; k++) {
    const int number = numbers ? numbers[from->values[k]] : from->values[k];
    for (int child = 0; child < children && number >= 0 && !status; child++)
      status = flesh_members_add(to, first + children * number + child);
  }
  return status;
}

int flesh_mesh_sets_append(flesh_mesh_sets *to, const flesh_mesh_sets *from, const flesh_mesh_sets_map *map)
{
  int status = FLESH_OK;
  for (int k = 0; k < from->count && !status; k++) {
    const flesh_mesh_set *old = &from->sets[k];
    int set;
    status = flesh_mesh_sets_take(to, old->name, strlen(old->name), &set);
    if (!status) status = append(&to->sets[set].nodes, &old->nodes, map->nodes, map->first_node, 1);
    if (!status && map->first_children) status = append_children(&to->sets[set].tets, &old->tets, map->first_children);
    else if (!status)
      status = append(&to->sets[set].tets, &old->tets, map->tets, map->first_tet, map->children ? map->children : 1);
  }
  return status;
}

int flesh_mesh_sets_add_between(flesh_mesh_sets *sets, int from, int end, const int *ends)
{
  int status = FLESH_OK;
  if (!sets->count) return FLESH_OK;
  uint8_t *has = flesh_calloc((size_t)from, 1);
  if (!has) return no_memory();
  for (int k = 0; k < sets->count && !status; k++) {
    flesh_members *members = &sets->sets[k].nodes;
    const int own = members->count;
    for (int m = 0; m < own; m++) has[members->values[m]] = 1;
    for (int n = from; n < end && own && !status; n++)
      if (has[ends[2 * (size_t)n]] && has[ends[2 * (size_t)n + 1]]) status = flesh_members_add(members, n);
    for (int m = 0; m < own; m++) has[members->values[m]] = 0;
  }
  flesh_free(has);
  return status;
}

const char *flesh_mesh_sets_text(const flesh_mesh_sets *sets)
{
  enum { SHOWN = 12 };
  static _Thread_local char text[480];
  const int shown = sets->count < SHOWN ? sets->count : SHOWN;
  if (!sets->count) return "the mesh has no named sets";
  strcpy(text, sets->count == 1 ? "the mesh has the set" : "the mesh has the sets");
  for (int k = 0; k < shown; k++)
    flesh_text_add(text, sizeof text, "%s '%.40s'", !k ? "" : k == sets->count - 1 ? " and" : ",", sets->sets[k].name);
  if (shown < sets->count) flesh_text_add(text, sizeof text, " and %d more", sets->count - shown);
  return text;
}
