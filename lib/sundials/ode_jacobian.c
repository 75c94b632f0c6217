/* ode_jacobian.c: df/dy as a matrix: SUNDIALS' sparse one, and flesh's. */
#include <sunmatrix/sunmatrix_sparse.h>

#include "base/error.h"
#include "linear/block_matrix.h"
#include "sundials/pair_matrix.h"
#include "sundials/ode_problem.h"

sunindextype flesh_ode_entries(const flesh_ode_problem *self) { return flesh_ida_entries(self->motion); }

int flesh_ode_sunmatrix_create(flesh_ode_problem *problem, SUNContext context, SUNMatrix *matrix)
{
  FLESH_NEED({problem, "problem"}, {context, "context"}, {matrix, "matrix"});
  return flesh_pair_matrix_create(NULL, problem, context, matrix);
}

/* Makes room for a sparse Jacobian, or fails with the reason why there can be none. */
static int prepare_sparse(flesh_ode_problem *self, SUNMatrix J)
{
  const sunindextype size = 2 * (sunindextype)self->n, entries = flesh_ode_entries(self);
  if (SUNMatGetID(J) != SUNMATRIX_SPARSE || SUNSparseMatrix_SparseType(J) != CSC_MAT ||
      SUNSparseMatrix_Rows(J) != size || SUNSparseMatrix_Columns(J) != size || entries < 0 ||
      SUNSparseMatrix_NNZ(J) < entries)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "the matrix must be this problem's own of flesh_ode_sunmatrix_create or a "
                      "SUNSparseMatrix of %lld x %lld in compressed columns with room for %lld "
                      "entries",
                      (long long)size, (long long)size, (long long)entries);
  int separate = self->mass_is_diagonal;
  for (int e = 0; e < 3 * self->n && separate; e++) separate = e % 9 % 4 == 0 || self->inverse[e] == 0;
  if (!separate)
    return flesh_fail(FLESH_ERR_ARGUMENT, "df/dy is full where the mass couples dofs, as consistent mass does; use "
                                          "lumped mass or flesh_ode_jacobian_times");
  if (!self->motion->jacobian.couples && !flesh_block_is_diagonal(self->C))
    return flesh_fail(FLESH_ERR_ARGUMENT, "an effect couples velocities of nodes that it did not couple near the rest "
                                          "shape; use flesh_ode_jacobian_times");
  return flesh_ida_make_sparse(self->motion);
}

static void fill_sparse(flesh_ode_problem *self, SUNMatrix J)
{
  const flesh_ida_sparse *sparse = &self->motion->sparse;
  const flesh_scalar_view *view = &sparse->view;
  const int64_t n = self->n;
  const uint8_t *fixed = self->motion->constraints.fixed;
  sunindextype *starts = SUNSparseMatrix_IndexPointers(J), *rows = SUNSparseMatrix_IndexValues(J), next = 0;
  double *values = SUNSparseMatrix_Data(J);
  flesh_scalar_view_fill(view, self->K, sparse->K_values);
  flesh_scalar_view_fill(view, self->C, sparse->D_values);
  /* The zeros on the diagonal keep the pattern unchanged when the identity is added. */
  for (int half = 0; half < 2; half++)
    for (int64_t d = 0; d < n; d++) {
      const double *forces = half ? sparse->D_values : sparse->K_values;
      starts[half * n + d] = next;
      rows[next] = d;
      values[next++] = half && !fixed[d];
      for (int64_t k = view->starts[d]; k < view->starts[d + 1]; k++) {
        const int64_t row = view->indices[k];
        if (half && !self->motion->jacobian.couples && row / 3 != d / 3) continue;
        rows[next] = n + row;
        values[next++] = fixed[row] ? 0 : -self->inverse[9 * (row / 3) + 4 * (row % 3)] * forces[k];
      }
    }
  starts[2 * n] = next;
}

/* Fills x' = v; v' = -(K x + C v), divided by the mass. */
static int fill_pair(flesh_ode_problem *self, double t, const double *y, flesh_pair_matrix *J)
{
  int damped, project = self->motion->options.eigenvalue_filter >= FLESH_FILTER_CLAMP_ALWAYS;
  int status = flesh_ode_assemble(self, t, y, project, J->K, J->D, &damped);
  if (status) return status;
  flesh_block_combine(-1, J->K, NULL);
  flesh_block_combine(damped ? -1 : 0, J->D, NULL);
  J->rows.from_x = J->rows.identity = 0;
  J->rows.from_v = 1;
  return FLESH_OK;
}

int flesh_ode_jacobian(sunrealtype t, N_Vector y_vector, N_Vector fy, SUNMatrix J, void *data, N_Vector w1, N_Vector w2,
                       N_Vector w3)
{
  FLESH_NEED({J, "J"});
  (void)w1, (void)w2, (void)w3;
  flesh_ode_problem *self = flesh_ode_problem_of(data);
  if (!self) return FLESH_ERR_ARGUMENT;
  flesh_pair_matrix *own = flesh_pair_matrix_of(J);
  if (own && own->rhs == self) {
    const double *y = flesh_ida_read_at(self->motion, t, y_vector);
    return y ? fill_pair(self, t, y, own) : FLESH_ERR_ARGUMENT;
  }
  int status = flesh_ida_check_sparse(self->motion);
  if (!status) status = flesh_ode_jacobian_times_setup(t, y_vector, fy, data);
  if (!status) status = prepare_sparse(self, J);
  if (!status) fill_sparse(self, J);
  return status;
}
