/* diagonal_blocks.h: what preconditioners ask of a matrix's diagonal blocks: how large they are, and their inverses. */
#ifndef FLESH_LINEAR_DIAGONAL_BLOCKS_H
#define FLESH_LINEAR_DIAGONAL_BLOCKS_H

#include "base/isa.h"
#include "base/team.h"
#include "flesh/block_matrix.h"

/* The largest size of a diagonal entry; infinite where one is no number. `threads` may be NULL. */
FLESH_PER_ISA double flesh_diagonal_largest(const flesh_block_matrix *A, flesh_threads *threads);

/* inverse [9*rows] of scale times the first blocks of A, as many as `rows`; of one that has none, nearly. */
FLESH_PER_ISA void flesh_diagonal_invert(const flesh_block_matrix *A, int rows, double scale, float *inverse);
/* Inverts the sums of the diagonal blocks of all ranks' partial A, for the nodes of this one: the same bits for owners
 * and ghosts. blocks [9*A->rows] is room. Collective. */
FLESH_PER_ISA void flesh_diagonal_invert_sums(const flesh_block_matrix *A, const flesh_team *team, double scale,
                                              double *blocks, float *inverse);

#endif
