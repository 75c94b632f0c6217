/* coarse_team.h: what the ranks of a team add up for the coarse level that they share. */
#ifndef FLESH_LINEAR_COARSE_TEAM_H
#define FLESH_LINEAR_COARSE_TEAM_H

#include <stdint.h>

#include "base/team.h"
#include "linear/coarse_cholesky.h"

/* The factor's blocks that the matrix has, too: the others are zero on all ranks until it is factored. */
typedef struct flesh_coarse_sums {
  int count;
  int *blocks; /* [count] */
} flesh_coarse_sums;

/* A factor for n patches that are coupled where `touch` [n*n] is not 0 on any rank, which all ranks know then; NULL:
 * there was no memory for it. FLESH_ERR_MEMORY; both are to be cleared also then. `team` NULL: a rank by itself. */
FLESH_PER_ISA int flesh_coarse_sums_create(const flesh_team *team, int n, uint8_t *touch,
                                           flesh_coarse_cholesky *matrix, flesh_coarse_sums *sums);
FLESH_PER_ISA void flesh_coarse_sums_clear(flesh_coarse_sums *sums);
/* The matrix, before it is factored, becomes the sum of the ranks'. */
FLESH_PER_ISA void flesh_coarse_sum_matrix(const flesh_team *team, const flesh_coarse_sums *sums,
                                           flesh_coarse_cholesky *matrix);
/* The sum of the ranks' x [count], by sums in double precision. */
FLESH_PER_ISA void flesh_coarse_sum(const flesh_team *team, int count, float *x);

#endif
