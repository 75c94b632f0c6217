/* gmsh.h: what the readers of Gmsh's format 2 and 4.1 share: numbers from ASCII or binary. */
#ifndef FLESH_MESH_GMSH_H
#define FLESH_MESH_GMSH_H

#include "mesh/draft.h"
#include "base/scan.h"
#include "mesh/tag_map.h"

typedef struct flesh_gmsh {
  flesh_scanner *s;
  flesh_draft *draft;
  int major;           /* 2 or 4 */
  int binary, swap;    /* swap: the file has the other byte order */
  flesh_tag_map
      volumes; /* 4.1: tag of a volume -> its first physical tag, a part's: its parent's */
  flesh_tag_map names;    /* key of a named physical group -> its set */
  flesh_tag_map entities; /* 4.1: key of an entity -> the first of its groups */
  struct flesh_gmsh_group {
    int set, next; /* next: of the same entity; -1: none */
  } *groups;
  int group_count, group_room;
  int nodes_read, elements_read;
  int64_t others; /* elements that are no tets */
  int64_t last_group, last_nodes[4]; /* 2.2: physical tag and corners of the last tet */
} flesh_gmsh;

/* Fails with line or byte before the sentence. */
int flesh_gmsh_fail(const flesh_gmsh *g, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* The next number: an int of 4 bytes, a size of 8, a real of 8 in binary files. */
int flesh_gmsh_int(flesh_gmsh *g, int64_t *value);
int flesh_gmsh_size(flesh_gmsh *g, int64_t *value);
int flesh_gmsh_real(flesh_gmsh *g, double *value);

/* Fails unless `count` (of `item`) is at least `least` and `count` times the bytes each takes in
 * ASCII or binary are left in the file. */
int flesh_gmsh_check_count(const flesh_gmsh *g, const char *item, int64_t count, int64_t least,
                           int ascii_bytes, int binary_bytes);
/* Leaves out that many bytes, which have been checked to be there. */
void flesh_gmsh_skip_bytes(flesh_gmsh *g, int64_t bytes);
/* Sets the row that is read: "node 5" of the form `form`; moves to its first number. */
void flesh_gmsh_row(flesh_gmsh *g, const char *item, int64_t index, const char *form);
/* Checks that nothing is left in an ASCII row. */
int flesh_gmsh_row_end(flesh_gmsh *g);

/* Gives node `index` its tag, which must be new. */
int flesh_gmsh_add_node(flesh_gmsh *g, int index, int64_t tag);
/* Adds a tet of the given type by its node tags. */
int flesh_gmsh_add_tet(flesh_gmsh *g, int64_t type, int64_t tag, const int64_t *node_tags,
                       int64_t region, int64_t where);
/* Present line or byte. */
int64_t flesh_gmsh_where(const flesh_gmsh *g);

/* Nodes of an element type, 0 when unknown; whether it is a tet that is read; tells tets of higher
 * order. */
int flesh_gmsh_type_nodes(int64_t type);
int flesh_gmsh_is_tet(int64_t type);
int flesh_gmsh_check_type(const flesh_gmsh *g, int64_t type, int64_t tag);

/* Named physical groups (gmsh_names.c), of points, curves and surfaces sets of the nodes of their elements, of volumes sets
 * of tets. The set of the group of that dimension, 0 to 3, and tag; -1: it has no name. */
int flesh_gmsh_named(const flesh_gmsh *g, int dimension, int64_t tag);
/* 4.1: puts the entity into the group, if the group has a name. */
int flesh_gmsh_join_group(flesh_gmsh *g, int dimension, int64_t entity, int64_t tag);
/* 4.1: the first group of the entity; -1: it is in none that has a name. */
int flesh_gmsh_group(const flesh_gmsh *g, int64_t dimension, int64_t entity);
/* Adds the node to the set. */
int flesh_gmsh_add_to_set(flesh_gmsh *g, int set, int64_t element, int64_t node_tag);
void flesh_gmsh_clear_names(flesh_gmsh *g);
/* Dimension of an element of the type, whose nodes are known. */
int flesh_gmsh_type_dimension(int64_t type);

/* Bodies of the sections; the scanner stands behind the line of the section's name. */
int flesh_gmsh_physical_names(flesh_gmsh *g);
int flesh_gmsh2_nodes(flesh_gmsh *g);
int flesh_gmsh2_elements(flesh_gmsh *g);
int flesh_gmsh4_entities(flesh_gmsh *g, int partitioned);
int flesh_gmsh4_nodes(flesh_gmsh *g);
int flesh_gmsh4_elements(flesh_gmsh *g);

enum { FLESH_GMSH_TET4 = 4, FLESH_GMSH_TET10 = 11, FLESH_GMSH_POINT = 15 };

#endif
