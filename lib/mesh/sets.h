/* sets.h: the named sets of a mesh: nodes, tets, or both under one name. */
#ifndef FLESH_MESH_SETS_H
#define FLESH_MESH_SETS_H

#include <stddef.h>

/* Indices from 0; in rising order once the sets are settled (flesh_mesh_sets_settle). */
typedef struct flesh_members {
  int *values; /* [count] */
  int count, room;
} flesh_members;

typedef struct flesh_mesh_set {
  char *name;
  flesh_members nodes, tets;
} flesh_mesh_set;

/* The sets of a mesh; zero-initialised there are none. */
typedef struct flesh_mesh_sets {
  int count, room;
  flesh_mesh_set *sets; /* [count] in the order in which they were added */
} flesh_mesh_sets;

enum { FLESH_MOST_SETS = 4096 };

/* Finds the index of the set with this name of `length` bytes; makes the set if there is none. FLESH_ERR_FILE for more
 * than FLESH_MOST_SETS sets and for control characters in the name, FLESH_ERR_MEMORY. */
int flesh_mesh_sets_take(flesh_mesh_sets *sets, const char *name, size_t length, int *set);
/* Returns the index of the set with this name; -1: there is none. */
int flesh_mesh_sets_find(const flesh_mesh_sets *sets, const char *name, size_t length);
/* Adds a member. FLESH_ERR_MEMORY. */
int flesh_members_add(flesh_members *members, int value);
/* Sorts the members and drops repeats. */
void flesh_members_settle(flesh_members *members);
/* Sorts the members of all sets and drops repeats. */
void flesh_mesh_sets_settle(flesh_mesh_sets *sets);
void flesh_mesh_sets_clear(flesh_mesh_sets *sets);

/* Maps nodes and tets of a mesh to those of another mesh that was made from it or from a part of it. */
typedef struct flesh_mesh_sets_map {
  const int *nodes, *tets;   /* new number of each, -1: it is gone; NULL: the old number */
  int first_node, first_tet; /* added to the new number */
  int children;              /* number of consecutive tets that replace each tet; 0: one */
  const int *first_children; /* [tets+1] first of the tets made of each, in place of tets, first_tet, children; or NULL */
} flesh_mesh_sets_map;

/* Adds the members of `from`, mapped to the other mesh, to the sets of the same names in `to`. FLESH_ERR_FILE,
 * FLESH_ERR_MEMORY. */
int flesh_mesh_sets_append(flesh_mesh_sets *to, const flesh_mesh_sets *from, const flesh_mesh_sets_map *map);

/* Adds each node from <= i < end to the sets that have both its ends, ends [2*end]. FLESH_ERR_MEMORY. */
int flesh_mesh_sets_add_between(flesh_mesh_sets *sets, int from, int end, const int *ends);

/* Returns "the mesh has the sets 'a', 'b' and 'c'", valid until the next call in this thread. */
const char *flesh_mesh_sets_text(const flesh_mesh_sets *sets);

#endif
