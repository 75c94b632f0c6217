/* pressure_curved.h: a pressure on the curved faces of ten-node tets. */
#ifndef FLESH_EFFECT_PRESSURE_CURVED_H
#define FLESH_EFFECT_PRESSURE_CURVED_H

#include "flesh/effects.h"

/* flesh_effect_pressure on a mesh of order 2, its arguments checked. */
int flesh_pressure_curved(const flesh_body *body, int count, const int *triangles, double pressure,
                          const flesh_amplitude *amplitude, flesh_effect **effect);

#endif
