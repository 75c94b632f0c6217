// TEST quick seconds=60
/* test_stretch_forms.c: the forms of the singular values against their formulas on GSL's singular values, the textbook
 * derivatives of the polar rotation, and differences; their Hessians' eigenvalues against GSL's of the 9x9 matrix;
 * their values where the polar rotation is not unique. */
#include "test_matrix.h"

#include <gsl/gsl_eigen.h>
#include <gsl/gsl_linalg.h>
#include <gsl/gsl_sort_vector.h>
#include <stdlib.h>

#include "flesh/material.h"
#include "material/form.h"

static const flesh_energy forms[] = {FLESH_ENERGY_CR, FLESH_ENERGY_FCR, FLESH_ENERGY_STVK};
enum { FORMS = sizeof forms / sizeof *forms };

static flesh_material raw(flesh_energy energy, double mu, double lambda)
{
  flesh_material m;
  CHECK_OK(flesh_material_from_lame(energy, FLESH_CONSTANTS_RAW, mu, lambda, &m));
  return m;
}

static double largest(const double *x, int n)
{
  double size = 0;
  for (int k = 0; k < n; k++) size = fmax(size, fabs(x[k]));
  return size;
}

static int ascending(const void *a, const void *b)
{
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* ---- the reference: GSL's singular values ---- */

/* Computes F = R S with a rotation R: the singular values s, the smallest with the sign of det F, R and S. */
static void polar(const double F[9], double s[3], double R[9], double S[9])
{
  double U[9], V[9], VS[9];
  memcpy(U, F, sizeof U);
  gsl_matrix_view u = gsl_matrix_view_array(U, 3, 3), v = gsl_matrix_view_array(V, 3, 3);
  gsl_vector_view values = gsl_vector_view_array(s, 3);
  gsl_linalg_SV_decomp_jacobi(&u.matrix, &v.matrix, &values.vector);
  if (s[2] < 1e-14 * s[0]) { /* what GSL leaves undetermined for a flat F */
    const double a[3] = {U[0], U[3], U[6]}, b[3] = {U[1], U[4], U[7]};
    double c[3];
    flesh_vec3_cross(a, b, c);
    for (int i = 0; i < 3; i++) U[3 * i + 2] = c[i];
  }
  if (flesh_mat3_determinant(U) * flesh_mat3_determinant(V) < 0) {
    s[2] = -s[2];
    for (int i = 0; i < 3; i++) U[3 * i + 2] = -U[3 * i + 2];
  }
  flesh_mat3_multiply_transposed(U, V, R);
  for (int k = 0; k < 9; k++) VS[k] = V[k] * s[k % 3];
  flesh_mat3_multiply_transposed(VS, V, S);
}

static long double formula(flesh_energy energy, const double s[3], long double mu, long double lambda)
{
  long double squares = 0, sum = 0, J = 1;
  for (int k = 0; k < 3; k++) {
    const long double e = energy == FLESH_ENERGY_STVK ? ((long double)s[k] * s[k] - 1) / 2 : (long double)s[k] - 1;
    squares += e * e, sum += e, J *= s[k];
  }
  return mu * squares + lambda / 2 * (energy == FLESH_ENERGY_FCR ? (J - 1) * (J - 1) : sum * sum);
}

/* Computes dR in direction X: R [w]x, where (tr(S) I - S) w is the axis of R^T X - X^T R. */
static void rotate_rate(const double R[9], const double S[9], const double X[9], double dR[9])
{
  double K[9], M[9], C[9], spin[9], trace = flesh_mat3_trace(S), w[3] = {0};
  flesh_mat3_transposed_multiply(R, X, K);
  const double axis[3] = {K[7] - K[5], K[2] - K[6], K[3] - K[1]};
  for (int k = 0; k < 9; k++) M[k] = (k % 4 == 0) * trace - S[k];
  flesh_mat3_cofactor(M, C);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) w[i] += C[3 * j + i] * axis[j] / flesh_mat3_determinant(M);
  const double cross[9] = {0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0};
  memcpy(spin, cross, sizeof spin);
  flesh_mat3_multiply(R, spin, dR);
}

/* Computes the stress, and its change in direction X, by the textbook formulas. */
static void textbook(const flesh_material *m, const double F[9], const double X[9], double P[9], double dP[9])
{
  double s[3], R[9], S[9], dR[9], C[9], CX[9], CFX[9], FX[9];
  const double mu = m->mu, lambda = m->lambda;
  polar(F, s, R, S);
  if (m->energy == FLESH_ENERGY_STVK) {
    double E[9], dE[9], XF[9];
    flesh_mat3_transposed_multiply(F, F, E);
    flesh_mat3_transposed_multiply(F, X, XF);
    for (int k = 0; k < 9; k++) E[k] = (E[k] - (k % 4 == 0)) / 2;
    for (int k = 0; k < 9; k++) dE[k] = (XF[k] + XF[3 * (k % 3) + k / 3]) / 2;
    const double trace = flesh_mat3_trace(E), rate = flesh_mat3_trace(dE);
    double T[9], dT[9], FdT[9];
    for (int k = 0; k < 9; k++) {
      T[k] = 2 * mu * E[k] + (k % 4 == 0) * lambda * trace;
      dT[k] = 2 * mu * dE[k] + (k % 4 == 0) * lambda * rate;
    }
    flesh_mat3_multiply(F, T, P);
    flesh_mat3_multiply(X, T, dP);
    flesh_mat3_multiply(F, dT, FdT);
    for (int k = 0; k < 9; k++) dP[k] += FdT[k];
    return;
  }
  rotate_rate(R, S, X, dR);
  for (int k = 0; k < 9; k++) {
    P[k] = 2 * mu * (F[k] - R[k]);
    dP[k] = 2 * mu * (X[k] - dR[k]);
  }
  if (m->energy == FLESH_ENERGY_CR) {
    const double strain = flesh_mat3_trace(S) - 3, rate = flesh_mat3_inner(R, X);
    for (int k = 0; k < 9; k++) {
      P[k] += lambda * strain * R[k];
      dP[k] += lambda * (rate * R[k] + strain * dR[k]);
    }
    return;
  }
  /* cof is quadratic: its change is the mixed term of F and X. */
  for (int k = 0; k < 9; k++) FX[k] = F[k] + X[k];
  flesh_mat3_cofactor(F, C);
  flesh_mat3_cofactor(X, CX);
  flesh_mat3_cofactor(FX, CFX);
  const double dilation = flesh_mat3_determinant(F) - 1, rate = flesh_mat3_inner(C, X);
  for (int k = 0; k < 9; k++) {
    P[k] += lambda * dilation * C[k];
    dP[k] += lambda * (rate * C[k] + dilation * (CFX[k] - C[k] - CX[k]));
  }
}

/* ---- points of evaluation ---- */

enum { KINDS = 14 };

static void draw(int kind, double F[9])
{
  double s[3] = {1 + 0.6 * uniform(), 1 + 0.6 * uniform(), 1 + 0.6 * uniform()}, scale = 1;
  switch (kind) {
  case 1: /* reflected */
    s[0] += 1, s[2] = -0.3 * s[2];
    break;
  case 2: /* flat */
    s[2] = 0;
    break;
  case 3: /* turned inside out */
    s[0] = -s[0] - 2, s[1] = -s[1] - 2, s[2] = -s[2];
    break;
  case 4: /* a rotation */
    s[0] = s[1] = s[2] = 1;
    break;
  case 5:
    s[1] = s[0];
    break;
  case 6: /* two equal, reflected */
    s[0] = s[1] = 2, s[2] = -0.5;
    break;
  case 7: /* all but equal */
    s[1] = s[0] * (1 + 1e-9), s[2] = s[0] * (1 - 1e-12);
    break;
  case 8: /* equal and flat */
    s[1] = s[0], s[2] = 0;
    break;
  case 9: /* nearly flat */
    s[2] = 1e-7;
    break;
  case 10: /* drawn out */
    s[0] = 30, s[1] = 0.1;
    break;
  case 11: /* scaled */
    s[0] = s[1] = s[2];
    break;
  case 12: /* near the cone of F without a unique rotation */
    s[0] = 2, s[1] = 0.5, s[2] = -0.49;
    break;
  case 13:
    scale = 1e3;
    break;
  default:
    break;
  }
  compose(s, F);
  for (int k = 0; k < 9; k++) F[k] *= scale;
}

static void values_against_the_formulas(void)
{
  double worst = 0;
  for (int n = 0; n < FORMS; n++)
    for (int trial = 0; trial < 100 * KINDS; trial++) {
      double F[9], s[3], R[9], S[9], psi;
      const flesh_material m = raw(forms[n], 1, exp(2 + 2 * uniform()));
      draw(trial % KINDS, F);
      CHECK_OK(flesh_material_energy(&m, F, &psi));
      polar(F, s, R, S);
      const long double expected = formula(forms[n], s, m.mu, m.lambda);
      const double terms = m.mu + m.lambda + (double)expected;
      worst = fmax(worst, fabs((double)(psi - expected)) / terms);
    }
  printf("# values off by %.2g\n", worst);
  CHECK_BELOW(worst, 1e-13);
}

static void stress_and_hessian_against_the_textbook(void)
{
  gsl_eigen_symm_workspace *work = gsl_eigen_symm_alloc(9);
  gsl_vector *expected = gsl_vector_alloc(9);
  for (int n = 0; n < FORMS; n++) {
    double stress = 0, hessian = 0, eigenvalues = 0, pairs = 0;
    for (int trial = 0; trial < 60 * KINDS; trial++) {
      double F[9], P[9], Q[9], H[81], K[81], dP[9], values[9], vectors[81];
      const flesh_material m = raw(forms[n], 1, exp(2 + 2 * uniform()));
      draw(trial % KINDS, F);
      CHECK_OK(flesh_material_stress(&m, F, P));
      CHECK_OK(flesh_material_hessian(&m, F, H));
      CHECK_OK(flesh_material_eigen(&m, F, values, vectors));
      for (int p = 0; p < 9; p++) {
        double X[9] = {0};
        X[p] = 1;
        textbook(&m, F, X, Q, dP);
        for (int q = 0; q < 9; q++) K[9 * q + p] = dP[q];
      }
      const double scale = largest(K, 81), terms = largest(Q, 9) + scale * largest(F, 9);
      for (int k = 0; k < 9; k++) stress = fmax(stress, fabs(P[k] - Q[k]) / terms);
      for (int k = 0; k < 81; k++) hessian = fmax(hessian, fabs(H[k] - K[k]) / scale);
      for (int k = 0; k < 9; k++)
        for (int p = 0; p < 9; p++) {
          double Kq = 0;
          for (int q = 0; q < 9; q++) Kq += K[9 * p + q] * vectors[9 * k + q];
          pairs = fmax(pairs, fabs(Kq - values[k] * vectors[9 * k + p]) / scale);
        }
      gsl_matrix_view matrix = gsl_matrix_view_array(K, 9, 9);
      gsl_eigen_symm(&matrix.matrix, expected, work);
      gsl_sort_vector(expected);
      qsort(values, 9, sizeof *values, ascending);
      for (int k = 0; k < 9; k++)
        eigenvalues = fmax(eigenvalues, fabs(values[k] - gsl_vector_get(expected, k)) / scale);
    }
    printf("# %s: stress off by %.2g, Hessian by %.2g, its pairs by %.2g, its eigenvalues by %.2g\n",
           flesh_energy_name(forms[n]), stress, hessian, pairs, eigenvalues);
    CHECK_BELOW(stress, 1e-13);
    CHECK_BELOW(hessian, 1e-12);
    CHECK_BELOW(pairs, 1e-12);
    CHECK_BELOW(eigenvalues, 1e-12);
  }
  gsl_vector_free(expected);
  gsl_eigen_symm_free(work);
}

/* Checks sixth-order differences of the energy and of the stress, further from the cone than their steps. */
static void stress_and_hessian_by_differences(void)
{
  static const double weight[4] = {0, 45, -9, 1};
  for (int n = 0; n < FORMS; n++)
    for (int kind = 0; kind < KINDS; kind++) {
      double stress = 0, hessian = 0;
      for (int trial = 0; trial < 10; trial++) {
        double F[9], P[9], H[81];
        const flesh_material m = raw(forms[n], 1, exp(2 + 2 * uniform()));
        draw(kind, F);
        if (kind == 12) F[0] += 0.5; /* another point, not as near */
        CHECK_OK(flesh_material_stress(&m, F, P));
        CHECK_OK(flesh_material_hessian(&m, F, H));
        const double h = (kind == 12 ? 1e-4 : 1e-3) * fmax(1, 1e-2 * largest(F, 9));
        double energies = 0, terms = largest(P, 9) + largest(H, 81) * largest(F, 9);
        for (int p = 0; p < 9; p++) {
          double slope = 0, column[9] = {0};
          for (int k = -3; k <= 3; k++) {
            double G[9], psi, Q[9];
            if (!k) continue;
            memcpy(G, F, sizeof G);
            G[p] += k * h;
            CHECK_OK(flesh_material_energy(&m, G, &psi));
            CHECK_OK(flesh_material_stress(&m, G, Q));
            const double factor = (k > 0 ? 1 : -1) * weight[abs(k)] / (60 * h);
            slope += factor * psi;
            for (int q = 0; q < 9; q++) column[q] += factor * Q[q];
            energies = fmax(energies, fabs(psi));
          }
          stress = fmax(stress, fabs(slope - P[p]) / (terms + energies / h * 1e-3));
          for (int q = 0; q < 9; q++)
            hessian = fmax(hessian, fabs(column[q] - H[9 * q + p]) / (largest(H, 81) + terms / h * 1e-3));
        }
      }
      if (stress > 1e-10 || hessian > 1e-10)
        printf("# %s kind %d: %.2g, %.2g\n", flesh_energy_name(forms[n]), kind, stress, hessian);
      CHECK_BELOW(stress, 1e-10);
      CHECK_BELOW(hessian, 1e-10);
    }
}

/* s_2 + s_3 = 0: a reflection of a plane stretched equally in two directions, a line, a point. */
static void bounded_where_the_rotation_is_not_unique(void)
{
  static const double cones[][3] = {{1, 1, -1}, {2, 0.7, -0.7}, {3, 0, 0}, {0, 0, 0}, {2, 0.5, -0.5 + 1e-9}};
  for (int n = 0; n < 2; n++) /* StVK is a polynomial */
    for (unsigned c = 0; c < sizeof cones / sizeof *cones; c++)
      for (int trial = 0; trial < 20; trial++) {
        double F[9], P[9], H[81], K[81], psi, values[9], vectors[81], U[9] = {0};
        const flesh_material m = raw(forms[n], 1, 4);
        compose(cones[c], F);
        CHECK_OK(flesh_material_energy(&m, F, &psi));
        CHECK_NEAR(psi, (double)formula(forms[n], cones[c], m.mu, m.lambda), 1e-13 * (1 + fabs(psi)));
        CHECK_OK(flesh_material_stress(&m, F, P));
        CHECK_OK(flesh_material_hessian(&m, F, H));
        CHECK_OK(flesh_material_hessian_projected(&m, F, K));
        CHECK_OK(flesh_material_eigen(&m, F, values, vectors));
        double tension = 0;
        for (int k = 0; k < 3 && forms[n] == FLESH_ENERGY_CR; k++) tension += m.lambda * (cones[c][k] - 1);
        const double most = (4 * m.mu + 2 * fabs(tension)) / FLESH_SMALLEST_STRETCH_SUM;
        CHECK_BELOW(largest(values, 9), 1.001 * most + 100);
        CHECK(values[3] == -largest(values, 9) || tension > 2 * m.mu); /* the twist of s_2 and s_3 */
        CHECK(isfinite(largest(H, 81)) && isfinite(largest(K, 81)));
        /* The stress is that of some rotation: with R = (2 mu F + ... - P)/..., P = 2 mu (F - R) + tension R. */
        if (forms[n] == FLESH_ENERGY_CR) {
          for (int k = 0; k < 9; k++) U[k] = (2 * m.mu * F[k] - P[k]) / (2 * m.mu - tension);
          double UU[9];
          flesh_mat3_transposed_multiply(U, U, UU);
          for (int k = 0; k < 9; k++) CHECK_NEAR(UU[k], k % 4 == 0, 1e-13);
          CHECK_NEAR(flesh_mat3_determinant(U), 1, 1e-13);
          CHECK_NEAR(flesh_mat3_inner(U, F), cones[c][0] + cones[c][1] + cones[c][2], 1e-12);
        }
      }
}

static void rest_is_that_of_linear_elasticity(void)
{
  static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (int n = 0; n < FORMS; n++)
    for (int trial = 0; trial < 20; trial++) {
      flesh_material m;
      const double young = exp(5 * uniform()), nu = 0.25 + 0.2499 * uniform();
      const double mu = young / (2 * (1 + nu)), lambda = young * nu / ((1 + nu) * (1 - 2 * nu));
      double back[3], ratio, psi, R[9], P[9], H[81];
      CHECK_OK(flesh_material_from_young(forms[n], FLESH_CONSTANTS_MATCHED, young, nu, &m));
      CHECK_OK(flesh_material_small_strain(&m, &back[0], &back[1], &back[2]));
      CHECK_NEAR(back[0], mu, 1e-14 * mu);
      CHECK_NEAR(back[1], lambda, 1e-14 * (mu + lambda));
      CHECK(back[2] == 0);
      CHECK_OK(flesh_material_rest_ratio(&m, &ratio));
      CHECK(ratio == 1);
      CHECK_OK(flesh_material_energy(&m, identity, &psi));
      CHECK(psi == 0);
      random_rotation(R);
      CHECK_OK(flesh_material_stress(&m, R, P));
      CHECK_BELOW(largest(P, 9), 1e-14 * (mu + lambda));
      CHECK_OK(flesh_material_hessian(&m, identity, H));
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
          for (int k = 0; k < 3; k++)
            for (int l = 0; l < 3; l++) {
              const double hooke = lambda * (i == j && k == l) + mu * ((i == k && j == l) + (i == l && j == k));
              CHECK_NEAR(H[9 * (3 * i + j) + 3 * k + l], hooke, 1e-14 * (mu + lambda));
            }
    }
}

/* Forms psi(I_C, J) have none, and say so. */
static void no_function_of_the_invariants(void)
{
  for (int n = 0; n < FORMS; n++) {
    const flesh_material m = raw(forms[n], 1, 4);
    flesh_psi psi = {.value = 7};
    CHECK(m.psi(3, 1, &m, &psi) == FLESH_UNDEFINED && psi.value == 7);
    CHECK(flesh_form_of_stretches(forms[n]));
  }
  CHECK(!flesh_form_of_stretches(FLESH_ENERGY_S) && !flesh_form_of_stretches(FLESH_ENERGY_AB));
  CHECK(!flesh_form_of_stretches(FLESH_ENERGY_USER));
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(values_against_the_formulas), TEST(stress_and_hessian_against_the_textbook),
                   TEST(stress_and_hessian_by_differences), TEST(bounded_where_the_rotation_is_not_unique),
                   TEST(rest_is_that_of_linear_elasticity), TEST(no_function_of_the_invariants));
}
