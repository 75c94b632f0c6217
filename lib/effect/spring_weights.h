/* spring_weights.h: the nodes' shares of a spring that acts within a radius. */
#ifndef FLESH_EFFECT_SPRING_WEIGHTS_H
#define FLESH_EFFECT_SPRING_WEIGHTS_H

#include "flesh/body.h"

/* Returns a twentieth of the longest side of the axis-aligned box around the body that contains `tet`, m. */
double flesh_spring_radius(const flesh_body *body, int tet);

/* Adds to `weights` [nodes] the integrals of k(X) N_a over the rest shape, divided by that of k = (1 - s^2)^2, where s
 * < 1 is the distance from `centre` over `radius`. None is negative, and they sum to 1. At order 2, where integrals of
 * N_a may be negative, each tet's integral is distributed in proportion to the integrals of k N_a^2 (as HRZ lumps
 * masses). Only the part of the body connected with `tet` within the radius counts. FLESH_ERR_ARGUMENT if it is empty,
 * FLESH_ERR_MEMORY. */
int flesh_spring_weights(const flesh_mesh *mesh, int tet, const double centre[3], double radius, double *weights);

#endif
