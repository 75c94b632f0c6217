/* psi_forms.h: the energies psi(I_C, J) with their first and second derivatives, for one
 * (I_C, J) or several side by side (lanes.h); formulas and sources in flesh/material.h.
 *
 * The value, whose logarithm costs more than all the derivatives, is filled only where asked. */
#ifndef FLESH_MATERIAL_PSI_FORMS_H
#define FLESH_MATERIAL_PSI_FORMS_H

#include "flesh/material.h"
#include "material/form.h"
#include "math/logarithm.h"

#if FLESH_LANES == 1
typedef flesh_psi flesh_psi_real;
#else
typedef struct flesh_psi_real {
  flesh_real value, I, J, II, IJ, JJ;
} flesh_psi_real;
#endif

/* Where lambda multiplies J - alpha, J - 1 is taken first: it is exact near rest, so that nearly
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

/* lambda (alpha - 1) = mu */
static inline void flesh_psi_e(const flesh_material *m, int with_value, flesh_real I_C,
                               flesh_real J, flesh_psi_real *psi)
{
  flesh_real dilation = J - 1, offset = dilation - m->mu / m->lambda;
  if (with_value) psi->value = 0.5 * m->mu * (I_C - 3) + 0.5 * m->lambda * offset * offset;
  psi->J = m->lambda * dilation - m->mu;
  psi->JJ = flesh_all(m->lambda);
}

/* lambda (alpha - 1) = 3/4 mu */
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

/* The form `energy` where it is defined; nothing for FLESH_ENERGY_USER. */
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
    FLESH_FORM_LIST(FLESH_FORM_CASE)
#undef FLESH_FORM_CASE
  case FLESH_ENERGY_USER:
    break;
  }
}

#endif
