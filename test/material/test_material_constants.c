// TEST quick
/* test_material_constants.c: the maps from small-strain constants, their limits and refusals, and the rest state of
 * every form. */
#include "test_matrix.h"

#include <gsl/gsl_roots.h>

#include "flesh/material.h"
#include "material/form.h"

static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
static const flesh_energy matched[] = {FLESH_ENERGY_NEO, FLESH_ENERGY_A, FLESH_ENERGY_B,
                                       FLESH_ENERGY_E, FLESH_ENERGY_S, FLESH_ENERGY_FUNG, FLESH_ENERGY_AB,
                                       FLESH_ENERGY_CR, FLESH_ENERGY_FCR, FLESH_ENERGY_STVK};
enum { MATCHED_COUNT = sizeof matched / sizeof *matched };

/* Computes the stress's slope at F = I in direction X from stresses only: sixth-order differences. */
static void stress_slope(const flesh_material *m, const double X[9], double dP[9])
{
  static const double weight[4] = {0, 45, -9, 1};
  const double h = 1e-3;
  for (int k = 0; k < 9; k++) dP[k] = 0;
  for (int k = 1; k <= 3; k++) {
    double F[9], plus[9], minus[9];
    for (int c = 0; c < 9; c++) F[c] = identity[c] + k * h * X[c];
    CHECK_OK(flesh_material_stress(m, F, plus));
    for (int c = 0; c < 9; c++) F[c] = identity[c] - k * h * X[c];
    CHECK_OK(flesh_material_stress(m, F, minus));
    for (int c = 0; c < 9; c++) dP[c] += weight[k] * (plus[c] - minus[c]) / (60 * h);
  }
}

static void matched_constants_linearise_to_the_given(void)
{
  static const double ratios[] = {-0.99, -0.5, -0.1, 0, 0.1, 0.3, 0.45, 0.49, 0.4999};
  const double young = 2.5e5;
  for (int n = 0; n < MATCHED_COUNT; n++)
    for (size_t r = 0; r < sizeof ratios / sizeof *ratios; r++) {
      double nu = ratios[r], mu = young / (2 * (1 + nu));
      double lambda = young * nu / ((1 + nu) * (1 - 2 * nu));
      flesh_material m;
      /* A and FCR are not bounded from below there; Fung's is only stable where its own lambda is positive. */
      const int limited = matched[n] == FLESH_ENERGY_A || matched[n] == FLESH_ENERGY_FCR ||
                          (matched[n] == FLESH_ENERGY_FUNG && nu < -0.4);
      if (limited && nu < 0) {
        CHECK(flesh_material_from_young(matched[n], FLESH_CONSTANTS_MATCHED, young, nu, &m) == FLESH_ERR_ARGUMENT);
        continue;
      }
      CHECK_OK(flesh_material_from_young(matched[n], FLESH_CONSTANTS_MATCHED, young, nu, &m));
      CHECK(m.young == young && m.poisson == nu && m.constants == FLESH_CONSTANTS_MATCHED);
      for (int trial = 0; trial < 10; trial++) {
        double X[9], dP[9];
        random_matrix(X); /* its antisymmetric part must have no effect: no rest stress */
        stress_slope(&m, X, dP);
        for (int i = 0; i < 3; i++)
          for (int j = 0; j < 3; j++) {
            double hooke =
                mu * (X[3 * i + j] + X[3 * j + i]) + (i == j) * lambda * flesh_mat3_trace(X);
            CHECK_NEAR(dP[3 * i + j], hooke, 2e-11 * (mu + lambda));
          }
      }
      double mu_back, lambda_back, stress;
      CHECK_OK(flesh_material_small_strain(&m, &mu_back, &lambda_back, &stress));
      CHECK_NEAR(mu_back, mu, 1e-14 * mu);
      CHECK_NEAR(lambda_back, lambda, 1e-14 * (mu + lambda));
      CHECK_NEAR(stress, 0, 1e-15 * mu);
    }
}

/* 3/g and 8 + 3 - 4 h 3/g, in fractions: g = 2 f'(3) and h = f''(3) of Arruda & Boyce's five terms with N = 25. */
#define AB_MU     2.9269884323013344
#define AB_LAMBDA 10.949403605981431

/* The maps themselves, as defined for the family of forms. */
static void maps_of_the_constants(void)
{
  const double mu = 3, lambda = 8;
  static const struct {
    flesh_energy energy;
    flesh_constants constants;
    double mu, lambda, alpha;
  } rows[] = {{FLESH_ENERGY_NEO, FLESH_CONSTANTS_MATCHED, 3, 8, 1},
              {FLESH_ENERGY_A, FLESH_CONSTANTS_MATCHED, 3, 8, 1},
              {FLESH_ENERGY_B, FLESH_CONSTANTS_MATCHED, 3, 10, 1},
              {FLESH_ENERGY_E, FLESH_CONSTANTS_MATCHED, 3, 11, 1 + 3. / 11},
              {FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 4, 10.5, 1 + 3 / 10.5},
              {FLESH_ENERGY_D, FLESH_CONSTANTS_AS_E, 3, 11, 1},
              {FLESH_ENERGY_FUNG, FLESH_CONSTANTS_MATCHED, 3, 9.5, 1 + 3 / 9.5}, /* b = 1/4 */
              {FLESH_ENERGY_AB, FLESH_CONSTANTS_MATCHED, AB_MU, AB_LAMBDA, 1 + 3 / AB_LAMBDA}, /* N = 25 */
              {FLESH_ENERGY_CR, FLESH_CONSTANTS_MATCHED, 3, 8, 1},
              {FLESH_ENERGY_FCR, FLESH_CONSTANTS_MATCHED, 3, 8, 1},
              {FLESH_ENERGY_STVK, FLESH_CONSTANTS_MATCHED, 3, 8, 1},
              {FLESH_ENERGY_FUNG, FLESH_CONSTANTS_RAW, 3, 8, 1.375},
              {FLESH_ENERGY_CR, FLESH_CONSTANTS_RAW, 3, 8, 1},
              {FLESH_ENERGY_FCR, FLESH_CONSTANTS_RAW, 3, 8, 1},
              {FLESH_ENERGY_STVK, FLESH_CONSTANTS_RAW, 3, 8, 1},
              {FLESH_ENERGY_NEO, FLESH_CONSTANTS_RAW, 3, 8, 1},
              {FLESH_ENERGY_A, FLESH_CONSTANTS_RAW, 3, 8, 1},
              {FLESH_ENERGY_B, FLESH_CONSTANTS_RAW, 3, 8, 1},
              {FLESH_ENERGY_C, FLESH_CONSTANTS_RAW, 3, 8, 1},
              {FLESH_ENERGY_M, FLESH_CONSTANTS_RAW, 3, 8, 1},
              {FLESH_ENERGY_D, FLESH_CONSTANTS_RAW, 3, 8, 1},
              {FLESH_ENERGY_E, FLESH_CONSTANTS_RAW, 3, 8, 1.375},
              {FLESH_ENERGY_S, FLESH_CONSTANTS_RAW, 3, 8, 1.28125}};
  for (unsigned n = 0; n < sizeof rows / sizeof *rows; n++) {
    flesh_material m;
    CHECK_OK(flesh_material_from_lame(rows[n].energy, rows[n].constants, mu, lambda, &m));
    CHECK_NEAR(m.mu, rows[n].mu, 1e-14);
    CHECK_NEAR(m.lambda, rows[n].lambda, 1e-14);
    CHECK_NEAR(m.alpha, rows[n].alpha, 1e-14);
    CHECK(m.energy == rows[n].energy && m.constants == rows[n].constants);
    CHECK(isnan(m.young) && isnan(m.poisson));
  }
}

static void stress_at_rest(void)
{
  const double mu = 7, lambda = 31;
  static const struct {
    flesh_energy energy;
    double mu, lambda; /* rest stress = mu * this + lambda * that */
  } rows[] = {{FLESH_ENERGY_NEO, 0, 0}, {FLESH_ENERGY_A, 0, 0}, {FLESH_ENERGY_B, 0, 0},
              {FLESH_ENERGY_C, 0, 0.5}, {FLESH_ENERGY_M, 1, 0}, {FLESH_ENERGY_D, 1, 0},
              {FLESH_ENERGY_E, 0, 0},   {FLESH_ENERGY_S, 0, 0}, {FLESH_ENERGY_FUNG, 0, 0},
              {FLESH_ENERGY_AB, 0, 0},  {FLESH_ENERGY_CR, 0, 0}, {FLESH_ENERGY_FCR, 0, 0},
              {FLESH_ENERGY_STVK, 0, 0}};
  for (unsigned n = 0; n < sizeof rows / sizeof *rows; n++) {
    flesh_material m;
    double R[9], P[9], stress, expected = rows[n].mu * mu + rows[n].lambda * lambda;
    CHECK_OK(flesh_material_from_lame(rows[n].energy, FLESH_CONSTANTS_RAW, mu, lambda, &m));
    CHECK_OK(flesh_material_small_strain(&m, NULL, NULL, &stress));
    CHECK_NEAR(stress, expected, 1e-14 * mu);
    CHECK_OK(flesh_material_stress(&m, identity, P));
    for (int k = 0; k < 9; k++) CHECK_NEAR(P[k], expected * identity[k], 1e-14 * mu);
    random_rotation(R);
    CHECK_OK(flesh_material_stress(&m, R, P));
    for (int k = 0; k < 9; k++) CHECK_NEAR(P[k], expected * R[k], 1e-13 * lambda);
  }
}

/* mu + lambda (s^3 - a) s */
static double uniform_stress(double s, void *data)
{
  const double *c = data;
  return c[0] + c[1] * (s * s * s - c[2]) * s;
}

static double gsl_root(double mu, double lambda, double a, double low, double high)
{
  double constants[3] = {mu, lambda, a};
  gsl_function f = {uniform_stress, constants};
  gsl_root_fsolver *solver = gsl_root_fsolver_alloc(gsl_root_fsolver_brent);
  gsl_root_fsolver_set(solver, &f, low, high);
  for (int k = 0; k < 200; k++) {
    gsl_root_fsolver_iterate(solver);
    if (gsl_root_fsolver_x_upper(solver) - gsl_root_fsolver_x_lower(solver) < 1e-15) break;
  }
  double s = gsl_root_fsolver_root(solver);
  gsl_root_fsolver_free(solver);
  return s;
}

static int rest_of(flesh_energy energy, double mu, double lambda, double *ratio)
{
  flesh_material m;
  CHECK_OK(flesh_material_from_lame(energy, FLESH_CONSTANTS_RAW, mu, lambda, &m));
  return flesh_material_rest_ratio(&m, ratio);
}

static void rest_volume_of_d(void)
{
  /* s^4 - s is least at s^3 = 1/4, where it is -3/4 4^(-1/3): no root for lambda/mu < 4^(4/3)/3. */
  const double limit = pow(4, 4. / 3) / 3, least = pow(0.25, 1. / 3);
  CHECK_NEAR(limit, 2.1165, 5e-5);
  const double above[] = {2.12, 2.2, 2.5, 3, 9, 100, 5e3, 1e7};
  for (int n = 0; n < 8; n++) {
    double ratio = 7, s = gsl_root(34000, 34000 * above[n], 1, least, 1);
    CHECK_OK(rest_of(FLESH_ENERGY_D, 34000, 34000 * above[n], &ratio));
    CHECK_NEAR(ratio, s * s * s, 1e-13);
    CHECK(ratio >= 0.25 && ratio < 1);
  }
  const double below[] = {0, 0.5, 2, 2.11, limit * (1 - 1e-9)};
  for (int n = 0; n < 5; n++) {
    double ratio = 7;
    CHECK(rest_of(FLESH_ENERGY_D, 1, below[n], &ratio) == FLESH_UNDEFINED && ratio == 7);
    CHECK_TEXT(flesh_error_text(), "no rest volume");
  }
  double ratio; /* the two roots are only 2e-5 apart: still the larger one */
  CHECK_OK(rest_of(FLESH_ENERGY_D, 1, limit * (1 + 1e-9), &ratio));
  CHECK(ratio > 0.25);
  CHECK_NEAR(ratio, 0.25, 1e-4);
  /* It is a minimum of the energy along uniform scaling; the smaller root is a maximum. */
  flesh_material m;
  CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_D, FLESH_CONSTANTS_RAW, 1, 3, &m));
  CHECK_OK(flesh_material_rest_ratio(&m, &ratio));
  double energy[3];
  for (int k = 0; k < 3; k++) {
    double s = cbrt(ratio) + 0.01 * (k - 1), F[9] = {s, 0, 0, 0, s, 0, 0, 0, s};
    CHECK_OK(flesh_material_energy(&m, F, &energy[k]));
  }
  CHECK(energy[1] < energy[0] && energy[1] < energy[2]);
}

static void rest_volume_of_the_others(void)
{
  for (int n = 0; n < MATCHED_COUNT; n++)
    for (int trial = 0; trial < 50; trial++) {
      double ratio = 7, mu = exp(10 * uniform());
      CHECK_OK(rest_of(matched[n], mu, mu * exp(5 * uniform() + 4.5), &ratio));
      CHECK(ratio == 1);
    }
  double ratio = 7;
  CHECK(rest_of(FLESH_ENERGY_M, 1, 5, &ratio) == FLESH_UNDEFINED && ratio == 7);
  CHECK(rest_of(FLESH_ENERGY_C, 1, 5, &ratio) == FLESH_UNDEFINED && ratio == 7);
}

/* D with another rest offset: swells for lambda (a-1) > mu. */
static int offset_psi(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  const double *c = m->user;
  *psi = (flesh_psi){.value = c[0] / 2 * (I_C - 3) + c[1] / 2 * (J - c[2]) * (J - c[2]),
                     .I = c[0] / 2,
                     .J = c[1] * (J - c[2]),
                     .JJ = c[1]};
  return FLESH_OK;
}

/* Only J: psi_J J^(1/3) has its maximum, `depth`, at s = 2: two roots 2 -+ sqrt(depth), the first a minimum for a body
 * that swells. */
static int dip_psi(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  double depth = *(const double *)m->user, s = cbrt(J);
  (void)I_C;
  *psi = (flesh_psi){.J = depth - (s - 2) * (s - 2), .JJ = -2 * (s - 2) / (3 * s * s)};
  return FLESH_OK;
}

static void rest_volume_of_a_users_psi(void)
{
  static const double offsets[] = {1.5, 3, 20, 0.9, 1.05};
  for (int n = 0; n < 5; n++) {
    double constants[3] = {1, 10, offsets[n]}, ratio = 7;
    flesh_material m;
    CHECK_OK(flesh_material_from_psi(offset_psi, constants, &m));
    CHECK_OK(flesh_material_rest_ratio(&m, &ratio));
    double least = cbrt(offsets[n] / 4), s = gsl_root(1, 10, offsets[n], least, 10);
    CHECK_NEAR(ratio, s * s * s, 1e-13 * s * s * s);
  }
  flesh_material m;
  double depth = 1e-8, dip_ratio = 7;
  CHECK_OK(flesh_material_from_psi(dip_psi, &depth, &m));
  CHECK_OK(flesh_material_rest_ratio(&m, &dip_ratio));
  CHECK_NEAR(cbrt(dip_ratio), 2 - 1e-4, 1e-11);
  depth = -1e-8;
  CHECK(flesh_material_rest_ratio(&m, &dip_ratio) == FLESH_UNDEFINED);
  /* E below its limit: without stress at rest, but at a maximum; the minimum is larger. */
  double constants[3] = {1, 0.2, 1 + 1 / 0.2}, ratio = 7, s = gsl_root(1, 0.2, 6, 1.1, 10);
  CHECK_OK(flesh_material_from_psi(offset_psi, constants, &m));
  CHECK_OK(flesh_material_rest_ratio(&m, &ratio));
  CHECK_NEAR(ratio, s * s * s, 1e-13 * s * s * s);
}

/* C with lambda = 0 does not resist changes of volume: it is at rest at any volume. */
static void indifferent_to_volume_rests_as_it_is(void)
{
  static const double mus[] = {1, 0.3, 5000, 34482.758620689652};
  for (int n = 0; n < 4; n++) {
    double ratio = 7;
    flesh_material m;
    CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_C, FLESH_CONSTANTS_RAW, mus[n], 0, &m));
    CHECK_OK(flesh_material_rest_ratio(&m, &ratio));
    CHECK(ratio == 1);
  }
}

#define REFUSED(call, ...)                                                                         \
  do {                                                                                             \
    static const char *const parts[] = {__VA_ARGS__};                                              \
    flesh_material untouched = {.mu = 7}, *material = &untouched;                                  \
    CHECK((call) == FLESH_ERR_ARGUMENT);                                                           \
    for (unsigned part = 0; part < sizeof parts / sizeof *parts; part++)                           \
      CHECK_TEXT(flesh_error_text(), parts[part]);                                                 \
    CHECK(untouched.mu == 7 && !untouched.psi);                                                    \
  } while (0)

static int lame(flesh_energy e, flesh_constants c, double mu, double lambda, flesh_material *m)
{
  return flesh_material_from_lame(e, c, mu, lambda, m);
}
static int young(flesh_energy e, flesh_constants c, double E, double nu, flesh_material *m)
{
  return flesh_material_from_young(e, c, E, nu, m);
}

/* With both of the constants besides mu and lambda, unless they are NaN. */
static int more(flesh_energy e, flesh_constants c, double mu, double lambda, double exponent, double links,
                flesh_material *m)
{
  flesh_material_given given;
  flesh_material_given_default(&given);
  given.mu = mu, given.lambda = lambda, given.exponent = exponent, given.links = links;
  return flesh_material_from_given(e, c, &given, m);
}

static void constants_of_single_forms(void)
{
  const flesh_constants RAW = FLESH_CONSTANTS_RAW, MATCHED = FLESH_CONSTANTS_MATCHED;
  const flesh_energy FUNG = FLESH_ENERGY_FUNG, AB = FLESH_ENERGY_AB, S = FLESH_ENERGY_S;
  REFUSED(more(S, RAW, 3, 8, 0.1, NAN, material), "exponent is given with energy S", "of Fung");
  REFUSED(more(FUNG, RAW, 3, 8, NAN, 9, material), "links is given with energy Fung", "of AB");
  REFUSED(more(FUNG, RAW, 3, 8, 0, NAN, material), "exponent is 0", "finite and >= 1e-06");
  REFUSED(more(FUNG, RAW, 3, 8, INFINITY, NAN, material), "exponent is inf", "finite");
  REFUSED(more(AB, RAW, 3, 8, NAN, 0.9, material), "links is 0.9", ">= 1");
  REFUSED(more(FUNG, RAW, 3, 0.2, 0.125, NAN, material), "raw lambda is 0.2", "lambda > max(0, (1/3 - 2 b) mu)",
          "stable rest");
  REFUSED(more(FUNG, RAW, 3, 0, 2, NAN, material), "raw lambda is 0", "needs lambda > 0");
  REFUSED(more(AB, RAW, 3, 0.5, NAN, 25, material), "raw lambda is 0.5", "lambda > max(0, 2/3 f'(3)");
  REFUSED(more(FUNG, MATCHED, 3, 8, 2, NAN, material), "matched lambda is -1", "needs lambda > 0");
  REFUSED(more(AB, MATCHED, 3, 0, NAN, 1, material), "matched lambda is -", "energy AB needs lambda > ");
  REFUSED(lame(FLESH_ENERGY_CR, RAW, 3, -2, material), "lambda is -2 ", "lambda > -2/3 mu = -2");
  REFUSED(lame(FLESH_ENERGY_STVK, FLESH_CONSTANTS_AS_E, 3, 1, material), "as_e", "D only");
  flesh_material m;
  flesh_material_given given;
  flesh_material_given_default(&given);
  CHECK(flesh_material_from_given(FUNG, RAW, &given, &m) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "none of the pairs");
  given.mu = given.lambda = given.young = given.poisson = 0.3;
  CHECK(flesh_material_from_given(FUNG, RAW, &given, &m) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "more than one of the pairs");
  /* just inside every limit */
  CHECK_OK(more(FUNG, RAW, 3, 0.25 + 1e-9, 0.125, NAN, &m));
  CHECK_OK(more(FUNG, RAW, 3, 1e-9, 2, NAN, &m));
  CHECK_OK(more(FUNG, MATCHED, 3, 8, 1.83, NAN, &m));
  CHECK(m.exponent == 1.83 && m.links == 0);
  CHECK_OK(more(AB, RAW, 3, 8, NAN, 1, &m));
  CHECK(m.links == 1 && m.exponent == 0);
  CHECK_OK(lame(FLESH_ENERGY_FCR, RAW, 3, 0, &m));
}

static void refused_constants(void)
{
  const flesh_constants RAW = FLESH_CONSTANTS_RAW, MATCHED = FLESH_CONSTANTS_MATCHED,
                        AS_E = FLESH_CONSTANTS_AS_E;
  REFUSED(lame(FLESH_ENERGY_E, RAW, 3, 1, material), "lambda is 1 ", "mu 3", "lambda > mu/3 = 1",
          "stable rest state");
  REFUSED(lame(FLESH_ENERGY_S, RAW, 8, 1, material), "lambda is 1 ", "lambda > mu/8 = 1",
          "stable rest state");
  REFUSED(lame(FLESH_ENERGY_B, RAW, 3, 0, material), "lambda is 0", "B needs lambda > 0",
          "stable rest state");
  REFUSED(lame(FLESH_ENERGY_NEO, RAW, 3, -2, material), "lambda is -2 ", "lambda > -2/3 mu = -2");
  REFUSED(lame(FLESH_ENERGY_A, RAW, 3, -0.1, material), "raw lambda is -0.1", "A needs lambda >= 0", "bounded from below");
  REFUSED(lame(FLESH_ENERGY_A, MATCHED, 3, -0.1, material), "matched lambda is -0.1", "A needs lambda >= 0");
  REFUSED(young(FLESH_ENERGY_A, MATCHED, 1e5, -0.1, material), "poisson -0.1", "A needs lambda >= 0");
  REFUSED(lame(FLESH_ENERGY_D, RAW, 3, -1, material), "lambda is -1", "D needs lambda >= 0");
  REFUSED(lame(FLESH_ENERGY_C, RAW, 3, -1, material), "lambda is -1", "C needs lambda >= 0");
  REFUSED(lame(FLESH_ENERGY_M, MATCHED, 3, 1, material), "matched", "energy M", "must be raw");
  REFUSED(lame(FLESH_ENERGY_C, MATCHED, 3, 1, material), "matched", "energy C", "must be raw");
  REFUSED(lame(FLESH_ENERGY_D, MATCHED, 3, 1, material), "matched", "energy D", "raw or as_e");
  REFUSED(lame(FLESH_ENERGY_S, AS_E, 3, 1, material), "as_e", "energy S", "D only");
  REFUSED(lame(FLESH_ENERGY_B, MATCHED, 3, -2, material), "lambda is -2 ", "lambda > -2/3 mu = -2", "(-1, 0.5)");
  REFUSED(lame(FLESH_ENERGY_D, AS_E, 3, -2.1, material), "lambda is -2.1 ", "as_e", "(-1, 0.5)");
  REFUSED(lame(FLESH_ENERGY_S, RAW, 0, 1, material), "mu is 0", "> 0");
  REFUSED(lame(FLESH_ENERGY_S, RAW, -1, 1, material), "mu is -1", "> 0");
  REFUSED(lame(FLESH_ENERGY_S, RAW, NAN, 1, material), "mu is", "finite");
  REFUSED(lame(FLESH_ENERGY_S, RAW, INFINITY, 1, material), "mu is inf", "finite");
  REFUSED(lame(FLESH_ENERGY_S, RAW, 1, NAN, material), "lambda is", "finite");
  REFUSED(lame(FLESH_ENERGY_M, RAW, 1, INFINITY, material), "lambda is inf", "finite");
  REFUSED(lame(FLESH_ENERGY_USER, RAW, 1, 1, material), "no built-in", FLESH_FORM_NAMES);
  REFUSED(lame(FLESH_ENERGY_S, (flesh_constants)9, 1, 1, material), "constants is number 9",
          "raw, matched, as_e");
  REFUSED(young(FLESH_ENERGY_S, MATCHED, 1e5, nextafter(0.5, 1), material), "poisson is 0.5", "(-1, 0.5]");
  REFUSED(young(FLESH_ENERGY_C, RAW, 1e5, 0.5, material), "poisson is 0.5 with energy C", "no volume term");
  REFUSED(young(FLESH_ENERGY_CR, MATCHED, 1e5, 0.5, material), "poisson is 0.5 with energy CR", "no volume term");
  REFUSED(young(FLESH_ENERGY_S, MATCHED, 1e5, 0.5 - 1e-12, material), "poisson is 0.5 - 1e-12", "at most 0.4999999995");
  REFUSED(young(FLESH_ENERGY_M, RAW, 1e5, nextafter(0.5, 0), material), "poisson is 0.5 - 5.55e-17", "or 0.5");
  REFUSED(lame(FLESH_ENERGY_B, RAW, 1, 1.1e9, material), "lambda is 1100000000 with mu 1", "at most 1e+09 mu");
  REFUSED(young(FLESH_ENERGY_S, MATCHED, 1e5, -1, material), "poisson is -1", "(-1, 0.5]");
  REFUSED(young(FLESH_ENERGY_S, RAW, 1e5, -0.5, material), "poisson -0.5", "lambda > mu/8");
  REFUSED(young(FLESH_ENERGY_S, MATCHED, 1e5, NAN, material), "poisson is", "(-1, 0.5]");
  REFUSED(young(FLESH_ENERGY_NEO, RAW, 1e5, -1, material), "poisson is -1", "(-1, 0.5]");
  REFUSED(young(FLESH_ENERGY_S, MATCHED, 0, 0.3, material), "young is 0", "> 0");
  REFUSED(young(FLESH_ENERGY_S, MATCHED, INFINITY, 0.3, material), "young is inf", "finite");
  REFUSED(young(FLESH_ENERGY_E, RAW, 1e5, 0.1, material), "young 100000 and poisson 0.1",
          "raw lambda is", "lambda > mu/3");
  REFUSED(young(FLESH_ENERGY_S, MATCHED, 1.7e308, 0.4999, material), "finite");
  flesh_material m; /* just inside every limit */
  CHECK_OK(lame(FLESH_ENERGY_E, RAW, 3, 1 + 1e-9, &m));
  CHECK_OK(lame(FLESH_ENERGY_S, RAW, 8, 1 + 1e-9, &m));
  CHECK_OK(lame(FLESH_ENERGY_B, RAW, 3, 1e-9, &m));
  CHECK_OK(lame(FLESH_ENERGY_D, RAW, 3, 0, &m));
  CHECK_OK(young(FLESH_ENERGY_S, MATCHED, 1, 0, &m));
  CHECK_OK(young(FLESH_ENERGY_S, MATCHED, 1, 0.5 - 1e-9, &m));
  CHECK_OK(young(FLESH_ENERGY_NEO, RAW, 1, -0.9, &m));
}

/* From either pair the bits are those of the function for that pair; from none, both, or half of one, it is refused. */
static void given_constants_are_one_pair(void)
{
  flesh_material_given given;
  flesh_material expected, made, untouched = {.mu = 7};
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++) {
    const flesh_energy energy = (flesh_energy)e;
    const flesh_constants constants = flesh_form_default_constants(energy);
    flesh_material_given_default(&given);
    CHECK(flesh_material_from_given(energy, constants, &given, &untouched) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "none of the pairs");
    given.mu = 3e4, given.lambda = 2e5;
    CHECK_OK(flesh_material_from_lame(energy, constants, given.mu, given.lambda, &expected));
    CHECK_OK(flesh_material_from_given(energy, constants, &given, &made));
    CHECK(made.mu == expected.mu && made.lambda == expected.lambda && made.alpha == expected.alpha &&
          made.psi == expected.psi && isnan(made.young));
    given.young = 1e5;
    CHECK(flesh_material_from_given(energy, constants, &given, &untouched) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "more than one of the pairs");
    flesh_material_given_default(&given);
    given.young = 1e5, given.poisson = 0.4;
    CHECK_OK(flesh_material_from_young(energy, constants, given.young, given.poisson, &expected));
    CHECK_OK(flesh_material_from_given(energy, constants, &given, &made));
    CHECK(made.mu == expected.mu && made.lambda == expected.lambda && made.young == 1e5 && made.poisson == 0.4);
    given.poisson = NAN;
    CHECK(flesh_material_from_given(energy, constants, &given, &untouched) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "poisson is");
    CHECK(untouched.mu == 7);
  }
}

static void names_go_both_ways(void)
{
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++) {
    flesh_energy back = FLESH_ENERGY_USER;
    CHECK_OK(flesh_energy_from_name(flesh_energy_name((flesh_energy)e), &back));
    CHECK((int)back == e);
  }
  for (int c = 0; c < 3; c++) {
    flesh_constants back = (flesh_constants)9;
    CHECK_OK(flesh_constants_from_name(flesh_constants_name((flesh_constants)c), &back));
    CHECK((int)back == c);
  }
  flesh_energy energy = FLESH_ENERGY_S;
  flesh_constants constants = FLESH_CONSTANTS_AS_E;
  static const char *const wrong[] = {"neo", "", "BA", "user", "S "};
  for (int k = 0; k < 5; k++) {
    CHECK(flesh_energy_from_name(wrong[k], &energy) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), wrong[k]);
    CHECK_TEXT(flesh_error_text(), FLESH_FORM_NAMES);
  }
  CHECK(flesh_energy_from_name(NULL, &energy) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_constants_from_name("as-e", &constants) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "'as-e'; it must be one of raw, matched, as_e");
  CHECK(energy == FLESH_ENERGY_S && constants == FLESH_CONSTANTS_AS_E);
  CHECK(!strcmp(flesh_energy_name((flesh_energy)99), "unknown"));
  CHECK(!strcmp(flesh_constants_name((flesh_constants)99), "unknown"));
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(matched_constants_linearise_to_the_given),
                   TEST(maps_of_the_constants), TEST(stress_at_rest), TEST(rest_volume_of_d),
                   TEST(rest_volume_of_the_others), TEST(rest_volume_of_a_users_psi),
                   TEST(indifferent_to_volume_rests_as_it_is),
                   TEST(refused_constants), TEST(given_constants_are_one_pair),
                   TEST(constants_of_single_forms), TEST(names_go_both_ways));
}
