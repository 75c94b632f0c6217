/* solver.h: options, stages and statistics of the nonlinear solve, without any SUNDIALS type.
 * Functions that return no status cannot fail. */
#ifndef FLESH_SOLVER_H
#define FLESH_SOLVER_H

#include <stdint.h>
#include <stdio.h>

#include "flesh/effect.h"
#include "flesh/linear_solver.h"
#include "flesh/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum flesh_line_search {
  /* full steps, reduced by an Armijo search on the incremental potential if necessary */
  FLESH_LINE_SEARCH_POTENTIAL,
  FLESH_LINE_SEARCH_NONE,  /* plain full Newton steps */
  FLESH_LINE_SEARCH_RESIDUAL /* KINSOL's own line search on the residual norm */
} flesh_line_search;

/* Mechanisms of a solve and of its recovery, each of which can be switched off (flesh_solver_options.techniques;
 * `flesh hardcases --ablation` measures the effect of each). flesh_technique_name and _doc return their names and
 * short descriptions. */
typedef enum flesh_technique {
  /* After a filtered step that was too short, when few nodes carry the residual, PCG follows the true Hessian
   * downhill along its directions of negative curvature, in one solve (PCG only, with a filter whose name does not
   * end in ALWAYS). This reduces the iterations at a crease or an inverting tet to a tenth. */
  FLESH_TECHNIQUE_NEGATIVE_CURVATURE = 1 << 0,
  /* After a step whose decrease of the potential differs from the prediction and which leaves few nodes that carry
   * the residual (a crease, for instance), only these and two rings of neighbours, at most a quarter of the body, are
   * solved for, with all other nodes constrained; the solve continues from there if the potential has fallen. Not
   * used if contact acts on the dofs that carry most of the residual. With FLESH_LINE_SEARCH_POTENTIAL only. */
  FLESH_TECHNIQUE_NONLINEAR_ELIMINATION = 1 << 1,
  /* When the line search keeps cutting steps because a straight step strains stiff parts that rotate, a longer step
   * is taken, followed by one or two Newton steps (counted as such); the result is accepted if its potential is lower
   * than the cut step's (the watchdog technique of Chamberlain et al. 1982). With FLESH_LINE_SEARCH_POTENTIAL only. */
  FLESH_TECHNIQUE_WATCHDOG = 1 << 2,
  /* Untangles a body near equilibrium if tets stay inverted or collapsed, or wind once more around an edge, although
   * no load holds them so: finds the equilibrium of materials that resist changes of volume less (Poisson's ratio 0),
   * from there the true one, and keeps it if its potential is lower; counted in flesh_solve_stats. Does nothing for
   * bodies that may collapse: those with residual stress at rest (forms M, C, D), and those that start in an exact
   * line or point. */
  FLESH_TECHNIQUE_UNTANGLE = 1 << 3,
  /* Lengthens a step that lowers the potential more than the quadratic model predicted: if few nodes carry the residual,
   * after a cut, or after sixteen such filtered steps. */
  FLESH_TECHNIQUE_LONGER_STEPS = 1 << 4,
  /* Solves a step of a tangled body first with materials that resist changes of volume less. */
  FLESH_TECHNIQUE_SOFTENED_STEPS = 1 << 5,
  /* Bends steps of nearly incompressible tet10-mean elements to second order in their changes of volume. */
  FLESH_TECHNIQUE_VOLUME_ARCS = 1 << 6,
  /* Keeps a matrix for further iterations of its stage while it predicts their residuals. */
  FLESH_TECHNIQUE_KEPT_MATRICES = 1 << 7,
  /* Keeps a matrix for the first iteration of the stages that follow. */
  FLESH_TECHNIQUE_MATRICES_ACROSS_STEPS = 1 << 8,
  /* Keeps a preconditioner until its age has cost as many iterations as building a new one would. */
  FLESH_TECHNIQUE_KEPT_PRECONDITIONERS = 1 << 9,
  /* Makes linear tolerances follow the rate at which residuals fall (Eisenstat & Walker 1996, choice 2). */
  FLESH_TECHNIQUE_FORCING_TERMS = 1 << 10,
  /* Uses a matrix in single precision in linear solves where inertia hides its round-off. */
  FLESH_TECHNIQUE_SINGLE_PRECISION = 1 << 11,
  /* Makes the target relative to the forces at the solution if the first residual is larger than all of them. */
  FLESH_TECHNIQUE_BALANCED_TARGET = 1 << 12,
  /* Judges a step by slopes where round-off hides the decrease of the potential (Hager & Zhang 2005). */
  FLESH_TECHNIQUE_APPROXIMATE_WOLFE = 1 << 13,
  /* Solves by a sparse factorisation where PCG would cost more. */
  FLESH_TECHNIQUE_DIRECT_FALLBACK = 1 << 14,
  /* Extrapolates the first iterate of a step from the steps before it. */
  FLESH_TECHNIQUE_EXTRAPOLATION = 1 << 15,
  /* Continues the rigid motion of a free body in the first iterate of a step. */
  FLESH_TECHNIQUE_RIGID_GUESS = 1 << 16,
  FLESH_TECHNIQUES_ALL = (1 << 17) - 1
} flesh_technique;

/* Returns the technique's name in a scene's list `techniques`, such as "watchdog"; NULL if `technique` is not one of
 * the enum's single bits. */
FLESH_API const char *flesh_technique_name(flesh_technique technique);
/* Returns a short description of the technique's effect, without a full stop; NULL likewise. */
FLESH_API const char *flesh_technique_doc(flesh_technique technique);

typedef struct flesh_solver_options {
  /* Relative tolerance of Newton's iteration. It has converged when ||r||_2 over the free dofs <= newton_tolerance *
   * max(||applied load||, first), or r is at rounding. The load is that of the current iterate; `first` is ||r||_2 at
   * the first iterate, but at most the largest ||r_e||_2 at the current one: of the load (over the free dofs) and of
   * each other effect e, inertia included (over the free dofs; over all dofs for an effect that couples nodes, so that
   * reactions count). If no load acts and that maximum is less than ten times ||r||_2, so that nothing balances, `first`
   * is at most the larger of the maximum and the force that strains an edge by its own length. With error control, and
   * with FLESH_METHOD_IDA, the residual follows from flesh_adaptive_options.tolerance instead.
   * At the end of a step the mean of J of an incompressible tet is within a hundredth of newton_tolerance of 1, or
   * within newton_tolerance if a further correction changes no force by more than that. */
  double newton_tolerance;
  /* Largest ratio of the residual after a linear solve to that before it; FLESH_TECHNIQUE_FORCING_TERMS lowers it. */
  double linear_tolerance;
  /* Maximum number of iterations per solve. A solve ends earlier when 300 iterations (100 in a motion of bodies that
   * touch each other) lower the potential by less than a tenth of the whole decrease so far. */
  int max_newton;
  /* Maximum number of iterations per linear solve. If a linear solve does not converge in so many, it and all further
   * ones of the nonlinear solve are done by a factorisation, as long as that takes no more arithmetic. */
  int max_linear;
  int max_cutbacks;        /* how often a failed step (or load increment) may be halved */
  flesh_linear_solver linear_solver;
  flesh_preconditioner preconditioner;
  flesh_eigenvalue_filter eigenvalue_filter;
  flesh_line_search line_search;
  /* 1: a solve that ends at max_newton is accepted, as in programs that take a fixed number of iterations per step,
   * and counted in flesh_solve_stats. 0: such a step is retried and fails. */
  int accept_unconverged;
  /* Techniques in use, bits of flesh_technique; by default FLESH_TECHNIQUES_ALL. */
  unsigned techniques;
  /* Number of threads of a solve, 0: one for each processor that this process may use. Results do not depend on it. */
  int threads;
  /* Maximum number of solves of a stage of a step. Each repeats the solve with the lagged quantities (normal forces
   * and directions behind friction, follower loads) at the end of the last solve, until that changes no residual by
   * more than the tolerance. 0: as often as the method needs to keep its order, once for methods of order 1, else
   * twice, and up to four times while friction is off by a hundredth of contact's forces, as at impacts; with error
   * control, the lag of friction counts as an error instead. 1: friction uses the previous step; effects that follow
   * the shape (FLESH_IS_FOLLOWER_LOAD) are solved as with 0. FLESH_METHOD_IDA lags nothing, and statics repeats
   * follower loads anyway. */
  int lag_iterations;
} flesh_solver_options;

/* Sets newton_tolerance 1e-4, linear_tolerance 1e-2, max_newton 1200, max_linear 2000, max_cutbacks 8,
 * PCG, the preconditioner and eigenvalue filter AUTO, the line search on the potential, all techniques,
 * threads 1, lag_iterations 0, and accept_unconverged 0. */
FLESH_API void flesh_solver_options_default(flesh_solver_options *options);

/* A stage: the equations r(u) = 0 of one solve. It gives the time, and how the unknown u [3*n] moves the point from a
 * base: x = x0 + sx u, v = v0 + sv u, a = a0 + sa u. */
typedef struct flesh_stage {
  double t, load;    /* time and load of the point; load is 1 except in load increments */
  /* Fraction of the displacement from x0 to the prescribed positions at t; 1 except in increments. */
  double prescribed_fraction;
  flesh_shift shift; /* sx, sv, sa; its `filter` is not read (the options decide) */
  /* Base of the point, borrowed until the next stage; v0 and a0 may be NULL for zero. */
  const double *x0, *v0, *a0;
  /* The point's lagged state, borrowed; NULL: x0 (at t), v0 or rest. */
  const double *x_lag, *v_lag;
  double t_lag;
  /* [3*n] m, positions at t_from, the start of the step: the path from there to the point must be clear of obstacles;
   * borrowed; NULL: the lagged state. */
  const double *x_from;
  double t_from;
  /* The state at which effects freeze terms without a potential (flesh_point). 0: the start of the stage, x0 and v0,
   * as for backward Euler; 1: the state set by flesh_problem_freeze, and x0 and v0 before the first call. */
  int frozen_at_solution;
  /* Multipliers of the point, [tets] Pa, borrowed, NULL for zero; and the factor of penalties, 0 for 1. */
  const double *multipliers;
  double penalty;
  const double *internal; /* internal variables of all effects at the point, borrowed; NULL: 0 */
  /* [3*nodes] 1 for dofs that stay at x0, in addition to the constrained ones; borrowed; NULL: none. */
  const uint8_t *held;
} flesh_stage;

/* Statistics of one solve, or sums over a step with its halvings. */
typedef struct flesh_solve_stats {
  /* Solves with softened materials count in all of these except `solves`. */
  int solves, newton, linear, assemblies, projections, residuals, potentials;
  int backtracks; /* line-search reductions */
  /* Solves for few nodes only (nonlinear_elimination); their Newton iterations; and the sum of these iterations, each
   * times its fraction of the elements (an iteration costs about 1.5 times that fraction of an iteration of the whole
   * body). */
  int subdomains, subdomain_newton;
  double subdomain_share;
  int watchdog_steps; /* longer steps that were accepted (watchdog) */
  /* Iterates accepted by the line search whose potential is above that of the solve's first iterate by more than
   * 1e-12 of the sum of its terms' sizes: none, unless an effect's residual is not the gradient of its potential. */
  int potential_rises;
  int at_rounding;                  /* solves that ended at rounding above the tolerance */
  int untanglings, untangled_nodes; /* number of untanglings, and of nodes moved by them */
  int unconverged;                  /* solves accepted without convergence (accept_unconverged) */
  int linear_single; /* those of the `linear` in single precision */
  int multiplier_updates; /* updates of the pressures of incompressible tets, each followed by a solve */
  int direct; /* linear solves by a direct factorisation because conjugate gradients did not converge */
  /* N, 2-norms over the free dofs, from the last solve. */
  double residual_first, residual_last, residual_target;
  /* Statistics of the integrator: internal steps; steps rejected by their error or their gain of energy, and steps
   * whose Newton iteration did not converge; order and length [s] of the last step. */
  int steps, rejected, convergence_failures, order;
  /* Steps, included in `steps`, for which backward Euler replaced a method of order 2: that method balances forces
   * before the end of its step and would have ended it inside an obstacle. */
  int impact_steps;
  /* Steps among `steps` that backward Euler took because the method's own step would have gained energy, however
   * short, or, with error control, to lead out of a tangle; or that a Runge-Kutta method took with error control,
   * because steps of Newmark's family gained energy or their accelerations swung. */
  int damped_steps;
  double h_last;
} flesh_solve_stats;

/* Progress of the current step, for `stop` to report. Newton's iteration is that of the current solve; the residual,
 * N, is that at its last linear solve, 0 before the first. FLESH_METHOD_IDA gives t and h of its internal step, and 0
 * for the rest. */
typedef struct flesh_progress {
  double t, h; /* s, start and length of the part of the step that is tried */
  int newton;
  long linear; /* linear iterations of this solve so far */
  double residual, target;
} flesh_progress;

/* Formats of SUNDIALS' ...PrintAllStats functions: TABLE is a line `name = value` per statistic; CSV a header row of
 * names and a row of values (SUNDIALS has both in one row); CSV_ROW the row alone, for further runs of a table. */
typedef enum flesh_stats_format {
  FLESH_STATS_TABLE,
  FLESH_STATS_CSV,
  FLESH_STATS_CSV_ROW
} flesh_stats_format;

/* Writes *stats to the caller's file. FLESH_ERR_FILE when that fails.
 * KINPrintAllStats(flesh_integrator_kinsol(integrator), ...) writes KINSOL's own statistics, and likewise for IDA.
 * Further errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_solve_stats_print(const flesh_solve_stats *stats, flesh_stats_format format,
                                      FILE *file);

#ifdef __cplusplus
}
#endif
#endif
