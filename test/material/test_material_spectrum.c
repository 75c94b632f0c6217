// TEST quick seconds=60
/* test_material_spectrum.c: the closed-form eigenpairs, the projected Hessian and the
 * singular-frame blocks against GSL's eigen-solver of the full 9x9 Hessian. */
#include "test_matrix.h"

#include <gsl/gsl_eigen.h>
#include <stdlib.h>

#include "flesh/material.h"
#include "material/stretch.h"
#include "math/eig3.h"

/* A mixed form, so that psi_IJ and psi_II are not 0 as in most built-in ones. */
static int mixed_psi(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  double i = I_C - 3;
  (void)m;
  *psi = (flesh_psi){.value = 0.5 * i + 0.3 * i * i - 0.7 * i * (J - 1) + 2 * (J - 1.2) * (J - 1.2),
                     .I = 0.5 + 0.6 * i - 0.7 * (J - 1),
                     .J = -0.7 * i + 4 * (J - 1.2),
                     .II = 0.6,
                     .IJ = -0.7,
                     .JJ = 4};
  return FLESH_OK;
}

static flesh_material material_number(int n)
{
  flesh_material m;
  if (n == FLESH_ENERGY_COUNT) CHECK_OK(flesh_material_from_psi(mixed_psi, NULL, &m));
  else
    CHECK_OK(flesh_material_from_lame((flesh_energy)n, FLESH_CONSTANTS_RAW, 1,
                                      exp(2.5 + 2.5 * uniform()), &m));
  return m;
}

/* Makes random, reflected, degenerate, repeated and large F for material_number(n). */
static void draw(int trial, int n, double F[9])
{
  const int positive = n < FLESH_ENERGY_COUNT && flesh_psi_needs_volume((flesh_energy)n);
  double s[3];
  for (int k = 0; k < 3; k++) s[k] = 0.05 + 1.5 * fabs(uniform());
  switch (trial % 10) {
  case 0:
    s[0] = s[1] = s[2] = 1;
    break;
  case 1:
    s[1] = s[0];
    break;
  case 2:
    s[1] = s[2] = s[0];
    break;
  case 3:
    s[2] = -s[2];
    break;
  case 4:
    s[2] = 0;
    break;
  case 5:
    s[1] = s[2] = 0;
    break;
  case 6:
    s[1] = s[0], s[2] = -s[0];
    break;
  case 7:
    for (int k = 0; k < 3; k++) s[k] *= n == FLESH_ENERGY_FUNG ? 10 : 1e3; /* which grows exponentially */
    break;
  default:
    break;
  }
  if (trial % 100 == 9) s[0] = s[1] = s[2] = 0;
  if (positive)
    for (int k = 0; k < 3; k++) s[k] = fmax(fabs(s[k]), 0.05);
  compose(s, F);
}

static double largest(const double *x, int n)
{
  double size = 0;
  for (int k = 0; k < n; k++) size = fmax(size, fabs(x[k]));
  return size;
}

typedef struct solver {
  gsl_matrix *H, *vectors;
  gsl_vector *values;
  gsl_eigen_symmv_workspace *work;
} solver;

static solver solver_create(void)
{
  return (solver){gsl_matrix_alloc(9, 9), gsl_matrix_alloc(9, 9), gsl_vector_alloc(9),
                  gsl_eigen_symmv_alloc(9)};
}

static void solver_destroy(solver s)
{
  gsl_matrix_free(s.H);
  gsl_matrix_free(s.vectors);
  gsl_vector_free(s.values);
  gsl_eigen_symmv_free(s.work);
}

/* Computes eigenvalues, ascending in s.values, and eigenvectors in the columns of s.vectors. */
static void solve(solver s, const double H[81])
{
  memcpy(s.H->data, H, 81 * sizeof *H);
  gsl_eigen_symmv(s.H, s.values, s.vectors, s.work);
  gsl_eigen_symmv_sort(s.values, s.vectors, GSL_EIGEN_SORT_VAL_ASC);
}

static int ascending(const void *a, const void *b)
{
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static double smallest_eigenvalue(const flesh_spectrum *spectrum)
{
  double w[3], Q[9];
  flesh_eigh3(spectrum->A, w, Q);
  double smallest = w[0];
  for (int k = 0; k < 3; k++)
    smallest = fmin(smallest, fmin(spectrum->twist[k], spectrum->flip[k]));
  return smallest;
}

static void eigenpairs_against_gsl(void)
{
  solver gsl = solver_create();
  for (int n = 0; n <= FLESH_ENERGY_COUNT; n++) {
    double value_worst = 0, pair_worst = 0, basis_worst = 0, smallest_worst = 0;
    for (int trial = 0; trial < 2000; trial++) {
      double F[9], H[81], values[9], vectors[81];
      flesh_material m = material_number(n);
      draw(trial, n, F);
      CHECK_OK(flesh_material_hessian(&m, F, H));
      CHECK_OK(flesh_material_eigen(&m, F, values, vectors));
      double scale = largest(H, 81);
      for (int k = 0; k < 9; k++) /* H q = value q, and the q are orthonormal */
        for (int p = 0; p < 9; p++) {
          double Hq = 0, dot = 0;
          for (int r = 0; r < 9; r++) {
            Hq += H[9 * p + r] * vectors[9 * k + r];
            dot += vectors[9 * k + r] * vectors[9 * p + r];
          }
          pair_worst = fmax(pair_worst, fabs(Hq - values[k] * vectors[9 * k + p]) / scale);
          basis_worst = fmax(basis_worst, fabs(dot - (k == p)));
        }
      CHECK(values[0] <= values[1] && values[1] <= values[2]);
      flesh_spectrum spectrum;
      double U[9], V[9];
      CHECK_OK(flesh_spectrum_at(&m, F, &spectrum, U, V));
      solve(gsl, H);
      smallest_worst =
          fmax(smallest_worst,
               fabs(smallest_eigenvalue(&spectrum) - gsl_vector_get(gsl.values, 0)) / scale);
      qsort(values, 9, sizeof *values, ascending);
      for (int k = 0; k < 9; k++)
        value_worst = fmax(value_worst, fabs(values[k] - gsl_vector_get(gsl.values, k)) / scale);
    }
    printf("# %s: values %.2g, pairs %.2g, basis %.2g\n", flesh_energy_name((flesh_energy)n),
           value_worst, pair_worst, basis_worst);
    CHECK_BELOW(value_worst, 1e-12);
    CHECK_BELOW(pair_worst, 1e-12);
    CHECK_BELOW(basis_worst, 1e-14);
    CHECK_BELOW(smallest_worst, 1e-12);
  }
  solver_destroy(gsl);
}

static void projection_against_gsl(void)
{
  solver gsl = solver_create();
  for (int n = 0; n <= FLESH_ENERGY_COUNT; n++) {
    double worst = 0, negative = 0;
    int clamped = 0;
    for (int trial = 0; trial < 1000; trial++) {
      double F[9], H[81], K[81], expected[81] = {0};
      flesh_material m = material_number(n);
      draw(trial, n, F);
      CHECK_OK(flesh_material_hessian(&m, F, H));
      CHECK_OK(flesh_material_hessian_projected(&m, F, K));
      double scale = largest(H, 81);
      solve(gsl, H);
      clamped += gsl_vector_get(gsl.values, 0) < 0;
      for (int k = 0; k < 9; k++)
        for (int p = 0; p < 9; p++)
          for (int r = 0; r < 9; r++)
            expected[9 * p + r] += fmax(gsl_vector_get(gsl.values, k), 0) *
                                   gsl_matrix_get(gsl.vectors, p, k) *
                                   gsl_matrix_get(gsl.vectors, r, k);
      for (int k = 0; k < 81; k++) worst = fmax(worst, fabs(K[k] - expected[k]) / scale);
      for (int p = 0; p < 9; p++)
        for (int r = 0; r < 9; r++) CHECK(K[9 * p + r] == K[9 * r + p]);
      solve(gsl, K);
      negative = fmax(negative, -gsl_vector_get(gsl.values, 0) / scale);
    }
    CHECK_BELOW(worst, 1e-12);
    CHECK_BELOW(negative, 1e-14);
    CHECK(clamped > 0 || n == FLESH_ENERGY_M); /* the projection had to act */
  }
  solver_destroy(gsl);
}

/* Compares the stiffness blocks in the singular frame, plain and clamped, with the 9x9 Hessian contracted with the same
 * two gradients. */
static void blocks_against_the_full_hessian(void)
{
  for (int n = 0; n <= FLESH_ENERGY_COUNT; n++) {
    double worst = 0;
    int changed = 0;
    for (int trial = 0; trial < 400; trial++) {
      double F[9], H[81], U[9], V[9], a[3], b[3], va[3], vb[3], B[9], UB[9], K[9];
      flesh_material m = material_number(n);
      flesh_spectrum spectrum;
      draw(trial, n, F);
      CHECK_OK(flesh_spectrum_at(&m, F, &spectrum, U, V));
      for (int k = 0; k < 3; k++) a[k] = uniform(), b[k] = uniform();
      flesh_mat3_transposed_times(V, a, va);
      flesh_mat3_transposed_times(V, b, vb);
      CHECK_OK(flesh_material_hessian(&m, F, H));
      double scale = largest(H, 81);
      for (int clamp = 0; clamp < 2; clamp++) {
        if (clamp) {
          flesh_spectrum before = spectrum;
          int was_changed = flesh_spectrum_filter(&spectrum, FLESH_FILTER_CLAMP);
          CHECK(was_changed == (memcmp(&before, &spectrum, sizeof before) != 0));
          CHECK(was_changed == (smallest_eigenvalue(&before) < 0));
          CHECK(smallest_eigenvalue(&spectrum) >= -1e-14 * scale);
          changed += was_changed;
          CHECK_OK(flesh_material_hessian_projected(&m, F, H));
        }
        flesh_spectrum_block(&spectrum, va, vb, B);
        flesh_mat3_multiply(U, B, UB);
        flesh_mat3_multiply_transposed(UB, U, K);
        for (int i = 0; i < 3; i++)
          for (int j = 0; j < 3; j++) {
            double sum = 0;
            for (int k = 0; k < 3; k++)
              for (int l = 0; l < 3; l++) sum += H[9 * (3 * i + k) + 3 * j + l] * a[k] * b[l];
            worst = fmax(worst, fabs(sum - K[3 * i + j]) / scale);
          }
      }
    }
    CHECK_BELOW(worst, 1e-12);
    CHECK(changed > 0 || n == FLESH_ENERGY_M);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(eigenpairs_against_gsl), TEST(projection_against_gsl),
                   TEST(blocks_against_the_full_hessian));
}
