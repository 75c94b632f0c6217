/* ode_problem.h: the equations of motion as y' = f(t, y); what the callbacks of CVODE and ARKODE, their matrix and
 * their linear solver share. */
#ifndef FLESH_SUNDIALS_ODE_PROBLEM_H
#define FLESH_SUNDIALS_ODE_PROBLEM_H

#include "flesh/ode.h"
#include "sundials/ida_problem.h"

/* M + gamma C + gamma^2 K and what it takes to solve with it. */
typedef struct flesh_ode_condensed {
  flesh_block_matrix *A, *C; /* C: of the preconditioner */
  int damped;                /* C is not zero */
  double gamma;
  flesh_preconditioner_data *preconditioner;
  flesh_direct *direct;
} flesh_ode_condensed;

struct flesh_ode_problem {
  flesh_user_data head; /* first */
  flesh_ida_problem *motion; /* after a start: M in D, M of the free dofs in K, factored */
  int n;
  double *inverse;     /* [3*n] 3x3 blocks of M^-1 where mass_is_diagonal */
  int mass_is_diagonal;
  double *rate, *room; /* [2*n], [2*n] */
  flesh_block_matrix *K, *C; /* dr/dx, dr/dv for the products; NULL before they are wanted */
  int damped;
  flesh_ode_condensed condensed; /* NULL matrices before it is wanted */
};

/* NULL, with words, where user_data leads to none. */
flesh_ode_problem *flesh_ode_problem_of(const void *user_data);
/* y = M^-1 b on the free dofs, b being 0 on the others. y and b must not overlap. Of a part of a body b is collected, and
 * y is that of own nodes (base/team.h). */
int flesh_ode_divide_by_mass(flesh_ode_problem *problem, const double *b, double *y);
/* K = dr/dx and C = dr/dv at (t, y) of the free dofs; whether C is not zero, on any rank. */
int flesh_ode_assemble(flesh_ode_problem *problem, double t, const double *y, int project, flesh_block_matrix *K,
                       flesh_block_matrix *C, int *damped);
/* Memory for the condensed matrix and the options' solver. */
int flesh_ode_make_condensed(flesh_ode_problem *problem, int damping);
/* Prepares that solver for condensed.A. */
int flesh_ode_factor(flesh_ode_problem *problem);

#endif
