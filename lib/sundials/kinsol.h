/* kinsol.h: owns a KINSOL and solves stages with it. */
#ifndef FLESH_SUNDIALS_KINSOL_H
#define FLESH_SUNDIALS_KINSOL_H

#include "base/archive.h"
#include "flesh/kinsol.h"
#include "flesh/state.h"
#include "newton/newton.h"

enum { FLESH_KINSOL_CLONES = 8 }; /* number of vectors that KINInit clones, or more */

typedef struct flesh_nonlinear {
  flesh_newton *newton; /* the problem's iteration, which solves; its evaluation is the run's */
  double *u;            /* [3*n] solution of the last solve, or its last iterate */
  void *kinsol;
  /* The rest is private to kinsol.c. */
  flesh_problem *problem;
  SUNContext context;
  SUNMatrix matrix;
  SUNLinearSolver solver;
  N_Vector unknowns, scale; /* the vector of u; the weights of residuals */
  struct flesh_nonlinear *subdomain_solver; /* NULL: there is no nonlinear elimination */
  /* All vectors of KINSOL in a solver for subdomains, whose problem changes every time. */
  N_Vector vectors[FLESH_KINSOL_CLONES + 2];
  int vector_count;
} flesh_nonlinear;

/* Makes a KINSOL with its problem. Fails on all ranks or none. */
int flesh_nonlinear_create(const flesh_system *system, const flesh_solver_options *options,
                           flesh_nonlinear **nonlinear);
/* Does the same unless a rank passes a `status` other than FLESH_OK from earlier work. */
int flesh_nonlinear_create_after(int status, const flesh_system *system, const flesh_solver_options *options,
                                 flesh_nonlinear **nonlinear);
void flesh_nonlinear_destroy(flesh_nonlinear **nonlinear);

/* Solves the stage from u = 0, or from the one of `guesses` (each [3*n]; ended by NULL; may be NULL) with the lowest
 * potential, if that is lower; a solve that meets its iteration limit continues up to `extensions` times.
 * FLESH_NOT_CONVERGED; FLESH_UNDEFINED or FLESH_NONFINITE when the start has no residual. Adds to *stats. */
int flesh_nonlinear_solve(flesh_nonlinear *nonlinear, const flesh_stage *stage, const double *const *guesses,
                          int extensions, flesh_solve_stats *stats);
/* Sets the weights [3*n] of residuals in their norms, which are copied; NULL: ones. */
void flesh_nonlinear_set_weights(flesh_nonlinear *nonlinear, const double *weights);
/* Computes energies [effects], J, at x, v [3*n] and t. FLESH_OK when every energy has a value. */
int flesh_nonlinear_defined(flesh_nonlinear *nonlinear, double t, const double *x, const double *v, double *energies,
                            flesh_solve_stats *stats);

/* Whether everything that could limit steps is too far from the lagged state and from the solution. For use after a
 * successful solve. */
int flesh_nonlinear_is_clear(const flesh_nonlinear *nonlinear);

/* Return the stage's point, which is valid until the next call, and the reactions, N, at the dofs `constrained` [*count].
 * For use after a successful solve. */
flesh_point flesh_nonlinear_point(flesh_nonlinear *nonlinear);
const double *flesh_nonlinear_reactions(const flesh_nonlinear *nonlinear, const int **constrained, int *count);

/* Drops the matrices and statistics of earlier solves; the caches of effects stay. */
void flesh_nonlinear_forget(flesh_nonlinear *nonlinear);
/* Archives the memory that lasts from solve to solve. FLESH_ERR_MEMORY. */
int flesh_nonlinear_archive(flesh_nonlinear *nonlinear, flesh_archive *archive);

#endif
