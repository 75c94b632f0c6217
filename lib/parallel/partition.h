/* partition.h: assigns tets to ranks. */
#ifndef FLESH_PARALLEL_PARTITION_H
#define FLESH_PARALLEL_PARTITION_H

#include "flesh/mesh.h"

/* Assigns each tet to a rank from 0 to ranks - 1, part [tets], with equal numbers of tets within 3 %: by planes across
 * the axes (Berger & Bokhari 1987), or by METIS, from the graph of tets that share a face (Karypis & Kumar 1998), if
 * ranks then share less than two thirds of the nodes. Every rank gets a tet. FLESH_ERR_ARGUMENT if there are more ranks
 * than tets; FLESH_ERR_MEMORY. */
int flesh_partition_tets(const flesh_mesh *mesh, int ranks, int *part);

#endif
