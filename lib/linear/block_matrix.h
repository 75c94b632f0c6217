/* block_matrix.h: operations on the symmetric 3x3-block matrix of flesh/effect.h. */
#ifndef FLESH_LINEAR_BLOCK_MATRIX_H
#define FLESH_LINEAR_BLOCK_MATRIX_H

#include <stdint.h>

#include "base/team.h"
#include "flesh/block_matrix.h"
#include "flesh/threads.h"

/* Takes a block [9], row by row, of a matrix of nodes; FLESH_ERR_MEMORY. */
typedef int (*flesh_block_add)(void *to, int row, int column, const double block[9]);

/* y = A x. */
void flesh_block_multiply(const flesh_block_matrix *A, const double *x, double *y);
/* y = A x of a body whose matrix is the sum of the ranks' A; x is consistent, y collected (base/team.h). */
void flesh_block_multiply_of_team(const flesh_team *team, const flesh_block_matrix *A, const double *x, double *y);

/* A term of a sum of products: scale A x. */
typedef struct flesh_block_term {
  double scale;
  const flesh_block_matrix *A;
  const double *x;
} flesh_block_term;

/* Likewise y = the sum of the terms, in their order. `room` [3*rows]. */
void flesh_block_sum_of_team(const flesh_team *team, int count, const flesh_block_term *terms, double *room, double *y);
/* Whether no node's row knows of another node, on any rank. */
int flesh_block_is_diagonal_of_team(const flesh_team *team, const flesh_block_matrix *A);

/* Turns the rows and columns of the fixed dofs [3*rows] into `diagonal` times those of the
 * identity. */
void flesh_block_fix(flesh_block_matrix *A, const uint8_t *fixed, double diagonal, flesh_threads *threads);

/* The rows that this changes, ascending, into `rows` [A->rows]; returns how many. Only the pattern is read. */
int flesh_block_rows_to_fix(const flesh_block_matrix *A, const uint8_t *fixed, int *rows);

/* Like flesh_block_fix, for these rows alone. */
void flesh_block_fix_rows(flesh_block_matrix *A, const uint8_t *fixed, double diagonal, int count, const int *rows);

/* A = c A + B, both of one pattern; B NULL: A = c A. Nothing of A is read where c is 0. */
void flesh_block_combine(double c, flesh_block_matrix *A, const flesh_block_matrix *B);

/* Which block A has in this row and column, row <= column: its place in values / 9; -1: none. Only the pattern is read. */
int flesh_block_find(const flesh_block_matrix *A, int row, int column);

/* Whether no node's row knows of another node. */
int flesh_block_is_diagonal(const flesh_block_matrix *A);

/* A positive number of the size of A's diagonal, for the rows of constrained dofs. */
double flesh_block_mean_diagonal(const flesh_block_matrix *A);

/* B = A^-1 of a symmetric positive definite 3x3 block [9]; 0 when A is not positive definite (B
 * untouched). */
int flesh_block_invert(const double A[9], double B[9]);

#endif
