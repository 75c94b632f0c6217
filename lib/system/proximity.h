/* proximity.h: what a run's effects know of nodes that are near each other, and its matrix, whose pattern grows with
 * them. Belongs to a run; the effects are const. */
#ifndef FLESH_SYSTEM_PROXIMITY_H
#define FLESH_SYSTEM_PROXIMITY_H

#include <stddef.h>

#include "base/archive.h"
#include "system/effect_view.h"

/* Nothing is allocated where no effect of the finished system remembers anything (flesh_effect_barrier). `threads` (may be NULL) is
 * borrowed. FLESH_ERR_MEMORY. */
int flesh_proximity_create(const flesh_system *system, flesh_threads *threads, flesh_proximity *proximity);
void flesh_proximity_clear(flesh_proximity *proximity);

/* K [of the system's pattern, or grown here] gets a pattern that has all pairs that the Jacobian at `point` couples,
 * and its values are lost, where it has not: *grown is 1 then. FLESH_ERR_MEMORY, FLESH_ERR_ARGUMENT: K is as before. */
int flesh_proximity_cover(flesh_proximity *proximity, const flesh_point *point, flesh_block_matrix *K, int *grown);

/* A solve begins. */
void flesh_proximity_begin(flesh_proximity *proximity);
/* Tells the effects that a solve's matrix is made at the point next: see flesh_effect_private.predict. */
void flesh_proximity_predict(flesh_proximity *proximity, const flesh_point *point);

/* Tells the effects that the run is at x [3*n] at time t: see flesh_effect_barrier.follow, also for the errors. */
int flesh_proximity_follow(const flesh_proximity *proximity, int accepted, double t, const double *x, int *changed);

/* Archives the effects' memories of where the run has been, and K's pattern without its values; *grown is 1 if K has
 * got another pattern. Does nothing if there are no memories. FLESH_ERR_MEMORY. */
int flesh_proximity_archive(flesh_proximity *proximity, flesh_block_matrix *K, int *grown, flesh_archive *archive);

#endif
