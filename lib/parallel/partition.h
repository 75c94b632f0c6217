/* partition.h: which rank computes which tets. */
#ifndef FLESH_PARALLEL_PARTITION_H
#define FLESH_PARALLEL_PARTITION_H

#include "flesh/mesh.h"

/* The rank 0 to ranks - 1 of each tet into part [tets]: as many tets for each, within 3 %. By planes across the
 * axes (Berger & Bokhari 1987), or by METIS, from the graph of tets that share a face (Karypis & Kumar 1998), where
 * ranks then share less than two thirds of the nodes. Every rank gets a tet. FLESH_ERR_ARGUMENT where
 * there are more ranks than tets; FLESH_ERR_MEMORY. */
int flesh_partition_tets(const flesh_mesh *mesh, int ranks, int *part);

#endif
