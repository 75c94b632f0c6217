/* ida_linear_solver.c: Newton's equations of IDA with the velocities eliminated, as a SUNLinearSolver.
 *
 * With b = (b1, b2) the rows x' - v and r: cj dx - dv = b1 and K dx + (C + cj M) dv = b2. A constrained dof has
 * dx = b1, dv = b2, and no other row knows of it. */
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "sundials/ida_problem.h"

typedef struct solver {
  flesh_ida_problem *problem;
  int last_flag;
} solver;

static SUNLinearSolver_Type solver_type(SUNLinearSolver S)
{
  (void)S;
  return SUNLINEARSOLVER_DIRECT;
}

static int solver_initialize(SUNLinearSolver S)
{
  ((solver *)S->content)->last_flag = 0;
  return 0;
}

static int solver_setup(SUNLinearSolver S, SUNMatrix A)
{
  (void)A;
  solver *self = S->content;
  return self->last_flag = flesh_ida_factor(self->problem);
}

static int solver_solve(SUNLinearSolver S, SUNMatrix A, N_Vector x, N_Vector b, sunrealtype tolerance)
{
  (void)A, (void)tolerance;
  solver *self = S->content;
  flesh_ida_problem *problem = self->problem;
  const int n = problem->n;
  const double *b1 = N_VGetArrayPointer(b), *b2 = b1 + n, cj = problem->cj;
  double *dx = N_VGetArrayPointer(x), *dv = dx + n, *right = problem->right;
  /* D has no entries in constrained rows and columns. */
  flesh_ida_damping_times(problem, b1, right);
  for (int d = 0; d < n; d++) right[d] = problem->fixed[d] ? 0 : right[d] + b2[d];
  int status = flesh_ida_solve(problem, problem->options.linear_tolerance, right, problem->change);
  if (status) return self->last_flag = status;
  for (int d = 0; d < n; d++) {
    int fixed = problem->fixed[d];
    double step = problem->change[d], slope = b2[d];
    dv[d] = fixed ? slope : cj * step - b1[d];
    dx[d] = fixed ? b1[d] : step;
  }
  return self->last_flag = FLESH_OK;
}

static sunindextype solver_last_flag(SUNLinearSolver S) { return ((solver *)S->content)->last_flag; }

static int solver_free(SUNLinearSolver S)
{
  if (!S) return 0;
  free(S->content);
  S->content = NULL;
  SUNLinSolFreeEmpty(S);
  return 0;
}

int flesh_ida_sunlinsol_create(flesh_ida_problem *problem, SUNContext context, SUNLinearSolver *linear_solver)
{
  SUNLinearSolver S = SUNLinSolNewEmpty(context);
  solver *self = calloc(1, sizeof *self);
  if (!S || !self) {
    free(self);
    if (S) SUNLinSolFreeEmpty(S);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a SUNLinearSolver");
  }
  self->problem = problem;
  S->content = self;
  S->ops->gettype = solver_type;
  S->ops->initialize = solver_initialize;
  S->ops->setup = solver_setup;
  S->ops->solve = solver_solve;
  S->ops->lastflag = solver_last_flag;
  S->ops->free = solver_free;
  *linear_solver = S;
  return FLESH_OK;
}
