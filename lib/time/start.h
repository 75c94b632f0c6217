/* start.h: begins a method at a state of which it knows nothing. */
#ifndef FLESH_TIME_START_H
#define FLESH_TIME_START_H

#include "time/integrator.h"

/* Begins the method in a piece whose first step takes h: at a start, after an event, a caller's change, or where something
 * broke. A status > 0 has been recorded as the step's failure. */
int flesh_integrator_start(flesh_integrator *integrator, flesh_state *state, const flesh_piece *piece, double h,
                           flesh_solve_stats *stats);

/* Projects the velocity onto the constraints of multipliers, by a step of backward Euler that is as brief as a start
 * and has an error of the second order; *taken: it was. Stages of Runge-Kutta methods damp velocities across the
 * constraints; other methods would swing by them for good. If constraints do not hold at the state, the step's velocity
 * would close their gaps. */
int flesh_integrator_project_velocity(flesh_integrator *integrator, flesh_state *state, const flesh_piece *piece, double h,
                                      int *taken, flesh_solve_stats *stats);

#endif
