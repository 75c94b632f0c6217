/* stress.c: energy, first Piola-Kirchhoff stress and Hessian from psi's derivatives. */
#include <string.h>

#include "base/error.h"
#include "material/psi.h"
#include "material/stretch.h"
#include "math/mat3.h"

int flesh_material_energy(const flesh_material *material, const double F[9], double *psi)
{
  FLESH_NEED({material, "material"}, {F, "F"}, {psi, "psi"});
  flesh_psi at;
  flesh_stretch_real stretch;
  const int of_stretches = flesh_form_of_stretches(material->energy);
  int status = of_stretches ? flesh_stretch_at(material, F, &stretch, NULL, NULL) : flesh_psi_at(material, F, &at);
  if (status == FLESH_OK) *psi = of_stretches ? stretch.value : at.value;
  return status;
}

/* Computes the stress U diag(p) V^T. */
static int stress_of_stretches(const flesh_material *material, const double F[9], double P[9])
{
  flesh_stretch_real at;
  double U[9], V[9];
  int status = flesh_stretch_at(material, F, &at, U, V);
  if (status) return status;
  for (int k = 0; k < 9; k++) U[k] *= at.p[k % 3];
  flesh_mat3_multiply_transposed(U, V, P);
  return FLESH_OK;
}

int flesh_material_stress(const flesh_material *material, const double F[9], double P[9])
{
  FLESH_NEED({material, "material"}, {F, "F"}, {P, "P"});
  if (flesh_form_of_stretches(material->energy)) return stress_of_stretches(material, F, P);
  flesh_psi at;
  int status = flesh_psi_at(material, F, &at);
  if (status) return status;
  double C[9], result[9];
  flesh_mat3_cofactor(F, C);
  for (int k = 0; k < 9; k++) result[k] = 2 * at.I * F[k] + at.J * C[k];
  if (!flesh_mat3_finite(result)) return FLESH_NONFINITE;
  memcpy(P, result, sizeof result);
  return FLESH_OK;
}

/* H = 2 psi_I 1 + psi_J d cof F/dF + 4 psi_II f f^T + 2 psi_IJ (f g^T + g f^T) + psi_JJ g g^T,
 * f = vec F, g = vec cof F. */
int flesh_material_hessian(const flesh_material *material, const double F[9], double H[81])
{
  FLESH_NEED({material, "material"}, {F, "F"}, {H, "H"});
  if (flesh_form_of_stretches(material->energy)) return flesh_stretch_hessian(material, F, H);
  flesh_psi at;
  int status = flesh_psi_at(material, F, &at);
  if (status) return status;
  double g[9], result[81], check = 0;
  flesh_mat3_cofactor(F, g);
  for (int p = 0; p < 9; p++) {
    /* Column p of H: a combination of f and g, plus the terms of the unit direction p. */
    double along_f = 4 * at.II * F[p] + 2 * at.IJ * g[p];
    double along_g = 2 * at.IJ * F[p] + at.JJ * g[p];
    for (int q = 0; q <= p; q++) result[9 * p + q] = along_f * F[q] + along_g * g[q];
    result[10 * p] += 2 * at.I;
  }
  /* d cof_ij/dF_kl = +-F_mn with m, n the remaining row and column. */
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      int k = (i + 1) % 3, m = (i + 2) % 3, l = (j + 1) % 3, n = (j + 2) % 3;
      int p = 3 * i + j, same = 3 * k + l, cross = 3 * k + n;
      double plus = at.J * F[3 * m + n], minus = -at.J * F[3 * m + l];
      result[p > same ? 9 * p + same : 9 * same + p] += plus;
      result[p > cross ? 9 * p + cross : 9 * cross + p] += minus;
    }
  for (int p = 0; p < 9; p++)
    for (int q = 0; q <= p; q++) {
      check += 0 * result[9 * p + q];
      result[9 * q + p] = result[9 * p + q];
    }
  if (check != 0) return FLESH_NONFINITE;
  memcpy(H, result, sizeof result);
  return FLESH_OK;
}
