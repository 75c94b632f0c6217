/* gmsh.h: shared by the readers of Gmsh's formats 2 and 4.1: numbers from ASCII or binary. */
#ifndef FLESH_MESH_GMSH_H
#define FLESH_MESH_GMSH_H

#include "mesh/draft.h"
#include "base/scan.h"
#include "mesh/tag_map.h"

typedef struct flesh_gmsh {
  flesh_scanner *s;
  flesh_draft *draft;
  int major;           /* 2 or 4 */
  int binary, swap;    /* swap: the file's byte order is not this machine's */
  flesh_tag_map
      volumes; /* 4.1: tag of a volume -> its first physical tag, or the tag of its parent volume */
  flesh_tag_map names;    /* key of a named physical group -> its set */
  flesh_tag_map entities; /* 4.1: key of an entity -> the first of its groups */
  struct flesh_gmsh_group {
    int set, next; /* next: another group of the same entity; -1: none */
  } *groups;
  int group_count, group_room;
  int nodes_read, elements_read;
  int64_t others; /* number of elements that are not tets */
  int64_t last_group, last_nodes[4]; /* 2.2: physical tag and corners of the last tet */
} flesh_gmsh;

/* Fails with the line or byte before the sentence. */
int flesh_gmsh_fail(const flesh_gmsh *g, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* Read the next number; in binary files an int has 4 bytes, a size 8, a real 8. */
int flesh_gmsh_int(flesh_gmsh *g, int64_t *value);
int flesh_gmsh_size(flesh_gmsh *g, int64_t *value);
int flesh_gmsh_real(flesh_gmsh *g, double *value);

/* Fails unless `count` (of `item`) is at least `least` and the file has enough bytes left for `count` items of the
 * given ASCII or binary size. */
int flesh_gmsh_check_count(const flesh_gmsh *g, const char *item, int64_t count, int64_t least,
                           int ascii_bytes, int binary_bytes);
/* Skips that many bytes, which must be there. */
void flesh_gmsh_skip_bytes(flesh_gmsh *g, int64_t bytes);
/* Begins the row that is read, such as "node 5" of the form `form`; moves to its first number. */
void flesh_gmsh_row(flesh_gmsh *g, const char *item, int64_t index, const char *form);
/* Checks that nothing is left in an ASCII row. */
int flesh_gmsh_row_end(flesh_gmsh *g);

/* Gives node `index` its tag; fails if the tag is taken. */
int flesh_gmsh_add_node(flesh_gmsh *g, int index, int64_t tag);
/* Adds a tet of the given type by its node tags. */
int flesh_gmsh_add_tet(flesh_gmsh *g, int64_t type, int64_t tag, const int64_t *node_tags,
                       int64_t region, int64_t where);
/* Returns the current line or byte. */
int64_t flesh_gmsh_where(const flesh_gmsh *g);

/* Return the number of nodes of an element type (0: unknown), whether it is a tet that is read, and an error for tets
 * of higher order. */
int flesh_gmsh_type_nodes(int64_t type);
int flesh_gmsh_is_tet(int64_t type);
int flesh_gmsh_check_type(const flesh_gmsh *g, int64_t type, int64_t tag);

/* Finds the set of a named physical group (gmsh_names.c) by its dimension, 0 to 3, and tag; -1: it has no name. Groups
 * of points, curves and surfaces become sets of the nodes of their elements, groups of volumes sets of tets. */
int flesh_gmsh_named(const flesh_gmsh *g, int dimension, int64_t tag);
/* Puts the entity into the group, if the group has a name; 4.1 only. */
int flesh_gmsh_join_group(flesh_gmsh *g, int dimension, int64_t entity, int64_t tag);
/* Returns the first group of the entity; -1: it is in no named group; 4.1 only. */
int flesh_gmsh_group(const flesh_gmsh *g, int64_t dimension, int64_t entity);
/* Adds the node to the set. */
int flesh_gmsh_add_to_set(flesh_gmsh *g, int set, int64_t element, int64_t node_tag);
void flesh_gmsh_clear_names(flesh_gmsh *g);
/* Returns the dimension of an element type whose number of nodes is known. */
int flesh_gmsh_type_dimension(int64_t type);

/* Read the bodies of the sections; the scanner is after the line of the section's name. */
int flesh_gmsh_physical_names(flesh_gmsh *g);
int flesh_gmsh2_nodes(flesh_gmsh *g);
int flesh_gmsh2_elements(flesh_gmsh *g);
int flesh_gmsh4_entities(flesh_gmsh *g, int partitioned);
int flesh_gmsh4_nodes(flesh_gmsh *g);
int flesh_gmsh4_elements(flesh_gmsh *g);

enum { FLESH_GMSH_TET4 = 4, FLESH_GMSH_TET10 = 11, FLESH_GMSH_POINT = 15 };

#endif
