/* split_part.h: what a part of a split mesh (split.h) knows of the whole. */
#ifndef FLESH_MESH_SPLIT_PART_H
#define FLESH_MESH_SPLIT_PART_H

/* Layers of tets around a part's own. A rank that uses k layers of nodes beyond its own (parallel/rank_part.c) needs k
 * + 1 layers of tets. */
enum { FLESH_SPLIT_LAYERS = 2 };

/* Place of a part's mesh in the whole; flesh_mesh.split. */
typedef struct flesh_split_part {
  int parts, part;             /* number of parts, and number of this one, from 0 */
  int whole_nodes, whole_tets; /* counts of the whole, where every node belongs to some tet */
  int *nodes, *tets;           /* [nodes], [tets] numbers in the whole, rising */
  int *owners;                 /* [tets] part that owns each tet */
  int region_count, *regions;  /* region tags of the whole, rising */
  int found;                   /* nodes or triangles that selections of a scene have found here; -1: none was asked */
} flesh_split_part;

void flesh_split_part_destroy(flesh_split_part *split);
/* Returns this mesh's number of a node of the whole; -1: it does not have the node. */
int flesh_split_part_find(const flesh_split_part *split, int nodes, int node);

/* Returns whether the whole has tets of that region; 0 if `split` is NULL. */
int flesh_split_has_region(const flesh_split_part *split, int tag);

#endif
