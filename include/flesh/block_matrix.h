/* block_matrix.h: symmetric matrices of 3x3 blocks, which effects fill and linear solvers take. */
#ifndef FLESH_BLOCK_MATRIX_H
#define FLESH_BLOCK_MATRIX_H

#ifdef __cplusplus
extern "C" {
#endif

/* Symmetric matrix of 3x3 blocks, of which the upper triangle is stored by rows: row i holds the blocks (i,
 * column[k]) for row_start[i] <= k < row_end[i], columns ascending, the diagonal block first. Rows lie in memory in
 * an order of their own, near neighbours together, independent of the numbering of the nodes. */
typedef struct flesh_block_matrix {
  int rows;             /* nodes */
  const int *row_start; /* [rows+1], the last one is the number of all blocks */
  const int *row_end;   /* [rows] */
  const int *column;    /* [row_start[rows]] */
  double *values;       /* [9 * row_start[rows]], each block row-major */
  /* Slots of the effects' pairs in a pattern that has grown by nodes that came near each other; NULL: the system's
   * own slots. */
  const struct flesh_layout *layout;
  /* [row_start[rows]] 0: the block exists only because nodes came near each other; NULL: no such block */
  const unsigned char *own;
} flesh_block_matrix;

/* Terms b b^T of a matrix, one for each row b, that are much stiffer than the rest of it: a preconditioner may
 * project them out (FLESH_PRECONDITIONER_VOLUME_PROJECTION). */
typedef struct flesh_stiff_rows {
  int count, nodes_per_row; /* count 0 with nodes_per_row > 0: the rows are on other ranks */
  /* First main node of a row. From this one on, the nodes have most of b: they are the mid-edge nodes of a ten-node
   * tet, at whose corners b vanishes where F is constant. The projection moves these nodes alone. */
  int first_main;
  double ratio;     /* upper bound at rest of the stiffness of the terms relative to the rest of the matrix */
  double modulus;   /* lower bound at rest of the modulus of the rest of the matrix, Pa */
  int projection_disabled;      /* 1: preconditioners must leave the terms in the matrix */
  const int *nodes; /* [count][nodes_per_row] */
  float *values;    /* [count][nodes_per_row][3] b; 0: the matrix has no such term */
} flesh_stiff_rows;

#ifdef __cplusplus
}
#endif
#endif
