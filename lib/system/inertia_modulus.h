/* inertia_modulus.h: how inertia stiffens a body as a whole. */
#ifndef FLESH_SYSTEM_INERTIA_MODULUS_H
#define FLESH_SYSTEM_INERTIA_MODULUS_H

#include "flesh/system.h"

/* Returns density times squared radius over pi^2 [kg/m], the radius being that of a ball with the body's ratio of volume to
 * surface; 0 without inertia. Times shift.a / shift.x it is the modulus [Pa] of inertia where the body deforms as a whole.
 * Overwrites a and r [n]. */
double flesh_system_inertia_modulus(const flesh_system *system, double *a, double *r);

#endif
