/* split_check.h: whether the parts of a split mesh, which are files of their own, agree about the whole. */
#ifndef FLESH_PARALLEL_SPLIT_CHECK_H
#define FLESH_PARALLEL_SPLIT_CHECK_H

#include "flesh/ranks.h"

/* Whether every tet that some rank's part has is own to exactly one, and is the same in all parts that have it: owner,
 * region, nodes and their places. What ranks send each other follows from these. By sums over all ranks alone, for some
 * tets at a time. Collective; FLESH_ERR_FILE on all ranks with the first tet that is found, FLESH_ERR_MEMORY. */
int flesh_split_check_parts(flesh_communicator *communicator, const flesh_mesh *mesh);

#endif
