/* coarse_team.h: sums over the ranks of a team for the coarse level that they share. */
#ifndef FLESH_LINEAR_COARSE_TEAM_H
#define FLESH_LINEAR_COARSE_TEAM_H

#include <stdint.h>

#include "base/team.h"
#include "linear/coarse_cholesky.h"

/* The blocks of the factor that are also blocks of the matrix: the others are zero on all ranks until it is factored. */
typedef struct flesh_coarse_sums {
  int count;
  int *blocks; /* [count] */
} flesh_coarse_sums;

/* Makes a factor for n patches, two of which are coupled where `touch` [n*n] is not 0 on any rank; afterwards all ranks
 * have the united `touch`. NULL: there was no memory for it. FLESH_ERR_MEMORY; clear matrix and sums also then. `team`
 * NULL: a rank by itself. */
FLESH_PER_ISA int flesh_coarse_sums_create(const flesh_team *team, int n, uint8_t *touch,
                                           flesh_coarse_cholesky *matrix, flesh_coarse_sums *sums);
FLESH_PER_ISA void flesh_coarse_sums_clear(flesh_coarse_sums *sums);
/* Sums up the matrix over the ranks, before it is factored. */
FLESH_PER_ISA void flesh_coarse_sum_matrix(const flesh_team *team, const flesh_coarse_sums *sums,
                                           flesh_coarse_cholesky *matrix);
/* Sums up x [count] over the ranks, in double precision. */
FLESH_PER_ISA void flesh_coarse_sum(const flesh_team *team, int count, float *x);

#endif
