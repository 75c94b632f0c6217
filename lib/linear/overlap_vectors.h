/* overlap_vectors.h: residuals and corrections between a rank's nodes and its overlap (overlap.h).
 *
 * Collective. Vectors have four lanes a node: [4*rows] with node i at place[i] or the other way round with node nodes[p]
 * at p, [4*overlap] in the order `overlap_order`. What is sent between a begin and its end is on its way meanwhile; nothing
 * else is exchanged or added up then. */
#ifndef FLESH_LINEAR_OVERLAP_VECTORS_H
#define FLESH_LINEAR_OVERLAP_VECTORS_H

#include "linear/overlap.h"

/* r, which own nodes alone have, into `vector` at all of the overlap. */
void flesh_overlap_fetch(const flesh_overlap *overlap, const int *nodes, const float *r);
/* y, partial, into `vector`: the sum of all ranks in every overlap that has the node, the same bits for all who do. */
void flesh_overlap_sum(const flesh_overlap *overlap, const int *nodes, const float *y);
/* From `vector`, weighted. Not collective. */
void flesh_overlap_widen(const flesh_overlap *overlap, const int *overlap_order, float *wide);
/* From r, which own nodes alone have, to the overlap. */
void flesh_overlap_restrict(const flesh_overlap *overlap, const int *nodes, const float *r, const int *overlap_order,
                            float *wide);
/* Adds up the corrections of all ranks, z: the same bits for owners and their ghosts. `wide` is the same at the end as
 * at the beginning. */
void flesh_overlap_add_begin(const flesh_overlap *overlap, const float *wide);
void flesh_overlap_add_end(const flesh_overlap *overlap, const float *wide, float *z);

/* Conjugate gradients' residual in the overlap without being sent: r -= alpha s with s = A u + beta s follow from
 * products A u, which ranks add up for all whose overlap has a node. Vectors are in double or single precision, and what is kept
 * is rounded as they are.
 *
 * r at the start, of own nodes; s is zero. */
void flesh_overlap_keep(const flesh_overlap *overlap, int single, const void *r);
/* y, partial, to the sum of all ranks at own nodes, and zero at ghosts. */
void flesh_overlap_collect_begin(const flesh_overlap *overlap, int single, const void *y);
void flesh_overlap_collect_end(const flesh_overlap *overlap, int single, void *y);
/* One step on, with the y that was collected last. */
void flesh_overlap_advance(const flesh_overlap *overlap, int single, double alpha, double beta);
/* Like flesh_overlap_fetch and _restrict, with r at own nodes and `scale` times the kept residual elsewhere. Send
 * nothing. */
void flesh_overlap_fetch_kept(const flesh_overlap *overlap, const int *nodes, const float *r, double scale);
void flesh_overlap_restrict_kept(const flesh_overlap *overlap, const float *r, double scale, float *wide);

#endif
