/* partition_kinds.h: the ways to part a mesh of as many tets as ranks or more, 2 or more ranks. */
#ifndef FLESH_PARALLEL_PARTITION_KINDS_H
#define FLESH_PARALLEL_PARTITION_KINDS_H

#include "flesh/mesh.h"

/* Cuts by planes: halves, halves of these and so on, each cut across the axis that leaves the fewest nodes on the cut.
 * Writes ranks into part [tets]; the counts of two ranks' tets differ by one for each of the log2 of the ranks at most.
 * FLESH_ERR_MEMORY. */
int flesh_partition_planes(const flesh_mesh *mesh, int ranks, int *part);

/* Cuts by METIS; if flesh is built without it, `made` is 0 and `part` is left. FLESH_ERR_MEMORY. */
int flesh_partition_metis(const flesh_mesh *mesh, int ranks, int *part, int *made);

#endif
