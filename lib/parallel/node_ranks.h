/* node_ranks.h: the ranks that have a node, or are within some layers of tets of it. */
#ifndef FLESH_PARALLEL_NODE_RANKS_H
#define FLESH_PARALLEL_NODE_RANKS_H

#include "flesh/mesh.h"

typedef struct flesh_node_ranks {
  int nodes;
  int *first; /* [nodes+1] first of each node's ranks */
  int *ranks; /* [first[nodes]] ranks of each node, rising; none for a node without tets */
} flesh_node_ranks;

/* Finds the ranks whose tets have each node of the whole; `part` [tets] is the rank of each tet. FLESH_ERR_MEMORY. The
 * caller clears the lists, also after an error. */
int flesh_node_ranks_create(const flesh_mesh *whole, const int *part, flesh_node_ranks *lists);
/* Adds a layer: every rank of one of a tet's nodes gets all nodes of the tet. FLESH_ERR_MEMORY; `lists` is then
 * unchanged. */
int flesh_node_ranks_grow(const flesh_mesh *whole, flesh_node_ranks *lists);
/* Adds ranks for the nodes of cells [count*width]: the rank that owns the cell's first node or, if `everywhere` is not
 * 0, all ranks below `everywhere`. owner [nodes]: -1 for nodes without tets, which are skipped. FLESH_ERR_MEMORY. */
int flesh_node_ranks_add_cells(flesh_node_ranks *lists, int count, int width, const int *cells, const int *owner, int everywhere);
/* Adds the ranks of `other`. FLESH_ERR_MEMORY. */
int flesh_node_ranks_add(flesh_node_ranks *lists, const flesh_node_ranks *other);
void flesh_node_ranks_clear(flesh_node_ranks *lists);

/* Returns whether the node has that rank. */
int flesh_node_ranks_has(const flesh_node_ranks *lists, int node, int rank);

#endif
