/* attempt.h: one try of a part of a step in time.
 *
 * The way of a state through a step of backward Euler in which nothing fails; each line calls those that are indented
 * below it:
 *
 *   integrator                   recognises the caller's state (system/evaluation)
 *     steps                      the part of the step that is tried
 *       attempt                  one try of it
 *         backward_euler         its stage: base and shift
 *         first_iterates         of extrapolation and rigid_guess
 *         multipliers            once, where nothing holds volumes
 *           sundials/kinsol      solves the stage
 *             newton/stage       first iterate, target, convergence
 *             KINSOL             iterates, and calls from below
 *    ^          callbacks        1 the residual: equations, system, effects
 *    ^          callbacks        2 the Jacobian: newton keeps K, or assembles it
 *    ^          linear_solver    3 the set-up: newton prepares, linear makes the preconditioner
 *    ^          linear_solver    4 the solve: newton's direction (K p = -r) and line_search
 *         step_energy            work and energy: energy_watch
 *         backward_euler         the state at the end of the step
 *         internals              what effects remember of the path, and of what touches
 *     recovery/untangle          is it a tangle at rest?
 */
#ifndef FLESH_TIME_ATTEMPT_H
#define FLESH_TIME_ATTEMPT_H

#include <math.h>

#include "time/integrator.h"

/* The last moment before the event. */
static inline double flesh_before(double t, double event) { return t < event ? t : nextafter(event, -INFINITY); }

/* First iterates u for a step of h to stage->t, with NULL behind them: the method's own, or straight on, and as rigid bodies
 * where some are free. They are in the integrator's room. */
void flesh_integrator_guess(flesh_integrator *integrator, const flesh_method_row *row, const flesh_state *state,
                            const flesh_stage *stage, double h, const double *guesses[3]);

/* Remembers the accepted step of h to the state for first iterates to come, and counts it as easy or not if it has `stages`
 * (0: it does not count). The statistics are those before and after its solves. */
void flesh_integrator_remember_solves(flesh_integrator *integrator, int stages, double h, const flesh_state *state,
                                      const flesh_solve_stats *before, const flesh_solve_stats *after);

/* Tries the part cutbacks->part of a piece by `row`, the method's own or backward Euler in its stead, and takes the state
 * to its end. A status > 0 has changed nothing; `blocked` and the control's refusal then say why. */
int flesh_integrator_attempt(flesh_integrator *integrator, const flesh_method_row *row, flesh_state *state,
                             const flesh_piece *piece, const flesh_cutbacks *cutbacks, flesh_solve_stats *stats);

#endif
