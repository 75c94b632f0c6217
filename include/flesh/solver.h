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
  /* Full steps, reduced by an Armijo search on the incremental potential where needed. */
  FLESH_LINE_SEARCH_POTENTIAL,
  FLESH_LINE_SEARCH_NONE,  /* plain full Newton steps */
  FLESH_LINE_SEARCH_RESIDUAL /* KINSOL's own line search on the residual norm */
} flesh_line_search;

/* Mechanisms of a solve and of its recovery. Each can be switched off (flesh_solver_options.techniques); `flesh
 * hardcases --ablation` measures what each is worth. flesh_technique_name and flesh_technique_doc describe them. */
typedef enum flesh_technique {
  /* After a filtered step that was too short, if few nodes carry the residual, PCG follows the true Hessian downhill
   * along its directions of negative curvature, in one solve (PCG only, with a filter other than ALWAYS). A crease
   * or an inverting tet then costs a tenth of the iterations. */
  FLESH_TECHNIQUE_NEGATIVE_CURVATURE = 1 << 0,
  /* After a step whose decrease of the potential differed from the prediction and that left few nodes carrying the
   * residual (a crease, for instance), solves for these nodes and two rings of neighbours, at most a quarter of the
   * body, with all others constrained, and continues from there if the potential has fallen. Not used where contact
   * acts on the dofs that carry most of the residual. With FLESH_LINE_SEARCH_POTENTIAL only. */
  FLESH_TECHNIQUE_NONLINEAR_ELIMINATION = 1 << 1,
  /* Takes a longer step, and one or two Newton steps (counted as such) from there, where the line search keeps cutting
   * steps because a straight step strains stiff parts that rotate. The result is accepted if its potential is lower
   * than the cut step's (the watchdog technique of Chamberlain et al. 1982). With FLESH_LINE_SEARCH_POTENTIAL only. */
  FLESH_TECHNIQUE_WATCHDOG = 1 << 2,
  /* For a body near equilibrium with tets that stay inverted or collapsed, or wind once too often around an edge,
   * without a load that holds them so. Finds the equilibrium of materials that resist changes of volume less
   * (Poisson's ratio 0), then from there the true equilibrium, and keeps it if its potential is lower; counted in
   * flesh_solve_stats. Does nothing for a body with residual stress at rest (forms M, C, D) or one that starts in an
   * exact line or point: these may collapse. */
  FLESH_TECHNIQUE_UNTANGLE = 1 << 3,
  /* Lengthens a step that lowers the potential more than the quadratic model predicted, where few nodes carry the
   * residual, after a cut, or after sixteen such filtered steps. */
  FLESH_TECHNIQUE_LONGER_STEPS = 1 << 4,
  /* Solves a step of a tangled body first with materials that resist changes of volume less. */
  FLESH_TECHNIQUE_SOFTENED_STEPS = 1 << 5,
  /* Bends steps of nearly incompressible tet10-mean so that their changes of volume are kept to second order. */
  FLESH_TECHNIQUE_VOLUME_ARCS = 1 << 6,
  /* Keeps a matrix for further iterations of its stage while it predicts their residuals. */
  FLESH_TECHNIQUE_KEPT_MATRICES = 1 << 7,
  /* Keeps a matrix for the first iteration of the stages that follow. */
  FLESH_TECHNIQUE_MATRICES_ACROSS_STEPS = 1 << 8,
  /* Keeps a preconditioner until its age has cost as many iterations as building a new one would. */
  FLESH_TECHNIQUE_KEPT_PRECONDITIONERS = 1 << 9,
  /* Linear tolerances follow the rate at which residuals fall (Eisenstat & Walker 1996, choice 2). */
  FLESH_TECHNIQUE_FORCING_TERMS = 1 << 10,
  /* Linear solves use a matrix in single precision where inertia hides its round-off. */
  FLESH_TECHNIQUE_SINGLE_PRECISION = 1 << 11,
  /* Makes the target relative to the forces at the solution where the first residual is larger than all of them. */
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

/* Returns the technique's name in a scene's list `techniques`, such as "watchdog"; NULL where `technique` is not one
 * of the enum's single bits. */
FLESH_API const char *flesh_technique_name(flesh_technique technique);
/* Returns a few words on what the technique does, without a full stop; NULL where flesh_technique_name returns
 * NULL. */
FLESH_API const char *flesh_technique_doc(flesh_technique technique);

typedef struct flesh_solver_options {
  /* A solve has converged when ||r||_2 over the free dofs <= newton_tolerance * max(||applied load||, first), or when
   * r is at round-off. The load is that of the current iterate. `first` is ||r||_2 at the first iterate, but at most
   * the largest ||r_e||_2 at the current one: of the load (over the free dofs) and of each other effect e, inertia
   * included (over the free dofs, or over all dofs if the effect couples nodes, so that reactions count). If no load
   * acts and that largest norm is less than ten times ||r||_2, so that nothing balances, `first` is at most the
   * larger of that norm and the force that strains an edge by its own length.
   * At the end of a step, the mean of J of an incompressible tet is within a hundredth of newton_tolerance of 1, or
   * within newton_tolerance where a further correction changes no force by more than that. */
  double newton_tolerance;
  double linear_tolerance; /* residual reduction of each linear solve */
  /* Newton iterations per solve. Every 300 of them must lower the potential by at least a tenth of its decrease so
   * far, or the solve ends there. */
  int max_newton;
  /* PCG iterations per linear solve. A linear solve that needs more, and all further ones of the nonlinear solve,
   * use a factorisation, as long as that takes no more arithmetic. */
  int max_linear;
  int max_cutbacks;        /* how often a failing step (or load increment) may be halved */
  flesh_linear_solver linear_solver;
  flesh_preconditioner preconditioner;
  flesh_eigenvalue_filter eigenvalue_filter;
  flesh_line_search line_search;
  /* 1: a solve that ends at max_newton is accepted, as in programs that take a fixed number of iterations per step,
   * and counted in flesh_solve_stats. 0: such a step is retried and fails. */
  int accept_unconverged;
  /* Bits of flesh_technique; by default FLESH_TECHNIQUES_ALL. */
  unsigned techniques;
  /* Threads of a solve; 0: one for each processor that this process may use. Results do not depend on it. */
  int threads;
  /* Largest number of solves per stage of a step. Each solve takes what is lagged (normal forces and directions of
   * friction, follower loads) from the end of the previous one, until that changes no residual by more than the
   * tolerance. 0: as many as keep the method's order (one for methods of order 1, else two), and up to four while
   * friction is off by a hundredth of the contact forces, as at impacts; where errors choose steps, friction's lag
   * counts as an error instead. 1: friction uses the previous step; effects that follow the shape
   * (FLESH_IS_FOLLOWER_LOAD) are solved as with 0. FLESH_METHOD_IDA lags nothing, and statics always repeats solves
   * for follower loads. */
  int lag_iterations;
} flesh_solver_options;

/* Sets newton_tolerance 1e-4, linear_tolerance 1e-2, max_newton 1200, max_linear 2000, max_cutbacks 8,
 * PCG, the preconditioner and eigenvalue filter AUTO, the line search on the potential, all techniques,
 * threads 1, lag_iterations 0, and accept_unconverged 0. */
FLESH_API void flesh_solver_options_default(flesh_solver_options *options);

/* Equations r(u) = 0 of one solve. The unknown u [3*n] moves the point from a base, x = x0 + sx u, v = v0 + sv u,
 * a = a0 + sa u; the stage also sets the point's time. */
typedef struct flesh_stage {
  double t, load;    /* time of the point, and factor on its loads: 1 but for load increments */
  /* Fraction of the displacement from x0 to the prescribed positions at t; 1 but for load increments. */
  double prescribed_fraction;
  flesh_shift shift; /* sx, sv, sa; its `filter` is not read (the options decide) */
  /* Base of the point, borrowed until the next stage; v0 and a0 may be NULL for zero. */
  const double *x0, *v0, *a0;
  /* Lagged state of the point, borrowed until the next stage; NULL: x_lag is x0 (at t), v_lag is v0 or rest. */
  const double *x_lag, *v_lag;
  double t_lag;
  /* Positions [3*n] m at t_from, the start of the step: obstacles must leave the way from there to the point free.
   * Borrowed; NULL: the lagged state. */
  const double *x_from;
  double t_from;
  /* State at which effects freeze terms without a potential (flesh_point). 0: the start of the stage, x0 and v0, as
   * for backward Euler. 1: the state that flesh_problem_freeze sets, x0 and v0 before its first call. */
  int frozen_at_solution;
  /* Multipliers of the point, [tets] Pa, borrowed, NULL for zero; and the factor on penalties, 0 for 1. */
  const double *multipliers;
  double penalty;
  const double *internal; /* internal variables of all effects at the point, borrowed; NULL: 0 */
  /* Flags [3*nodes] of dofs that stay at x0, beside the constrained ones; borrowed; NULL: none. */
  const uint8_t *held;
} flesh_stage;

/* Counts of one solve, or sums over a step with its cutbacks. */
typedef struct flesh_solve_stats {
  /* Solves with softened materials count in all of these except `solves`. */
  int solves, newton, linear, assemblies, projections, residuals, potentials;
  int backtracks; /* line-search reductions */
  /* Solves for few nodes alone (nonlinear elimination), their Newton iterations, and the sum of these iterations,
   * each times its fraction of the elements (such an iteration costs about 1.5 times that fraction of one of the
   * whole body). */
  int subdomains, subdomain_newton;
  double subdomain_share;
  int watchdog_steps; /* longer steps that the watchdog accepted */
  /* Iterates accepted by the line search although their potential exceeds that of the solve's first iterate by more
   * than 1e-12 of the sum of its terms' sizes. 0 unless the residual of an effect is not the gradient of its
   * potential. */
  int potential_rises;
  int at_rounding;                  /* solves that ended at round-off above the tolerance */
  int untanglings, untangled_nodes; /* how often tangles were removed, and how many nodes moved */
  int unconverged;                  /* solves accepted without convergence (accept_unconverged) */
  int linear_single; /* linear iterations in single precision, part of `linear` */
  int multiplier_updates; /* updates of the pressures of incompressible tets, each followed by a solve */
  int direct; /* linear solves by a factorisation because conjugate gradients did not converge */
  /* 2-norms of the residual over the free dofs [N], in the last solve. */
  double residual_first, residual_last, residual_target;
  /* Counts of the integrator: internal steps; steps rejected for their error or their gain of energy; steps rejected
   * because Newton's iteration did not converge; order and length [s] of the last step. */
  int steps, rejected, convergence_failures, order;
  /* Steps, included in `steps`, for which backward Euler replaced a method of order 2: that method balances forces
   * before the end of its step and would have ended it inside an obstacle. */
  int impact_steps;
  /* Steps, included in `steps`, for which backward Euler replaced the method because it would have gained energy at
   * any step length or, where errors choose steps, to lead out of a tangle. */
  int damped_steps;
  double h_last;
} flesh_solve_stats;

/* Progress of the current step, for `stop` to report. `newton` counts the iterations of the current solve;
 * `residual`, in N, is that at its last linear solve, 0 before the first. FLESH_METHOD_IDA gives t and h of its
 * internal step, and 0 for the rest. */
typedef struct flesh_progress {
  double t, h; /* s; start and length of the part of the step that is being tried */
  int newton;
  long linear; /* linear iterations of this solve so far */
  double residual, target;
} flesh_progress;

/* Layouts of flesh_solve_stats_print, those of SUNDIALS' ...PrintAllStats functions: TABLE is a line `name = value`
 * for each count; CSV is a row of names and a row of values (SUNDIALS has both in one row); CSV_ROW is the values
 * alone, for the next runs of a table. */
typedef enum flesh_stats_format {
  FLESH_STATS_TABLE,
  FLESH_STATS_CSV,
  FLESH_STATS_CSV_ROW
} flesh_stats_format;

/* Writes *stats to the caller's file. KINPrintAllStats(flesh_integrator_kinsol(integrator), ...) and its counterpart
 * of IDA write the counts of KINSOL and IDA themselves. Errors: FLESH_ERR_FILE where writing fails,
 * FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_solve_stats_print(const flesh_solve_stats *stats, flesh_stats_format format,
                                      FILE *file);

#ifdef __cplusplus
}
#endif
#endif
