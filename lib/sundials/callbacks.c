/* callbacks.c: the functions that KINSOL calls. */
#include <stdlib.h>
#include <sunmatrix/sunmatrix_sparse.h>

#include "base/error.h"
#include "linear/block_matrix.h"
#include "sundials/problem.h"
#include "sundials/vector.h"

/* Returns the problem of user_data; NULL, with a sentence, if there is none, or if it has no stage and so no equations. */
static flesh_problem *problem_of(const void *user_data)
{
  flesh_problem *problem = flesh_user_data_problem(user_data, "flesh_problem");
  if (!problem) return NULL;
  if (problem->staged) return problem;
  flesh_fail(FLESH_ERR_ARGUMENT, "the flesh_problem has no stage; flesh_problem_set_stage comes first");
  return NULL;
}

/* KINSOL takes a positive code as "try a shorter step" and gives up at a negative one. */
static int callback_status(const flesh_problem *problem, int status)
{
  if (status > 0 && problem->newton.options.line_search == FLESH_LINE_SEARCH_NONE) return -1;
  return status;
}

int flesh_kinsol_residual(N_Vector u, N_Vector r, void *data)
{
  flesh_problem *problem = problem_of(data);
  if (!problem) return FLESH_ERR_ARGUMENT;
  const double *at = flesh_problem_read(problem, u, 0, 0);
  double *values = at ? flesh_problem_open(problem, r, 1) : NULL;
  if (!values) return FLESH_ERR_ARGUMENT;
  const int status = flesh_equations_residual(&problem->newton.equations, at, values);
  flesh_problem_close(problem, r, values);
  return callback_status(problem, status);
}

static int fill_sparse(flesh_problem *problem, SUNMatrix J)
{
  if (!problem->view.starts) {
    int status = flesh_scalar_view_create(problem->newton.equations.K, &problem->view);
    if (status) return status;
  }
  const flesh_scalar_view *view = &problem->view;
  if (SUNSparseMatrix_Rows(J) != view->n || SUNSparseMatrix_Columns(J) != view->n ||
      SUNSparseMatrix_NNZ(J) < view->entries)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "the sparse matrix is %lld x %lld with room for %lld entries; it must be %lld x "
                      "%lld with %lld",
                      (long long)SUNSparseMatrix_Rows(J), (long long)SUNSparseMatrix_Columns(J),
                      (long long)SUNSparseMatrix_NNZ(J), (long long)view->n, (long long)view->n,
                      (long long)view->entries);
  sunindextype *starts = SUNSparseMatrix_IndexPointers(J), *indices = SUNSparseMatrix_IndexValues(J);
  for (int64_t k = 0; k <= view->n; k++) starts[k] = (sunindextype)view->starts[k];
  for (int64_t k = 0; k < view->entries; k++) indices[k] = (sunindextype)view->indices[k];
  flesh_scalar_view_fill(view, problem->newton.equations.K, SUNSparseMatrix_Data(J));
  return FLESH_OK;
}

sunindextype flesh_problem_entries(const flesh_problem *problem)
{
  const flesh_block_matrix *K = problem->newton.equations.K;
  return flesh_sunindex(9 * (2 * (int64_t)K->row_start[K->rows] - K->rows));
}

int flesh_kinsol_jacobian(N_Vector u, N_Vector r, SUNMatrix J, void *data, N_Vector w1, N_Vector w2)
{
  FLESH_NEED({J, "J"});
  (void)w1, (void)w2;
  flesh_problem *problem = problem_of(data);
  if (!problem) return FLESH_ERR_ARGUMENT;
  const double *at = flesh_problem_read(problem, u, 0, 0);
  if (!at) return FLESH_ERR_ARGUMENT;
  const int sparse = SUNMatGetID(J) == SUNMATRIX_SPARSE;
  if (sparse && problem->newton.equations.evaluation.proximity.near)
    return flesh_fail(FLESH_ERR_ARGUMENT, "bodies touch each other, so that the Jacobian's pattern grows: it needs the "
                                          "problem's own matrix of flesh_sunmatrix_create, not a SUNSparseMatrix");
  if (sparse && problem->newton.equations.team)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the body is shared out among ranks, but a SUNSparseMatrix is for a single rank; take "
                                          "the problem's own matrix of flesh_sunmatrix_create");
  if (!sparse && !flesh_problem_owns_matrix(problem, J))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the matrix is neither a SUNSparseMatrix nor this problem's own of "
                                          "flesh_sunmatrix_create");
  const double *residual = r && !sparse ? flesh_problem_read(problem, r, 1, 1) : NULL;
  int status = flesh_newton_matrix(&problem->newton, at, residual);
  if (!status) problem->zeroed = 0;
  if (!status && sparse) status = fill_sparse(problem, J);
  return callback_status(problem, status);
}

int flesh_kinsol_jacobian_times(N_Vector v, N_Vector Jv, N_Vector u, flesh_sunboolean *new_u,
                                void *data)
{
  (void)u, (void)new_u;
  flesh_problem *problem = problem_of(data);
  if (!problem) return FLESH_ERR_ARGUMENT;
  const flesh_equations *equations = &problem->newton.equations;
  const double *x = flesh_problem_read(problem, v, 0, 0);
  double *y = x ? flesh_problem_open(problem, Jv, 1) : NULL;
  if (!y) return FLESH_ERR_ARGUMENT;
  if (!problem->newton.direction.assembled)
    return flesh_fail(FLESH_ERR_ARGUMENT, "flesh_kinsol_jacobian_times needs flesh_kinsol_jacobian or "
                                          "flesh_kinsol_preconditioner_setup before it");
  flesh_block_multiply_of_team(equations->team, equations->K, x, y);
  const double curvature = flesh_dot(equations->threads, equations->n, x, y);
  const int is_zero = flesh_largest(equations->threads, equations->n, x) == 0;
  flesh_problem_close(problem, Jv, y);
  return curvature > 0 || is_zero ? FLESH_OK : FLESH_NOT_POSITIVE;
}

int flesh_kinsol_preconditioner_setup(N_Vector u, N_Vector uscale, N_Vector fval, N_Vector fscale,
                                      void *data)
{
  (void)uscale, (void)fval, (void)fscale;
  flesh_problem *problem = problem_of(data);
  if (!problem) return FLESH_ERR_ARGUMENT;
  const double *at = flesh_problem_read(problem, u, 0, 0);
  if (!at) return FLESH_ERR_ARGUMENT;
  int status = flesh_newton_matrix(&problem->newton, at, NULL);
  if (!status) status = flesh_matrix_policy_refresh(&problem->newton.policy);
  return callback_status(problem, status);
}

int flesh_kinsol_preconditioner_solve(N_Vector u, N_Vector uscale, N_Vector fval, N_Vector fscale,
                                      N_Vector z, void *data)
{
  (void)u, (void)uscale, (void)fval, (void)fscale;
  flesh_problem *problem = problem_of(data);
  if (!problem) return FLESH_ERR_ARGUMENT;
  if (!flesh_problem_read(problem, z, 1, 0)) return FLESH_ERR_ARGUMENT;
  double *values = flesh_problem_open(problem, z, 0);
  if (!problem->newton.direction.prepared)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "flesh_kinsol_preconditioner_solve needs flesh_kinsol_preconditioner_setup before it");
  const int status = flesh_direction_precondition(&problem->newton.direction, values);
  flesh_problem_close(problem, z, values);
  return status;
}
