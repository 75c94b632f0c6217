/* rigid_fit.h: finds the rigid motion that takes the rest shape closest to a deformed shape. */
#ifndef FLESH_MESH_RIGID_FIT_H
#define FLESH_MESH_RIGID_FIT_H

#include <stdint.h>

typedef struct flesh_rigid_fit {
  double R[9];                /* proper rotation */
  double centre[3], moved[3]; /* centres of the chosen nodes at rest and now: x ~ moved + R (X - centre) */
} flesh_rigid_fit;

/* Fits by least squares over the nodes i < count with chosen[i] set, at least one (Kabsch 1976). X, x [3*count]. */
void flesh_rigid_fit_find(int count, const double *X, const double *x, const uint8_t *chosen,
                          flesh_rigid_fit *fit);

/* Computes y = moved + R (X - centre). */
void flesh_rigid_fit_apply(const flesh_rigid_fit *fit, const double X[3], double y[3]);

#endif
