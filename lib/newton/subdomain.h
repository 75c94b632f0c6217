/* subdomain.h: minimises a stage's potential over the few nodes that carry its residual, all others constrained. */
#ifndef FLESH_NEWTON_SUBDOMAIN_H
#define FLESH_NEWTON_SUBDOMAIN_H

#include "base/memory.h"
#include "newton/equations.h"

/* May end a solve from outside: stop(data); NULL where nobody is asked. */
typedef struct flesh_stop {
  int (*stop)(void *data);
  void *data;
} flesh_stop;

/* A solver for the stages of systems of few nodes. */
typedef struct flesh_stage_solver {
  void *data;
  /* Solves the stage from u = 0: u [3*nodes], also the last iterate after FLESH_NOT_CONVERGED. Adds to *stats. The
   * calling thread is in the reserve that the system is in; nothing of it may stay in use. NULL: there is none. */
  int (*solve)(void *data, const flesh_system *system, const flesh_solver_options *options, const flesh_stage *stage,
               flesh_stop stop, flesh_solve_stats *stats, double *u);
} flesh_stage_solver;

/* The whole of which the subdomain is a part. All is borrowed. */
typedef struct flesh_subdomain_parent {
  const flesh_equations *equations;
  const flesh_solver_options *options;
  const double *u_matrix; /* [n] near where K was assembled, ... */
  flesh_eigenvalue_filter filter; /* ... with this filter */
  flesh_stage_solver solver;
  flesh_reserve *reserve; /* of flesh_subdomain_reserve: where all is made */
  flesh_stop stop;
  flesh_solve_stats *stats;
} flesh_subdomain_parent;

/* Room for the largest subdomain of the system, solved with PCG. Returns new; NULL: no memory. */
flesh_reserve *flesh_subdomain_reserve(const flesh_system *system);

/* w [n], 0 but at the subdomain's nodes, so that u + w decreases an approximate potential, with a model of what is no sum
 * over elements; the caller checks the true one. r [n] is the residual at u, which is near u_matrix. FLESH_OK;
 * FLESH_NOT_CONVERGED where the subdomain would be no small part of the body; < 0: errors, also where the reserve is
 * full. Counts in the parent's stats. Collective: of a body that ranks share out each has a subdomain of its own, and
 * FLESH_NOT_CONVERGED is of all of them. */
int flesh_subdomain_solve(const flesh_subdomain_parent *parent, const double *u, const double *r, double *w);

#endif
