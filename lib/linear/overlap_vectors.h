/* overlap_vectors.h: residuals and corrections between a rank's nodes and its overlap (overlap.h).
 *
 * Collective. Vectors have four lanes a node: [4*rows] with node i at place[i] or, the other way round, node nodes[p] at p;
 * [4*overlap] in the order `overlap_order`. Between a begin and its end, messages are on their way; do not exchange or add
 * up anything else then. */
#ifndef FLESH_LINEAR_OVERLAP_VECTORS_H
#define FLESH_LINEAR_OVERLAP_VECTORS_H

#include "linear/overlap.h"

/* Fetches r, which only own nodes have, into `vector` at all nodes of the overlap. */
void flesh_overlap_fetch(const flesh_overlap *overlap, const int *nodes, const float *r);
/* Sums up y, partial, over all ranks into `vector` in every overlap that has the node, with the same bits in all of them. */
void flesh_overlap_sum(const flesh_overlap *overlap, const int *nodes, const float *y);
/* Copies `vector`, weighted, to `wide`. Not collective. */
void flesh_overlap_widen(const flesh_overlap *overlap, const int *overlap_order, float *wide);
/* Restricts r, which only own nodes have, to the overlap. */
void flesh_overlap_restrict(const flesh_overlap *overlap, const int *nodes, const float *r, const int *overlap_order,
                            float *wide);
/* Adds up the corrections of all ranks in z, with the same bits at owners and their ghosts. `wide` must be the same in both
 * calls. */
void flesh_overlap_add_begin(const flesh_overlap *overlap, const float *wide);
void flesh_overlap_add_end(const flesh_overlap *overlap, const float *wide, float *z);

/* Functions that keep conjugate gradients' residual in the overlap without sending it: r -= alpha s and s = A u + beta s
 * follow from products A u, which ranks add up for all whose overlap has a node. Vectors are in double or single precision,
 * and what is kept is rounded as they are.
 *
 * Starts with r of own nodes and s = 0. */
void flesh_overlap_keep(const flesh_overlap *overlap, int single, const void *r);
/* Sums up y, partial, over all ranks at own nodes, and sets it to zero at ghosts. */
void flesh_overlap_collect_begin(const flesh_overlap *overlap, int single, const void *y);
void flesh_overlap_collect_end(const flesh_overlap *overlap, int single, void *y);
/* Advances r and s by one step, with the y that was collected last. */
void flesh_overlap_advance(const flesh_overlap *overlap, int single, double alpha, double beta);
/* Do what flesh_overlap_fetch and flesh_overlap_restrict do without sending: they take r at own nodes and `scale` times the
 * kept residual elsewhere. */
void flesh_overlap_fetch_kept(const flesh_overlap *overlap, const int *nodes, const float *r, double scale);
void flesh_overlap_restrict_kept(const flesh_overlap *overlap, const float *r, double scale, float *wide);

#endif
