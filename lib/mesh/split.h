/* split.h: meshes in several files, one for each rank that is to compute a part of it, so that no rank ever needs the
 * whole. An index names them all.
 *
 * A part has its own tets, all tets with one of their nodes, and all tets with a node of those: so it knows of each node
 * of its own tets, and of the next layer's, which parts' tets have it. What is on the boundary of its own tets and of the
 * next layer is then on the boundary of the whole, too. Nodes and tets stand in the order of the whole, whose numbers are
 * ints, as everywhere: at most INT_MAX / 3 nodes and INT_MAX / 4 tets (INT_MAX / 16 of ten nodes). */
#ifndef FLESH_MESH_SPLIT_H
#define FLESH_MESH_SPLIT_H

#include "base/scan.h"
#include "mesh/mesh.h"
#include "mesh/split_part.h"

/* An index. Its parts are in the files part_00000.bin and so on beside it. */
typedef struct flesh_split_row {
  int own, tets, nodes; /* own tets, all tets, nodes of a part */
  int members;          /* numbers in its list of the members of sets */
} flesh_split_row;

typedef struct flesh_split {
  char *path;   /* of the index */
  int64_t mark; /* the same in all files of a split mesh, and hardly in those of another */
  int order, nodes, tets, parts, region_count;
  int *regions;          /* [region_count] rising */
  flesh_mesh_sets sets;  /* by name; the parts have the members */
  flesh_split_row *rows; /* [parts] */
} flesh_split;

/* Whether what the scanner is at begins an index. */
int flesh_split_begins(const flesh_scanner *s);
/* Whether the file at `path` is one; 0 also where it cannot be read. */
int flesh_split_is_index(const char *path);
/* FLESH_ERR_FILE with file and line; FLESH_ERR_MEMORY. To be closed also then. */
int flesh_split_read(flesh_scanner *s, flesh_split *split);
int flesh_split_open(const char *path, flesh_split *split);
void flesh_split_close(flesh_split *split);
/* Into FOLDER/index.txt, behind its parts; what an older split has beyond `parts` goes. */
int flesh_split_write_index(const flesh_split *split, const char *folder);
/* FOLDER/index.txt goes: what is in the folder is no split mesh until the new index is written. */
int flesh_split_begin(const char *folder);

/* The mesh of part `part`, with `split`. Returns new. FLESH_ERR_FILE for a part that is missing, damaged, or of another
 * split; FLESH_ERR_MEMORY. */
int flesh_split_read_part(const flesh_split *split, int part, flesh_mesh **mesh);
/* The whole of all its parts. Returns new. The same errors. */
int flesh_split_read_whole(const flesh_split *split, flesh_mesh **mesh);

/* The arrays of a part, as files have them: borrowed in writing. */
typedef struct flesh_split_arrays {
  int nodes, tets;
  double *positions; /* [3*nodes] */
  int *node_numbers, *tet_nodes, *edge_nodes; /* [nodes], [4*tets] in this part's numbers, [6*tets] at order 2 */
  int *regions, *tet_numbers, *owners;        /* [tets] */
  int member_count, *members; /* [member_count] for each set: how many nodes and tets, these nodes, these tets (split_sets.c) */
} flesh_split_arrays;

/* Room for so many as `counts` has. FLESH_ERR_MEMORY; to be cleared also then. */
int flesh_split_arrays_take(flesh_split_arrays *arrays, const flesh_split_row *counts, int order);

/* How many numbers the list of a part's members has, and the list itself; nodes [whole nodes], tets [whole tets]: the
 * part's number of each, -1 where it has none. */
int64_t flesh_split_count_members(const flesh_mesh_sets *sets, const int *nodes, const int *tets);
void flesh_split_list_members(const flesh_mesh_sets *sets, const int *nodes, const int *tets, int *members);
/* The sets of a part. Returns FLESH_ERR_FILE where the list is none, FLESH_ERR_MEMORY; to be cleared also then. */
int flesh_split_take_sets(const flesh_split *split, int part, const flesh_split_arrays *arrays, flesh_mesh_sets *sets);
void flesh_split_arrays_clear(flesh_split_arrays *arrays);
/* Writes part `part` into the folder, and fills in split->rows[part]. */
int flesh_split_write_part(flesh_split *split, const char *folder, int part, const flesh_split_arrays *arrays);
/* Whether all parts' files are there, each with as many bytes as the index makes it have. FLESH_ERR_FILE otherwise. */
int flesh_split_check_files(const flesh_split *split);
/* A part's arrays from its file, checked against the index. */
int flesh_split_load_part(const flesh_split *split, int part, flesh_split_arrays *arrays);

/* Writes `mesh` in `parts` parts into the folder, which is made; owners [tets] the part of each tet, none without one.
 * FLESH_ERR_ARGUMENT for a mesh with nodes that no tet has; FLESH_ERR_FILE; FLESH_ERR_MEMORY. */
int flesh_split_mesh(const flesh_mesh *mesh, int parts, const int *owners, const char *folder);
/* The box of flesh_mesh_box in blocks of cells, one part after the other, so that no more than a part is ever in memory.
 * *split is filled in, to be closed. FLESH_ERR_ARGUMENT as that, and for more parts than blocks can be made. */
int flesh_split_box(const int cells[3], const double size[3], const double origin[3], int parts, const char *folder,
                    flesh_split *split);

#endif
