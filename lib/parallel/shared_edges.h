/* shared_edges.h: sums over the ranks at edges whose tets belong to several ranks. */
#ifndef FLESH_PARALLEL_SHARED_EDGES_H
#define FLESH_PARALLEL_SHARED_EDGES_H

#include <stddef.h>

#include "base/team.h"
#include "mesh/edges.h"
#include "mesh/mesh.h"

/* The shared edges of a rank; zeros: none. */
typedef struct flesh_shared_edges {
  const flesh_team *team;
  int count, of_all; /* edges of this rank between nodes that others have, too; those of all ranks, each once */
  int *edges;        /* [count] number of each among the rank's edges */
  int *place;        /* [count] number of each among those of all ranks */
  double *between;   /* [of_all] sums */
} flesh_shared_edges;

/* Finds the shared edges; without a team there are none. `status` is the caller's own so far, on which all ranks agree
 * first. Borrows the team. FLESH_ERR_MEMORY. Collective; the caller clears `shared`, also after an error. */
int flesh_shared_edges_create(const flesh_team *team, const flesh_mesh_edges *edges, int status,
                              flesh_shared_edges *shared);
void flesh_shared_edges_clear(flesh_shared_edges *shared);
/* Adds up the ranks' sums [edges]. Collective. */
void flesh_shared_edges_sum(const flesh_shared_edges *shared, double *sums);
/* Returns the most bytes that shared edges of the mesh's pieces, and finding them, take from a reserve; 0 without a
 * team. `work` [nodes] is work space. Collective. */
size_t flesh_shared_edges_room(const flesh_team *team, const flesh_mesh *mesh, double *work);

#endif
