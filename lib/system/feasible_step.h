/* feasible_step.h: limits of steps by effects such as contact, for solves and steps; the effects define them in
 * flesh_effect_operations. */
#ifndef FLESH_SYSTEM_FEASIBLE_STEP_H
#define FLESH_SYSTEM_FEASIBLE_STEP_H

#include "system/proximity.h"

/* Returns the feasible fraction of the straight step of all nodes from x_from [3*n] at t_from to x_to at t_to; 1: all of
 * it. `proximity`: the run's; NULL: there is no run. `internal`: the step's internal variables; NULL: all 0. */
double flesh_system_max_feasible_step(const flesh_system *system, const flesh_proximity *proximity,
                                      const double *internal, double t_from, const double *x_from, double t_to,
                                      const double *x_to);
/* Moves nodes of x_to that cannot be reached from x_from to feasible positions. */
void flesh_system_push_out(const flesh_system *system, double t_from, const double *x_from, double t_to, double *x_to);
/* Corrects x [3*n] so that touching bodies keep their gaps (flesh_effect_private.keep_gaps); returns whether it has changed
 * x. */
int flesh_system_keep_gaps(const flesh_system *system, const flesh_proximity *proximity, const double *internal,
                            const double *x_from, double *x);
/* Whether a step from x_from to x_to must have tunnelled through an obstacle or another body. */
int flesh_system_tunnelled(const flesh_system *system, const flesh_proximity *proximity, const double *internal,
                           double t_from, const double *x_from, double t_to, const double *x_to);
/* Does what flesh_system_check does, with internal variables (NULL: all 0). */
int flesh_system_check_with(const flesh_system *system, const double *internal, double t, const double *x);
/* Whether any effect limits steps. */
int flesh_system_limits_step(const flesh_system *system);

#endif
