/* rank_sums.h: numbers that effects need as sums over all ranks (flesh_effect_ranks). */
#ifndef FLESH_SYSTEM_RANK_SUMS_H
#define FLESH_SYSTEM_RANK_SUMS_H

#include "system/parts.h"

/* Room for them, where the system has a team and effects that need some. FLESH_ERR_MEMORY. */
int flesh_rank_sums_create(flesh_system *system);
/* Finds all of them at a point as effects see it. Collective, and cannot fail: before anything that can. */
void flesh_rank_sums_find(const flesh_system *system, const flesh_point *point);
/* Those of an effect; NULL: it needs none, or the rank is by itself. */
const double *flesh_rank_sums_of(const flesh_system *system, int effect);

#endif
