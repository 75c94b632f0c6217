/* partition.h: which rank computes which tets. */
#ifndef FLESH_PARALLEL_PARTITION_H
#define FLESH_PARALLEL_PARTITION_H

#include "flesh/mesh.h"

/* The rank 0 to ranks - 1 of each tet into part [tets]: as many tets for each, within 3 %, and few nodes between them
 * (METIS' multilevel k-way partition of the graph of tets that share a face; Karypis & Kumar 1998). Every rank gets a
 * tet. FLESH_ERR_ARGUMENT where there are more ranks than tets, or flesh is built without METIS and there are two or
 * more; FLESH_ERR_MEMORY. */
int flesh_partition_tets(const flesh_mesh *mesh, int ranks, int *part);

#endif
