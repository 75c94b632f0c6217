/* connected.h: the connected parts of a body that is shared by ranks. */
#ifndef FLESH_PARALLEL_CONNECTED_H
#define FLESH_PARALLEL_CONNECTED_H

#include "base/team.h"

/* Unites the connected parts of the ranks' meshes: part [nodes] is a number below `count` of a part on this rank, or -1
 * for a node without tets here, and becomes the number of the body's part, in the same order for any number of ranks.
 * Returns the number of the body's parts; FLESH_ERR_MEMORY, on all ranks or none. `room` [nodes+ranks] is work space.
 * Collective. */
int flesh_connected_unite(const flesh_team *team, int count, double *room, int *part);

#endif
