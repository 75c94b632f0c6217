/* overlap.h: the matrix of a rank's preconditioner, among its own nodes, its ghosts and a layer beyond: its overlap
 * (team.h). A rank's matrix is partial; what the other ranks' tets add, and the rows of nodes beyond, come from
 * those. What each rank finds with its own is added up: additive Schwarz with overlap (Dryja & Widlund 1994). */
#ifndef FLESH_LINEAR_OVERLAP_H
#define FLESH_LINEAR_OVERLAP_H

#include <stddef.h>

#include "base/team.h"
#include "flesh/block_matrix.h"

typedef struct flesh_overlap {
  const flesh_team *team; /* NULL: there is none, and the matrix is A, as it is where the team has no other ranks */
  flesh_block_matrix matrix;
  int *row_start, *column, *own_place; /* the matrix's; [blocks of A] which of its blocks they are */
  int *first_given, *first_taken; /* [ranks+1] of the blocks that each rank gets, and of those that it sends */
  int *given; /* blocks of A that other ranks get, rank by rank */
  int *taken; /* blocks of the matrix to which those of other ranks are added; ~block: transposed */
  double *sent, *received; /* [9] of each, or [3] of each node */
  double *vector, *found; /* [3*overlap] of either */
  double *r, *s;          /* [3*(overlap-own)] what is kept of nodes that others own (overlap_vectors.h) */
  float *weight;  /* [overlap] of what is found with the matrix, on either side of it; 1 in no other overlap */
  int shared_count, *shared; /* nodes that other ranks or their overlaps have, too */
  int *place, *there;        /* [nodes], [overlap]: where vectors and the factor's order have each node */
  int *here, *from;          /* [overlap], [nodes]: where the others have theirs; of nodes beyond `here` is 0 */
} flesh_overlap;

/* The team as solves with matrices of A's pattern need it (flesh_team_narrow): with the ghosts that A has blocks of.
 * `needed` [nodes] is room, of zeros. Collective, and fails on all ranks if one comes with a `status` other than FLESH_OK, of
 * what it has made before, or FLESH_ERR_MEMORY. */
int flesh_overlap_narrow(const flesh_block_matrix *A, const flesh_team *team, int status, uint8_t *needed,
                         const flesh_team **narrow);
/* For A's pattern; `team` may be NULL. overlap->vector begins with the places x [3*A->rows] of the
 * overlap's nodes (NULL: with none). Collective; FLESH_ERR_MEMORY, which ranks that go on have to agree on. To be cleared also
 * when it fails. */
int flesh_overlap_create(const flesh_block_matrix *A, const flesh_team *team, const double *x, flesh_overlap *overlap);
/* How vectors order the rank's nodes, nodes [team->nodes], and how the factor does that is made of the matrix,
 * overlap_order [team->overlap]: before any function of overlap_vectors.h. FLESH_ERR_MEMORY. */
int flesh_overlap_set_orders(flesh_overlap *overlap, const int *nodes, const int *overlap_order);
void flesh_overlap_clear(flesh_overlap *overlap);

/* In overlap->vector all nodes get the numbers of their owners. Collective. */
void flesh_overlap_update_vector(const flesh_overlap *overlap);
/* The matrix, of A's values. Collective. */
const flesh_block_matrix *flesh_overlap_update(flesh_overlap *overlap, const flesh_block_matrix *A);

#endif
