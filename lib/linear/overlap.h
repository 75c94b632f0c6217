/* overlap.h: the matrix of a rank's preconditioner, among its own nodes, its ghosts and a layer beyond: its overlap
 * (team.h). A rank's matrix is partial; contributions of the other ranks' tets, and the rows of nodes beyond, come from
 * these ranks. The corrections that the ranks find with their matrices are added up: additive Schwarz with overlap (Dryja &
 * Widlund 1994). */
#ifndef FLESH_LINEAR_OVERLAP_H
#define FLESH_LINEAR_OVERLAP_H

#include "base/team.h"
#include "flesh/block_matrix.h"

typedef struct flesh_overlap {
  const flesh_team *team; /* NULL: there is none; the matrix is then A, as in a team without other ranks */
  flesh_block_matrix matrix;
  int *row_start, *column, *own_place; /* pattern of the matrix; [blocks of A] their places in it */
  int *first_given, *first_taken; /* [ranks+1] first of the blocks that each rank is given, and of those taken from it */
  int *given; /* blocks of A that are given to other ranks, rank by rank */
  int *taken; /* blocks of the matrix to which blocks taken from other ranks are added; ~block: transposed */
  double *sent, *received; /* messages: [9] for each block, or [3] for each node */
  double *vector, *found; /* [3*overlap] each */
  double *r, *s;          /* [3*(overlap-own)] the residual kept at nodes that others own (overlap_vectors.h) */
  float *weight;  /* [overlap] weights of corrections, on either side of the matrix; 1 at nodes that no other overlap has */
  int shared_count, *shared; /* nodes that other ranks, or their overlaps, have, too */
  int *place, *there;        /* [nodes], [overlap]: place of each node in vectors and in the factor's order */
  /* [overlap], [nodes]: for each place in one, the place in the other; `here` is 0 for nodes beyond */
  int *here, *from;
} flesh_overlap;

/* Narrows the team to what solves with matrices of A's pattern need (flesh_team_narrow): the ghosts of which A has blocks.
 * `needed` [nodes] is work space, all zero. Collective; fails on all ranks if one passes a `status` other than FLESH_OK
 * from earlier work, or with FLESH_ERR_MEMORY. */
int flesh_overlap_narrow(const flesh_block_matrix *A, const flesh_team *team, int status, uint8_t *needed,
                         const flesh_team **narrow);
/* Makes the overlap for A's pattern; `team` may be NULL. overlap->vector then begins with the positions of the overlap's
 * nodes, from the rank's x [3*A->rows] (NULL: not). Collective; FLESH_ERR_MEMORY, on which ranks must agree before they go
 * on. Clear it also after a failure. */
int flesh_overlap_create(const flesh_block_matrix *A, const flesh_team *team, const double *x, flesh_overlap *overlap);
/* Sets the orders of the rank's nodes in vectors, nodes [team->nodes], and in the factor of the matrix, overlap_order
 * [team->overlap]. Call it before any function of overlap_vectors.h. FLESH_ERR_MEMORY. */
int flesh_overlap_set_orders(flesh_overlap *overlap, const int *nodes, const int *overlap_order);
void flesh_overlap_clear(flesh_overlap *overlap);

/* Sets the values of all nodes in overlap->vector to those of their owners. Collective. */
void flesh_overlap_update_vector(const flesh_overlap *overlap);
/* Returns the matrix, updated from A's values. Collective. */
const flesh_block_matrix *flesh_overlap_update(flesh_overlap *overlap, const flesh_block_matrix *A);

#endif
