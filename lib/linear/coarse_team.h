/* coarse_team.h: what the ranks of a team add up for the coarse level that they share. */
#ifndef FLESH_LINEAR_COARSE_TEAM_H
#define FLESH_LINEAR_COARSE_TEAM_H

#include <stddef.h>
#include <stdint.h>

#include "base/team.h"

/* What the matrices of all ranks couple between them, touch [n*n]. FLESH_ERR_MEMORY on all ranks, or none; nothing
 * happens where `team` is NULL. */
int flesh_coarse_unite(const flesh_team *team, size_t n, uint8_t *touch);
/* The sum of the ranks' x [count], by sums in double precision. */
void flesh_coarse_sum(const flesh_team *team, int count, float *x);

#endif
