/* callbacks.c: the functions that KINSOL calls. */
#include <stdlib.h>
#include <string.h>
#include <sunmatrix/sunmatrix_sparse.h>

#include "base/error.h"
#include "sparse/block_matrix.h"
#include "sundials/problem.h"
#include "sundials/vector.h"

/* NULL, with words, where user_data leads to none. */
static flesh_problem *problem_of(const void *user_data)
{
  flesh_problem *problem = flesh_first_member(user_data);
  if (problem && problem->self == problem) return problem;
  flesh_fail_user_data("flesh_problem");
  return NULL;
}

/* KINSOL takes a positive code as "try a shorter step" and gives up at a negative one. */
static int callback_status(const flesh_problem *problem, int status)
{
  if (status > 0 && problem->options.globalization == FLESH_GLOBALIZATION_NONE) return -1;
  return status;
}

int flesh_kinsol_residual(N_Vector u, N_Vector r, void *data)
{
  flesh_problem *problem = problem_of(data);
  if (!problem) return FLESH_ERR_ARGUMENT;
  const double *at = flesh_vector_data(u, problem->n);
  double *values = at ? flesh_vector_data(r, problem->n) : NULL;
  if (!values) return FLESH_ERR_ARGUMENT;
  return callback_status(problem, flesh_problem_residual(problem, at, values));
}

static int fill_sparse(flesh_problem *problem, SUNMatrix J)
{
  if (!problem->view.starts) {
    int status = flesh_scalar_view_create(problem->K, &problem->view);
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
  flesh_scalar_view_fill(view, problem->K, SUNSparseMatrix_Data(J));
  return FLESH_OK;
}

sunindextype flesh_problem_entries(const flesh_problem *problem)
{
  return 9 * (2 * (sunindextype)problem->K->row_start[problem->K->rows] - problem->K->rows);
}

int flesh_kinsol_jacobian(N_Vector u, N_Vector r, SUNMatrix J, void *data, N_Vector w1, N_Vector w2)
{
  (void)w1, (void)w2;
  flesh_problem *problem = problem_of(data);
  if (!problem) return FLESH_ERR_ARGUMENT;
  const double *at = flesh_vector_data(u, problem->n);
  if (!at) return FLESH_ERR_ARGUMENT;
  int project = problem->options.projection == FLESH_PROJECTION_ALWAYS, sparse = SUNMatGetID(J) == SUNMATRIX_SPARSE;
  if (!sparse && !flesh_problem_owns_matrix(problem, J))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the matrix is neither a SUNSparseMatrix nor this problem's own of "
                                          "flesh_sunmatrix_create");
  const double *residual = r && !sparse ? flesh_vector_data(r, problem->n) : NULL;
  if (residual && flesh_problem_keep_matrix(problem, at, residual)) return 0;
  int status = flesh_problem_assemble(problem, at, project);
  if (!status && sparse) status = fill_sparse(problem, J);
  return callback_status(problem, status);
}

int flesh_kinsol_jacobian_times(N_Vector v, N_Vector Jv, N_Vector u, flesh_sunboolean *new_u,
                                void *data)
{
  (void)u, (void)new_u;
  flesh_problem *problem = problem_of(data);
  if (!problem) return FLESH_ERR_ARGUMENT;
  const double *x = flesh_vector_data(v, problem->n);
  double *y = x ? flesh_vector_data(Jv, problem->n) : NULL, curvature = 0;
  if (!y) return FLESH_ERR_ARGUMENT;
  flesh_block_multiply(problem->K, x, y);
  for (int d = 0; d < problem->n; d++) curvature += x[d] * y[d];
  return !(curvature > 0);
}

int flesh_kinsol_preconditioner_setup(N_Vector u, N_Vector uscale, N_Vector fval, N_Vector fscale,
                                      void *data)
{
  (void)uscale, (void)fval, (void)fscale;
  flesh_problem *problem = problem_of(data);
  if (!problem) return FLESH_ERR_ARGUMENT;
  const double *at = flesh_vector_data(u, problem->n);
  if (!at) return FLESH_ERR_ARGUMENT;
  int project = problem->options.projection == FLESH_PROJECTION_ALWAYS;
  int status = flesh_problem_assemble(problem, at, project);
  if (!status) status = flesh_problem_factor(problem);
  return callback_status(problem, status);
}

int flesh_kinsol_preconditioner_solve(N_Vector u, N_Vector uscale, N_Vector fval, N_Vector fscale,
                                      N_Vector z, void *data)
{
  (void)u, (void)uscale, (void)fval, (void)fscale;
  flesh_problem *problem = problem_of(data);
  if (!problem) return FLESH_ERR_ARGUMENT;
  double *values = flesh_vector_data(z, problem->n);
  if (!values) return FLESH_ERR_ARGUMENT;
  if (!problem->direct) {
    problem->linear->preconditioner_apply(problem->preconditioner, values, values);
    return 0;
  }
  int status = flesh_direct_solve(problem->direct, values, problem->work);
  memcpy(values, problem->work, (size_t)problem->n * sizeof *values);
  return status;
}
