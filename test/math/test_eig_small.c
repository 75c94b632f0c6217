// TEST quick
/* test_eig_small.c: Jacobi rotations give the eigenvectors of symmetric matrices, including graded and singular
 * ones. */
#include "math/eig_small.h"
#include "test.h"

static unsigned long long seed = 7;

/* Returns the largest error of A Q = Q diag(w) and of Q^T Q = I over the magnitude of A. */
static double error_of(int n, const double *A, const double *w, const double *Q)
{
  double worst = 0, size = 0;
  for (int k = 0; k < n * n; k++) size = fmax(size, fabs(A[k]));
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) {
      double image = 0, product = 0;
      for (int k = 0; k < n; k++) image += A[n * i + k] * Q[n * k + j], product += Q[n * k + i] * Q[n * k + j];
      worst = fmax(worst, fabs(image - w[j] * Q[n * i + j]) / (size > 0 ? size : 1));
      worst = fmax(worst, fabs(product - (i == j)));
    }
  return worst;
}

static void eigenvectors_are_eigenvectors(void)
{
  double worst = 0;
  for (int n = 1; n <= FLESH_EIGH_LARGEST; n++)
    for (int trial = 0; trial < 200; trial++) {
      double A[144], copy[144], w[12], Q[144];
      for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) A[n * i + j] = A[n * j + i] = 2 * test_uniform(&seed) - 1;
      for (int k = 0; k < n * n && trial % 4 == 1; k++) A[k] *= pow(10, -4. * (k / n + k % n));
      for (int k = 0; k < n * n && trial % 4 == 2; k++) A[k] = 1; /* rank 1 */
      for (int k = 0; k < n * n && trial == 3; k++) A[k] = 0;
      memcpy(copy, A, sizeof copy);
      flesh_eigh_small(n, copy, w, Q);
      worst = fmax(worst, error_of(n, A, w, Q));
    }
  printf("# error %.2g\n", worst);
  CHECK_BELOW(worst, 2e-15 * FLESH_EIGH_LARGEST);
}

/* The matrix of second differences of n points has the eigenvalues 2 - 2 cos(pi k / (n + 1)). */
static void eigenvalues_of_a_chain(void)
{
  enum { N = 9 };
  double A[N * N] = {0}, w[N], Q[N * N];
  for (int i = 0; i < N; i++)
    for (int j = 0; j < N; j++) A[N * i + j] = i == j ? 2 : i == j + 1 || j == i + 1 ? -1 : 0;
  flesh_eigh_small(N, A, w, Q);
  for (int k = 1; k <= N; k++) {
    const double expected = 2 - 2 * cos(acos(-1) * k / (N + 1));
    double nearest = INFINITY;
    for (int i = 0; i < N; i++) nearest = fmin(nearest, fabs(w[i] - expected));
    CHECK_BELOW(nearest, 1e-14);
  }
}

static void rubbish_ends(void)
{
  double A[4] = {1, NAN, NAN, 1}, w[2], Q[4];
  flesh_eigh_small(2, A, w, Q);
  CHECK(!isfinite(w[0]) || !isfinite(w[1]));
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(eigenvectors_are_eigenvectors), TEST(eigenvalues_of_a_chain), TEST(rubbish_ends));
}
