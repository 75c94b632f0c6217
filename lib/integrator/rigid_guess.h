/* rigid_guess.h: where a free body gets to when it goes on moving as a rigid one. */
#ifndef FLESH_INTEGRATOR_RIGID_GUESS_H
#define FLESH_INTEGRATOR_RIGID_GUESS_H

#include "flesh/integrator.h"

/* Displacements u [3*nodes] over h of the rigid motion that fits the velocities best (all nodes alike). A Newton step
 * knows no turn but a small one, so a spinning body is better started from there than where it stands. */
void flesh_rigid_guess(const flesh_mesh *mesh, const flesh_state *state, double h, double *u);

#endif
