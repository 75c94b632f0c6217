/* solver.h: options and statistics of the nonlinear solve, without any SUNDIALS type. */
#ifndef FLESH_SOLVER_H
#define FLESH_SOLVER_H

#include <stdio.h>

#include "flesh/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum flesh_linear_solver {
  FLESH_LINEAR_PCG,
  FLESH_LINEAR_KLU,
  FLESH_LINEAR_CHOLMOD /* only where built in */
} flesh_linear_solver;

typedef enum flesh_preconditioner {
  FLESH_PRECONDITIONER_AUTO,      /* two-level, or IC on meshes of a few hundred nodes */
  FLESH_PRECONDITIONER_TWO_LEVEL, /* IC, and displacements trilinear in the cells of a grid */
  FLESH_PRECONDITIONER_IC,        /* incomplete Cholesky on 3x3 blocks, no fill */
  FLESH_PRECONDITIONER_JACOBI, /* inverse of the diagonal blocks */
  FLESH_PRECONDITIONER_NONE
} flesh_preconditioner;

typedef enum flesh_projection {
  FLESH_PROJECTION_DEMAND, /* true Hessian first; projected where it shows negative curvature */
  FLESH_PROJECTION_ALWAYS,
  FLESH_PROJECTION_NEVER
} flesh_projection;

/* What projection makes of an element's negative eigenvalues. */
typedef enum flesh_filtering {
  FLESH_FILTERING_AUTO,     /* trust region in dynamics, absolute values in statics */
  FLESH_FILTERING_CLAMP,    /* zero */
  FLESH_FILTERING_ABSOLUTE, /* absolute values */
  /* Zero after a filtered step whose decrease the quadratic model foretold to a hundredth, else
   * absolute values (Chen et al. 2024, "Trust-Region Eigenvalue Filtering"). */
  FLESH_FILTERING_TRUST_REGION
} flesh_filtering;

typedef enum flesh_globalization {
  /* Full steps guarded by an Armijo search on the incremental potential. */
  FLESH_GLOBALIZATION_ENERGY,
  FLESH_GLOBALIZATION_NONE,  /* plain full Newton steps */
  FLESH_GLOBALIZATION_KINSOL /* KINSOL's own line search on the residual norm */
} flesh_globalization;

typedef struct flesh_solver_options {
  /* Converged when ||r||_2 over the free dofs <= newton_tolerance *
   * max(||r at the first iterate||_2, ||applied load||_2), or r is at rounding. */
  double newton_tolerance;
  double linear_tolerance; /* residual reduction of each linear solve */
  /* Iterations per solve; every 300 of them must gain at least a tenth of what has been gained (of
   * potential), else the solve ends there. */
  int max_newton;
  /* Iterations per linear solve. One that they do not end, and with it the rest of the nonlinear
   * one, is left to a direct factorisation by KLU, as long as that takes no more arithmetic. */
  int max_linear;
  int max_halvings;        /* how often a failing step (or load increment) may be halved */
  flesh_linear_solver linear_solver;
  flesh_preconditioner preconditioner;
  flesh_projection projection;
  flesh_filtering filtering;
  flesh_globalization globalization;
  /* 1: a solve that ends at max_newton counts all the same, as in programs that take a fixed number
   * of iterations per step; it is counted in flesh_solve_stats. 0: such a step is retried and
   * fails. */
  int accept_unconverged;
  /* 1: a calm body whose tets stay inverted or collapsed, or wind once more around an edge, without
   * a load that holds them so, has those nodes placed anew by their neighbours and the rest shape;
   * counted in flesh_solve_stats. A body that is stressed at rest (forms M, C, D) or begins in an
   * exact line or point may collapse. */
  int untangle;
  /* Threads of a solve, 0: one for each processor this process may use. Results do not depend on
   * it. */
  int threads;
  /* 1: a step that lowers the potential more than the quadratic model foretold is lengthened where
   * few nodes carry the residual, after a cut, or after sixteen projected ones like it; where few
   * nodes carry it, PCG then follows the true Hessian downhill along its directions of negative
   * curvature (projection on demand, PCG only). A crease or a tet that turns inside out costs a
   * tenth of the iterations then. 0: never. */
  int follow_curvature;
  /* 1: after a step that lowered the potential otherwise than foretold and left few nodes that
   * carry the residual (a crease again), these and two rings of neighbours, at most a quarter of
   * the body, are solved for alone, all others held; the whole goes on from there if its potential
   * has fallen. 0: never. With FLESH_GLOBALIZATION_ENERGY only. */
  int nonlinear_elimination;
  /* 1: where steps are cut by what is stiff, which a straight step cannot turn, some go beyond, and
   * one or two Newton steps (counted as such) back from there; taken if the potential ends lower
   * than the cut step's (the watchdog technique of Chamberlain et al. 1982). 0: never. With
   * FLESH_GLOBALIZATION_ENERGY only. */
  int watchdog;
} flesh_solver_options;

/* tau 1e-6, eta 1e-2, 1200 Newton, 2000 linear, 8 halvings, PCG, auto, on demand, energy search,
 * unconverged solves refused, untangling, 1 thread, negative curvature followed, nonlinear
 * elimination, watchdog. */
FLESH_API void flesh_solver_options_default(flesh_solver_options *options);

/* What AUTO means for a mesh of so many nodes; any other kind is itself. */
FLESH_API flesh_preconditioner flesh_preconditioner_choose(flesh_preconditioner kind, int nodes);
/* As in a scene. NULL: no such kind. */
FLESH_API const char *flesh_preconditioner_name(flesh_preconditioner kind);

/* Of one solve, or summed over a step with its halvings. */
typedef struct flesh_solve_stats {
  int solves, newton, linear, assemblies, projections, residuals, potentials;
  int backtracks; /* line-search reductions */
  /* Solves for few nodes alone (nonlinear_elimination), and their Newton iterations: as such, and
   * each counted as its elements' share of all (which cost about half as much again as a share of
   * the whole's). */
  int patches, patch_newton;
  double patch_share;
  int detours; /* steps beyond what cut them that were taken (watchdog) */
  /* Iterates accepted by the guard whose potential lies above that of their solve's first one by
   * more than 1e-12 of the sum of its terms' sizes: none, unless an effect's potential and residual
   * differ. */
  int potential_rises;
  int at_rounding;                  /* solves that ended at rounding above the tolerance */
  int untanglings, untangled_nodes; /* how often a calm tangle was put back, and nodes moved */
  int unconverged;                  /* solves accepted without convergence (accept_unconverged) */
  int linear_single; /* those of `linear` in single precision */
  int direct; /* linear solves left to a direct factorisation: conjugate gradients did not end */
  /* 2-norms over the free dofs [N], of the last solve. */
  double residual_first, residual_last, residual_target;
  /* Of the integrator: internal steps, those thrown away because they erred too much, and those
   * because Newton's iterations did not converge; order and length [s] of the last one. */
  int steps, rejected, convergence_failures, order;
  double h_last;
} flesh_solve_stats;

/* The layouts of SUNDIALS' ...PrintAllStats functions: a line `name = value` per figure; a header
 * row of names and a row of values (SUNDIALS has both in one row); the row alone, for the next runs
 * of a table. */
typedef enum flesh_stats_format {
  FLESH_STATS_TABLE,
  FLESH_STATS_CSV,
  FLESH_STATS_CSV_ROW
} flesh_stats_format;

/* Writes *stats to the caller's file. FLESH_ERR_FILE when that fails. The figures of KINSOL and IDA
 * themselves: KINPrintAllStats(flesh_integrator_kinsol(integrator), ...), and so for IDA. */
FLESH_API int flesh_solve_stats_print(const flesh_solve_stats *stats, flesh_stats_format format,
                                      FILE *file);

#ifdef __cplusplus
}
#endif
#endif
