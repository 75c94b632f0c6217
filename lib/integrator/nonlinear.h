/* nonlinear.h: one nonlinear solve of a stage by KINSOL. */
#ifndef FLESH_INTEGRATOR_NONLINEAR_H
#define FLESH_INTEGRATOR_NONLINEAR_H

#include "flesh/kinsol.h"

typedef struct flesh_nonlinear flesh_nonlinear;

int flesh_nonlinear_create(const flesh_system *system, const flesh_solver_options *options,
                           flesh_nonlinear **nonlinear);
void flesh_nonlinear_destroy(flesh_nonlinear **nonlinear);

/* Solves the stage from u = 0, or from the one of `guesses` (each [3*n]; NULL ends them; may be NULL) that has the
 * lowest potential, where that is lower; a solve that meets its iteration limit goes on as many times as
 * `extensions` says. The solution is flesh_nonlinear_unknowns() [3*n], also (the last iterate) after
 * FLESH_NOT_CONVERGED. FLESH_UNDEFINED or FLESH_NONFINITE when the start has no residual. Adds to *stats. */
int flesh_nonlinear_solve(flesh_nonlinear *nonlinear, const flesh_stage *stage, const double *const *guesses,
                          int extensions, flesh_solve_stats *stats);
/* The next stage goes on smoothly from the last one: what was prepared for that may serve. */
void flesh_nonlinear_go_on(flesh_nonlinear *nonlinear);
const double *flesh_nonlinear_unknowns(const flesh_nonlinear *nonlinear);

/* `stop` is asked before every Newton iteration and within long linear solves: a negative status ends the solve with
 * it. NULL: not asked. */
void flesh_nonlinear_set_stop(flesh_nonlinear *nonlinear, int (*stop)(void *data), void *data);

/* The acceleration a [3*n] that balances x and v at t; constrained dofs keep the a they come with. As
 * flesh_problem_acceleration. */
int flesh_nonlinear_acceleration(flesh_nonlinear *nonlinear, double t, const double *x, const double *v,
                                 double *a, flesh_solve_stats *stats);

/* As flesh_problem_take_up. */
int flesh_nonlinear_take_up(flesh_nonlinear *nonlinear, double t, const double *x_prescribed,
                            const double *v_prescribed, double *x, double *v, flesh_solve_stats *stats);

/* FLESH_OK when every energy has a value at x, v [3*n] and t. */
int flesh_nonlinear_defined(flesh_nonlinear *nonlinear, double t, const double *x, const double *v,
                            flesh_solve_stats *stats);

/* Positions [3*n] last evaluated: the last iterate, or the trial that had no value. */
const double *flesh_nonlinear_positions(const flesh_nonlinear *nonlinear);

/* Node with the largest residual at the last iterate; -1 when it has none. */
int flesh_nonlinear_worst_node(const flesh_nonlinear *nonlinear);
/* Where its evaluations are counted, borrowed. */
void flesh_nonlinear_set_costs(flesh_nonlinear *nonlinear, flesh_costs *costs);
/* KINSOL's memory. */
void *flesh_nonlinear_kinsol(const flesh_nonlinear *nonlinear);
/* Those of its solves. */
flesh_threads *flesh_nonlinear_threads(const flesh_nonlinear *nonlinear);
size_t flesh_nonlinear_memory(const flesh_nonlinear *nonlinear);

#endif
