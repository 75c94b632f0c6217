/* split.h: meshes in several files, one for the part of each rank, so that no rank ever needs the whole mesh. An index
 * names them all.
 *
 * A part has its own tets, all tets with a node of these, and all tets with a node of those. Hence it knows for each
 * node of its own tets and of the next layer which parts' tets have it, and the boundary of its own tets and the next
 * layer is correct: what is on the boundary there is on the boundary of the whole. Nodes and tets stand in the order of
 * the whole. Their numbers in the whole are ints, as everywhere: at most INT_MAX / 3 nodes and INT_MAX / 4 tets
 * (INT_MAX / 16 with ten nodes). */
#ifndef FLESH_MESH_SPLIT_H
#define FLESH_MESH_SPLIT_H

#include "base/scan.h"
#include "mesh/mesh.h"
#include "mesh/split_part.h"

/* Row of a part in the index; the parts are in the files part_00000.bin and so on beside the index. */
typedef struct flesh_split_row {
  int own, tets, nodes; /* own tets, all tets, and nodes of the part */
  int members;          /* length of its list of members of sets */
} flesh_split_row;

typedef struct flesh_split {
  char *path;   /* path of the index */
  int64_t mark; /* the same in all files of a split mesh; another split almost surely has another mark */
  int order, nodes, tets, parts, region_count;
  int *regions;          /* [region_count] rising */
  flesh_mesh_sets sets;  /* names only; the parts have the members */
  flesh_split_row *rows; /* [parts] */
} flesh_split;

/* Returns whether the text at the scanner begins an index. */
int flesh_split_begins(const flesh_scanner *s);
/* Returns whether the file at `path` is an index; 0 also if it cannot be read. */
int flesh_split_is_index(const char *path);
/* Read an index. FLESH_ERR_FILE with file and line; FLESH_ERR_MEMORY. The caller closes `split`, also after an
 * error. */
int flesh_split_read(flesh_scanner *s, flesh_split *split);
int flesh_split_open(const char *path, flesh_split *split);
void flesh_split_close(flesh_split *split);
/* Writes FOLDER/index.txt, after all parts are written; removes parts that an older split has beyond `parts`. */
int flesh_split_write_index(const flesh_split *split, const char *folder);
/* Removes FOLDER/index.txt, so that the folder is no split mesh until the new index is written. */
int flesh_split_begin(const char *folder);

/* Reads the mesh of part `part`, with its flesh_mesh.split. Returns new. FLESH_ERR_FILE for a part that is missing,
 * damaged, or of another split; FLESH_ERR_MEMORY. */
int flesh_split_read_part(const flesh_split *split, int part, flesh_mesh **mesh);
/* Reads all parts into the whole mesh. Returns new. Fails as flesh_split_read_part. */
int flesh_split_read_whole(const flesh_split *split, flesh_mesh **mesh);

/* Arrays of a part, as in its file; borrowed when written. */
typedef struct flesh_split_arrays {
  int nodes, tets;
  double *positions; /* [3*nodes] */
  int *node_numbers, *tet_nodes, *edge_nodes; /* [nodes], [4*tets] numbers in this part, [6*tets] at order 2 */
  int *regions, *tet_numbers, *owners;        /* [tets] */
  int member_count, *members; /* [member_count] for each set: node count, tet count, nodes, tets (split_sets.c) */
} flesh_split_arrays;

/* Allocates arrays for the numbers in `counts`. FLESH_ERR_MEMORY; the caller clears them, also then. */
int flesh_split_arrays_take(flesh_split_arrays *arrays, const flesh_split_row *counts, int order);

/* flesh_split_count_members returns the length of a part's list of members; flesh_split_list_members fills the list.
 * nodes [whole nodes], tets [whole tets]: the part's number of each, -1 if it has none. */
int64_t flesh_split_count_members(const flesh_mesh_sets *sets, const int *nodes, const int *tets);
void flesh_split_list_members(const flesh_mesh_sets *sets, const int *nodes, const int *tets, int *members);
/* Makes the sets of a part from its list. FLESH_ERR_FILE if the list is invalid, FLESH_ERR_MEMORY; the caller clears
 * the sets, also then. */
int flesh_split_take_sets(const flesh_split *split, int part, const flesh_split_arrays *arrays, flesh_mesh_sets *sets);
void flesh_split_arrays_clear(flesh_split_arrays *arrays);
/* Writes part `part` into the folder and fills in split->rows[part]. FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_split_write_part(flesh_split *split, const char *folder, int part, const flesh_split_arrays *arrays);
/* Checks that the files of all parts are there, with the sizes that follow from the index. FLESH_ERR_FILE,
 * FLESH_ERR_MEMORY. */
int flesh_split_check_files(const flesh_split *split);
/* Loads a part's arrays from its file and checks them against the index. FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_split_load_part(const flesh_split *split, int part, flesh_split_arrays *arrays);

/* Writes `mesh` in `parts` parts into the folder, which is made; owners [tets] is the part of each tet, and every part
 * has some. FLESH_ERR_ARGUMENT for a mesh with nodes that no tet has; FLESH_ERR_FILE; FLESH_ERR_MEMORY. */
int flesh_split_mesh(const flesh_mesh *mesh, int parts, const int *owners, const char *folder);
/* Writes the box of flesh_mesh_box in blocks of cells, one part after the other, so that only one part is in memory at
 * a time. Fills *split, which the caller closes. Fails as flesh_mesh_box; FLESH_ERR_ARGUMENT for more parts than blocks
 * can be made. */
int flesh_split_box(const int cells[3], const double size[3], const double origin[3], int parts, const char *folder,
                    flesh_split *split);

#endif
