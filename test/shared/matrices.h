/* matrices.h: block matrices for tests, random ones and those of a bar. */
#ifndef FLESH_TEST_MATRICES_H
#define FLESH_TEST_MATRICES_H

#include <gsl/gsl_linalg.h>
#include <stdlib.h>

#include "body.h"
#include "linear/block_matrix.h"
#include "test.h"

static unsigned long long seed = 1;

static inline void randomise(int n, double *x)
{
  for (int d = 0; d < n; d++) x[d] = 2 * test_uniform(&seed) - 1;
}

/* Makes a matrix of a mesh's pattern with random entries, its diagonal raised by `dominance` times the row's sum. */
static inline flesh_block_matrix *random_matrix(const test_body *b, double dominance)
{
  flesh_block_matrix *A = NULL;
  CHECK_OK(flesh_system_matrix_create(b->system, &A));
  double *sums = calloc((size_t)b->n, sizeof *sums);
  randomise(9 * A->row_start[A->rows], A->values);
  for (int i = 0; i < A->rows; i++) {
    double *block = A->values + 9 * (size_t)A->row_start[i];
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < r; c++) block[3 * r + c] = block[3 * c + r];
    for (int k = A->row_start[i]; k < A->row_end[i]; k++)
      for (int p = 0; p < 9; p++) {
        sums[3 * i + p / 3] += fabs(A->values[9 * (size_t)k + p]);
        sums[3 * A->column[k] + p % 3] += fabs(A->values[9 * (size_t)k + p]);
      }
  }
  for (int d = 0; d < b->n; d++)
    A->values[9 * (size_t)A->row_start[d / 3] + 4 * (d % 3)] += dominance * sums[d];
  free(sums);
  return A;
}

static inline void make(flesh_mesh *mesh, flesh_energy energy, double poisson, test_body *b)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_young(energy, FLESH_CONSTANTS_MATCHED, 1e5, poisson, &material));
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_LUMPED, 1, b));
  CHECK_OK(flesh_system_finalize(b->system));
}

/* Makes the backward-Euler matrix of a bent bar that is clamped at one end. */
static inline flesh_block_matrix *bar_matrix(const test_body *b, double jitter, double inertia, int project)
{
  flesh_block_matrix *A = NULL;
  uint8_t *fixed = calloc((size_t)b->n, 1);
  double *x = malloc((size_t)b->n * sizeof *x);
  memcpy(x, b->state.x, (size_t)b->n * sizeof *x);
  test_jitter(b->n, jitter, 5, x);
  flesh_point point = flesh_point_at(0, x, b->state.v, b->state.v);
  CHECK_OK(flesh_system_matrix_create(b->system, &A));
  CHECK_OK(flesh_system_jacobian(b->system, &point, &(flesh_shift){1, 0, inertia, project}, A));
  for (int d = 0; d < b->n; d++) fixed[d] = flesh_mesh_positions(b->mesh)[d - d % 3] == 0;
  flesh_block_fix(A, fixed, 1e4, NULL);
  free(fixed);
  free(x);
  return A;
}

/* Solves A x = b by GSL's LU. */
static inline double *solve_by_gsl(int unknowns, const double *A, const double *b)
{
  size_t n = (size_t)unknowns;
  double *x = calloc(n, sizeof *x);
  gsl_matrix *matrix = gsl_matrix_alloc(n, n);
  memcpy(matrix->data, A, n * n * sizeof *A);
  gsl_vector_const_view right = gsl_vector_const_view_array(b, n);
  gsl_vector_view solution = gsl_vector_view_array(x, n);
  gsl_permutation *order = gsl_permutation_alloc(n);
  int sign;
  gsl_linalg_LU_decomp(matrix, order, &sign);
  gsl_linalg_LU_solve(matrix, order, &right.vector, &solution.vector);
  gsl_permutation_free(order);
  gsl_matrix_free(matrix);
  return x;
}

#endif
