/* psi.c: the energies of psi_forms.h as functions to call. */
#include "material/psi.h"

#include <assert.h>
#include <math.h>

#include "base/error.h"
#include "material/psi_forms.h"
#include "math/mat3.h"

/* A flesh_psi_function of every form of the invariants. */
#define BUILTIN(NAME, name, ...)                                                                 \
  static int psi_##name(double I_C, double J, const flesh_material *material, flesh_psi *psi)    \
  {                                                                                              \
    if (flesh_psi_needs_volume(FLESH_ENERGY_##NAME) && !(J > 0)) return FLESH_UNDEFINED;         \
    flesh_psi_form(FLESH_ENERGY_##NAME, material, 1, I_C, J, psi);                               \
    return FLESH_OK;                                                                             \
  }
FLESH_NEO_HOOKEAN_FORM_LIST(BUILTIN)

#define STIFFENING(NAME, name, ...)                                                              \
  static int psi_##name(double I_C, double J, const flesh_material *material, flesh_psi *psi)    \
  {                                                                                              \
    flesh_psi_stiffening_form(FLESH_ENERGY_##NAME, material, 1, I_C, J, psi);                    \
    return FLESH_OK;                                                                             \
  }
FLESH_STIFFENING_FORM_LIST(STIFFENING)

/* Fails for forms of the singular values, which have no psi(I_C, J); the caller adds a sentence. */
static int psi_of_stretches(double I_C, double J, const flesh_material *material, flesh_psi *psi)
{
  (void)I_C, (void)J, (void)material, (void)psi;
  return FLESH_UNDEFINED;
}

#define ENTRY(NAME, name, ...) [FLESH_ENERGY_##NAME] = psi_##name,
#define STRETCH_ENTRY(NAME, ...) [FLESH_ENERGY_##NAME] = psi_of_stretches,
const flesh_psi_function flesh_psi_builtins[] = {FLESH_INVARIANT_FORM_LIST(ENTRY)
                                                 FLESH_STRETCH_FORM_LIST(STRETCH_ENTRY)};

const flesh_psi_function flesh_psi_batches[FLESH_ENERGY_COUNT] = {FLESH_NEO_HOOKEAN_FORM_LIST(ENTRY)};
static_assert(sizeof flesh_psi_builtins / sizeof *flesh_psi_builtins == FLESH_ENERGY_COUNT, "a psi of every form");

int flesh_psi_at(const flesh_material *material, const double F[9], flesh_psi *psi)
{
  double I_C = flesh_mat3_norm2(F), det = flesh_mat3_determinant(F);
  if (!isfinite(I_C) || !isfinite(det)) return FLESH_NONFINITE;
  if (!material->psi) return flesh_fail(FLESH_ERR_ARGUMENT, "the material has no psi; a flesh_material_from_ function makes one");
  flesh_psi at;
  int status = material->psi(I_C, det, material, &at);
  if (status) return status;
  /* 0 times a finite number is 0; otherwise it is NaN. */
  double check = 0 * at.value + 0 * at.I + 0 * at.J + 0 * at.II + 0 * at.IJ + 0 * at.JJ;
  if (check != 0) return FLESH_NONFINITE;
  *psi = at;
  return FLESH_OK;
}
