/* psi.c: the eight energies of psi_forms.h as functions to call. */
#include "material/psi.h"

#include <math.h>
#include <stddef.h>

#include "material/psi_forms.h"
#include "math/mat3.h"

/* A flesh_psi_function of every built-in form. */
#define BUILTIN(name, energy)                                                                    \
  static int name(double I_C, double J, const flesh_material *material, flesh_psi *psi)          \
  {                                                                                              \
    if (flesh_psi_needs_volume(energy) && !(J > 0)) return FLESH_UNDEFINED;                      \
    flesh_psi_form(energy, material, 1, I_C, J, psi);                                            \
    return FLESH_OK;                                                                             \
  }

BUILTIN(psi_neo, FLESH_ENERGY_NEO)
BUILTIN(psi_a, FLESH_ENERGY_A)
BUILTIN(psi_b, FLESH_ENERGY_B)
BUILTIN(psi_c, FLESH_ENERGY_C)
BUILTIN(psi_m, FLESH_ENERGY_M)
BUILTIN(psi_d, FLESH_ENERGY_D)
BUILTIN(psi_e, FLESH_ENERGY_E)
BUILTIN(psi_s, FLESH_ENERGY_S)

const flesh_psi_function flesh_psi_builtins[FLESH_ENERGY_COUNT] = {
    [FLESH_ENERGY_NEO] = psi_neo, [FLESH_ENERGY_A] = psi_a, [FLESH_ENERGY_B] = psi_b, [FLESH_ENERGY_C] = psi_c,
    [FLESH_ENERGY_M] = psi_m,     [FLESH_ENERGY_D] = psi_d, [FLESH_ENERGY_E] = psi_e, [FLESH_ENERGY_S] = psi_s};

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
