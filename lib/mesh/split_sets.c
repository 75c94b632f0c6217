/* split_sets.c: the named sets of a split mesh. The index has their names; a part has for each set, in that order, the
 * number of its nodes and of its tets in the set, then these nodes and these tets. */
#include "base/error.h"
#include "mesh/split.h"

/* Lists the members that the part has, in its numbers, at *to unless that is NULL. Returns their number. */
static int list(const flesh_members *members, const int *numbers, int **to)
{
  int found = 0;
  for (int k = 0; k < members->count; k++) {
    const int own = numbers[members->values[k]];
    if (own < 0) continue;
    if (to) *(*to)++ = own;
    found++;
  }
  return found;
}

int64_t flesh_split_count_members(const flesh_mesh_sets *sets, const int *nodes, const int *tets)
{
  int64_t count = 0;
  for (int k = 0; k < sets->count; k++)
    count += 2 + list(&sets->sets[k].nodes, nodes, NULL) + (int64_t)list(&sets->sets[k].tets, tets, NULL);
  return count;
}

void flesh_split_list_members(const flesh_mesh_sets *sets, const int *nodes, const int *tets, int *members)
{
  for (int k = 0; k < sets->count; k++) {
    int *counts = members;
    members += 2;
    counts[0] = list(&sets->sets[k].nodes, nodes, &members);
    counts[1] = list(&sets->sets[k].tets, tets, &members);
  }
}

/* Adds the next `count` numbers of the list, which must be rising and in 0 <= number < end. */
static int take(const flesh_split_arrays *a, int *at, int count, int end, flesh_members *members)
{
  int status = FLESH_OK;
  if (count < 0 || count > a->member_count - *at) return FLESH_ERR_FILE;
  for (int k = 0; k < count && !status; k++) {
    const int number = a->members[(*at)++];
    if (number < 0 || number >= end || (k && number <= members->values[members->count - 1])) return FLESH_ERR_FILE;
    status = flesh_members_add(members, number);
  }
  return status;
}

int flesh_split_take_sets(const flesh_split *split, int part, const flesh_split_arrays *a, flesh_mesh_sets *sets)
{
  int at = 0, set, status = flesh_mesh_sets_append(sets, &split->sets, &(flesh_mesh_sets_map){0});
  for (set = 0; set < sets->count && !status; set++) {
    if (a->member_count - at < 2) status = FLESH_ERR_FILE;
    if (status) break;
    const int nodes = a->members[at], tets = a->members[at + 1];
    at += 2;
    status = take(a, &at, nodes, a->nodes, &sets->sets[set].nodes);
    if (!status) status = take(a, &at, tets, a->tets, &sets->sets[set].tets);
  }
  if (!status && at != a->member_count) status = FLESH_ERR_FILE;
  return status == FLESH_ERR_FILE ? flesh_fail(status, "%s: the sets of part %d are inconsistent; split the mesh again",
                                               split->path, part)
                                  : status;
}
