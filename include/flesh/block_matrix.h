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
  /* The slots of the effects' pairs in a pattern that has grown by nodes that came near each other; NULL: the system's
   * own slots. */
  const struct flesh_layout *layout;
  const unsigned char *own; /* [row_start[rows]] 0: only nodes that came near each other have this block; NULL: none */
} flesh_block_matrix;

/* Terms b b^T of a matrix, one of each row b, that are much stiffer than the rest of it: a preconditioner may project
 * them out (FLESH_PRECONDITIONER_VOLUME_PROJECTION). */
typedef struct flesh_stiff_rows {
  int count, nodes_per_row; /* count 0 with nodes in a row: other ranks have the rows */
  /* From this one on, a row's nodes have most of b: the mid-edge nodes of a ten-node tet, at whose corners b vanishes
   * where F is constant. The projection moves these nodes alone. */
  int first_main;
  double ratio;     /* how many times as stiff as what remains, at rest, at most */
  double modulus;   /* Pa, of what remains, at rest, at least */
  int projection_disabled;      /* 1: preconditioners are to leave them in the matrix */
  const int *nodes; /* [count][nodes_per_row] */
  float *values;    /* [count][nodes_per_row][3] b; 0: the matrix has no such term */
} flesh_stiff_rows;

#ifdef __cplusplus
}
#endif
#endif
