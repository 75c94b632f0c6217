/* draft.h: a mesh while it is read from a file. */
#ifndef FLESH_MESH_DRAFT_H
#define FLESH_MESH_DRAFT_H

#include <stdint.h>

#include "mesh/mesh.h"
#include "mesh/tag_map.h"

typedef struct flesh_draft {
  const char *path; /* file with the tets */
  char *owned_path; /* the same path if it must be freed, else NULL */
  int binary;
  int nodes, tets;
  int node_base;     /* number of the first node in formats that number nodes consecutively */
  double *positions; /* [3*nodes] */
  int64_t *node_tag; /* [nodes] in formats with free node numbers, else NULL */
  flesh_tag_map tags; /* node number -> index */
  int64_t solids;   /* number of solid elements that are not tets; flesh_draft_finish refuses them */
  int tet_room, tet_size; /* tet_size: nodes of each tet, 4 or 10; 0 while there is no tet */
  int *tet_nodes;         /* [4*tet_room] */
  int *edge_nodes;        /* [6*tet_room] if tet_size is 10, else NULL */
  int *regions;
  int64_t *tet_where, *tet_tag;
  flesh_mesh_sets sets; /* settled (sets.h) by flesh_draft_finish */
} flesh_draft;

/* Sets the number of nodes and allocates them. FLESH_ERR_MEMORY. */
int flesh_draft_set_nodes(flesh_draft *draft, int nodes);
/* Sets the number of nodes, which have free numbers. flesh_draft_tag_node gives a node its number and returns 0, 1 if
 * another node has the number already, or FLESH_ERR_MEMORY. */
int flesh_draft_set_tagged_nodes(flesh_draft *draft, int nodes);
int flesh_draft_tag_node(flesh_draft *draft, int index, int64_t tag);
/* Allocates that many tets of `size` nodes. FLESH_ERR_FILE if other tets have another size; FLESH_ERR_MEMORY. */
int flesh_draft_reserve_tets(flesh_draft *draft, int size, int tets);
/* Adds a tet of `size` nodes, indices from 0, with nodes on edges in VTK's order. FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_draft_add_tet(flesh_draft *draft, int size, const int *nodes, int region, int64_t where,
                        int64_t tag);
/* Returns the index of a file's node number; -1 if it is outside [node_base, node_base + nodes). */
int flesh_draft_node(const flesh_draft *draft, int64_t number);
/* Makes the mesh from the draft. Returns new. */
int flesh_draft_finish(flesh_draft *draft, flesh_mesh **mesh);
void flesh_draft_clear(flesh_draft *draft);

#endif
