/* node_ranks.h: which ranks have a node, or are within some layers of tets from it. */
#ifndef FLESH_PARALLEL_NODE_RANKS_H
#define FLESH_PARALLEL_NODE_RANKS_H

#include "flesh/mesh.h"

typedef struct flesh_node_ranks {
  int nodes;
  int *first; /* [nodes+1] where a node's ranks begin */
  int *ranks; /* [first[nodes]] each node's by rising number; none where no tet has the node */
} flesh_node_ranks;

/* Finds the ranks whose tets have each node of the whole; `part` [tets] the rank of each. FLESH_ERR_MEMORY. To be
 * cleared also when it fails. */
int flesh_node_ranks_create(const flesh_mesh *whole, const int *part, flesh_node_ranks *lists);
/* One layer more: every rank of a tet's nodes has all of the tet's nodes. The same errors; `lists` is kept then. */
int flesh_node_ranks_grow(const flesh_mesh *whole, flesh_node_ranks *lists);
/* Also of the nodes of cells [count*width]: of each cell the rank that owns its first node or, where `everywhere` is
 * not 0, the ranks below that. owner [nodes]: -1 where no tet has the node, which is passed over. The same errors. */
int flesh_node_ranks_add_cells(flesh_node_ranks *lists, int count, int width, const int *cells, const int *owner, int everywhere);
/* Also what `other` has. The same errors. */
int flesh_node_ranks_add(flesh_node_ranks *lists, const flesh_node_ranks *other);
void flesh_node_ranks_clear(flesh_node_ranks *lists);

/* Whether `rank` is one of the node's. */
int flesh_node_ranks_has(const flesh_node_ranks *lists, int node, int rank);

#endif
