/* ida_callbacks.c: the functions that IDA calls, its vector, the sparse 2N x 2N Jacobian, and the condensed matrix. */
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdlib.h>
#include <sunmatrix/sunmatrix_sparse.h>

#include "base/error.h"
#include "base/parallel_vector.h"
#include "sundials/ida_problem.h"
#include "sundials/pair_matrix.h"
#include "sundials/vector.h"

/* Returns the problem of user_data; NULL, with a sentence, if there is none, or if its constraints and mass are not known
 * yet. */
static flesh_ida_problem *problem_of(const void *user_data)
{
  flesh_ida_problem *problem = flesh_user_data_problem(user_data, "flesh_ida_problem");
  if (!problem) return NULL;
  if (problem->constraints.started) return problem;
  flesh_fail(FLESH_ERR_ARGUMENT, "the flesh_ida_problem has not been started; flesh_ida_start comes first");
  return NULL;
}

int flesh_ida_residual(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r, void *data)
{
  flesh_ida_problem *problem = problem_of(data);
  if (!problem) return FLESH_ERR_ARGUMENT;
  const double *at = flesh_ida_read_at(problem, t, y), *rate = at ? flesh_ida_read(problem, yp, 0, 1) : NULL;
  double *F = rate ? flesh_ida_open(problem, r, 2) : NULL;
  if (!F) return FLESH_ERR_ARGUMENT;
  const int status = flesh_ida_evaluate(problem, t, at, rate, F);
  flesh_ida_close(problem, r, F);
  return status;
}

sunindextype flesh_ida_entries(const flesh_ida_problem *self)
{
  const flesh_ida_matrices *J = &self->jacobian;
  const int64_t full = 9 * (2 * (int64_t)J->K->row_start[J->K->rows] - J->K->rows);
  return flesh_sunindex(2 * (int64_t)self->evaluation.n + full + (J->couples ? full : 9 * (int64_t)J->K->rows));
}

int flesh_ida_make_sparse(flesh_ida_problem *self)
{
  if (self->sparse.D_values) return FLESH_OK;
  int status = self->sparse.view.starts ? FLESH_OK : flesh_scalar_view_create(self->jacobian.K, &self->sparse.view);
  if (status) return status;
  size_t bytes = (size_t)self->sparse.view.entries * sizeof *self->sparse.K_values;
  if (!self->sparse.K_values) self->sparse.K_values = malloc(bytes);
  if (self->sparse.K_values) self->sparse.D_values = malloc(bytes);
  return self->sparse.D_values ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for a sparse Jacobian");
}

/* Fills the Jacobian. Columns of x: cj in the rows x' - v, K below. Columns of v: -1, C + cj M below. Constrained dofs: the
 * identity. */
static void fill_columns(const flesh_ida_problem *self, SUNMatrix J)
{
  const flesh_ida_constraints *held = &self->constraints;
  const flesh_scalar_view *view = &self->sparse.view;
  const int64_t n = self->evaluation.n;
  sunindextype *starts = SUNSparseMatrix_IndexPointers(J), *rows = SUNSparseMatrix_IndexValues(J), next = 0;
  double *values = SUNSparseMatrix_Data(J);
  for (int64_t d = 0; d < n; d++) {
    starts[d] = next;
    rows[next] = d;
    values[next++] = held->fixed[d] ? 1 : self->jacobian.cj;
    for (int64_t k = view->starts[d]; k < view->starts[d + 1]; k++) {
      rows[next] = n + view->indices[k];
      values[next++] = self->sparse.K_values[k];
    }
  }
  for (int64_t d = 0; d < n; d++) {
    starts[n + d] = next;
    rows[next] = d;
    values[next++] = held->fixed[d] ? 0 : -1;
    for (int64_t k = view->starts[d]; k < view->starts[d + 1]; k++) {
      int64_t row = view->indices[k];
      if (!self->jacobian.couples && row / 3 != d / 3) continue;
      rows[next] = n + row;
      values[next++] = row == d && held->fixed[d] ? 1 : self->sparse.D_values[k];
    }
  }
  starts[2 * n] = next;
}

static int fill_sparse(flesh_ida_problem *self, SUNMatrix J)
{
  const sunindextype size = 2 * (sunindextype)self->evaluation.n, entries = flesh_ida_entries(self);
  if (SUNSparseMatrix_SparseType(J) != CSC_MAT || SUNSparseMatrix_Rows(J) != size ||
      SUNSparseMatrix_Columns(J) != size || entries < 0 || SUNSparseMatrix_NNZ(J) < entries)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "the sparse matrix is %lld x %lld with room for %lld entries; it must be %lld x %lld in "
                      "compressed columns with %lld",
                      (long long)SUNSparseMatrix_Rows(J), (long long)SUNSparseMatrix_Columns(J),
                      (long long)SUNSparseMatrix_NNZ(J), (long long)size, (long long)size, (long long)entries);
  if (!self->jacobian.couples && !self->jacobian.D_is_diagonal)
    return flesh_fail(FLESH_ERR_ARGUMENT, "an effect couples velocities of nodes that it did not couple near the "
                                          "rest shape; use the condensed solver");
  int status = flesh_ida_make_sparse(self);
  if (status) return status;
  flesh_scalar_view_fill(&self->sparse.view, self->jacobian.K, self->sparse.K_values);
  flesh_scalar_view_fill(&self->sparse.view, self->jacobian.D, self->sparse.D_values);
  fill_columns(self, J);
  return FLESH_OK;
}

int flesh_ida_jacobian(sunrealtype t, sunrealtype cj, N_Vector y, N_Vector yp, N_Vector r, SUNMatrix J, void *data,
                       N_Vector w1, N_Vector w2, N_Vector w3)
{
  FLESH_NEED({J, "J"});
  (void)r, (void)w1, (void)w2, (void)w3;
  flesh_ida_problem *problem = problem_of(data);
  if (!problem) return FLESH_ERR_ARGUMENT;
  int sparse = SUNMatGetID(J) == SUNMATRIX_SPARSE;
  if (sparse && flesh_ida_check_sparse(problem)) return FLESH_ERR_ARGUMENT;
  const double *at = flesh_ida_read_at(problem, t, y), *rate = at ? flesh_ida_read(problem, yp, 0, 1) : NULL;
  if (!rate) return FLESH_ERR_ARGUMENT;
  const flesh_pair_matrix *own = flesh_pair_matrix_of(J);
  if (!sparse && !(own && own->view && own->ida == problem))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the matrix is neither a SUNSparseMatrix nor this problem's own of "
                                          "flesh_ida_sunmatrix_create");
  int status =
      flesh_ida_assemble(problem, t, cj, at, rate, sparse ? FLESH_IDA_APART : FLESH_IDA_CONDENSED);
  return !status && sparse ? fill_sparse(problem, J) : status;
}

int flesh_ida_jacobian_times(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r, N_Vector v, N_Vector Jv,
                             sunrealtype cj, void *data, N_Vector w1, N_Vector w2)
{
  (void)t, (void)y, (void)yp, (void)r, (void)cj, (void)w1, (void)w2;
  flesh_ida_problem *problem = problem_of(data);
  if (!problem) return FLESH_ERR_ARGUMENT;
  const double *x = flesh_ida_read(problem, v, 1, 0);
  double *z = x ? flesh_ida_open(problem, Jv, 1) : NULL;
  if (!z) return FLESH_ERR_ARGUMENT;
  if (problem->jacobian.content != FLESH_IDA_CONDENSED)
    return flesh_fail(FLESH_ERR_ARGUMENT, "flesh_ida_jacobian_times needs flesh_ida_preconditioner_setup beside it");
  flesh_ida_multiply(problem, x, z);
  flesh_ida_close(problem, Jv, z);
  return FLESH_OK;
}

int flesh_ida_preconditioner_setup(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r, sunrealtype cj, void *data)
{
  (void)r;
  flesh_ida_problem *problem = problem_of(data);
  if (!problem) return FLESH_ERR_ARGUMENT;
  const double *at = flesh_ida_read_at(problem, t, y), *rate = at ? flesh_ida_read(problem, yp, 0, 1) : NULL;
  if (!rate) return FLESH_ERR_ARGUMENT;
  int status = flesh_ida_assemble(problem, t, cj, at, rate, FLESH_IDA_CONDENSED);
  return status ? status : flesh_ida_factor(problem);
}

int flesh_ida_preconditioner_solve(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r, N_Vector right, N_Vector z,
                                   sunrealtype cj, sunrealtype delta, void *data)
{
  (void)t, (void)y, (void)yp, (void)r, (void)cj, (void)delta;
  flesh_ida_problem *problem = problem_of(data);
  if (!problem) return FLESH_ERR_ARGUMENT;
  const double *b = flesh_ida_read(problem, right, 1, 0);
  double *x = b ? flesh_ida_open(problem, z, 1) : NULL;
  if (!x) return FLESH_ERR_ARGUMENT;
  if (problem->jacobian.content != FLESH_IDA_CONDENSED)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "flesh_ida_preconditioner_solve needs flesh_ida_preconditioner_setup before it");
  const int status = flesh_ida_solve_both(problem, b, 1, x);
  flesh_ida_close(problem, z, x);
  return status;
}

int flesh_ida_sunmatrix_create(flesh_ida_problem *problem, SUNContext context, SUNMatrix *matrix)
{
  FLESH_NEED({problem, "problem"}, {context, "context"}, {matrix, "matrix"});
  return flesh_pair_matrix_create(problem, NULL, context, matrix);
}

/* Returns sqrt(sum (w x)^2 / N) over all ranks. */
static sunrealtype weighted_norm_of_team(N_Vector x, N_Vector w)
{
  const flesh_team *team = flesh_threads_team(flesh_vector_threads(x));
  return N_VWL2Norm(x, w) / sqrt(6 * team->all);
}

/* Returns this norm on one rank. */
static sunrealtype weighted_norm(N_Vector x, N_Vector w)
{
  const int n = (int)N_VGetLength(x);
  return sqrt(flesh_weighted_square_of_part(N_VGetArrayPointer(x), N_VGetArrayPointer(w), 0, n) / n);
}

int flesh_ida_vector_create(const flesh_ida_problem *problem, SUNContext context, N_Vector *y)
{
  FLESH_NEED({problem, "problem"}, {context, "context"}, {y, "y"});
  const flesh_evaluation *e = &problem->evaluation;
  *y = N_VNew_Serial(2 * (sunindextype)e->n, context);
  int status = *y ? flesh_vector_vectorise(*y, e->team ? problem->threads : NULL)
                  : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", 2 * e->n);
  if (*y) (*y)->ops->nvwrmsnorm = e->team ? weighted_norm_of_team : weighted_norm;
  if (*y && e->team) (*y)->ops->nvmaxnorm = flesh_vector_largest;
  return flesh_team_agree(e->team, status);
}
