/* velocity_scale.h: length of a body and velocity of its bending, the units of tolerances of positions and velocities. */
#ifndef FLESH_SYSTEM_VELOCITY_SCALE_H
#define FLESH_SYSTEM_VELOCITY_SCALE_H

#include "flesh/block_matrix.h"
#include "flesh/system.h"

/* Returns the longest side L of the box around the body at rest, m. Collective, as is the next. */
double flesh_system_length_scale(const flesh_system *system);

/* Computes u = (-2 s z, y z, s^2 + (z^2 - y^2)/2) at X: incompressible bending of a beam along s in the plane of s and z
 * about the centre of its box. */
void flesh_bent_shape(const double box[6], const double X[3], double u[3]);

/* Returns L over the period of bending, m/s: L omega / (2 pi), omega^2 being the Rayleigh quotient of a bent shape; without
 * stiffness the speed that the load causes along L; otherwise L per second. *mass: the body's, kg; 0 where it has no value.
 * Overwrites K, of the system's pattern, and `room` [n] each. */
enum { FLESH_VELOCITY_SCALE_ROOM = 5 };
double flesh_system_velocity_scale(const flesh_system *system, flesh_block_matrix *K,
                                   double *const room[FLESH_VELOCITY_SCALE_ROOM], double *mass);

#endif
