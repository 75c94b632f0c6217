/* proximity.h: caches of a run's effects for nodes that are near each other, and the run's matrix, whose pattern grows with
 * them. Belongs to a run; the effects are const. */
#ifndef FLESH_SYSTEM_PROXIMITY_H
#define FLESH_SYSTEM_PROXIMITY_H

#include "base/archive.h"
#include "system/effect_view.h"

/* Makes the caches; allocates nothing if no effect of the finalized system has one (flesh_effect_barrier). Borrows
 * `threads` (may be NULL). FLESH_ERR_MEMORY. */
int flesh_proximity_create(const flesh_system *system, flesh_threads *threads, flesh_proximity *proximity);
void flesh_proximity_clear(flesh_proximity *proximity);

/* Makes sure that K, of the system's pattern or grown here, has all pairs that the Jacobian at `point` couples. If not,
 * sets *grown to 1 and gives K a new pattern, losing its values. FLESH_ERR_MEMORY, FLESH_ERR_ARGUMENT: K is as before. */
int flesh_proximity_cover(flesh_proximity *proximity, const flesh_point *point, flesh_block_matrix *K, int *grown);

/* Starts a solve. */
void flesh_proximity_begin(flesh_proximity *proximity);
/* Tells the effects that the solve's next matrix is at `point`: see flesh_effect_private.predict. */
void flesh_proximity_predict(flesh_proximity *proximity, const flesh_point *point);

/* Tells the effects that the run is at x [3*n] at time t: see flesh_effect_barrier.follow, also for the errors. */
int flesh_proximity_follow(const flesh_proximity *proximity, int accepted, double t, const double *x, int *changed);

/* Archives the effects' caches of the run's past, and K's pattern without its values; *grown is 1 if K has got another
 * pattern. Does nothing if there are no caches. FLESH_ERR_MEMORY. */
int flesh_proximity_archive(flesh_proximity *proximity, flesh_block_matrix *K, int *grown, flesh_archive *archive);

#endif
