/* psi.c: the eight energies psi(I_C, J) with their first and second derivatives; formulas and
 * sources in flesh/material.h. */
#include "material/psi.h"

#include <math.h>
#include <stddef.h>

#include "math/mat3.h"

/* Where lambda multiplies J - alpha, J - 1 is taken first: it is exact near rest, so that nearly
 * incompressible constants (lambda >> mu) do not magnify the rounding of alpha. */

static int psi_neo(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  if (!(J > 0)) return FLESH_UNDEFINED;
  double log_J = log(J), inverse = 1 / J;
  double pressure = m->lambda * log_J - m->mu; /* J psi_J */
  *psi = (flesh_psi){.value = 0.5 * m->mu * (I_C - 3) + (0.5 * m->lambda * log_J - m->mu) * log_J,
                     .I = 0.5 * m->mu,
                     .J = pressure * inverse,
                     .JJ = (m->lambda - pressure) * inverse * inverse};
  return FLESH_OK;
}

static int psi_a(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  if (!(J > 0)) return FLESH_UNDEFINED;
  double dilation = J - 1, inverse = 1 / J;
  *psi = (flesh_psi){.value = 0.5 * m->mu * (I_C - 3) - m->mu * log(J) +
                              0.5 * m->lambda * dilation * dilation,
                     .I = 0.5 * m->mu,
                     .J = m->lambda * dilation - m->mu * inverse,
                     .JJ = m->lambda + m->mu * inverse * inverse};
  return FLESH_OK;
}

/* mu/2 (J^(-2/3) I_C - 3), shared by B and C. */
static void psi_isochoric(double I_C, double J, double mu, flesh_psi *psi)
{
  double root = cbrt(J), inverse = 1 / J, c = 1 / (root * root); /* c = J^(-2/3) */
  double I_bar = c * I_C;
  *psi = (flesh_psi){.value = 0.5 * mu * (I_bar - 3),
                     .I = 0.5 * mu * c,
                     .J = -mu / 3 * I_bar * inverse,
                     .IJ = -mu / 3 * c * inverse,
                     .JJ = 5 * mu / 9 * I_bar * inverse * inverse};
}

static int psi_b(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  if (!(J > 0)) return FLESH_UNDEFINED;
  double dilation = J - 1;
  psi_isochoric(I_C, J, m->mu, psi);
  psi->value += 0.5 * m->lambda * dilation * dilation;
  psi->J += m->lambda * dilation;
  psi->JJ += m->lambda;
  return FLESH_OK;
}

static int psi_c(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  if (!(J > 0)) return FLESH_UNDEFINED;
  psi_isochoric(I_C, J, m->mu, psi);
  psi->value += 0.5 * m->lambda * (J - 1);
  psi->J += 0.5 * m->lambda;
  return FLESH_OK;
}

static int psi_m(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  (void)J;
  *psi = (flesh_psi){.value = 0.5 * m->mu * (I_C - 3), .I = 0.5 * m->mu};
  return FLESH_OK;
}

static int psi_d(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  double dilation = J - 1;
  *psi = (flesh_psi){.value = 0.5 * m->mu * (I_C - 3) + 0.5 * m->lambda * dilation * dilation,
                     .I = 0.5 * m->mu,
                     .J = m->lambda * dilation,
                     .JJ = m->lambda};
  return FLESH_OK;
}

/* lambda (alpha - 1) = mu */
static int psi_e(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  double dilation = J - 1, offset = dilation - m->mu / m->lambda;
  *psi = (flesh_psi){.value = 0.5 * m->mu * (I_C - 3) + 0.5 * m->lambda * offset * offset,
                     .I = 0.5 * m->mu,
                     .J = m->lambda * dilation - m->mu,
                     .JJ = m->lambda};
  return FLESH_OK;
}

/* lambda (alpha - 1) = 3/4 mu */
static int psi_s(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  double dilation = J - 1, offset = dilation - 0.75 * m->mu / m->lambda, inverse = 1 / (I_C + 1);
  *psi = (flesh_psi){.value = 0.5 * m->mu * (I_C - 3) + 0.5 * m->lambda * offset * offset -
                              0.5 * m->mu * log1p(I_C),
                     .I = 0.5 * m->mu * I_C * inverse,
                     .J = m->lambda * dilation - 0.75 * m->mu,
                     .II = 0.5 * m->mu * inverse * inverse,
                     .JJ = m->lambda};
  return FLESH_OK;
}

flesh_psi_function flesh_psi_builtin(flesh_energy energy)
{
  switch (energy) {
  case FLESH_ENERGY_NEO:
    return psi_neo;
  case FLESH_ENERGY_A:
    return psi_a;
  case FLESH_ENERGY_B:
    return psi_b;
  case FLESH_ENERGY_C:
    return psi_c;
  case FLESH_ENERGY_M:
    return psi_m;
  case FLESH_ENERGY_D:
    return psi_d;
  case FLESH_ENERGY_E:
    return psi_e;
  case FLESH_ENERGY_S:
    return psi_s;
  case FLESH_ENERGY_USER:
    break;
  }
  return NULL;
}

int flesh_psi_at(const flesh_material *material, const double F[9], flesh_psi *psi, double *J)
{
  double I_C = flesh_mat3_norm2(F), det = flesh_mat3_determinant(F);
  if (!isfinite(I_C) || !isfinite(det)) return FLESH_NONFINITE;
  flesh_psi at;
  int status = material->psi(I_C, det, material, &at);
  if (status) return status;
  /* 0 times a finite number is 0, times anything else NaN. */
  double check = 0 * at.value + 0 * at.I + 0 * at.J + 0 * at.II + 0 * at.IJ + 0 * at.JJ;
  if (check != 0) return FLESH_NONFINITE;
  *psi = at;
  if (J) *J = det;
  return FLESH_OK;
}
