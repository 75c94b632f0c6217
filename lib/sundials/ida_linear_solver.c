/* ida_linear_solver.c: Newton's equations of IDA with the velocities eliminated, as a SUNLinearSolver.
 *
 * With b = (b1, b2) the rows x' - v and r: cj dx - dv = b1 and K dx + (C + cj M) dv = b2. A constrained dof has
 * dx = b1, dv = b2, and no other row knows of it.
 *
 * With A = K + cj C + cj^2 M the elimination is A dx = b2 + (C + cj M) b1, dv = cj dx - b1. In short steps cj dx and
 * b1 nearly cancel, and what a truncated solve leaves in dx would swamp dv. So the unknown is w = dx - b1/cj = dv/cj,
 * of which nothing cancels: A w = b2 + (C + cj M) b1 - A b1/cj. */
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "sparse/block_matrix.h"
#include "sundials/compatibility.h"
#include "sundials/ida_problem.h"
#include "sundials/vector.h"

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

/* IDA takes a status that it does not know for success, whatever its sign. */
static int known_flag(solver *self, int status)
{
  self->last_flag = status;
  return status == FLESH_OK ? FLESH_SUN_SUCCESS : status > 0 ? SUNLS_CONV_FAIL : FLESH_SUNLS_FATAL;
}

static int solver_setup(SUNLinearSolver S, SUNMatrix A)
{
  (void)A;
  solver *self = S->content;
  int filled = self->problem->content == FLESH_IDA_CONDENSED;
  return known_flag(self, filled ? flesh_ida_factor(self->problem) : FLESH_NOT_POSITIVE);
}

int flesh_ida_solve_both(flesh_ida_problem *problem, const double *b, int approximately, double *x)
{
  const int n = problem->n;
  const double *b1 = b, *b2 = b + n, cj = problem->cj;
  double *dx = x, *dv = x + n, *right = problem->right, *free1 = problem->change, *Kfree1 = problem->work;
  for (int d = 0; d < n; d++) free1[d] = problem->fixed[d] ? 0 : b1[d];
  flesh_ida_damping_times(problem, free1, right);
  flesh_block_multiply(problem->K, free1, Kfree1);
  for (int d = 0; d < n; d++) right[d] = problem->fixed[d] ? 0 : b2[d] + right[d] - Kfree1[d] / cj;
  double *w = problem->change;
  int status = FLESH_OK;
  if (approximately && problem->preconditioner) flesh_preconditioner_apply(problem->preconditioner, right, w);
  else status = flesh_ida_solve(problem, problem->options.linear_tolerance, right, w);
  if (status) return status;
  for (int d = 0; d < n; d++) {
    int fixed = problem->fixed[d];
    double first = b1[d], second = b2[d];
    dx[d] = fixed ? first : w[d] + first / cj;
    dv[d] = fixed ? second : cj * w[d];
  }
  return FLESH_OK;
}

static int solver_solve(SUNLinearSolver S, SUNMatrix A, N_Vector x, N_Vector b, sunrealtype tolerance)
{
  (void)A, (void)tolerance;
  solver *self = S->content;
  const sunindextype length = 2 * (sunindextype)self->problem->n;
  const double *right = flesh_vector_data(b, length);
  double *solution = right ? flesh_vector_data(x, length) : NULL;
  if (!solution) return known_flag(self, FLESH_ERR_ARGUMENT);
  return known_flag(self, flesh_ida_solve_both(self->problem, right, 0, solution));
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
