/* linear_solver.c: the Newton step as a SUNLinearSolver: the step that it returns is already scaled by the line search. */
#include "base/error.h"
#include "sundials/problem.h"
#include "sundials/sunlinsol.h"
#include "sundials/vector.h"

typedef struct solver {
  flesh_linear_solver_report report; /* first */
  flesh_problem *problem;
  N_Vector scaling; /* scaling of the residual, from KINSOL; NULL: none */
} solver;

/* Accepts KINSOL's function for products, which is not used: products are by the block matrix. */
static int solver_set_products(SUNLinearSolver S, void *data, SUNATimesFn times)
{
  (void)S, (void)data, (void)times;
  return 0;
}

static int solver_set_scaling(SUNLinearSolver S, N_Vector residual_scaling, N_Vector unknown_scaling)
{
  (void)unknown_scaling;
  ((solver *)S->content)->scaling = residual_scaling;
  return 0;
}

static int solver_setup(SUNLinearSolver S, SUNMatrix A)
{
  solver *self = S->content;
  if (!A || !flesh_problem_owns_matrix(self->problem, A))
    return self->report.last_flag =
               flesh_fail(FLESH_ERR_ARGUMENT, "the matrix must be this problem's own of flesh_sunmatrix_create");
  return self->report.last_flag = flesh_newton_prepare(&self->problem->newton, !self->problem->zeroed);
}

static int solver_solve(SUNLinearSolver S, SUNMatrix A, N_Vector x, N_Vector b, sunrealtype tolerance)
{
  (void)A;
  solver *self = S->content;
  flesh_newton *newton = &self->problem->newton;
  const double *right = flesh_problem_read(self->problem, b, 1, 0);
  double *p = right ? flesh_problem_open(self->problem, x, 1) : NULL;
  if (!p) return self->report.last_flag = FLESH_ERR_ARGUMENT;
  const double *weights = self->scaling ? flesh_problem_read(self->problem, self->scaling, 0, 2) : NULL;
  const int assemblies = newton->stats.assemblies;
  self->report.last_flag = flesh_newton_step(newton, weights, right, tolerance, p);
  flesh_problem_close(self->problem, x, p);
  if (newton->stats.assemblies > assemblies) self->problem->zeroed = 0;
  self->report.iterations = newton->direction.iterations;
  self->report.residual = newton->direction.residual;
  return self->report.last_flag;
}

int flesh_sunlinsol_create(flesh_problem *problem, SUNContext context, SUNLinearSolver *linear_solver)
{
  FLESH_NEED({problem, "problem"}, {context, "context"}, {linear_solver, "solver"});
  int status = flesh_sunlinsol_make(sizeof(solver), SUNLINEARSOLVER_MATRIX_ITERATIVE, context, linear_solver);
  if (status) return status;
  SUNLinearSolver S = *linear_solver;
  ((solver *)S->content)->problem = problem;
  S->ops->setatimes = solver_set_products;
  S->ops->setscalingvectors = solver_set_scaling;
  S->ops->setup = solver_setup;
  S->ops->solve = solver_solve;
  return FLESH_OK;
}
