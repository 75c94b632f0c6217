/* pair_matrix.h: matrices of y = (x, v) [2N x 2N] as SUNDIALS' SUNMatrix: of every free dof the rows
 *
 *   from_x x + from_v v          and          K x + D v, divided by the mass where there is one,
 *
 * of a constrained dof `identity` times those of the identity. Jacobians of F(t, y, y') and of f(t, y) have this
 * shape, and so have their sums with each other and with the identity. */
#ifndef FLESH_SUNDIALS_PAIR_MATRIX_H
#define FLESH_SUNDIALS_PAIR_MATRIX_H

#include <sundials/sundials_matrix.h>

#include "sundials/ida_problem.h"
#include "sundials/ode_problem.h"

typedef struct flesh_pair_matrix {
  flesh_ida_problem *ida;   /* the problem whose dofs these are: one of the two */
  flesh_ode_problem *rhs;   /* its mass divides the rows K x + D v */
  int view;                 /* of what `ida` holds: K and D are its own */
  flesh_block_matrix *K, *D; /* rows and columns of constrained dofs are zero */
  flesh_ida_rows rows;
} flesh_pair_matrix;

/* A view of the matrix in `ida`, or a matrix for `rhs` with memory of its own. Returns new. */
int flesh_pair_matrix_create(flesh_ida_problem *ida, flesh_ode_problem *rhs, SUNContext context, SUNMatrix *matrix);
/* NULL where it is none of these. */
flesh_pair_matrix *flesh_pair_matrix_of(SUNMatrix A);

#endif
