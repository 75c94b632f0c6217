/* partition_kinds.h: two ways to partition a mesh, for at least 2 ranks and at most as many as tets. */
#ifndef FLESH_PARALLEL_PARTITION_KINDS_H
#define FLESH_PARALLEL_PARTITION_KINDS_H

#include "flesh/mesh.h"

/* Cuts by planes: into halves, these into halves and so on, each time across the axis that leaves the fewest nodes on
 * the cut. Writes ranks into part [tets]; the numbers of tets of two ranks differ at most by log2 of the number of
 * ranks. FLESH_ERR_MEMORY. */
int flesh_partition_planes(const flesh_mesh *mesh, int ranks, int *part);

/* Cuts by METIS; if flesh is built without it, `made` is 0 and `part` unchanged. FLESH_ERR_MEMORY. */
int flesh_partition_metis(const flesh_mesh *mesh, int ranks, int *part, int *made);

#endif
