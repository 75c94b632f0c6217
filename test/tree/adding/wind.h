/* wind.h: the pressure of moving air. */
#ifndef FLESH_EFFECT_WIND_H
#define FLESH_EFFECT_WIND_H

#include "flesh/effects.h"

/* Creates the pressure of air of `density` kg/m^3 that moves at `velocity` [3] m/s, on `triangles` [3*count], wound
 * outwards: r = density coefficient/2 A |s| s n with s = (v - velocity).n. The area A and the normal n are lagged.
 * FLESH_ERR_ARGUMENT if density or coefficient are not positive or a triangle is invalid; FLESH_ERR_MEMORY. Borrows
 * nothing. */
int flesh_effect_wind(const flesh_body *body, int count, const int *triangles, const double velocity[3],
                      double density, double coefficient, const flesh_amplitude *amplitude, flesh_effect **effect);

#endif
