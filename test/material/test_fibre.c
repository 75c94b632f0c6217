// TEST quick
/* test_fibre.c: the tension of a muscle fibre follows the published curves, is smooth and the derivative of its energy;
 * the closed-form eigenvalues of its Hessian by F agree with a solver. */
#include <gsl/gsl_eigen.h>
#include <gsl/gsl_sort_vector.h>
#include <stddef.h>

#include "flesh/fibre.h"
#include "flesh/material.h"
#include "material/fibre_forms.h"
#include "math/mat3.h"
#include "test.h"

enum { ENERGY, TENSION, STIFFNESS };

/* Divided by the peak stress 1 Pa, at optimal stretch 1. */
static double value(flesh_fibre_curve curve, double passive, double activation, double l, int which)
{
  flesh_fibre fibre;
  double tension[3];
  CHECK_OK(flesh_fibre_default(curve, 1, &fibre));
  fibre.passive_stress *= passive;
  CHECK_OK(flesh_fibre_tension(&fibre, activation, l, tension));
  return tension[which];
}

/* Blemker, Pinsky & Delp 2005, equation 6: the active tension, and the passive one from their constants P_1 to P_4. */
static double blemker(double l)
{
  if (l <= 0.4 || l >= 1.6) return 0;
  if (l <= 0.6) return 9 * (l - 0.4) * (l - 0.4);
  return l < 1.4 ? 1 - 4 * (1 - l) * (1 - l) : 9 * (l - 1.6) * (l - 1.6);
}

static double exponential(double l, double c_1, double c_2, double limit)
{
  if (l <= 1) return 0;
  if (l < 1 + limit) return c_1 * (exp(c_2 * (l - 1)) - 1);
  return c_1 * (exp(c_2 * limit) - 1) + c_1 * c_2 * exp(c_2 * limit) * (l - 1 - limit);
}

static void curves_are_the_published_ones(void)
{
  double tail = 0, middle = 0, gauss = 0, toe[2] = {0, 0}, beyond[2] = {0, 0};
  for (int k = 0; k <= 4000; k++) {
    const double l = k * 5e-4, off = value(FLESH_FIBRE_BLEMKER, 0, 1, l, TENSION) - blemker(l);
    const double far = fabs(l - 1);
    if (far > 0.4 && far < 0.6) {
      tail = fmax(tail, off);
      CHECK(off > -1e-15);
    } else {
      middle = fmax(middle, fabs(off));
    }
    if (l >= 0.4)
      gauss = fmax(gauss, fabs(value(FLESH_FIBRE_THELEN, 0, 1, l, TENSION) - exp(-(l - 1) * (l - 1) / 0.45)));
    const double passive[2] = {exponential(l, 0.05, 6.6, 0.4),
                               exponential(l, 1 / (exp(5) - 1), 5 / 0.6, 0.6)};
    for (int c = 0; c < 2; c++) {
      const double error = fabs(value((flesh_fibre_curve)c, 1, 0, l, TENSION) - passive[c]);
      const double at = (l - 1) * (c ? 5 / 0.6 : 6.6);
      if (at > 0 && at < 1. / 3) toe[c] = fmax(toe[c], error);
      else beyond[c] = fmax(beyond[c], error);
    }
  }
  printf("# blemker's tails %.2g above, the middle off by %.2g; thelen by %.2g\n", tail, middle, gauss);
  printf("# passive off by %.2g and %.2g, toes by %.2g and %.2g\n", beyond[0], beyond[1], toe[0], toe[1]);
  CHECK_BELOW(tail, 0.012);
  CHECK_BELOW(fmax(middle, gauss), 1e-14);
  CHECK_BELOW(fmax(beyond[0], beyond[1]), 1e-14);
  CHECK_BELOW(toe[0], 0.004);
  CHECK_BELOW(toe[1], 0.004);
  CHECK_NEAR(value(FLESH_FIBRE_BLEMKER, 0, 1, 3, ENERGY), 0.68, 1e-14);
}

/* Compares with central differences, also across the points where pieces of the curves join. */
static void tension_is_smooth_and_the_derivative_of_the_energy(void)
{
  const double h = 1e-5;
  for (int c = 0; c < FLESH_FIBRE_CURVE_COUNT; c++) {
    double worst[2] = {0, 0}, jump = 0;
    for (double l = 0.01; l < 2.5; l += 0.00499) {
      double at[3][3];
      for (int k = 0; k < 3; k++)
        for (int w = 0; w < 3; w++) at[k][w] = value((flesh_fibre_curve)c, 1, 0.7, l + (k - 1) * h, w);
      worst[0] = fmax(worst[0], fabs((at[2][ENERGY] - at[0][ENERGY]) / (2 * h) - at[1][TENSION]));
      worst[1] = fmax(worst[1], fabs((at[2][TENSION] - at[0][TENSION]) / (2 * h) - at[1][STIFFNESS]));
      CHECK(at[1][TENSION] >= 0);
    }
    const double joints[] = {0.4, 0.6, 1, 1.4, 1.6, 1 + 1 / (3 * 6.6), 1 + 0.2 / 5, 1.6};
    for (int k = 0; k < 8; k++) {
      jump = fmax(jump, fabs(value((flesh_fibre_curve)c, 1, 1, joints[k] + 1e-9, STIFFNESS) -
                             value((flesh_fibre_curve)c, 1, 1, joints[k] - 1e-9, STIFFNESS)));
      CHECK_NEAR(value((flesh_fibre_curve)c, 1, 1, joints[k] + 1e-9, ENERGY),
                 value((flesh_fibre_curve)c, 1, 1, joints[k] - 1e-9, ENERGY), 1e-8);
    }
    printf("# %s: tension off by %.2g, stiffness by %.2g, jumps by %.2g\n", flesh_fibre_curve_name((flesh_fibre_curve)c),
           worst[0], worst[1], jump);
    CHECK_BELOW(worst[0], 1e-8);
    CHECK_BELOW(worst[1], 1e-6);
    CHECK_BELOW(jump, 1e-6);
    CHECK(value((flesh_fibre_curve)c, 1, 1, 0, ENERGY) == 0);
  }
}

/* An optimal stretch scales the curve's stretch and keeps the energy; stresses scale. */
static void constants_scale(void)
{
  flesh_fibre fibre;
  double one[3], other[3];
  for (int c = 0; c < FLESH_FIBRE_CURVE_COUNT; c++)
    for (double l = 0.2; l < 2; l += 0.3) {
      CHECK_OK(flesh_fibre_default((flesh_fibre_curve)c, 1, &fibre));
      CHECK_OK(flesh_fibre_tension(&fibre, 0.3, l, one));
      CHECK_OK(flesh_fibre_default((flesh_fibre_curve)c, 3e5, &fibre));
      fibre.optimal_stretch = 1.25;
      CHECK_OK(flesh_fibre_tension(&fibre, 0.3, 1.25 * l, other));
      const double factor[3] = {3e5, 3e5 / 1.25, 3e5 / (1.25 * 1.25)};
      for (int w = 0; w < 3; w++) CHECK_NEAR(other[w], factor[w] * one[w], 1e-9 * (1 + fabs(other[w])));
    }
}

/* Computes dW/dF = T f a^T. */
static void stress_at(const flesh_fibre_constants *c, const double F[9], const double a[3], double P[9])
{
  double f[3];
  flesh_fibre_real at;
  flesh_mat3_times(F, a, f);
  flesh_fibre_form(c, 0.8, flesh_vec3_dot(f, f), &at);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) P[3 * i + j] = at.T * f[i] * a[j];
}

static void eigenvalues(const double H[81], double w[9])
{
  double copy[81];
  memcpy(copy, H, sizeof copy);
  gsl_matrix_view A = gsl_matrix_view_array(copy, 9, 9);
  gsl_vector_view values = gsl_vector_view_array(w, 9);
  gsl_eigen_symm_workspace *space = gsl_eigen_symm_alloc(9);
  gsl_eigen_symm(&A.matrix, &values.vector, space);
  gsl_eigen_symm_free(space);
  gsl_sort_vector(&values.vector);
}

/* Computes (T 1 + D f f^T) (x) a a^T. */
static void closed_form(const flesh_fibre_constants *c, flesh_eigenvalue_filter filter, const double F[9],
                        const double a[3], double H[81], double w[9])
{
  double f[3];
  flesh_fibre_real at;
  flesh_mat3_times(F, a, f);
  const double I = flesh_vec3_dot(f, f);
  flesh_fibre_form(c, 0.8, I, &at);
  if (filter) flesh_fibre_filter(filter, I, &at);
  for (int p = 0; p < 9; p++)
    for (int q = 0; q < 9; q++)
      H[9 * p + q] = ((p / 3 == q / 3) * at.T + at.D * f[p / 3] * f[q / 3]) * a[p % 3] * a[q % 3];
  const double own[9] = {at.T, at.T, at.stiffness};
  memcpy(w, own, sizeof own);
  gsl_vector_view values = gsl_vector_view_array(w, 9);
  gsl_sort_vector(&values.vector);
}

/* F of any kind: inverted, flat, zero along the fibre. */
static void any_gradient(int trial, unsigned long long *seed, double F[9], double a[3])
{
  for (int k = 0; k < 9; k++) F[k] = (trial % 7 ? 1.5 : 1e-3) * (2 * test_uniform(seed) - 1);
  for (int k = 0; k < 3; k++) a[k] = 2 * test_uniform(seed) - 1;
  if (trial % 11 == 0)
    for (int i = 0; i < 3; i++) F[3 * i] = F[3 * i + 1] = F[3 * i + 2] = 0;
  const double length = sqrt(flesh_vec3_dot(a, a));
  for (int k = 0; k < 3; k++) a[k] /= length;
}

static void eigenvalues_are_those_of_a_solver(void)
{
  unsigned long long seed = 5;
  double worst[2] = {0, 0}, filtered = 0;
  int negative = 0;
  for (int trial = 0; trial < 2000; trial++) {
    flesh_fibre fibre;
    flesh_fibre_constants c;
    double F[9], a[3], H[81], differences[81], own[9], right[9];
    CHECK_OK(flesh_fibre_default((flesh_fibre_curve)(trial % 2), 1, &fibre));
    if (trial % 3) fibre.passive_stress = 0;
    CHECK_OK(flesh_fibre_constants_of(&fibre, &c));
    any_gradient(trial, &seed, F, a);
    closed_form(&c, FLESH_FILTER_NONE, F, a, H, own);
    const double h = 1e-5;
    for (int q = 0; q < 9; q++) {
      double up[9], down[9], G[9];
      memcpy(G, F, sizeof G);
      G[q] = F[q] + h;
      stress_at(&c, G, a, up);
      G[q] = F[q] - h;
      stress_at(&c, G, a, down);
      for (int p = 0; p < 9; p++) differences[9 * p + q] = (up[p] - down[p]) / (2 * h);
    }
    for (int k = 0; k < 81; k++) worst[0] = fmax(worst[0], fabs(H[k] - differences[k]));
    eigenvalues(H, right);
    for (int k = 0; k < 9; k++) worst[1] = fmax(worst[1], fabs(own[k] - right[k]));
    negative += right[0] < -1e-3;
    for (int filter = FLESH_FILTER_CLAMP; filter <= FLESH_FILTER_ABSOLUTE; filter++) {
      double changed[9], unused[9];
      closed_form(&c, (flesh_eigenvalue_filter)filter, F, a, H, unused);
      eigenvalues(H, changed);
      for (int k = 0; k < 9; k++)
        own[k] = filter == FLESH_FILTER_CLAMP ? fmax(right[k], 0) : fabs(right[k]);
      gsl_vector_view values = gsl_vector_view_array(own, 9);
      gsl_sort_vector(&values.vector);
      for (int k = 0; k < 9; k++) filtered = fmax(filtered, fabs(own[k] - changed[k]));
    }
  }
  printf("# Hessian off by %.2g from differences, eigenvalues by %.2g, filtered ones by %.2g; %d of 2000 indefinite\n",
         worst[0], worst[1], filtered, negative);
  CHECK_BELOW(worst[0], 1e-6);
  CHECK_BELOW(fmax(worst[1], filtered), 1e-12);
  CHECK(negative > 200);
}

static void bad_constants_are_refused(void)
{
  flesh_fibre fibre, bad;
  double tension[3];
  CHECK(flesh_fibre_default((flesh_fibre_curve)9, 1, &fibre) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_fibre_default(FLESH_FIBRE_BLEMKER, NAN, &fibre) == FLESH_ERR_ARGUMENT);
  CHECK(!flesh_fibre_curve_name((flesh_fibre_curve)9) && !strcmp(flesh_fibre_curve_name(FLESH_FIBRE_THELEN), "thelen"));
  CHECK_OK(flesh_fibre_default(FLESH_FIBRE_BLEMKER, 1, &fibre));
  const struct {
    size_t member;
    double value;
    const char *words;
  } cases[] = {{offsetof(flesh_fibre, peak_stress), -1, "peak_stress is -1 Pa"},
               {offsetof(flesh_fibre, optimal_stretch), 0, "optimal_stretch is 0"},
               {offsetof(flesh_fibre, passive_stress), NAN, "passive stress c1 is nan Pa"},
               {offsetof(flesh_fibre, passive_exponent), 0, "passive exponent c2 is 0"},
               {offsetof(flesh_fibre, passive_limit), 0, "passive limit is 0"},
               {offsetof(flesh_fibre, passive_limit), 20, "at most 15.1515"},
               {offsetof(flesh_fibre, max_shortening_velocity), -1, "max_shortening_velocity is -1 1/s"}};
  for (int k = 0; k < 7; k++) {
    bad = fibre;
    *(double *)((char *)&bad + cases[k].member) = cases[k].value;
    CHECK(flesh_fibre_tension(&bad, 1, 1, tension) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), cases[k].words);
  }
  CHECK(flesh_fibre_tension(&fibre, 1.5, 1, tension) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "activation is 1.5; it must be from 0 to 1");
  CHECK(flesh_fibre_tension(&fibre, 1, INFINITY, tension) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "stretch is inf; it must be from 0 to 1e100");
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(curves_are_the_published_ones),
                   TEST(tension_is_smooth_and_the_derivative_of_the_energy), TEST(constants_scale),
                   TEST(eigenvalues_are_those_of_a_solver), TEST(bad_constants_are_refused));
}
