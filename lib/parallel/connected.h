/* connected.h: the connected parts of a body that ranks share out. */
#ifndef FLESH_PARALLEL_CONNECTED_H
#define FLESH_PARALLEL_CONNECTED_H

#include "base/team.h"

/* Unites the connected parts of the ranks' meshes: part [nodes] has the numbers from 0 to before `count` of those of this
 * rank, -1 where a node has no tet here, and gets those of the body's parts, in the same order on any number of ranks.
 * Returns how many the body has; FLESH_ERR_MEMORY, on all ranks or none. `room` [nodes+ranks]. Collective. */
int flesh_connected_unite(const flesh_team *team, int count, double *room, int *part);

#endif
