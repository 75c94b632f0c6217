/* ode_problem.h: the equations of motion as y' = f(t, y), for the callbacks of CVODE and ARKODE, their matrix and their
 * linear solver. */
#ifndef FLESH_SUNDIALS_ODE_PROBLEM_H
#define FLESH_SUNDIALS_ODE_PROBLEM_H

#include "flesh/ode.h"
#include "sundials/ida_problem.h"

/* M + gamma C + gamma^2 K and its solver. */
typedef struct flesh_ode_condensed {
  flesh_block_matrix *A, *C; /* C: for the preconditioner */
  int damped;                /* 1: C is not zero */
  double gamma;
  flesh_preconditioner_data *preconditioner;
  flesh_direct *direct;
} flesh_ode_condensed;

struct flesh_ode_problem {
  flesh_user_data head; /* first */
  flesh_ida_problem *motion; /* after a start: D is M, K is M of the free dofs, factored */
  int n;
  double *inverse;     /* [3*n] 3x3 blocks of M^-1 where mass_is_diagonal */
  int mass_is_diagonal;
  double *rate, *room; /* [2*n], [2*n] */
  flesh_block_matrix *K, *C; /* dr/dx, dr/dv for the products; NULL until they are needed */
  int damped;
  flesh_ode_condensed condensed; /* its matrices are NULL until they are needed */
};

/* Returns the problem of user_data; NULL, with a sentence, if there is none. */
flesh_ode_problem *flesh_ode_problem_of(const void *user_data);
/* Computes y = M^-1 b on the free dofs; b is 0 on the others. y and b must not overlap. On a part of a body b is collected,
 * and y is set at own nodes (base/team.h). */
int flesh_ode_divide_by_mass(flesh_ode_problem *problem, const double *b, double *y);
/* Assembles K = dr/dx and C = dr/dv of the free dofs at (t, y); *damped: whether C is not zero, on any rank. */
int flesh_ode_assemble(flesh_ode_problem *problem, double t, const double *y, int project, flesh_block_matrix *K,
                       flesh_block_matrix *C, int *damped);
/* Allocates the condensed matrix and the options' solver. */
int flesh_ode_make_condensed(flesh_ode_problem *problem, int damping);
/* Prepares that solver for condensed.A. */
int flesh_ode_factor(flesh_ode_problem *problem);

#endif
