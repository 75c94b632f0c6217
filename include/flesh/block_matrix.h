/* block_matrix.h: symmetric matrices of 3x3 blocks, which effects fill and linear solvers use. */
#ifndef FLESH_BLOCK_MATRIX_H
#define FLESH_BLOCK_MATRIX_H

#ifdef __cplusplus
extern "C" {
#endif

/* Symmetric matrix of 3x3 blocks, upper triangle by rows: row i holds the blocks (i, column[k]) for row_start[i] <=
 * k < row_end[i], columns ascending, the diagonal block first. Rows are stored in an order that keeps neighbours
 * close in memory, whatever the numbering of the nodes. */
typedef struct flesh_block_matrix {
  int rows;             /* number of block rows: one for each node */
  const int *row_start; /* [rows+1]; the last entry is the number of all blocks */
  const int *row_end;   /* [rows] */
  const int *column;    /* [row_start[rows]] */
  double *values;       /* [9 * row_start[rows]], each block row-major */
  /* Slots of the effects' pairs in a pattern that has grown by pairs of nodes that came near each other; NULL: the
   * pattern has the system's own slots. */
  const struct flesh_layout *layout;
  /* [row_start[rows]] 0: the block is there only for nodes that came near each other; NULL: no block is */
  const unsigned char *own;
} flesh_block_matrix;

/* Terms b b^T of a matrix, one for each row vector b, that are much stiffer than the rest of the matrix. A
 * preconditioner may project them out (FLESH_PRECONDITIONER_VOLUME_PROJECTION). */
typedef struct flesh_stiff_rows {
  int count, nodes_per_row; /* count 0 but nodes_per_row > 0: only other ranks have rows */
  /* Index of the first node in a row that carries most of b: the mid-edge nodes of a ten-node tet, as b vanishes at
   * its corners where F is constant. The projection moves only the nodes from this one on. */
  int first_main;
  double ratio;     /* largest ratio of the stiffness of a term to that of the rest of the matrix, at rest */
  double modulus;   /* Pa, smallest modulus of the rest of the matrix, at rest */
  int projection_disabled;      /* 1: preconditioners must leave the terms in the matrix */
  const int *nodes; /* [count][nodes_per_row] */
  float *values;    /* [count][nodes_per_row][3] b; 0: the matrix has no such term */
} flesh_stiff_rows;

#ifdef __cplusplus
}
#endif
#endif
