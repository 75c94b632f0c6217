/* wind.h: the pressure of moving air. */
#ifndef FLESH_EFFECT_WIND_H
#define FLESH_EFFECT_WIND_H

#include "flesh/effects.h"

/* Air of `density` kg/m^3 that goes at `velocity` [3] m/s, on `triangles` [3*count], wound outwards: r = density
 * coefficient/2 A |s| s n with s = (v - velocity).n. The area A and the normal n are lagged.
 * FLESH_ERR_ARGUMENT where density or coefficient are not positive or a triangle is none; FLESH_ERR_MEMORY. Returns
 * new; borrows nothing. */
int flesh_effect_wind(const flesh_body *body, int count, const int *triangles, const double velocity[3],
                      double density, double coefficient, const flesh_amplitude *amplitude, flesh_effect **effect);

#endif
