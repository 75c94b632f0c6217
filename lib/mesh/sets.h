/* sets.h: the named sets of a mesh: nodes, tets, or both of one name. */
#ifndef FLESH_MESH_SETS_H
#define FLESH_MESH_SETS_H

#include <stddef.h>

/* Indices from 0; rising once the sets are settled. */
typedef struct flesh_members {
  int *values; /* [count] */
  int count, room;
} flesh_members;

typedef struct flesh_mesh_set {
  char *name;
  flesh_members nodes, tets;
} flesh_mesh_set;

/* Zero-initialised there are none. */
typedef struct flesh_mesh_sets {
  int count, room;
  flesh_mesh_set *sets; /* [count] in the order in which they were taken */
} flesh_mesh_sets;

enum { FLESH_MOST_SETS = 4096 };

/* The set of the name of `length` bytes, by its index in *set; made where there is none. FLESH_ERR_FILE for more than
 * FLESH_MOST_SETS sets and for control characters in the name, FLESH_ERR_MEMORY. */
int flesh_mesh_sets_take(flesh_mesh_sets *sets, const char *name, size_t length, int *set);
/* Its index; -1: there is no set of that name. */
int flesh_mesh_sets_find(const flesh_mesh_sets *sets, const char *name, size_t length);
/* FLESH_ERR_MEMORY. */
int flesh_members_add(flesh_members *members, int value);
/* Sorts the members, and drops what is there twice. */
void flesh_members_settle(flesh_members *members);
/* Sorts the members of all sets, and drops what is there twice. */
void flesh_mesh_sets_settle(flesh_mesh_sets *sets);
void flesh_mesh_sets_clear(flesh_mesh_sets *sets);

/* The nodes and tets of a mesh in another mesh that was made of it, or of a part of it. */
typedef struct flesh_mesh_sets_map {
  const int *nodes, *tets;   /* the new number of each, -1 where it is gone; NULL: the old number */
  int first_node, first_tet; /* added to the new number */
  int children;              /* tets that one became, in a row; 0: one */
  const int *first_children; /* [tets+1] the first of the tets that each became, in a row, in place of the three above; or NULL */
} flesh_mesh_sets_map;

/* Adds the members of `from`, as numbered in the other mesh, to the sets of the same names in `to`. FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_mesh_sets_append(flesh_mesh_sets *to, const flesh_mesh_sets *from, const flesh_mesh_sets_map *map);

/* Adds each node from number `from` to before `end` to the sets that have both its ends, ends [2*end]. FLESH_ERR_MEMORY. */
int flesh_mesh_sets_add_between(flesh_mesh_sets *sets, int from, int end, const int *ends);

/* "the mesh has the sets 'a', 'b' and 'c'", in memory of the thread until the next call. */
const char *flesh_mesh_sets_text(const flesh_mesh_sets *sets);

#endif
