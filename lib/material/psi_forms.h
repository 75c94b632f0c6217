/* psi_forms.h: the energies psi(I_C, J) with first and second derivatives, for one (I_C, J) or several side by side
 * (lanes.h); formulas and sources in flesh/material.h.
 *
 * The value is computed only on request, as its logarithm costs more than all derivatives. */
#ifndef FLESH_MATERIAL_PSI_FORMS_H
#define FLESH_MATERIAL_PSI_FORMS_H

#include "flesh/material.h"
#include "material/form.h"
#include "math/exponential.h"
#include "math/logarithm.h"

#if FLESH_LANES == 1
typedef flesh_psi flesh_psi_real;
#else
typedef struct flesh_psi_real {
  flesh_real value, I, J, II, IJ, JJ;
} flesh_psi_real;
#endif

/* Forms in which lambda multiplies J - alpha compute J - 1 first. That is exact near rest, so that nearly
 * incompressible constants (lambda >> mu) do not magnify the rounding of alpha. */

static inline void flesh_psi_neo(const flesh_material *m, int with_value, flesh_real I_C,
                                 flesh_real J, flesh_psi_real *psi)
{
  flesh_real log_J = flesh_log(J), inverse = 1 / J;
  flesh_real pressure = m->lambda * log_J - m->mu; /* J psi_J */
  if (with_value) psi->value = 0.5 * m->mu * (I_C - 3) + (0.5 * m->lambda * log_J - m->mu) * log_J;
  psi->J = pressure * inverse;
  psi->JJ = (m->lambda - pressure) * inverse * inverse;
}

static inline void flesh_psi_a(const flesh_material *m, int with_value, flesh_real I_C,
                               flesh_real J, flesh_psi_real *psi)
{
  flesh_real dilation = J - 1, inverse = 1 / J;
  if (with_value)
    psi->value =
        0.5 * m->mu * (I_C - 3) - m->mu * flesh_log(J) + 0.5 * m->lambda * dilation * dilation;
  psi->J = m->lambda * dilation - m->mu * inverse;
  psi->JJ = m->lambda + m->mu * inverse * inverse;
}

/* mu/2 (J^(-2/3) I_C - 3), shared by B and C. */
static inline void flesh_psi_isochoric(const flesh_material *m, int with_value, flesh_real I_C,
                                       flesh_real J, flesh_psi_real *psi)
{
  flesh_real root = flesh_inverse_cbrt(J), inverse = 1 / J, c = root * root; /* J^(-2/3) */
  flesh_real I_bar = c * I_C;
  if (with_value) psi->value = 0.5 * m->mu * (I_bar - 3);
  psi->I = 0.5 * m->mu * c;
  psi->J = -m->mu / 3 * I_bar * inverse;
  psi->IJ = -m->mu / 3 * c * inverse;
  psi->JJ = 5 * m->mu / 9 * I_bar * inverse * inverse;
}

static inline void flesh_psi_b(const flesh_material *m, int with_value, flesh_real I_C,
                               flesh_real J, flesh_psi_real *psi)
{
  flesh_real dilation = J - 1;
  flesh_psi_isochoric(m, with_value, I_C, J, psi);
  if (with_value) psi->value += 0.5 * m->lambda * dilation * dilation;
  psi->J += m->lambda * dilation;
  psi->JJ += m->lambda;
}

static inline void flesh_psi_c(const flesh_material *m, int with_value, flesh_real I_C,
                               flesh_real J, flesh_psi_real *psi)
{
  flesh_psi_isochoric(m, with_value, I_C, J, psi);
  if (with_value) psi->value += 0.5 * m->lambda * (J - 1);
  psi->J += 0.5 * m->lambda;
}

static inline void flesh_psi_m(const flesh_material *m, int with_value, flesh_real I_C,
                               flesh_real J, flesh_psi_real *psi)
{
  (void)J;
  if (with_value) psi->value = 0.5 * m->mu * (I_C - 3);
}

static inline void flesh_psi_d(const flesh_material *m, int with_value, flesh_real I_C,
                               flesh_real J, flesh_psi_real *psi)
{
  flesh_real dilation = J - 1;
  if (with_value) psi->value = 0.5 * m->mu * (I_C - 3) + 0.5 * m->lambda * dilation * dilation;
  psi->J = m->lambda * dilation;
  psi->JJ = flesh_all(m->lambda);
}

/* Form E: lambda (alpha - 1) = mu. */
static inline void flesh_psi_e(const flesh_material *m, int with_value, flesh_real I_C,
                               flesh_real J, flesh_psi_real *psi)
{
  flesh_real dilation = J - 1, offset = dilation - m->mu / m->lambda;
  if (with_value) psi->value = 0.5 * m->mu * (I_C - 3) + 0.5 * m->lambda * offset * offset;
  psi->J = m->lambda * dilation - m->mu;
  psi->JJ = flesh_all(m->lambda);
}

/* Form S: lambda (alpha - 1) = 3/4 mu. */
static inline void flesh_psi_s(const flesh_material *m, int with_value, flesh_real I_C,
                               flesh_real J, flesh_psi_real *psi)
{
  flesh_real dilation = J - 1, inverse = 1 / (I_C + 1);
  if (with_value) {
    flesh_real offset = dilation - 0.75 * m->mu / m->lambda;
    psi->value = 0.5 * m->mu * (I_C - 3) + 0.5 * m->lambda * offset * offset -
                 0.5 * m->mu * flesh_log1p(I_C);
  }
  psi->I = 0.5 * m->mu * I_C * inverse;
  psi->J = m->lambda * dilation - 0.75 * m->mu;
  psi->II = 0.5 * m->mu * inverse * inverse;
  psi->JJ = flesh_all(m->lambda);
}

/* Computes the neo-Hookean form `energy`; nothing for other forms. */
static inline void flesh_psi_form(flesh_energy energy, const flesh_material *m, int with_value,
                                  flesh_real I_C, flesh_real J, flesh_psi_real *psi)
{
  flesh_real zero = flesh_all(0);
  *psi = (flesh_psi_real){zero, flesh_all(0.5 * m->mu), zero, zero, zero, zero};
  switch (energy) {
#define FLESH_FORM_CASE(NAME, name, ...)                                                           \
  case FLESH_ENERGY_##NAME:                                                                        \
    flesh_psi_##name(m, with_value, I_C, J, psi);                                                  \
    break;
    FLESH_NEO_HOOKEAN_FORM_LIST(FLESH_FORM_CASE)
#undef FLESH_FORM_CASE
  default:
    break;
  }
}

/* Adds lambda/2 (J-alpha)^2 with lambda (alpha - 1) = pressure to the length terms of Fung and of Arruda & Boyce. */
static inline void flesh_psi_volume(const flesh_material *m, int with_value, double pressure, flesh_real J,
                                    flesh_psi_real *psi)
{
  flesh_real dilation = J - 1, offset = dilation - pressure / m->lambda;
  if (with_value) psi->value += 0.5 * m->lambda * offset * offset;
  psi->J = m->lambda * dilation - pressure;
  psi->JJ = flesh_all(m->lambda);
}

/* Length term of Fung. Side by side, b (I_C - 3) must be at most FLESH_EXPONENTIAL_LARGEST. */
static inline void flesh_psi_fung(const flesh_material *m, int with_value, flesh_real I_C, flesh_real J,
                                  flesh_psi_real *psi)
{
  const double b = m->exponent;
  flesh_real growth = flesh_exp(b * (I_C - 3));
  if (with_value) psi->value = 0.5 * m->mu / b * (growth - 1);
  psi->I = 0.5 * m->mu * growth;
  psi->II = 0.5 * m->mu * b * growth;
  flesh_psi_volume(m, with_value, m->mu, J, psi);
}

/* The length term mu f(I_C) of Arruda & Boyce: 2 f'(3) and f''(3). */
#define FLESH_AB(k) ((const double[]){1. / 2, 1. / 20, 11. / 1050, 19. / 7000, 519. / 673750}[(k) - 1])

static inline double flesh_ab_slope(double links)
{
  const double b = 1 / links;
  return 2 * (FLESH_AB(1) + b * (6 * FLESH_AB(2) + b * (27 * FLESH_AB(3) + b * (108 * FLESH_AB(4) +
                                                                               b * 405 * FLESH_AB(5)))));
}

static inline double flesh_ab_curvature(double links)
{
  const double b = 1 / links;
  return b * (2 * FLESH_AB(2) + b * (18 * FLESH_AB(3) + b * (108 * FLESH_AB(4) + b * 540 * FLESH_AB(5))));
}

static inline void flesh_psi_ab(const flesh_material *m, int with_value, flesh_real I_C, flesh_real J,
                                flesh_psi_real *psi)
{
  const double b = 1 / m->links;
  flesh_real x = b * I_C, value = flesh_all(0), slope = flesh_all(0), curvature = flesh_all(0);
  /* Horner's scheme for f = sum of c_k b^(k-1) I_C^k, f' and b f''. */
  for (int k = 5; k >= 1; k--) {
    value = value * x + FLESH_AB(k);
    slope = slope * x + k * FLESH_AB(k);
    if (k > 1) curvature = curvature * x + k * (k - 1) * FLESH_AB(k);
  }
  if (with_value) {
    double rest = 0;
    for (int k = 5; k >= 1; k--) rest = rest * 3 * b + FLESH_AB(k);
    psi->value = m->mu * (value * I_C - 3 * rest);
  }
  psi->I = m->mu * slope;
  psi->II = m->mu * b * curvature;
  flesh_psi_volume(m, with_value, m->mu * flesh_ab_slope(m->links), J, psi);
}

/* Returns the I_C above which the stiffening forms, computed side by side, leave their domain. */
static inline double flesh_psi_largest(const flesh_material *m)
{
  return m->energy == FLESH_ENERGY_FUNG ? FLESH_EXPONENTIAL_LARGEST / m->exponent : INFINITY;
}

/* Computes the stiffening form `energy`; nothing for other forms. */
static inline void flesh_psi_stiffening_form(flesh_energy energy, const flesh_material *m, int with_value,
                                             flesh_real I_C, flesh_real J, flesh_psi_real *psi)
{
  flesh_real zero = flesh_all(0);
  *psi = (flesh_psi_real){zero, zero, zero, zero, zero, zero};
#define FLESH_FORM_CASE(NAME, name, ...) \
  if (energy == FLESH_ENERGY_##NAME) flesh_psi_##name(m, with_value, I_C, J, psi);
  FLESH_STIFFENING_FORM_LIST(FLESH_FORM_CASE)
#undef FLESH_FORM_CASE
}

#endif
