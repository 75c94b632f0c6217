/* stretch.h: the Hessian of any form in the frame of F's singular vectors, and for forms of the singular values
 * (stretch_forms.h) their value and stress. */
#ifndef FLESH_MATERIAL_STRETCH_H
#define FLESH_MATERIAL_STRETCH_H

#include "material/stretch_forms.h"

/* A form of the singular values at F, with F's singular vectors, which may both be NULL. FLESH_NONFINITE where F is not
 * finite or anything overflows; then nothing is written. */
int flesh_stretch_at(const flesh_material *material, const double F[9], flesh_stretch_real *psi, double U[9],
                     double V[9]);

/* The Hessian of any form at F = U diag(sigma) V^T. Status as flesh_psi_at's; then nothing is written. */
int flesh_spectrum_at(const flesh_material *material, const double F[9], flesh_spectrum *spectrum, double U[9],
                      double V[9]);

/* d vec(P)/d vec(F) [81] of any form from its eigenpairs. Status as flesh_psi_at's; then nothing is written. */
int flesh_stretch_hessian(const flesh_material *material, const double F[9], double H[81]);

#endif
