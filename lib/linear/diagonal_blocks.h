/* diagonal_blocks.h: largest entry and inverses of a matrix's diagonal blocks, for preconditioners. */
#ifndef FLESH_LINEAR_DIAGONAL_BLOCKS_H
#define FLESH_LINEAR_DIAGONAL_BLOCKS_H

#include "base/isa.h"
#include "base/team.h"
#include "flesh/block_matrix.h"

/* Returns the largest absolute value on the diagonal; infinite where one is no number. `threads` may be NULL. */
FLESH_PER_ISA double flesh_diagonal_largest(const flesh_block_matrix *A, flesh_threads *threads);

/* Computes inverse [9*rows], the inverses of scale times A's first `rows` diagonal blocks; a singular block has an
 * approximate one. */
FLESH_PER_ISA void flesh_diagonal_invert(const flesh_block_matrix *A, int rows, double scale, float *inverse);
/* Inverts, for this rank's nodes, the sums of the diagonal blocks of all ranks' partial A, with the same bits at owners and
 * ghosts. blocks [9*A->rows] is work space. Collective. */
FLESH_PER_ISA void flesh_diagonal_invert_sums(const flesh_block_matrix *A, const flesh_team *team, double scale,
                                              double *blocks, float *inverse);

#endif
