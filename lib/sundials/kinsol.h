/* kinsol.h: owns a KINSOL and solves stages with it. */
#ifndef FLESH_SUNDIALS_KINSOL_H
#define FLESH_SUNDIALS_KINSOL_H

#include "base/archive.h"
#include "flesh/kinsol.h"
#include "flesh/state.h"
#include "newton/newton.h"

enum { FLESH_KINSOL_CLONES = 8 }; /* as many vectors as KINInit clones, or more */

typedef struct flesh_nonlinear {
  flesh_newton *newton; /* the iteration that solves, the problem's; its evaluation is the run's */
  double *u;            /* [3*n] the solution of the last solve, or its last iterate */
  void *kinsol;
  /* The rest is kinsol.c's. */
  flesh_problem *problem;
  SUNContext context;
  SUNMatrix matrix;
  SUNLinearSolver solver;
  N_Vector unknowns, scale; /* the vector of u; the weights of residuals */
  struct flesh_nonlinear *subdomain_solver; /* NULL: there is no nonlinear elimination */
  /* All vectors of KINSOL in a solver of subdomains, whose problem is another every time. */
  N_Vector vectors[FLESH_KINSOL_CLONES + 2];
  int vector_count;
} flesh_nonlinear;

/* Fails on all ranks or none. */
int flesh_nonlinear_create(const flesh_system *system, const flesh_solver_options *options,
                           flesh_nonlinear **nonlinear);
/* Does the same unless a rank comes with a `status` other than FLESH_OK, of what it has made before. */
int flesh_nonlinear_create_after(int status, const flesh_system *system, const flesh_solver_options *options,
                                 flesh_nonlinear **nonlinear);
void flesh_nonlinear_destroy(flesh_nonlinear **nonlinear);

/* Solves the stage from u = 0, or from the one of `guesses` (each [3*n]; NULL ends them; may be NULL) that has the
 * lowest potential, where that is lower; a solve that meets its iteration limit goes on as many times as
 * `extensions` says. FLESH_NOT_CONVERGED; FLESH_UNDEFINED or FLESH_NONFINITE when the start has no residual. Adds to
 * *stats. */
int flesh_nonlinear_solve(flesh_nonlinear *nonlinear, const flesh_stage *stage, const double *const *guesses,
                          int extensions, flesh_solve_stats *stats);
/* From now on norms of residuals are by these weights [3*n], which are copied; NULL: by ones. */
void flesh_nonlinear_set_weights(flesh_nonlinear *nonlinear, const double *weights);
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

/* Drops what earlier solves have left; the memories of effects stay. */
void flesh_nonlinear_forget(flesh_nonlinear *nonlinear);
/* Archives the memory that lasts from solve to solve. FLESH_ERR_MEMORY. */
int flesh_nonlinear_archive(flesh_nonlinear *nonlinear, flesh_archive *archive);

#endif
