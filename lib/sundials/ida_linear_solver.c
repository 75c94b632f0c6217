/* ida_linear_solver.c: Newton's equations of IDA with the velocities eliminated, as a SUNLinearSolver.
 *
 * With b = (b1, b2) for the rows x' - v and r: cj dx - dv = b1 and K dx + (C + cj M) dv = b2. A constrained dof has dx =
 * b1, dv = b2, and is in no other row.
 *
 * With A = K + cj C + cj^2 M the elimination is A dx = b2 + (C + cj M) b1, dv = cj dx - b1. In short steps cj dx and b1
 * nearly cancel, and the error of a truncated solve in dx would swamp dv. So the unknown is w = dx - b1/cj = dv/cj, in
 * which nothing cancels: A w = b2 + (C + cj M) b1 - A b1/cj. After sums of matrices the first rows are from_x dx + from_v
 * dv = b1, and cj = -from_x/from_v. */
#include "base/error.h"
#include "sundials/ida_problem.h"
#include "sundials/pair_matrix.h"
#include "sundials/sunlinsol.h"
#include "sundials/vector.h"

typedef struct solver {
  flesh_linear_solver_report report; /* first */
  flesh_ida_problem *problem;
} solver;

static int solver_setup(SUNLinearSolver S, SUNMatrix A)
{
  solver *self = S->content;
  const flesh_pair_matrix *own = flesh_pair_matrix_of(A);
  int status = own && own->view && own->ida == self->problem
                   ? flesh_ida_condense(self->problem)
                   : flesh_fail(FLESH_ERR_ARGUMENT, "the matrix must be this problem's own of flesh_ida_sunmatrix_create");
  return flesh_sunlinsol_flag_setup(&self->report, status ? status : flesh_ida_factor(self->problem));
}

int flesh_ida_solve_both(flesh_ida_problem *problem, const double *b, int approximately, double *x)
{
  const flesh_ida_solver *with = &problem->solver;
  flesh_ida_matrices *J = &problem->jacobian;
  flesh_ida_constraints *held = &problem->constraints;
  const int n = problem->evaluation.n;
  const double *b1 = b, *b2 = b + n, cj = J->cj, from_x = J->rows.from_x, share = cj / from_x;
  double *dx = x, *dv = x + n, *right = with->right, *free1 = with->change, *w = with->change;
  for (int d = 0; d < n; d++) {
    free1[d] = held->fixed[d] ? 0 : b1[d];
    right[d] = held->fixed[d] || d >= problem->evaluation.own ? 0 : b2[d];
  }
  flesh_ida_add_products(problem, share, free1, -from_x, free1, right);
  int status = FLESH_OK;
  if (approximately && with->preconditioner)
    with->linear->preconditioner_apply(with->preconditioner, right, w);
  else status = flesh_ida_solve(problem, problem->options.linear_tolerance, right, w);
  if (status) return status;
  flesh_team_update_ghosts(problem->evaluation.team, w); /* a preconditioner only sets owned nodes */
  for (int d = 0; d < n; d++) {
    int fixed = held->fixed[d];
    double first = b1[d], second = b2[d];
    dx[d] = fixed ? first / J->rows.identity : w[d] + first / from_x;
    dv[d] = fixed ? second / J->rows.identity : cj * w[d];
  }
  return FLESH_OK;
}

static int solver_solve(SUNLinearSolver S, SUNMatrix A, N_Vector x, N_Vector b, sunrealtype tolerance)
{
  (void)A, (void)tolerance;
  solver *self = S->content;
  flesh_ida_problem *problem = self->problem;
  const double *right = flesh_ida_read(problem, b, 1, 0);
  double *solution = right ? flesh_ida_open(problem, x, 1) : NULL;
  if (!solution) return flesh_sunlinsol_flag(&self->report, FLESH_ERR_ARGUMENT);
  int status = flesh_sunlinsol_ready(&self->report);
  if (!status) status = flesh_ida_solve_both(problem, right, 0, solution);
  flesh_ida_close(problem, x, solution);
  return flesh_sunlinsol_flag(&self->report, status);
}

int flesh_ida_sunlinsol_create(flesh_ida_problem *problem, SUNContext context, SUNLinearSolver *linear_solver)
{
  FLESH_NEED({problem, "problem"}, {context, "context"}, {linear_solver, "solver"});
  int status = flesh_sunlinsol_make(sizeof(solver), SUNLINEARSOLVER_DIRECT, context, linear_solver);
  if (status) return status;
  ((solver *)(*linear_solver)->content)->problem = problem;
  (*linear_solver)->ops->setup = solver_setup;
  (*linear_solver)->ops->solve = solver_solve;
  return FLESH_OK;
}
