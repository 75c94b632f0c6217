/* psi.h: the built-in energies psi(I_C, J), a flesh_psi_function each. */
#ifndef FLESH_MATERIAL_PSI_H
#define FLESH_MATERIAL_PSI_H

#include <stddef.h>

#include "flesh/material.h"
#include "material/form.h"

extern const flesh_psi_function flesh_psi_builtins[FLESH_ENERGY_COUNT];
/* Built-in energies that flesh_psi_form computes; NULL for the other forms. */
extern const flesh_psi_function flesh_psi_batches[FLESH_ENERGY_COUNT];

/* Returns the function of a built-in energy; NULL for FLESH_ENERGY_USER and unknown numbers. */
static inline flesh_psi_function flesh_psi_builtin(flesh_energy energy)
{
  return (unsigned)energy < FLESH_ENERGY_COUNT ? flesh_psi_builtins[energy] : NULL;
}

static inline flesh_psi_function flesh_psi_batched(flesh_energy energy)
{
  return (unsigned)energy < FLESH_ENERGY_COUNT ? flesh_psi_batches[energy] : NULL;
}

/* Computes psi and its derivatives at F. FLESH_NONFINITE for a non-finite F or an overflow, else the status of psi.
 * Writes nothing unless FLESH_OK. */
int flesh_psi_at(const flesh_material *material, const double F[9], flesh_psi *psi);

#endif
