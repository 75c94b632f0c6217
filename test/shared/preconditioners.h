/* preconditioners.h: preconditioners as full matrices, for tests. */
#ifndef FLESH_TEST_PRECONDITIONERS_H
#define FLESH_TEST_PRECONDITIONERS_H

#include <gsl/gsl_eigen.h>
#include <stdlib.h>

#include "linear/linear.h"
#include "test.h"

/* Returns P^-1 as a full matrix, computed column by column. */
static inline double *applied(const flesh_linear *linear, flesh_preconditioner_data *preconditioner, int n)
{
  double *P = malloc((size_t)n * n * sizeof *P), *unit = calloc((size_t)n, sizeof *unit),
         *column = malloc((size_t)n * sizeof *column);
  for (int d = 0; d < n; d++) {
    unit[d] = 1;
    linear->preconditioner_apply(preconditioner, unit, column);
    for (int e = 0; e < n; e++) P[e * n + d] = column[e];
    unit[d] = 0;
  }
  free(unit);
  free(column);
  return P;
}

/* Checks that the matrix P [n][n] is symmetric, up to rounding, and positive definite, whatever the matrix is. */
static inline void check_definite(int n, const double *P, double rounding)
{
  double asymmetry = 0, size = 0;
  for (int k = 0; k < n * n; k++) {
    asymmetry = fmax(asymmetry, fabs(P[k] - P[k % n * n + k / n]));
    size = fmax(size, fabs(P[k]));
  }
  CHECK_BELOW(asymmetry, rounding * size); /* incomplete Cholesky is in single precision */
  gsl_matrix *A = gsl_matrix_alloc((size_t)n, (size_t)n);
  gsl_vector *values = gsl_vector_alloc((size_t)n);
  gsl_eigen_symm_workspace *work = gsl_eigen_symm_alloc((size_t)n);
  memcpy(A->data, P, (size_t)n * n * sizeof *P);
  gsl_eigen_symm(A, values, work);
  printf("# least eigenvalue %.2g, largest %.2g\n", gsl_vector_min(values), gsl_vector_max(values));
  CHECK(gsl_vector_min(values) > 0);
  gsl_eigen_symm_free(work);
  gsl_vector_free(values);
  gsl_matrix_free(A);
}

#endif
