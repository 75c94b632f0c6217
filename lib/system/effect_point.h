/* effect_point.h: the point of evaluation as effects see it: without NULL, and with what is each effect's own. */
#ifndef FLESH_SYSTEM_EFFECT_POINT_H
#define FLESH_SYSTEM_EFFECT_POINT_H

#include "system/parts.h"

/* Counts the effects that need sums over all ranks, once they are all there; without a team none does. */
void flesh_effect_sums_count(flesh_system *system);
/* How many numbers of such sums the caller makes room for. */
int flesh_effect_sums_room(const flesh_system *system);

/* Returns the point as all effects see it. Finds their sums over all ranks, into `sums` [room]: collective, and
 * cannot fail; to be called before anything that can. */
flesh_point flesh_effect_point(const flesh_system *system, const flesh_point *point, double *sums);
/* Sets what effect k alone is to see; `internal` is that of the point, of all effects. */
void flesh_effect_point_turn(const flesh_system *system, int k, const double *internal, const double *sums,
                             flesh_point *full);

#endif
