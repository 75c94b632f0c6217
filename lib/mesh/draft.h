/* draft.h: a mesh while it is read from a file. */
#ifndef FLESH_MESH_DRAFT_H
#define FLESH_MESH_DRAFT_H

#include <stddef.h>
#include <stdint.h>

#include "mesh/mesh.h"
#include "mesh/tag_map.h"

typedef struct flesh_draft {
  const char *path; /* of the file with the tets */
  char *owned_path; /* to be freed, or NULL */
  int binary;
  int nodes, tets;
  int node_base;     /* number of the first node, for formats that number them in a row */
  double *positions; /* [3*nodes] */
  int64_t *node_tag; /* [nodes] for formats with free node numbers, else NULL */
  flesh_tag_map tags; /* their indices by these numbers */
  int64_t solids;   /* elements with a volume that are no tets: flesh_draft_finish refuses them */
  int tet_room, tet_size; /* tet_size: nodes of each tet, 4 or 10; 0 while there is none */
  int *tet_nodes;         /* [4*tet_room] */
  int *edge_nodes;        /* [6*tet_room] where tet_size is 10, else NULL */
  int *regions;
  int64_t *tet_where, *tet_tag;
  flesh_mesh_sets sets; /* settled by flesh_draft_finish */
} flesh_draft;

/* Sets the number of nodes and gets room for them. */
int flesh_draft_set_nodes(flesh_draft *draft, int nodes);
/* Sets the number of nodes that have free numbers. flesh_draft_tag_node gives a node its number: 0, 1 where another node has
 * the number already, FLESH_ERR_MEMORY. */
int flesh_draft_set_tagged_nodes(flesh_draft *draft, int nodes);
int flesh_draft_tag_node(flesh_draft *draft, int index, int64_t tag);
/* Gets room for that many tets of `size` nodes, which all others must have too: FLESH_ERR_FILE. */
int flesh_draft_reserve_tets(flesh_draft *draft, int size, int tets);
/* Adds a tet of `size` nodes, indices from 0, edges in VTK's order. */
int flesh_draft_add_tet(flesh_draft *draft, int size, const int *nodes, int region, int64_t where,
                        int64_t tag);
/* A file's node number as an index; -1 when it is outside [node_base, node_base + nodes). */
int flesh_draft_node(const flesh_draft *draft, int64_t number);
/* Makes the mesh. Returns new. */
int flesh_draft_finish(flesh_draft *draft, flesh_mesh **mesh);
void flesh_draft_clear(flesh_draft *draft);

#endif
