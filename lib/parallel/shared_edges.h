/* shared_edges.h: sums over the ranks at edges of which each rank has some tets. */
#ifndef FLESH_PARALLEL_SHARED_EDGES_H
#define FLESH_PARALLEL_SHARED_EDGES_H

#include <stddef.h>

#include "base/team.h"
#include "mesh/edges.h"
#include "mesh/mesh.h"

/* Zeros have no edges. */
typedef struct flesh_shared_edges {
  const flesh_team *team;
  int count, of_all; /* edges of this rank between nodes that others have, and those of all ranks, each once */
  int *edges;        /* [count] which of the rank's edges they are */
  int *place;        /* [count] and which of those of all ranks */
  double *between;   /* [of_all] sums */
} flesh_shared_edges;

/* Finds them; `status`: of what the rank has made before, on which all ranks agree first. Without a team there are none.
 * Borrows the team. FLESH_ERR_MEMORY. Collective; to be cleared also if it fails. */
int flesh_shared_edges_create(const flesh_team *team, const flesh_mesh_edges *edges, int status,
                              flesh_shared_edges *shared);
void flesh_shared_edges_clear(flesh_shared_edges *shared);
/* Adds up the ranks' sums [edges]. Collective. */
void flesh_shared_edges_sum(const flesh_shared_edges *shared, double *sums);
/* Bytes that those of the mesh's pieces take, and finding them, in a reserve at most; 0 without a team. `work` [nodes] is
 * room. Collective. */
size_t flesh_shared_edges_room(const flesh_team *team, const flesh_mesh *mesh, double *work);

#endif
