/* fibre.h: constants from which fibre_forms.h computes the tension of a muscle fibre. */
#ifndef FLESH_MATERIAL_FIBRE_H
#define FLESH_MATERIAL_FIBRE_H

#include "flesh/fibre.h"

/* Constants of a fibre; l = stretch/optimal_stretch. The passive part is 0 up to l = 1, a cubic up to 1 + toe,
 * exponential up to 1 + limit and linear beyond. toe_* and limit_* are its value, slope and energy where the cubic and
 * the line join, over passive_stress. */
typedef struct flesh_fibre_constants {
  flesh_fibre_curve curve;
  double peak_stress, inverse_optimal;
  double passive_stress, exponent, toe, limit;
  double toe_value, toe_slope, toe_energy;
  double limit_value, limit_slope, limit_energy;
  double max_shortening_velocity; /* 1/s; 0: the tension does not depend on speed */
} flesh_fibre_constants;

/* Computes the constants. FLESH_ERR_ARGUMENT, with the member and what would be valid. */
int flesh_fibre_constants_of(const flesh_fibre *fibre, flesh_fibre_constants *constants);

/* Adds the Kirchhoff stress T f f^T, T = W_L/L, of a fibre with direction a at rest and f = F a, at `activation` from 0
 * to 1: tau [9], row by row, Pa. */
void flesh_fibre_add_stress(const flesh_fibre_constants *constants, double activation, const double f[3],
                            double tau[9]);

#endif
