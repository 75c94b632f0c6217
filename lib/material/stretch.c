/* stretch.c: forms of the singular values at one F, and the spectrum of any form. */
#include "material/stretch.h"

#include <string.h>

#include "material/psi.h"
#include "math/svd3.h"

int flesh_stretch_at(const flesh_material *material, const double F[9], flesh_stretch_real *psi, double U[9],
                     double V[9])
{
  double left[9], right[9], sigma[3];
  flesh_stretch_real at;
  if (!flesh_mat3_finite(F)) return FLESH_NONFINITE;
  flesh_svd3(F, left, sigma, right);
  if (!flesh_stretch_form(material->energy, material, sigma, &at)) return FLESH_NONFINITE;
  *psi = at;
  if (U) memcpy(U, left, sizeof left);
  if (V) memcpy(V, right, sizeof right);
  return FLESH_OK;
}

int flesh_spectrum_at(const flesh_material *material, const double F[9], flesh_spectrum *spectrum, double U[9],
                      double V[9])
{
  double sigma[3];
  flesh_psi psi;
  flesh_spectrum at;
  if (flesh_form_of_stretches(material->energy)) {
    flesh_stretch_real stretch;
    int status = flesh_stretch_at(material, F, &stretch, U, V);
    if (!status) *spectrum = stretch.spectrum;
    return status;
  }
  int status = flesh_psi_at(material, F, &psi);
  if (status) return status;
  flesh_svd3(F, U, sigma, V);
  if (!flesh_spectrum_make(&psi, sigma, &at)) return FLESH_NONFINITE;
  *spectrum = at;
  return FLESH_OK;
}
