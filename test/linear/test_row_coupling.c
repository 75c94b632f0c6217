// TEST quick each_set
/* test_row_coupling.c: solves with sparse scalar matrices, exact ones and by polynomials, against full matrices. */
#include <gsl/gsl_blas.h>
#include <gsl/gsl_eigen.h>
#include <stdlib.h>

#include "matrices.h"
#include "linear/chebyshev.c"
#include "linear/sparse_cholesky.c"
#include "test.h"

/* A sparse factor against a full one, for a box of points, each coupled with those around it. */
static void sparse_factors_solve(void)
{
  enum { A = 9, B = 8, C = 7, N = A * B * C };
  int *starts = malloc((N + 1) * sizeof *starts), *neighbours = malloc(27 * N * sizeof *neighbours), count = 0;
  double *points = malloc(3 * N * sizeof *points), *dense = calloc(N * N, sizeof *dense),
         *right = malloc(N * sizeof *right);
  flesh_sparse_cholesky S;
  for (int i = 0; i < N; i++) {
    starts[i] = count;
    for (int c = 0; c < 3; c++) points[3 * i + c] = (double[]){i % A, i / A % B, i / (A * B)}[c];
    for (int j = 0; j < N; j++) {
      const int far = abs(i % A - j % A) > 1 || abs(i / A % B - j / A % B) > 1 || abs(i / (A * B) - j / (A * B)) > 1;
      if (far || i == j) continue;
      neighbours[count++] = j;
      if (j < i) dense[N * i + j] = dense[N * j + i] = 2 * test_uniform(&seed) - 1;
    }
  }
  starts[N] = count;
  CHECK_OK(flesh_sparse_cholesky_create(N, starts, neighbours, points, INFINITY, &S));
  for (int i = 0; i < N; i++)
    for (int j = 0; j < N; j++) dense[N * i + i] += i == j ? 0.01 : fabs(dense[N * i + j]);
  randomise(N, right);
  double *expected = solve_by_gsl(N, dense, right);
  for (int round = 0; round < 2; round++) { /* nothing of the last factor remains in the next */
    flesh_sparse_cholesky_zero(&S);
    for (int i = 0; i < N; i++) {
      S.values[flesh_sparse_cholesky_entry(&S, i, i)] = (float)dense[N * i + i];
      for (int e = starts[i]; e < starts[i + 1]; e++)
        S.values[flesh_sparse_cholesky_entry(&S, i, neighbours[e])] = (float)dense[N * i + neighbours[e]];
    }
    CHECK(flesh_sparse_cholesky_factor(&S) == 1);
    double off = 0, size = 0;
    for (int i = 0; i < N; i++) S.x[S.place[i]] = (float)right[i];
    flesh_sparse_cholesky_solve(&S);
    for (int i = 0; i < N; i++) {
      off = fmax(off, fabs((double)S.x[S.place[i]] - expected[i]));
      size = fmax(size, fabs(expected[i]));
    }
    printf("# %d panels, %zu numbers for %d rows; off by %.2g\n", S.panels, S.start[S.panels], N, off / size);
    CHECK_BELOW(off, 2e-5 * size);
  }
  flesh_sparse_cholesky_zero(&S);
  for (int i = 0; i < N; i++) S.values[flesh_sparse_cholesky_entry(&S, i, i)] = i == N / 2 ? -1 : 1;
  CHECK(flesh_sparse_cholesky_factor(&S) == 0);
  flesh_sparse_cholesky_clear(&S);
  free(expected);
  free(right);
  free(dense);
  free(points);
  free(neighbours);
  free(starts);
}

/* Returns the largest |S^(1/2) (1 - P S) v| / |v|. */
static double worst_error(int n, const double *S, const double *P, double *room)
{
  gsl_matrix_const_view s = gsl_matrix_const_view_array(S, (size_t)n, (size_t)n),
                        p = gsl_matrix_const_view_array(P, (size_t)n, (size_t)n);
  gsl_matrix_view e = gsl_matrix_view_array(room, (size_t)n, (size_t)n);
  gsl_matrix *product = gsl_matrix_alloc((size_t)n, (size_t)n), *square = gsl_matrix_alloc((size_t)n, (size_t)n);
  gsl_matrix_set_identity(&e.matrix);
  gsl_blas_dgemm(CblasNoTrans, CblasNoTrans, -1, &p.matrix, &s.matrix, 1, &e.matrix);
  gsl_blas_dgemm(CblasNoTrans, CblasNoTrans, 1, &s.matrix, &e.matrix, 0, product);
  gsl_blas_dgemm(CblasTrans, CblasNoTrans, 1, &e.matrix, product, 0, square);
  gsl_vector *values = gsl_vector_alloc((size_t)n);
  gsl_eigen_symm_workspace *work = gsl_eigen_symm_alloc((size_t)n);
  gsl_eigen_symm(square, values, work);
  const double worst = sqrt(gsl_vector_max(values));
  gsl_eigen_symm_free(work);
  gsl_vector_free(values);
  gsl_matrix_free(product);
  gsl_matrix_free(square);
  return worst;
}

/* Polynomials against a full matrix 1 + stiffness L, with a Laplacian L on a lattice surrounded by 0 with varying
 * weights: symmetric, with an error in every direction below what the projection requires. */
static void polynomials_solve(void)
{
  enum { A = 9, B = 6, C = 5, N = A * B * C };
  int *starts = malloc((N + 1) * sizeof *starts), *neighbours = malloc(6 * N * sizeof *neighbours), count = 0;
  double *points = malloc(3 * N * sizeof *points), *dense = malloc(N * N * sizeof *dense),
         *solve = malloc(N * N * sizeof *solve), *error = malloc(N * N * sizeof *error);
  float *weight = malloc(N * sizeof *weight);
  flesh_chebyshev polynomial;
  for (int i = 0; i < N; i++) {
    const int at[3] = {i % A, i / A % B, i / (A * B)}, size[3] = {A, B, C}, step[3] = {1, A, A * B};
    weight[i] = (float)(0.5 + test_uniform(&seed));
    starts[i] = count;
    for (int c = 0; c < 3; c++) {
      points[3 * i + c] = at[c];
      if (at[c] > 0) neighbours[count++] = i - step[c];
      if (at[c] < size[c] - 1) neighbours[count++] = i + step[c];
    }
  }
  starts[N] = count;
  CHECK_OK(flesh_chebyshev_create(N, starts, neighbours, points, NULL, &polynomial));
  for (double stiffness = 1; stiffness < 2e3; stiffness *= 10) {
    memset(dense, 0, N * N * sizeof *dense);
    flesh_chebyshev_zero(&polynomial);
    for (int i = 0; i < N; i++) {
      const float own = (float)(1 + 6 * stiffness / (double)(weight[i] * weight[i]));
      polynomial.values[flesh_chebyshev_entry(&polynomial, i, i)] = own;
      dense[N * i + i] = (double)own;
      for (int k = starts[i]; k < starts[i + 1]; k++) {
        const float off = (float)(-stiffness / (double)(weight[i] * weight[neighbours[k]]));
        polynomial.values[flesh_chebyshev_entry(&polynomial, i, neighbours[k])] = off;
        dense[N * i + neighbours[k]] = (double)off;
      }
    }
    CHECK(flesh_chebyshev_setup(&polynomial, 2) == 1);
    for (int i = 0; i < N; i++) {
      memset(polynomial.x, 0, N * sizeof *polynomial.x);
      polynomial.x[polynomial.place[i]] = 1;
      flesh_chebyshev_solve(&polynomial);
      for (int j = 0; j < N; j++) solve[N * j + i] = (double)polynomial.x[polynomial.place[j]];
    }
    double asymmetry = 0, size = 0, worst = 0;
    for (int k = 0; k < N * N; k++) {
      asymmetry = fmax(asymmetry, fabs(solve[k] - solve[k % N * N + k / N]));
      size = fmax(size, fabs(solve[k]));
    }
    CHECK_BELOW(asymmetry, 1e-5 * size);
    worst = worst_error(N, dense, solve, error);
    printf("# stiffness %g: degree %d, error %.3g\n", stiffness, polynomial.degree, worst);
    CHECK_BELOW(worst, 1);
  }
  flesh_chebyshev_zero(&polynomial);
  CHECK(flesh_chebyshev_setup(&polynomial, 2) == 0);
  flesh_chebyshev_clear(&polynomial);
  free(weight);
  free(error);
  free(solve);
  free(dense);
  free(points);
  free(neighbours);
  free(starts);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(sparse_factors_solve), TEST(polynomials_solve));
}
