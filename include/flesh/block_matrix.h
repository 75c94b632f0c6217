/* block_matrix.h: symmetric matrices of 3x3 blocks: effects fill them, linear solvers take them. */
#ifndef FLESH_BLOCK_MATRIX_H
#define FLESH_BLOCK_MATRIX_H


#ifdef __cplusplus
extern "C" {
#endif

/* Symmetric matrix of 3x3 blocks, upper triangle by rows: row i holds the blocks (i, column[k]) for
 * row_start[i] <= k < row_end[i], columns ascending, the diagonal block first. Rows lie in memory
 * in an order of their own: neighbours near each other, however the nodes are numbered. */
typedef struct flesh_block_matrix {
  int rows;             /* nodes */
  const int *row_start; /* [rows+1], the last the number of all blocks */
  const int *row_end;   /* [rows] */
  const int *column;    /* [row_start[rows]] */
  double *values;       /* [9 * row_start[rows]], each block row-major */
} flesh_block_matrix;

#ifdef __cplusplus
}
#endif
#endif
