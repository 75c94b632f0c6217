/* kinsol.h: owns a KINSOL and solves stages with it. */
#ifndef FLESH_SUNDIALS_KINSOL_H
#define FLESH_SUNDIALS_KINSOL_H

#include "base/archive.h"
#include "flesh/kinsol.h"
#include "flesh/state.h"
#include "system/evaluation.h"

typedef struct flesh_nonlinear flesh_nonlinear;
typedef struct flesh_newton flesh_newton; /* newton/newton.h */

/* Fails on all ranks or none. */
int flesh_nonlinear_create(const flesh_system *system, const flesh_solver_options *options,
                           flesh_nonlinear **nonlinear);
/* Does the same unless a rank comes with a `status` other than FLESH_OK, of what it has made before. */
int flesh_nonlinear_create_after(int status, const flesh_system *system, const flesh_solver_options *options,
                                 flesh_nonlinear **nonlinear);
void flesh_nonlinear_destroy(flesh_nonlinear **nonlinear);

/* Solves the stage from u = 0, or from the one of `guesses` (each [3*n]; NULL ends them; may be NULL) that has the
 * lowest potential, where that is lower; a solve that meets its iteration limit goes on as many times as
 * `extensions` says. The solution is flesh_nonlinear_unknowns() [3*n], also (the last iterate) after
 * FLESH_NOT_CONVERGED. FLESH_UNDEFINED or FLESH_NONFINITE when the start has no residual. Adds to *stats. */
int flesh_nonlinear_solve(flesh_nonlinear *nonlinear, const flesh_stage *stage, const double *const *guesses,
                          int extensions, flesh_solve_stats *stats);
/* From now on solves go as deep as to a residual of this norm, N: those that follow one whose target it was. 0: as deep
 * as the options say. */
void flesh_nonlinear_set_target(flesh_nonlinear *nonlinear, double target);
/* From now on norms of residuals are by these weights [3*n], which are copied; NULL: by ones. */
void flesh_nonlinear_weigh(flesh_nonlinear *nonlinear, const double *weights);
/* The norm of residuals r [3*n]. */
double flesh_nonlinear_norm(flesh_nonlinear *nonlinear, const double *r);
/* Solves to such a target go at least as deep as to these shares of their first residual and, where there is a load, of the
 * larger one of both: 1 and INFINITY unless they are set. They end with a step of which the inertia is such a residual, if a
 * node has the mass `of_node`, kg; 0: none does. */
void flesh_nonlinear_set_depth(flesh_nonlinear *nonlinear, double of_first, double of_load, double of_node);
/* Stages to come are of `softened` (system/softened.h), which is borrowed; NULL: of the system as it is. */
void flesh_nonlinear_soften(flesh_nonlinear *nonlinear, const flesh_system *softened);
/* The next stage goes on smoothly from the last one: what was prepared for that may serve. */
void flesh_nonlinear_go_on(flesh_nonlinear *nonlinear);
const double *flesh_nonlinear_unknowns(const flesh_nonlinear *nonlinear);
/* Whether the last solve was given up as the loads stretched the body without bound. */
int flesh_nonlinear_ran_away(const flesh_nonlinear *nonlinear);
/* Whether the last solve began at that of its guesses; NULL: at u = 0. */
int flesh_nonlinear_began_at(const flesh_nonlinear *nonlinear, const double *guess);

/* `stop` is asked before every Newton iteration and within long linear solves: a negative status ends the solve with
 * it. NULL: not asked. */
void flesh_nonlinear_set_stop(flesh_nonlinear *nonlinear, int (*stop)(void *data), void *data);

/* The acceleration a [3*n] that balances the state at t; constrained dofs keep the a they come with. As
 * flesh_newton_acceleration. */
int flesh_nonlinear_acceleration(flesh_nonlinear *nonlinear, const flesh_state *state, double t, double *a,
                                 flesh_solve_stats *stats);

/* Like flesh_newton_apply_constraint_jump. */
int flesh_nonlinear_apply_constraint_jump(flesh_nonlinear *nonlinear, double t, const double *x_prescribed,
                            const double *v_prescribed, double *x, double *v, flesh_solve_stats *stats);

/* p [3*n] = K^-1 b of the stage solved last, as flesh_newton_filter_error; *product = b.p. */
int flesh_nonlinear_filter_error(flesh_nonlinear *nonlinear, const double *b, double *p, double *product,
                                 flesh_solve_stats *stats);
/* Like flesh_newton_keep_volumes. */
int flesh_nonlinear_keep_volumes(flesh_nonlinear *nonlinear, double *p, flesh_solve_stats *stats);
/* The scale of the body's velocities, as system/velocity_scale.h has it, m/s. Not within a step. */
double flesh_nonlinear_velocity_scale(flesh_nonlinear *nonlinear);

/* FLESH_OK when every energy has a value at x, v [3*n] and t: they are in energies [effects], J. */
int flesh_nonlinear_defined(flesh_nonlinear *nonlinear, double t, const double *x, const double *v, double *energies,
                            flesh_solve_stats *stats);

/* After a solve that has succeeded: whether all that could limit steps is too far from the lagged state and from the
 * solution. */
int flesh_nonlinear_is_clear(const flesh_nonlinear *nonlinear);

/* After a solve that has succeeded: the stage's point, which is valid until the next call; the reactions at the dofs
 * `constrained` [*count], N. */
flesh_point flesh_nonlinear_point(flesh_nonlinear *nonlinear);
const double *flesh_nonlinear_reactions(const flesh_nonlinear *nonlinear, const int **constrained, int *count);

/* Node with the largest residual at the last iterate; -1 when it has none. */
int flesh_nonlinear_worst_node(const flesh_nonlinear *nonlinear);
/* Newton's iteration of the solve under way. */
void flesh_nonlinear_progress(const flesh_nonlinear *nonlinear, flesh_progress *progress);
/* The run's, of which the solver is a part; borrowed. Its point is the last iterate, or the trial that had no value. */
flesh_evaluation *flesh_nonlinear_evaluation(flesh_nonlinear *nonlinear);
/* The Newton iteration that solves; borrowed. */
flesh_newton *flesh_nonlinear_newton(flesh_nonlinear *nonlinear);
/* KINSOL's memory. */
void *flesh_nonlinear_kinsol(const flesh_nonlinear *nonlinear);
size_t flesh_nonlinear_memory(const flesh_nonlinear *nonlinear);
/* Drops what earlier solves have left; the memories of effects stay. */
void flesh_nonlinear_forget(flesh_nonlinear *nonlinear);
/* Archives the memory that lasts from solve to solve. FLESH_ERR_MEMORY. */
int flesh_nonlinear_archive(flesh_nonlinear *nonlinear, flesh_archive *archive);

#endif
