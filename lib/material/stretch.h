/* stretch.h: the Hessian of any form in the frame of F's singular vectors; for forms of the singular values
 * (stretch_forms.h) also value and stress. */
#ifndef FLESH_MATERIAL_STRETCH_H
#define FLESH_MATERIAL_STRETCH_H

#include "material/stretch_forms.h"

/* Computes a form of the singular values at F, and F's singular vectors; both may be NULL. FLESH_NONFINITE if F is not
 * finite or for an overflow; then nothing is written. */
int flesh_stretch_at(const flesh_material *material, const double F[9], flesh_stretch_real *psi, double U[9],
                     double V[9]);

/* Computes the Hessian of any form at F = U diag(sigma) V^T. Status as flesh_psi_at's; nothing is written unless
 * FLESH_OK. */
int flesh_spectrum_at(const flesh_material *material, const double F[9], flesh_spectrum *spectrum, double U[9],
                      double V[9]);

/* Computes d vec(P)/d vec(F) [81] of any form from its eigenpairs. Status as flesh_psi_at's; nothing is written unless
 * FLESH_OK. */
int flesh_stretch_hessian(const flesh_material *material, const double F[9], double H[81]);

#endif
