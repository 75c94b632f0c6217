/* gather.h: gathers vectors of the whole body on the first rank from the values that the ranks own. */
#ifndef FLESH_PARALLEL_GATHER_H
#define FLESH_PARALLEL_GATHER_H

#include "flesh/ranks.h"

typedef struct flesh_gather flesh_gather;

/* Makes a gather for vectors of three numbers per node. Borrows both. Returns new. Collective, and fails on all ranks
 * or none: FLESH_ERR_MEMORY. */
int flesh_gather_create(flesh_communicator *communicator, const flesh_rank_part *part, flesh_gather **gather);
/* Like flesh_gather_create, for vectors of one number per tet. */
int flesh_gather_create_tets(flesh_communicator *communicator, const flesh_rank_part *part, flesh_gather **gather);
/* Frees the gather and sets *gather to NULL; NULL-safe. */
void flesh_gather_destroy(flesh_gather **gather);

/* Copies the ranks' own nodes of `vector` [3*nodes of the part] into whole [3*nodes of the whole], which only the first
 * rank has (NULL elsewhere); nodes that no rank has stay unchanged. Collective. */
void flesh_gather_vector(flesh_gather *gather, const double *vector, double *whole);

/* Copies the ranks' `numbers` [tets of the part] into whole [tets of the whole], which only the first rank has.
 * Collective. */
void flesh_gather_numbers(flesh_gather *gather, const double *numbers, double *whole);

#endif
