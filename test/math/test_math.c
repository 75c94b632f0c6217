// TEST quick
/* test_math.c: 3x3 matrix operations, the rotation-variant SVD and the symmetric eigen-solver, on
 * random, degenerate, reflected, huge and tiny matrices, against identities and GSL. */
#include "test_matrix.h"

#include <float.h>
#include <gsl/gsl_eigen.h>
#include <gsl/gsl_linalg.h>
#include <gsl/gsl_sort_vector.h>

#include "math/eig3.h"
#include "math/svd3.h"

static double rotation_defect(const double R[9])
{
  double RtR[9], worst = 0;
  flesh_mat3_transposed_multiply(R, R, RtR);
  for (int k = 0; k < 9; k++) worst = fmax(worst, fabs(RtR[k] - (k % 4 == 0)));
  return fmax(worst, fabs(flesh_mat3_determinant(R) - 1));
}

/* Checks all guarantees of svd3.h for one matrix except the sign of sigma_3; returns the worst relative error. */
static double svd_error(const double F[9], double sigma[3])
{
  double U[9], V[9], US[9], again[9], scale = 0, worst = 0;
  flesh_svd3(F, U, sigma, V);
  for (int k = 0; k < 9; k++) scale = fmax(scale, fabs(F[k]));
  for (int k = 0; k < 9; k++) US[k] = U[k] * sigma[k % 3];
  flesh_mat3_multiply_transposed(US, V, again);
  for (int k = 0; k < 9; k++) {
    double off = fabs(again[k] - F[k]);
    if (!(off <= 1e300)) return INFINITY; /* NaN too */
    worst = fmax(worst, scale > 0 ? off / scale : off);
  }
  if (!(sigma[0] >= sigma[1] && sigma[1] >= fabs(sigma[2]))) return INFINITY;
  worst = fmax(worst, rotation_defect(U));
  return fmax(worst, rotation_defect(V));
}

static void matrix_operations(void)
{
  static const double one[9] = {[0] = 1, [4] = 1, [8] = 1};
  double worst = 0;
  for (int trial = 0; trial < 200; trial++) {
    double A[9], B[9], C[9], D[9], E[9], T[9];
    random_matrix(A);
    random_matrix(B);
    flesh_mat3_multiply(A, B, C);
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) {
        double sum = 0;
        for (int k = 0; k < 3; k++) sum += A[3 * i + k] * B[3 * k + j];
        worst = fmax(worst, fabs(sum - C[3 * i + j]));
      }
    flesh_mat3_transposed_multiply(B, one, T);
    flesh_mat3_multiply_transposed(A, T, D);
    flesh_mat3_transposed_multiply(A, one, T);
    flesh_mat3_transposed_multiply(T, B, E);
    for (int k = 0; k < 9; k++) worst = fmax(worst, fmax(fabs(C[k] - D[k]), fabs(C[k] - E[k])));
    CHECK_NEAR(flesh_mat3_determinant(C), flesh_mat3_determinant(A) * flesh_mat3_determinant(B),
               1e-14);
    CHECK_NEAR(flesh_mat3_trace(C), flesh_mat3_inner(T, B), 1e-14); /* tr(AB) = A^T : B */
    /* A^T cof A = det A I, and the inverse. */
    flesh_mat3_cofactor(A, D);
    flesh_mat3_transposed_multiply(A, D, E);
    for (int k = 0; k < 9; k++)
      worst = fmax(worst, fabs(E[k] - (k % 4 == 0) * flesh_mat3_determinant(A)));
    double det = flesh_mat3_inverse(A, D);
    flesh_mat3_multiply(A, D, E);
    for (int k = 0; k < 9; k++) worst = fmax(worst, fabs(E[k] - (k % 4 == 0)) * fmin(1, fabs(det)));
    double x[3] = {uniform(), uniform(), uniform()}, y[3] = {uniform(), uniform(), uniform()};
    double Ax[3], Aty[3];
    flesh_mat3_times(A, x, Ax);
    flesh_mat3_transposed_times(A, y, Aty);
    CHECK_NEAR(flesh_vec3_dot(y, Ax), flesh_vec3_dot(Aty, x), 1e-14);
  }
  CHECK_BELOW(worst, 1e-14);
}

static void svd_of_random_matrices(void)
{
  double worst = 0, gsl_worst = 0;
  gsl_matrix *A = gsl_matrix_alloc(3, 3), *V = gsl_matrix_alloc(3, 3);
  gsl_vector *S = gsl_vector_alloc(3), *work = gsl_vector_alloc(3);
  for (int trial = 0; trial < 20000; trial++) {
    double F[9], sigma[3];
    random_matrix(F);
    if (trial % 2) /* near the identity, as in most elements */
      for (int k = 0; k < 9; k++) F[k] = (k % 4 == 0) + F[k] * pow(10, -(trial % 17));
    if (trial % 4 == 2) /* nearly diagonal with distinct values: small angles, few sweeps */
      for (int k = 0; k < 9; k++) F[k] = (k % 4 == 0) * (3 - k / 4) + F[k] * pow(10, -(trial % 9));
    worst = fmax(worst, svd_error(F, sigma));
    double J = flesh_mat3_determinant(F);
    if (fabs(J) > 1e-12) CHECK((sigma[2] < 0) == (J < 0));
    if (trial % 10) continue;
    memcpy(A->data, F, sizeof F);
    gsl_linalg_SV_decomp_jacobi(A, V, S);
    for (int k = 0; k < 3; k++)
      gsl_worst = fmax(gsl_worst, fabs(fabs(sigma[k]) - gsl_vector_get(S, k)));
  }
  CHECK_BELOW(worst, 5e-15);
  CHECK_BELOW(gsl_worst, 1e-14);
  gsl_matrix_free(A);
  gsl_matrix_free(V);
  gsl_vector_free(S);
  gsl_vector_free(work);
}

/* Known singular values of every kind, multiplied by random rotations. */
static void svd_of_degenerate_matrices(void)
{
  static const double kinds[][3] = {
      {1, 1, 1},           {1, 1, -1},       {2, 2, 1},           {2, 1, 1},
      {2, 1, -1},          {1, 1, 0},        {1, 0, 0},           {3, 1e-8, 0},
      {1, 1e-8, 1e-16},    {1, 1e-8, -1e-9}, {1, 1e-15, 1e-15},   {1, 1e-30, -1e-30},
      {1, 1e-100, 1e-200}, {1, 1, 1e-17},    {1, 1 - 1e-9, 1e-3}, {1, 1 - 1e-15, 1},
      {1e8, 1, -1e-8},     {1e16, 1, 1},     {1, 1 - 1e-8, 1e-8}, {7, 7, -7}};
  double worst = 0, value_worst = 0;
  for (unsigned kind = 0; kind < sizeof kinds / sizeof *kinds; kind++)
    for (int trial = 0; trial < 500; trial++) {
      double F[9], sigma[3];
      const double *s = kinds[kind];
      compose(s, F);
      worst = fmax(worst, svd_error(F, sigma));
      for (int k = 0; k < 3; k++) {
        double expected = k == 1 && s[2] > s[1] ? s[2] : k == 2 && s[2] > s[1] ? s[1] : s[k];
        double off = fabs(fabs(sigma[k]) - fabs(expected)) / s[0];
        value_worst = fmax(value_worst, off);
      }
      if (fabs(s[2]) > 1e-6 * s[0]) CHECK((sigma[2] < 0) == (s[2] < 0));
    }
  CHECK_BELOW(worst, 5e-15);
  CHECK_BELOW(value_worst, 5e-15);
}

/* Exactly representable cases: no rounding in F is hidden by the tolerance. */
static void svd_of_exact_matrices(void)
{
  static const double cases[][9] = {
      {0, 0, 0, 0, 0, 0, 0, 0, 0},      {1, 0, 0, 0, 1, 0, 0, 0, 1},
      {-1, 0, 0, 0, -1, 0, 0, 0, -1},   {1, 0, 0, 0, 1, 0, 0, 0, -1},
      {1, 1, 1, 1, 1, 1, 1, 1, 1},      {1, 2, 3, 2, 4, 6, 4, 8, 12},
      {1, 2, 3, 4, 5, 6, 7, 8, 9},      {0, 0, 1, 0, 0, 0, 0, 0, 0},
      {0, 0, 0, 0, 0, 0, 0, -5, 0},     {0, 1, 0, 0, 0, 1, 1, 0, 0},
      {0, 1, 0, 1, 0, 0, 0, 0, 1},      {3, 0, 0, 4, 0, 0, 0, 0, 0},
      {1, 0, 0, 1e-200, 1, 0, 0, 0, 0}, {1, 0, 0, 0, 0x1p-60, 0, 0, 0, 0x1p-120}};
  for (unsigned c = 0; c < sizeof cases / sizeof *cases; c++)
    for (int exponent = -1020; exponent <= 1000; exponent += 101) {
      double F[9], sigma[3];
      for (int k = 0; k < 9; k++) F[k] = ldexp(cases[c][k], exponent);
      CHECK_BELOW(svd_error(F, sigma), 5e-15);
    }
  double U[9], sigma[3], V[9];
  flesh_svd3(cases[0], U, sigma, V);
  CHECK(sigma[0] == 0 && sigma[1] == 0 && sigma[2] == 0);
  CHECK(rotation_defect(U) == 0 && rotation_defect(V) == 0);
  flesh_svd3(cases[2], U, sigma, V);
  CHECK(sigma[0] == 1 && sigma[1] == 1 && sigma[2] == -1);
  double bad[9] = {1, 0, 0, 0, NAN, 0, 0, 0, 1}, endless[9] = {1, 0, 0, 0, 1, 0, INFINITY, 0, 1};
  flesh_svd3(bad, U, sigma, V);
  CHECK(isnan(sigma[0]) && rotation_defect(U) == 0 && rotation_defect(V) == 0);
  flesh_svd3(endless, U, sigma, V);
  CHECK(isnan(sigma[0]) && rotation_defect(U) == 0 && rotation_defect(V) == 0);
}

/* Scaling must not change the result: huge and tiny matrices, and rows of very different magnitude. */
static void svd_of_scaled_matrices(void)
{
  double worst = 0, value_worst = 0;
  for (int trial = 0; trial < 4000; trial++) {
    double F[9], G[9], sigma[3], scaled[3];
    random_matrix(F);
    int exponent = (int)(498 * uniform()); /* 1e-150 .. 1e150 */
    for (int k = 0; k < 9; k++) G[k] = ldexp(F[k], exponent);
    svd_error(F, sigma);
    worst = fmax(worst, svd_error(G, scaled));
    for (int k = 0; k < 3; k++)
      value_worst = fmax(value_worst, fabs(ldexp(scaled[k], -exponent) - sigma[k]) / sigma[0]);
    for (int k = 0; k < 9; k++) G[k] = F[k] * pow(10, (k / 3 - 1) * 40 * uniform());
    worst = fmax(worst, svd_error(G, scaled));
    for (int k = 0; k < 9; k++) G[k] = F[k] * pow(10, 150 * uniform());
    worst = fmax(worst, svd_error(G, scaled));
  }
  CHECK_BELOW(worst, 5e-15);
  CHECK_BELOW(value_worst, 5e-15);
}

/* Columns of very different length keep small singular values to relative accuracy, which F^T F would lose. */
static void svd_keeps_small_values(void)
{
  double worst = 0;
  for (int trial = 0; trial < 1000; trial++) {
    double R[9], sigma[3], U[9], V[9],
        s[3] = {1, 1e-7 * (1.5 + uniform()), 1e-14 * (1.5 + uniform())};
    random_rotation(R);
    for (int k = 0; k < 9; k++) R[k] *= s[k % 3]; /* F = R diag(s): singular values exactly s */
    flesh_svd3(R, U, sigma, V);
    for (int k = 0; k < 3; k++) worst = fmax(worst, fabs(sigma[k] / s[k] - 1));
  }
  CHECK_BELOW(worst, 1e-14);
}

static double eigen_error(const double A[9], double w[3])
{
  double Q[9], QW[9], again[9], scale = 0, worst = 0;
  flesh_eigh3(A, w, Q);
  for (int k = 0; k < 9; k++) scale = fmax(scale, fabs(A[k])), QW[k] = Q[k] * w[k % 3];
  flesh_mat3_multiply_transposed(QW, Q, again);
  for (int k = 0; k < 9; k++) {
    double off = fabs(again[k] - A[k]);
    if (!(off <= 1e300)) return INFINITY;
    worst = fmax(worst, scale > 0 ? off / scale : off);
  }
  if (!(w[0] <= w[1] && w[1] <= w[2])) return INFINITY;
  return fmax(worst, rotation_defect(Q));
}

static void symmetric_eigenvalues(void)
{
  static const double kinds[][3] = {{1, 2, 3},          {1, 1, 1},        {1, 1, 2},
                                    {-1, 2, 2},         {0, 0, 1},        {0, 1, 1},
                                    {1, 1 + 1e-12, -1}, {1e-12, 1, -1e6}, {-3, -2, -1}};
  double worst = 0, gsl_worst = 0;
  gsl_matrix *G = gsl_matrix_alloc(3, 3);
  gsl_vector *values = gsl_vector_alloc(3);
  gsl_eigen_symm_workspace *work = gsl_eigen_symm_alloc(3);
  for (int trial = 0; trial < 9000; trial++) {
    double A[9], w[3], R[9], RW[9];
    const double *kind = kinds[trial % 9];
    random_rotation(R);
    for (int k = 0; k < 9; k++) RW[k] = R[k] * kind[k % 3];
    flesh_mat3_multiply_transposed(RW, R, A);
    if (trial % 3 == 0) random_matrix(A);
    double scale = pow(10, trial % 5 == 0 ? 150 * uniform() : 0);
    for (int i = 0; i < 3; i++)
      for (int j = i; j < 3; j++) A[3 * i + j] = A[3 * j + i] = scale * A[3 * i + j];
    worst = fmax(worst, eigen_error(A, w));
    if (scale != 1) continue;
    memcpy(G->data, A, sizeof A);
    gsl_eigen_symm(G, values, work);
    gsl_sort_vector(values);
    double size = fmax(fabs(w[0]), fabs(w[2]));
    for (int k = 0; k < 3; k++)
      gsl_worst = fmax(gsl_worst, fabs(w[k] - gsl_vector_get(values, k)) / size);
  }
  CHECK_BELOW(worst, 5e-15);
  CHECK_BELOW(gsl_worst, 1e-14);
  double zero[9] = {0}, bad[9] = {1, 0, 0, 0, INFINITY, 0, 0, 0, 1}, w[3], Q[9];
  CHECK(eigen_error(zero, w) == 0);
  flesh_eigh3(bad, w, Q);
  CHECK(isnan(w[0]));
  gsl_matrix_free(G);
  gsl_vector_free(values);
  gsl_eigen_symm_free(work);
}

/* Matrices that are the unit matrix up to rounding, as F is of a body that is not deformed: what rounding leaves of it may
 * have two equal eigenvalues and any trace. */
static void units_but_for_rounding(void)
{
  static const double on[3] = {1 - 0x1p-53, 1, 1 + 0x1p-52}, off[5] = {0, 0x1p-54, -0x1p-54, 0x1p-53, -0x1p-53};
  double worst = 0;
  for (int c = 0; c < 27 * 15625; c++) {
    double F[9], A[9], values[3];
    for (int k = 0, rest = c; k < 9; rest /= k % 4 ? 5 : 3, k++) F[k] = k % 4 ? off[rest % 5] : on[rest % 3];
    for (int k = 0; k < 9; k++) A[k] = (F[k] + F[3 * (k % 3) + k / 3]) / 2;
    worst = fmax(worst, fmax(svd_error(F, values), eigen_error(A, values)));
  }
  CHECK_BELOW(worst, 5e-15);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(matrix_operations), TEST(svd_of_random_matrices),
                   TEST(svd_of_degenerate_matrices), TEST(svd_of_exact_matrices),
                   TEST(svd_of_scaled_matrices), TEST(svd_keeps_small_values),
                   TEST(symmetric_eigenvalues), TEST(units_but_for_rounding));
}
