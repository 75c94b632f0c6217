/* split_part.h: what the mesh of a part of a split mesh (split.h) knows of the whole. */
#ifndef FLESH_MESH_SPLIT_PART_H
#define FLESH_MESH_SPLIT_PART_H

/* Layers of tets around a part's own. A rank that reaches k layers of nodes beyond its own (parallel/rank_part.c) has to
 * know of k + 1. */
enum { FLESH_SPLIT_LAYERS = 2 };

/* The place of a part's mesh in the whole; flesh_mesh.split. */
typedef struct flesh_split_part {
  int parts, part;             /* how many, and which this is, from 0 */
  int whole_nodes, whole_tets; /* of the whole, where every node is of some tet */
  int *nodes, *tets;           /* [nodes], [tets] numbers in the whole, rising */
  int *owners;                 /* [tets] the part whose own each tet is */
  int region_count, *regions;  /* the whole's region tags, rising */
  int found;                   /* nodes or triangles that selections have found here, while a scene is read; -1: none asked */
} flesh_split_part;

void flesh_split_part_destroy(flesh_split_part *split);
/* This mesh's number of a node of the whole; -1: it has none. */
int flesh_split_part_find(const flesh_split_part *split, int nodes, int node);

/* Whether the whole has tets of that tag; 0 where `split` is NULL. */
int flesh_split_has_region(const flesh_split_part *split, int tag);

#endif
