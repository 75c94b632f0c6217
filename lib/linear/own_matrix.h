/* own_matrix.h: the matrix among the nodes that a rank owns, for its preconditioner. A rank's matrix is partial
 * (team.h): what other ranks' tets add to nodes between them is missing. Of that the diagonal blocks are added, which
 * leaves the matrix at least as stiff as that of the body; ghosts are cut off, as if they were constrained. */
#ifndef FLESH_LINEAR_OWN_MATRIX_H
#define FLESH_LINEAR_OWN_MATRIX_H

#include "base/team.h"
#include "flesh/block_matrix.h"

typedef struct flesh_own_matrix {
  const flesh_team *team; /* NULL: there is none, and the matrix is the whole */
  flesh_block_matrix view;
  int *row_end;           /* [rows] without the ghosts' columns, which are the last of a row */
  double *saved, *diagonal; /* [9*rows] of the partial matrix; summed up over the ranks */
} flesh_own_matrix;

/* For A's pattern; `team` may be NULL. FLESH_ERR_MEMORY. To be cleared also when it fails. */
int flesh_own_matrix_create(const flesh_block_matrix *A, const flesh_team *team, flesh_own_matrix *own);
void flesh_own_matrix_clear(flesh_own_matrix *own);

/* From here to the end A's diagonal blocks are those of the body, and what is returned is the matrix among own nodes;
 * the identity, scaled, at ghosts. Collective. */
const flesh_block_matrix *flesh_own_matrix_begin(flesh_own_matrix *own, const flesh_block_matrix *A);
void flesh_own_matrix_end(flesh_own_matrix *own, const flesh_block_matrix *A);

#endif
