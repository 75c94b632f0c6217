/* fibre.h: the constants that fibre_forms.h computes the tension of a muscle fibre with. */
#ifndef FLESH_MATERIAL_FIBRE_H
#define FLESH_MATERIAL_FIBRE_H

#include "flesh/fibre.h"

/* l = stretch/optimal_stretch. The passive part is 0 up to l = 1, a cubic up to 1 + toe, exponential up to 1 + limit and
 * linear beyond: what it has where the cubic and the line join, over passive_stress. */
typedef struct flesh_fibre_constants {
  flesh_fibre_curve curve;
  double peak_stress, inverse_optimal;
  double passive_stress, exponent, toe, limit;
  double toe_value, toe_slope, toe_energy;
  double limit_value, limit_slope, limit_energy;
  double max_shortening_velocity; /* 1/s; 0: none */
} flesh_fibre_constants;

/* FLESH_ERR_ARGUMENT, with the member and what would be valid. */
int flesh_fibre_constants_of(const flesh_fibre *fibre, flesh_fibre_constants *constants);

/* Adds the Kirchhoff stress T f f^T, T = W_L/L, of a fibre of direction a at rest, f = F a, active to a part
 * `activation`: tau [9], row by row, Pa. */
void flesh_fibre_add_stress(const flesh_fibre_constants *constants, double activation, const double f[3],
                            double tau[9]);

#endif
