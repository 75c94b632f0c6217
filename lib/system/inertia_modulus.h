/* inertia_modulus.h: how inertia stiffens a body as a whole. */
#ifndef FLESH_SYSTEM_INERTIA_MODULUS_H
#define FLESH_SYSTEM_INERTIA_MODULUS_H

#include "flesh/system.h"

/* The body's density times the square of how far its inside is from its surface, that of a ball with its ratio of volume
 * and surface, over pi^2 [kg/m]; 0 without inertia. Times shift.a / shift.x it is the modulus [Pa] that inertia has where
 * the body deforms as a whole. Overwrites a and r [n]. */
double flesh_system_inertia_modulus(const flesh_system *system, double *a, double *r);

#endif
