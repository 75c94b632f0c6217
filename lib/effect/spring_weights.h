/* spring_weights.h: how much of a spring that acts within a radius each node has. */
#ifndef FLESH_EFFECT_SPRING_WEIGHTS_H
#define FLESH_EFFECT_SPRING_WEIGHTS_H

#include "flesh/body.h"

/* A twentieth of the longest side of the box, parallel to the axes, round the body that `tet` is of, m. */
double flesh_spring_radius(const flesh_body *body, int tet);

/* Adds to `weights` [nodes] the integrals of k(X) N_a over the rest shape, divided by that of k = (1 - s^2)^2, s < 1 the
 * distance from `centre` over `radius`: none is negative, they sum to 1. At order 2, where integrals of N_a may be
 * negative, each tet's is shared as those of k N_a^2 are (as HRZ lumps masses). Only what is connected with `tet` within
 * the radius counts. FLESH_ERR_ARGUMENT where nothing is, FLESH_ERR_MEMORY. */
int flesh_spring_weights(const flesh_mesh *mesh, int tet, const double centre[3], double radius, double *weights);

#endif
