/* block_matrix.h: operations on the symmetric 3x3-block matrix of flesh/effect.h. */
#ifndef FLESH_LINEAR_BLOCK_MATRIX_H
#define FLESH_LINEAR_BLOCK_MATRIX_H

#include <stdint.h>

#include "base/team.h"
#include "flesh/block_matrix.h"
#include "flesh/threads.h"

/* Takes a 3x3 block [9], row-major, of a matrix of nodes; FLESH_ERR_MEMORY. */
typedef int (*flesh_block_add)(void *to, int row, int column, const double block[9]);

/* Computes y = A x. */
void flesh_block_multiply(const flesh_block_matrix *A, const double *x, double *y);
/* Computes y = A x for a body whose matrix is the sum of the ranks' A; x is consistent, y collected (base/team.h). */
void flesh_block_multiply_of_team(const flesh_team *team, const flesh_block_matrix *A, const double *x, double *y);

/* A term of a sum of products: scale A x. */
typedef struct flesh_block_term {
  double scale;
  const flesh_block_matrix *A;
  const double *x;
} flesh_block_term;

/* Computes y, the sum of the terms in their order, like flesh_block_multiply_of_team. `room` [3*rows] is work space. */
void flesh_block_sum_of_team(const flesh_team *team, int count, const flesh_block_term *terms, double *room, double *y);
/* Whether A has no block off the diagonal, on any rank. */
int flesh_block_is_diagonal_of_team(const flesh_team *team, const flesh_block_matrix *A);

/* Sets the rows and columns of the fixed dofs [3*rows] to `diagonal` times those of the identity. */
void flesh_block_fix(flesh_block_matrix *A, const uint8_t *fixed, double diagonal, flesh_threads *threads);

/* Lists the rows that flesh_block_fix changes, ascending, in `rows` [A->rows]; returns their number. Reads only the
 * pattern. */
int flesh_block_rows_to_fix(const flesh_block_matrix *A, const uint8_t *fixed, int *rows);

/* Does what flesh_block_fix does, for the listed rows alone. */
void flesh_block_fix_rows(flesh_block_matrix *A, const uint8_t *fixed, double diagonal, int count, const int *rows);

/* Computes A = c A + B, both of one pattern; B NULL: A = c A. With c = 0, nothing of A is read. */
void flesh_block_combine(double c, flesh_block_matrix *A, const flesh_block_matrix *B);

/* Returns the number of the block in this row and column, row <= column: its place in values / 9; -1: none. Reads only the
 * pattern. */
int flesh_block_find(const flesh_block_matrix *A, int row, int column);

/* Whether A has no block off the diagonal. */
int flesh_block_is_diagonal(const flesh_block_matrix *A);

/* Returns a positive number of the size of A's diagonal, for the rows of constrained dofs. */
double flesh_block_mean_diagonal(const flesh_block_matrix *A);

/* Computes B = A^-1 of a symmetric positive definite 3x3 block [9]. Returns 0, with B unchanged, if A is not positive
 * definite. */
int flesh_block_invert(const double A[9], double B[9]);

#endif
