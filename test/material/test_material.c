// TEST quick seconds=60
/* test_material.c: psi, P and H of the forms of I_C and J and of user-defined forms, against long double formulas,
 * finite differences, objectivity and isotropy; and statuses where there is no value. */
#include "test_matrix.h"

#include <float.h>

#include "flesh/material.h"
#include "material/form.h"

static const flesh_energy all[] = {FLESH_ENERGY_NEO, FLESH_ENERGY_A, FLESH_ENERGY_B,
                                   FLESH_ENERGY_C,   FLESH_ENERGY_M, FLESH_ENERGY_D,
                                   FLESH_ENERGY_E,   FLESH_ENERGY_S, FLESH_ENERGY_FUNG,
                                   FLESH_ENERGY_AB};
enum { ENERGIES = sizeof all / sizeof *all };

static int needs_positive_J(flesh_energy e) { return e <= FLESH_ENERGY_C; }

static flesh_material raw(flesh_energy energy, double mu, double lambda)
{
  flesh_material m;
  CHECK_OK(flesh_material_from_lame(energy, FLESH_CONSTANTS_RAW, mu, lambda, &m));
  return m;
}

/* The formulas as published, in extended precision. */
static long double formula(flesh_energy e, long double I, long double J, long double mu,
                           long double la)
{
  static const long double chain[5] = {1.0L / 2, 1.0L / 20, 11.0L / 1050, 19.0L / 7000, 519.0L / 673750};
  const long double b = e == FLESH_ENERGY_AB ? 1.0L / 25 : 0.25L; /* as usual */
  long double alpha, sum = 0, slope = 0;
  switch (e) {
  case FLESH_ENERGY_NEO:
    return mu / 2 * (I - 3) - mu * logl(J) + la / 2 * logl(J) * logl(J);
  case FLESH_ENERGY_A:
    return mu / 2 * (I - 3) - mu * logl(J) + la / 2 * (J - 1) * (J - 1);
  case FLESH_ENERGY_B:
    return mu / 2 * (powl(J, -2.0L / 3) * I - 3) + la / 2 * (J - 1) * (J - 1);
  case FLESH_ENERGY_C:
    return mu / 2 * (powl(J, -2.0L / 3) * I - 3) + la / 2 * (J - 1);
  case FLESH_ENERGY_M:
    return mu / 2 * (I - 3);
  case FLESH_ENERGY_D:
    return mu / 2 * (I - 3) + la / 2 * (J - 1) * (J - 1);
  case FLESH_ENERGY_E:
    alpha = 1 + mu / la;
    return mu / 2 * (I - 3) + la / 2 * (J - alpha) * (J - alpha);
  case FLESH_ENERGY_S:
    alpha = 1 + mu / la - mu / (4 * la);
    return mu / 2 * (I - 3) + la / 2 * (J - alpha) * (J - alpha) - mu / 2 * logl(I + 1);
  case FLESH_ENERGY_FUNG:
    alpha = 1 + mu / la;
    return mu / (2 * b) * expm1l(b * (I - 3)) + la / 2 * (J - alpha) * (J - alpha);
  case FLESH_ENERGY_AB:
    for (int k = 1; k <= 5; k++) {
      sum += chain[k - 1] * powl(b, k - 1) * (powl(I, k) - powl(3, k));
      slope += k * chain[k - 1] * powl(b, k - 1) * powl(3, k - 1);
    }
    alpha = 1 + 2 * slope * mu / la;
    return mu * sum + la / 2 * (J - alpha) * (J - alpha);
  default:
    return NAN;
  }
}

/* Weights of the sixth-order central difference, over 60 h. */
static const double weight[4] = {0, 45, -9, 1};

/* Differentiates a formula by I_C or J by differences with a step of 1/1000. */
static long double formula_slope(flesh_energy e, double I, double J, double mu, double la, int by_J)
{
  long double h = 1e-3L * (by_J ? (J == 0 ? 1 : fabs(J)) : I), sum = 0;
  for (int k = 1; k <= 3; k++) {
    long double dI = by_J ? 0 : k * h, dJ = by_J ? k * h : 0;
    sum += weight[k] * (formula(e, I + dI, J + dJ, mu, la) - formula(e, I - dI, J - dJ, mu, la));
  }
  return sum / (60 * h);
}

static void psi_against_the_formulas(void)
{
  double worst_value = 0, worst_slope = 0;
  for (int n = 0; n < ENERGIES; n++)
    for (int trial = 0; trial < 400; trial++) {
      double mu = exp(uniform()), la = mu * exp(3 + 3 * uniform());
      flesh_material m = raw(all[n], mu, la);
      double I = 3 * exp(2 * uniform()), J = exp(1.5 * uniform());
      if (!needs_positive_J(all[n])) J = trial % 7 ? 3 * uniform() : 0;
      if (trial % 3 == 0) I = 3 + 1e-6 * uniform(), J = 1 + 1e-8 * uniform();
      flesh_psi psi, plus, minus;
      CHECK_OK(m.psi(I, J, &m, &psi));
      double scale = mu * I + la * (J - 1) * (J - 1) + (mu + la) * 1e-3 + la * fabs(J - 1);
      double off = (double)(psi.value - formula(all[n], I, J, mu, la));
      worst_value = fmax(worst_value, fabs(off) / scale);
      double size = fabs(psi.I) + fabs(psi.J) + mu + la * fabs(J - 1);
      off = (double)(psi.I - formula_slope(all[n], I, J, mu, la, 0));
      worst_slope = fmax(worst_slope, fabs(off) / size);
      off = (double)(psi.J - formula_slope(all[n], I, J, mu, la, 1));
      worst_slope = fmax(worst_slope, fabs(off) / size);
      /* second derivatives from the first */
      double h = 1e-3 * I, d[3], s[3] = {0, 0, 0};
      for (int k = 1; k <= 3; k++) {
        CHECK_OK(m.psi(I + k * h, J, &m, &plus));
        CHECK_OK(m.psi(I - k * h, J, &m, &minus));
        s[0] += weight[k] * (plus.I - minus.I) / (60 * h);
        s[1] += weight[k] * (plus.J - minus.J) / (60 * h);
      }
      h = 1e-3 * (J == 0 ? 1 : fabs(J));
      for (int k = 1; k <= 3; k++) {
        CHECK_OK(m.psi(I, J + k * h, &m, &plus));
        CHECK_OK(m.psi(I, J - k * h, &m, &minus));
        s[2] += weight[k] * (plus.J - minus.J) / (60 * h);
      }
      d[0] = psi.II, d[1] = psi.IJ, d[2] = psi.JJ;
      double unit[3] = {size / I, size / I, (size + fabs(psi.JJ)) / fmin(1, fabs(J) + (J == 0))};
      for (int k = 0; k < 3; k++) worst_slope = fmax(worst_slope, fabs(d[k] - s[k]) / unit[k]);
    }
  CHECK_BELOW(worst_value, 1e-15);
  CHECK_BELOW(worst_slope, 1e-11);
}

/* Makes one F of each kind; returns 0 if the kind is not for this energy. */
static int draw(int kind, flesh_energy energy, double F[9])
{
  double s[3] = {1 + 0.6 * uniform(), 1 + 0.6 * uniform(), 1 + 0.6 * uniform()};
  double scale = 1;
  switch (kind) {
  case 0:
    break; /* ordinary */
  case 1:
    s[2] = -s[2];
    break; /* reflected */
  case 2:
    s[2] = 0;
    break; /* rank 2 */
  case 3:
    s[1] = s[2] = 0;
    break; /* rank 1 */
  case 4:
    s[0] = s[1] = s[2] = 0;
    break; /* a point */
  case 5:
    scale = 1e6;
    break; /* huge */
  case 6:
    s[0] = s[1] = s[2] = 1;
    break; /* a rotation */
  case 7:
    s[1] = s[0];
    break; /* repeated */
  case 8:
    s[2] = 1e-3;
    break; /* nearly flat */
  case 9:
    scale = 1e-3;
    break; /* nearly a point */
  case 10:
    s[0] = 30, s[1] = 0.1;
    break; /* drawn out */
  case 11:
    s[0] = -1, s[1] = -1, s[2] = -1;
    break;
  default:
    return 0;
  }
  if (energy == FLESH_ENERGY_FUNG && (kind == 5 || kind == 10)) return 0; /* e to the power of thousands */
  if (needs_positive_J(energy) && ((kind >= 1 && kind <= 4) || kind == 11)) return 0;
  compose(s, F);
  for (int k = 0; k < 9; k++) F[k] *= scale;
  return 1;
}
enum { KINDS = 12 };

static double largest(const double *x, int n)
{
  double size = 0;
  for (int k = 0; k < n; k++) size = fmax(size, fabs(x[k]));
  return size;
}

/* Checks psi -> P -> H by differences: returns the worst error relative to the present magnitudes. */
static double difference_error(const flesh_material *m, const double F[9])
{
  double P[9], H[81], worst = 0, C[9];
  if (flesh_material_stress(m, F, P) || flesh_material_hessian(m, F, H)) return INFINITY;
  /* A step well below the smallest singular value, if J must stay positive. */
  double J = flesh_mat3_determinant(F), length = fmax(largest(F, 9), 1e-3);
  flesh_mat3_cofactor(F, C);
  double reach = length;
  if (flesh_psi_needs_volume(m->energy) || m->energy == FLESH_ENERGY_USER)
    reach = J > 0 ? fmin(length, J / largest(C, 9)) : length;
  flesh_psi at;
  if (m->psi(flesh_mat3_norm2(F), J, m, &at)) return INFINITY;
  /* The magnitude of P's terms: at rest they cancel, but their rounding does not. */
  double terms = 2 * fabs(at.I) * length + fabs(at.J) * largest(C, 9) + 1;
  double h = 2e-3 * reach, energy_size = 0;
  for (int p = 0; p < 9; p++) {
    double G[9], plus, minus, P_plus[9], P_minus[9], slope = 0, column[9] = {0};
    memcpy(G, F, sizeof G);
    for (int k = 1; k <= 3; k++) {
      G[p] = F[p] + k * h;
      if (flesh_material_energy(m, G, &plus) || flesh_material_stress(m, G, P_plus))
        return INFINITY;
      G[p] = F[p] - k * h;
      if (flesh_material_energy(m, G, &minus) || flesh_material_stress(m, G, P_minus))
        return INFINITY;
      slope += weight[k] * (plus - minus) / (60 * h);
      for (int q = 0; q < 9; q++) column[q] += weight[k] * (P_plus[q] - P_minus[q]) / (60 * h);
      energy_size = fmax(energy_size, fmax(fabs(plus), fabs(minus)));
    }
    worst = fmax(worst, fabs(slope - P[p]) / (terms + energy_size / reach));
    for (int q = 0; q < 9; q++)
      worst = fmax(worst, fabs(column[q] - H[9 * q + p]) / (largest(H, 81) + terms / reach));
  }
  for (int p = 0; p < 9; p++)
    for (int q = 0; q < 9; q++)
      if (H[9 * p + q] != H[9 * q + p]) return INFINITY;
  return worst;
}

static void stress_and_hessian_by_differences(void)
{
  for (int n = 0; n < ENERGIES; n++)
    for (int kind = 0; kind < KINDS; kind++) {
      double worst = 0;
      for (int trial = 0; trial < 20; trial++) {
        double F[9];
        if (!draw(kind, all[n], F)) continue;
        flesh_material m = raw(all[n], 1, exp(2 + 2 * uniform()));
        worst = fmax(worst, difference_error(&m, F));
      }
      if (worst > 5e-11) printf("# energy %s kind %d\n", flesh_energy_name(all[n]), kind);
      CHECK_BELOW(worst, 5e-11);
    }
}

static void objective_and_isotropic(void)
{
  for (int n = 0; n < ENERGIES; n++)
    for (int trial = 0; trial < 200; trial++) {
      flesh_material m = raw(all[n], 1, 5);
      double F[9], R[9], RF[9], FR[9], P[9], RP[9], P_RF[9], P_FR[9], PR[9], psi, a, b;
      if (!draw(trial % KINDS, all[n], F)) continue;
      random_rotation(R);
      flesh_mat3_multiply(R, F, RF);
      flesh_mat3_multiply(F, R, FR);
      if (flesh_material_energy(&m, F, &psi) != FLESH_OK) continue;
      CHECK_OK(flesh_material_energy(&m, RF, &a));
      CHECK_OK(flesh_material_energy(&m, FR, &b));
      CHECK_OK(flesh_material_stress(&m, F, P));
      CHECK_OK(flesh_material_stress(&m, RF, P_RF));
      CHECK_OK(flesh_material_stress(&m, FR, P_FR));
      flesh_mat3_multiply(R, P, RP);
      flesh_mat3_multiply(P, R, PR);
      /* Rounding enters through J: |dpsi/dJ| times the rounding of a determinant. */
      double J = flesh_mat3_determinant(F), size = largest(F, 9), I_C = flesh_mat3_norm2(F);
      flesh_psi at;
      CHECK_OK(m.psi(I_C, J, &m, &at));
      double cube = size * size * size;
      double psi_unit = fabs(psi) + fabs(at.J) * cube + at.I * I_C + 1;
      double P_unit =
          largest(P, 9) + size * size * (fabs(at.J) + at.JJ * cube) + 1 + fabs(at.IJ) * size * cube;
      CHECK_NEAR(a / psi_unit, psi / psi_unit, 1e-14);
      CHECK_NEAR(b / psi_unit, psi / psi_unit, 1e-14);
      for (int k = 0; k < 9; k++) {
        CHECK_NEAR(P_RF[k] / P_unit, RP[k] / P_unit, 1e-14);
        CHECK_NEAR(P_FR[k] / P_unit, PR[k] / P_unit, 1e-14);
      }
    }
}

/* Calls every function at F; all must return `status` and leave their outputs unchanged. */
static void check_refuses(const flesh_material *m, const double F[9], int status)
{
  double psi = 7, P[9], H[81], values[9], vectors[81], K[81], left = 0;
  for (int k = 0; k < 81; k++) H[k] = vectors[k] = K[k] = 7;
  for (int k = 0; k < 9; k++) P[k] = values[k] = 7;
  CHECK(flesh_material_energy(m, F, &psi) == status);
  CHECK(flesh_material_stress(m, F, P) == status);
  CHECK(flesh_material_hessian(m, F, H) == status);
  CHECK(flesh_material_eigen(m, F, values, vectors) == status);
  CHECK(flesh_material_hessian_projected(m, F, K) == status);
  for (int k = 0; k < 81; k++) left += fabs(H[k] - 7) + fabs(vectors[k] - 7) + fabs(K[k] - 7);
  for (int k = 0; k < 9; k++) left += fabs(P[k] - 7) + fabs(values[k] - 7);
  CHECK(left == 0 && psi == 7);
}

static void undefined_without_positive_volume(void)
{
  static const double cases[][9] = {
      {1, 0, 0, 0, 1, 0, 0, 0, 0},    {1, 0, 0, 0, 1, 0, 0, 0, -1},
      {0, 0, 0, 0, 0, 0, 0, 0, 0},    {1, 2, 3, 2, 4, 6, 1, 1, 1},
      {-1, 0, 0, 0, -1, 0, 0, 0, -1}, {1, 0, 0, 0, 1, 0, 0, 0, -1e-300}};
  for (int n = 0; n < ENERGIES; n++) {
    flesh_material m = raw(all[n], 1, 5);
    for (unsigned c = 0; c < sizeof cases / sizeof *cases; c++) {
      double psi, H[81], K[81];
      if (needs_positive_J(all[n])) {
        CHECK(FLESH_UNDEFINED > 0);
        check_refuses(&m, cases[c], FLESH_UNDEFINED);
      } else {
        CHECK_OK(flesh_material_energy(&m, cases[c], &psi));
        CHECK_OK(flesh_material_hessian(&m, cases[c], H));
        CHECK_OK(flesh_material_hessian_projected(&m, cases[c], K));
        CHECK(isfinite(psi) && isfinite(largest(H, 81)) && isfinite(largest(K, 81)));
      }
    }
  }
}

static void nonfinite_is_reported(void)
{
  static const double bad[] = {NAN, INFINITY, -INFINITY, 1e200, 1e308, 1.5e103};
  for (int n = 0; n < ENERGIES; n++) {
    flesh_material m = raw(all[n], 1, 5);
    for (unsigned c = 0; c < sizeof bad / sizeof *bad; c++)
      for (int k = 0; k < 9; k++) {
        double F[9] = {bad[c], 0, 0, 0, bad[c], 0, 0, 0, bad[c]};
        if (c < 3)
          for (int l = 0; l < 9; l++) F[l] = l == k ? bad[c] : l % 4 == 0;
        check_refuses(&m, F, FLESH_NONFINITE);
      }
    /* From tiny to huge: either a recoverable status, or finite numbers. */
    for (int exponent = -320; exponent <= 308; exponent++) {
      double s = pow(10, exponent), F[9] = {s, 0, 0, 0, 2 * s, 0, 0, 0, 3 * s};
      double psi, P[9], H[81], K[81], values[9], vectors[81];
      int status = flesh_material_energy(&m, F, &psi);
      CHECK(status ? status > 0 : isfinite(psi));
      status = flesh_material_stress(&m, F, P);
      for (int k = 0; k < 9; k++) CHECK(status ? status > 0 : isfinite(P[k]));
      status = flesh_material_hessian(&m, F, H);
      for (int k = 0; k < 81; k++) CHECK(status ? status > 0 : isfinite(H[k]));
      status = flesh_material_eigen(&m, F, values, vectors);
      for (int k = 0; k < 9; k++) CHECK(status ? status > 0 : isfinite(values[k]));
      status = flesh_material_hessian_projected(&m, F, K);
      for (int k = 0; k < 81; k++) CHECK(status ? status > 0 : isfinite(K[k]));
    }
  }
}

/* A user-defined copy of S, written differently from the library's. */
static int users_s(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  const double *c = m->user; /* mu, lambda */
  double alpha = 1 + 0.75 * c[0] / c[1];
  psi->value =
      c[0] / 2 * (I_C - 3) + c[1] / 2 * (J - alpha) * (J - alpha) - c[0] / 2 * log(I_C + 1);
  psi->I = c[0] / 2 * (1 - 1 / (I_C + 1));
  psi->J = c[1] * (J - alpha);
  psi->II = c[0] / 2 / ((I_C + 1) * (I_C + 1));
  psi->IJ = 0;
  psi->JJ = c[1];
  return FLESH_OK;
}

/* A user-defined form: mu/2 (I-3) + a (I-3)^2 + b (I-3)(J-1) + lambda/2 (J-alpha)^2. */
static int users_own(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  const double mu = 1, a = 0.3, b = 0.2, la = 4, alpha = 1 + mu / la, i = I_C - 3;
  (void)m;
  *psi = (flesh_psi){.value = mu / 2 * i + a * i * i + b * i * (J - 1) +
                              la / 2 * (J - alpha) * (J - alpha),
                     .I = mu / 2 + 2 * a * i + b * (J - 1),
                     .J = b * i + la * (J - alpha),
                     .II = 2 * a,
                     .IJ = b,
                     .JJ = la};
  return FLESH_OK;
}

static int users_refusal(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  return users_own(I_C, J, m, psi), J < 0.5 ? FLESH_UNDEFINED : FLESH_OK;
}

static int users_nan(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  return users_own(I_C, J, m, psi), psi->IJ = NAN, FLESH_OK;
}

static void a_users_own_psi(void)
{
  double constants[2] = {3.5, 17};
  flesh_material copy, own, s = raw(FLESH_ENERGY_S, constants[0], constants[1]);
  CHECK_OK(flesh_material_from_psi(users_s, constants, &copy));
  CHECK_OK(flesh_material_from_psi(users_own, NULL, &own));
  CHECK(copy.energy == FLESH_ENERGY_USER && !strcmp(flesh_energy_name(copy.energy), "user"));
  for (int trial = 0; trial < 240; trial++) {
    double F[9], a, b, P[9], Q[9], H[81], K[81];
    if (trial % KINDS == 5 || !draw(trial % KINDS, FLESH_ENERGY_S, F)) continue;
    CHECK_OK(flesh_material_energy(&s, F, &a));
    CHECK_OK(flesh_material_energy(&copy, F, &b));
    CHECK_NEAR(a, b, 1e-13 * (1 + fabs(a)));
    CHECK_OK(flesh_material_stress(&s, F, P));
    CHECK_OK(flesh_material_stress(&copy, F, Q));
    for (int k = 0; k < 9; k++) CHECK_NEAR(P[k], Q[k], 1e-14 * (20 + 20 * largest(P, 9)));
    CHECK_OK(flesh_material_hessian_projected(&s, F, H));
    CHECK_OK(flesh_material_hessian_projected(&copy, F, K));
    for (int k = 0; k < 81; k++) CHECK_NEAR(H[k], K[k], 2e-13 * (20 + largest(H, 81)));
    CHECK_BELOW(difference_error(&copy, F), 5e-11);
    CHECK_BELOW(difference_error(&own, F), 5e-11);
  }
  flesh_material m;
  static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  static const double small[9] = {0.5, 0, 0, 0, 0.5, 0, 0, 0, 1};
  CHECK_OK(flesh_material_from_psi(users_refusal, NULL, &m));
  check_refuses(&m, small, FLESH_UNDEFINED);
  CHECK_OK(flesh_material_from_psi(users_nan, NULL, &m));
  check_refuses(&m, identity, FLESH_NONFINITE);
  CHECK(flesh_material_from_psi(NULL, NULL, &m) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "psi is NULL");
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(psi_against_the_formulas),
                   TEST(stress_and_hessian_by_differences), TEST(objective_and_isotropic),
                   TEST(undefined_without_positive_volume), TEST(nonfinite_is_reported),
                   TEST(a_users_own_psi));
}
