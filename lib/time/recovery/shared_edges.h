/* shared_edges.h: edges that tets of several ranks have (base/team.h), and sums over these ranks of a number of each edge.
 * Nothing else of a body lies on edges, so that messages between nodes have no place for it. */
#ifndef FLESH_TIME_RECOVERY_SHARED_EDGES_H
#define FLESH_TIME_RECOVERY_SHARED_EDGES_H

#include <stddef.h>

#include "base/team.h"
#include "flesh/mesh.h"

typedef struct flesh_shared_edges {
  const flesh_team *team; /* without ghosts that no tet has; NULL: there are no other ranks, and no edges */
  int count;              /* edges of this rank between nodes that others have, too */
  int *nodes;             /* [2*count] of this rank, the lower one first */
  int *first, *place;     /* [ranks within reach + 1], [first[ranks]] which of them each of these ranks has, too */
  double *own;             /* [count] */
  double *sent, *received; /* [first[ranks]] */
} flesh_shared_edges;

/* Finds the shared edges of the mesh's flat pieces (mesh/pieces.h). Collective, and fails on all ranks or none:
 * FLESH_ERR_MEMORY. To be cleared also then. */
int flesh_shared_edges_create(const flesh_mesh *mesh, const flesh_team *team, flesh_shared_edges *edges);
void flesh_shared_edges_clear(flesh_shared_edges *edges);
size_t flesh_shared_edges_memory(const flesh_shared_edges *edges);

/* Each of numbers [count] becomes its sum over the ranks that have the edge, added by rising rank: the same bits on all of
 * them. Collective. */
void flesh_shared_edges_sum(const flesh_shared_edges *edges, double *numbers);

#endif
