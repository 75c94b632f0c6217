/* pair_matrix.h: matrices of y = (x, v) [2N x 2N] as SUNDIALS' SUNMatrix. A free dof has the rows
 *
 *   from_x x + from_v v          and          K x + D v, divided by the mass if there is one;
 *
 * a constrained dof has `identity` times those of the identity. Jacobians of F(t, y, y') and of f(t, y) have this form, and
 * so have their sums with each other and with the identity. */
#ifndef FLESH_SUNDIALS_PAIR_MATRIX_H
#define FLESH_SUNDIALS_PAIR_MATRIX_H

#include <sundials/sundials_matrix.h>

#include "sundials/ida_problem.h"
#include "sundials/ode_problem.h"

typedef struct flesh_pair_matrix {
  flesh_ida_problem *ida;   /* problem of these dofs; either this or `rhs` is NULL */
  flesh_ode_problem *rhs;   /* problem whose mass divides the rows K x + D v */
  int view;                 /* 1: a view of the matrix in `ida`, which owns K and D */
  flesh_block_matrix *K, *D; /* rows and columns of constrained dofs are zero */
  flesh_ida_rows rows;
} flesh_pair_matrix;

/* Makes a view of the matrix in `ida`, or a matrix for `rhs` with memory of its own. Returns new. */
int flesh_pair_matrix_create(flesh_ida_problem *ida, flesh_ode_problem *rhs, SUNContext context, SUNMatrix *matrix);
/* Returns the pair matrix of a SUNMatrix; NULL where it is none. */
flesh_pair_matrix *flesh_pair_matrix_of(SUNMatrix A);

#endif
