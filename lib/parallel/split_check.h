/* split_check.h: checks that the parts of a split mesh, which are separate files, agree about the whole. */
#ifndef FLESH_PARALLEL_SPLIT_CHECK_H
#define FLESH_PARALLEL_SPLIT_CHECK_H

#include "flesh/ranks.h"

/* Checks that every tet in some rank's part is owned by exactly one part, and is the same in all parts that have it:
 * owner, region, nodes and their positions. Messages between ranks rely on this. Uses only sums over all ranks, for
 * some tets at a time. Collective; FLESH_ERR_FILE on all ranks with the first wrong tet, FLESH_ERR_MEMORY. */
int flesh_split_check_parts(flesh_communicator *communicator, const flesh_mesh *mesh);

#endif
