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

/* The mechanisms of a solve and of its recovery, each of which can be switched off (flesh_solver_options.techniques;
 * `flesh hardcases --ablation` measures what each is worth). flesh_technique_name and _doc have their words. */
typedef enum flesh_technique {
  /* After a filtered step that was too short, where few nodes carry the residual, PCG follows the true Hessian downhill
   * along its directions of negative curvature, in one solve (PCG only, with a filter that is not ALWAYS). A crease or
   * a tet that turns inside out costs a tenth of the iterations then. */
  FLESH_TECHNIQUE_NEGATIVE_CURVATURE = 1 << 0,
  /* After a step that lowered the potential otherwise than predicted and left few nodes that carry the residual (a
   * crease, for instance), these and two rings of neighbours, at most a quarter of the body, are solved for alone, all
   * others constrained; the solve continues from there if the potential has fallen. Not where contact acts on the dofs
   * that carry most of the residual. With FLESH_LINE_SEARCH_POTENTIAL only. */
  FLESH_TECHNIQUE_NONLINEAR_ELIMINATION = 1 << 1,
  /* A longer step is taken, and one or two Newton steps (counted as such) from there, where the line search keeps
   * cutting steps because a straight step strains stiff parts that rotate; the result is accepted if its potential is
   * lower than the cut step's (the watchdog technique of Chamberlain et al. 1982). With FLESH_LINE_SEARCH_POTENTIAL
   * only. */
  FLESH_TECHNIQUE_WATCHDOG = 1 << 2,
  /* A body near equilibrium whose tets stay inverted or collapsed, or wind once more around an edge, without a load that
   * holds them so: the equilibrium of materials that resist changes of volume less (Poisson's ratio 0) is found from
   * there, and from that the true one, which is kept if its potential is lower; counted in flesh_solve_stats. A body
   * with residual stress at rest (forms M, C, D), or one that starts in an exact line or point, may collapse: then
   * nothing is done. */
  FLESH_TECHNIQUE_UNTANGLE = 1 << 3,
  /* A step that lowers the potential more than the quadratic model predicted is lengthened where few nodes carry the
   * residual, after a cut, or after sixteen filtered ones like it. */
  FLESH_TECHNIQUE_LONGER_STEPS = 1 << 4,
  /* A step of a tangled body is solved with materials that resist changes of volume less first. */
  FLESH_TECHNIQUE_SOFTENED_STEPS = 1 << 5,
  /* Steps of nearly incompressible tet10-mean are bent to second order in their changes of volume. */
  FLESH_TECHNIQUE_VOLUME_ARCS = 1 << 6,
  /* A matrix is kept for further iterations of its stage while it predicts their residuals. */
  FLESH_TECHNIQUE_KEPT_MATRICES = 1 << 7,
  /* A matrix is kept for the first iteration of the stages that follow. */
  FLESH_TECHNIQUE_MATRICES_ACROSS_STEPS = 1 << 8,
  /* A preconditioner is kept until its age has cost as many iterations as a new one. */
  FLESH_TECHNIQUE_KEPT_PRECONDITIONERS = 1 << 9,
  /* Linear tolerances follow the rate at which residuals fall (Eisenstat & Walker 1996, choice 2). */
  FLESH_TECHNIQUE_FORCING_TERMS = 1 << 10,
  /* Linear solves use a matrix in single precision where inertia hides its round-off. */
  FLESH_TECHNIQUE_SINGLE_PRECISION = 1 << 11,
  /* The target is relative to the forces at the solution where the first residual is larger than all of them. */
  FLESH_TECHNIQUE_BALANCED_TARGET = 1 << 12,
  /* Slopes judge a step where round-off hides the decrease of the potential (Hager & Zhang 2005). */
  FLESH_TECHNIQUE_APPROXIMATE_WOLFE = 1 << 13,
  /* A sparse factorisation solves where PCG would cost more. */
  FLESH_TECHNIQUE_DIRECT_FALLBACK = 1 << 14,
  /* The first iterate of a step continues the steps before it. */
  FLESH_TECHNIQUE_EXTRAPOLATION = 1 << 15,
  /* The first iterate of a free body continues its rigid motion. */
  FLESH_TECHNIQUE_RIGID_GUESS = 1 << 16,
  FLESH_TECHNIQUES_ALL = (1 << 17) - 1
} flesh_technique;

/* "watchdog", as in a scene's list `techniques`; NULL where `technique` is not one of the enum's single bits. */
FLESH_API const char *flesh_technique_name(flesh_technique technique);
/* The technique's effect in a few words, without a full stop; NULL likewise. */
FLESH_API const char *flesh_technique_doc(flesh_technique technique);

typedef struct flesh_solver_options {
  /* Converged when ||r||_2 over the free dofs <= newton_tolerance * max(||applied load||,
   * first), or r is at rounding. The load is that of the current iterate; `first` is ||r||_2 at
   * the first iterate, but at most the largest ||r_e||_2 at the current one: of the load (over
   * the free dofs) and of each other effect e, inertia included (over the free dofs; over all of
   * them where it couples nodes, so that reactions count). Where no load acts and that is less
   * than ten times ||r||_2, so that nothing balances, `first` is at most the larger of it and
   * the force that strains an edge by its own length.
   * The mean of J of an incompressible tet is then within a hundredth of newton_tolerance of 1 at the end of a step, or
   * within newton_tolerance where a further correction changes no force by more than that. */
  double newton_tolerance;
  double linear_tolerance; /* residual reduction of each linear solve */
  /* Iterations per solve; every 300 of them must gain at least a tenth of what has been gained (of
   * potential), else the solve ends there. */
  int max_newton;
  /* Iterations per linear solve. A linear solve that does not converge in so many, and all further
   * ones of the nonlinear solve, are done by a factorisation, as long as that takes no more arithmetic. */
  int max_linear;
  int max_cutbacks;        /* how often a failing step (or load increment) may be halved */
  flesh_linear_solver linear_solver;
  flesh_preconditioner preconditioner;
  flesh_eigenvalue_filter eigenvalue_filter;
  flesh_line_search line_search;
  /* 1: a solve that ends at max_newton counts all the same, as in programs that take a fixed number
   * of iterations per step; it is counted in flesh_solve_stats. 0: such a step is retried and
   * fails. */
  int accept_unconverged;
  /* Bits of flesh_technique; FLESH_TECHNIQUES_ALL. */
  unsigned techniques;
  /* Threads of a solve, 0: one for each processor this process may use. Results do not depend on
   * it. */
  int threads;
  /* How often at most a stage of a step is solved, each time with what is lagged (normal forces and
   * directions behind friction, follower loads) as the last solve's end has it, until that changes
   * no residual by more than the tolerance. 0: as often as the method keeps its order, that is once by
   * methods of order 1, else twice, and while friction is off by a hundredth of contact's forces, as at
   * impacts, up to four times; where errors choose steps, friction's lag counts as an error in its
   * stead. 1: friction goes by the step before; what follows the shape (FLESH_IS_FOLLOWER_LOAD) is
   * solved as by 0. FLESH_METHOD_IDA lags nothing, and statics repeats follower loads anyway. */
  int lag_iterations;
} flesh_solver_options;

/* Sets newton_tolerance 1e-4, linear_tolerance 1e-2, max_newton 1200, max_linear 2000, max_cutbacks 8,
 * PCG, the preconditioner and eigenvalue filter AUTO, the line search on the potential, all techniques,
 * threads 1, lag_iterations 0, and accept_unconverged 0. */
FLESH_API void flesh_solver_options_default(flesh_solver_options *options);

/* The equations r(u) = 0 of one solve: how the unknown u [3*n] moves the point from a base,
 * x = x0 + sx u, v = v0 + sv u, a = a0 + sa u, and when. */
typedef struct flesh_stage {
  double t, load;    /* of the point; load is 1 but for load increments */
  /* Fraction of the displacement from x0 to the prescribed positions at t; 1 but for increments. */
  double prescribed_fraction;
  flesh_shift shift; /* sx, sv, sa; its `filter` is not read (the options decide) */
  /* Base of the point, borrowed until the next stage; v0 and a0 may be NULL for zero. */
  const double *x0, *v0, *a0;
  /* The point's lagged state, borrowed too; NULL: x0 (at t), v0 or rest. */
  const double *x_lag, *v_lag;
  double t_lag;
  /* [3*n] m, at t_from: the start of the step, from which obstacles must leave the way to the point free; borrowed;
   * NULL: the lagged state. */
  const double *x_from;
  double t_from;
  /* The state at which effects freeze terms without a potential (flesh_point): 0: where the stage starts, at x0 and v0,
   * as for backward Euler; 1: where flesh_problem_freeze says, x0 and v0 before that. */
  int frozen_at_solution;
  /* Multipliers of the point: [tets] Pa, borrowed, NULL for zero; and the factor on penalties, 0 for 1. */
  const double *multipliers;
  double penalty;
  const double *internal; /* of the point: internal variables of all effects, borrowed; NULL: 0 */
  /* [3*nodes] dofs that stay at x0, beside the constrained ones; borrowed; NULL: none. */
  const uint8_t *held;
} flesh_stage;

/* Figures of one solve, or sums over a step with its halvings. */
typedef struct flesh_solve_stats {
  /* Solves with softened materials count in all of these but `solves`. */
  int solves, newton, linear, assemblies, projections, residuals, potentials;
  int backtracks; /* line-search reductions */
  /* Solves for few nodes alone (nonlinear_elimination); their Newton iterations; and the sum of
   * these, each times its fraction of the elements (an iteration costs about 1.5 times that fraction
   * of one of the whole body). */
  int subdomains, subdomain_newton;
  double subdomain_share;
  int watchdog_steps; /* longer steps that were accepted (watchdog) */
  /* Iterates accepted by the line search whose potential is above that of their solve's first one by
   * more than 1e-12 of the sum of its terms' sizes: none, unless the residual of an effect is not
   * the gradient of its potential. */
  int potential_rises;
  int at_rounding;                  /* solves that ended at rounding above the tolerance */
  int untanglings, untangled_nodes; /* how often tangles were removed, and nodes moved */
  int unconverged;                  /* solves accepted without convergence (accept_unconverged) */
  int linear_single; /* those of `linear` in single precision */
  int multiplier_updates; /* of the pressures of incompressible tets, each followed by a solve */
  int direct; /* linear solves by a direct factorisation, as conjugate gradients did not converge */
  /* 2-norms over the free dofs [N], of the last solve. */
  double residual_first, residual_last, residual_target;
  /* Figures of the integrator: internal steps; those rejected by their error or their gain of energy, and those because
   * Newton's iteration did not converge; order and length [s] of the last one. */
  int steps, rejected, convergence_failures, order;
  /* Steps among `steps` that backward Euler took because a method of order 2, which balances forces before the end of
   * its step, would have ended them inside an obstacle. */
  int impact_steps;
  /* Steps among `steps` that it took because the method's own would have gained energy, however short, or, where errors
   * choose steps, to lead out of a tangle. */
  int damped_steps;
  double h_last;
} flesh_solve_stats;

/* Progress of the step that is being made; for `stop` to report. Newton's iteration is that of the solve under way,
 * with the residual at its last linear solve, N, 0 before the first; FLESH_METHOD_IDA gives t and h of its internal
 * step, and 0 for the rest. */
typedef struct flesh_progress {
  double t, h; /* s; the part of the step that is tried: its start and length */
  int newton;
  long linear; /* iterations of this solve so far */
  double residual, target;
} flesh_progress;

/* The layouts of SUNDIALS' ...PrintAllStats functions: a line `name = value` per figure; a header
 * row of names and a row of values (SUNDIALS has both in one row); the row alone, for the next runs
 * of a table. */
typedef enum flesh_stats_format {
  FLESH_STATS_TABLE,
  FLESH_STATS_CSV,
  FLESH_STATS_CSV_ROW
} flesh_stats_format;

/* Writes *stats to the caller's file. FLESH_ERR_FILE when that fails. The figures of KINSOL and IDA
 * themselves: KINPrintAllStats(flesh_integrator_kinsol(integrator), ...), and so for IDA.
 * Further errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_solve_stats_print(const flesh_solve_stats *stats, flesh_stats_format format,
                                      FILE *file);

#ifdef __cplusplus
}
#endif
#endif
