/* newton.h: one Newton iteration, made of its parts: equations, direction, line search, accelerators, matrix policy.
 *
 * The owner of the iteration (KINSOL, by the adapters in lib/sundials) asks for the matrix at an iterate, has it
 * prepared, and takes the step. README.md has the theory. Nothing here depends on SUNDIALS. */
#ifndef FLESH_NEWTON_NEWTON_H
#define FLESH_NEWTON_NEWTON_H

#include "flesh/state.h"
#include "base/memory.h"
#include "newton/line_search.h"
#include "newton/matrix_policy.h"
#include "newton/volume_arc.h"

/* A callback that may end a solve: stop(data) then returns a negative status. NULL: there is none. */
typedef struct flesh_stop {
  int (*stop)(void *data);
  void *data;
} flesh_stop;

/* A solver for the stages of systems of few nodes. */
typedef struct flesh_stage_solver {
  void *data;
  /* Solves the stage from u = 0: u [3*nodes], also the last iterate after FLESH_NOT_CONVERGED. Adds to *stats. The
   * calling thread allocates from the reserve that the system is in, and keeps nothing of it. NULL: there is none. */
  int (*solve)(void *data, const flesh_system *system, const flesh_solver_options *options, const flesh_stage *stage,
               flesh_stop stop, flesh_solve_stats *stats, double *u);
} flesh_stage_solver;

/* The watchdog's memory in a stage. */
typedef struct flesh_watchdog {
  int cuts;              /* steps cut so far */
  int pause, next_pause; /* cuts to let pass before the next try, and after the next that fails */
  double length;         /* of the next try at most, 2-norm; 0: not known */
} flesh_watchdog;

/* The exact derivative at a solution (tangent.c). */
typedef struct flesh_tangent {
  int known;            /* K is that of the last flesh_newton_factor_tangent */
  int kept, refreshes;  /* the preconditioner is that of an earlier one; so many to come are not to be kept */
  int has_pivots;       /* and is factored in `pivots` */
  int indefinite;       /* and is solved with by MINRES, as factors cost too much */
  int patterns;         /* of the equations, when `pivots` was made */
  double most;          /* operations that `pivots` may take, which nothing stops */
  flesh_direct *pivots; /* NULL: conjugate gradients, or the options' direct solver, were enough */
} flesh_tangent;

/* Targets of stages. The owner of the iteration sets them between stages. */
typedef struct flesh_newton_goal {
  double target;    /* N, of the residual; 0: what the options make of it */
  double of_first;  /* the residual falls at least to this share of the first one, where a target is given, */
  double of_load;   /* and, where there is a load, of the larger one of it and of the first residual */
  double node_mass; /* kg of a node: a step whose inertia is at most the target ends a solve; 0: none does */
} flesh_newton_goal;

enum { FLESH_RUNS_FREE = 2 };

/* State of the iterations of one stage. It begins anew with each stage. */
typedef struct flesh_newton_iterations {
  const double *began;   /* the guess that the stage began at, to be told from others; NULL: u = 0 */
  double first_load;     /* N, norm of the loads where the stage began; NaN: not known */
  const double *weights; /* [n] of the residual in the step's linear solves, borrowed; NULL: ones */
  int must_filter;       /* K turned out indefinite in its factorisation */
  int follow_curvature;  /* the next direction follows negative curvature, where there is one */
  int secant_matrices;   /* so many matrices to come have friction's secants, as a step had to be cut */
  double model_ratio;    /* actual over predicted decrease of the last filtered step; NaN: not known */
  flesh_watchdog watchdog;
  int moved_nothing;     /* the last step was cut, and would have moved nothing by a digit if it had not */
  int at_round_off;      /* a step was 0, because the residual is at round-off */
  int converged_by_step; /* the last step was so short that no other one is needed */
  int ran_away;          /* the loads of an equilibrium stretched it without bound, or led it away (FLESH_RUNS_FREE) */
  int stopped;           /* what `stop` returned; FLESH_OK: go on */
} flesh_newton_iterations;

typedef struct flesh_newton {
  /* Made once. */
  flesh_solver_options options;
  flesh_threads *threads;
  flesh_stage_solver solver; /* of the systems of few nodes; none: no nonlinear elimination */
  flesh_reserve *reserve;    /* memory of these systems; NULL: there are none */
  /* Set by the owner. */
  flesh_stop stop;
  flesh_newton_goal goal;
  /* Begins anew with each stage. */
  flesh_newton_iterations iterations;
  flesh_search search;
  /* Lasts from stage to stage; flesh_newton_forget drops it. */
  flesh_solve_stats stats; /* where all parts count */
  flesh_equations equations;
  flesh_direction direction;
  flesh_volume_arc arc;
  flesh_matrix_policy policy;
  flesh_tangent tangent;
  double edge_force;       /* N, of the softest edge (system/edge_force.h); NaN: not known yet */
  double *u;               /* [n] the iterate of K */
  int negative_curvature;  /* the last direction went along it */
} flesh_newton;

/* FLESH_ERR_ARGUMENT where the system is shared out among ranks, and they cannot solve it so yet. */
int flesh_newton_check_team(const flesh_system *system, const flesh_solver_options *options);
/* Makes what this rank needs, without the others; flesh_newton_init_collective comes next. Borrows `system` (finished),
 * copies `options`. FLESH_ERR_ARGUMENT for options that make no sense or are not built in, FLESH_ERR_MEMORY. The struct
 * must not move afterwards: its parts point to each other. */
int flesh_newton_init_local(const flesh_system *system, const flesh_solver_options *options, flesh_stage_solver solver,
                            flesh_newton *newton);
/* Finishes it together with the other ranks, unless one of them comes with a `status` other than FLESH_OK: of
 * flesh_newton_init_local, or of more that its caller has made. Fails on all ranks or none, and clears `newton` then, which
 * may be NULL on a rank whose status is not FLESH_OK. */
int flesh_newton_init_collective(const flesh_system *system, int status, flesh_newton *newton);
/* Both. */
int flesh_newton_init(const flesh_system *system, const flesh_solver_options *options, flesh_stage_solver solver,
                      flesh_newton *newton);
/* Whether such options and such a system need a solver of systems of few nodes. */
int flesh_newton_uses_elimination(const flesh_system *system, const flesh_solver_options *options);
/* Also after an initialisation that failed. */
void flesh_newton_clear(flesh_newton *newton);
/* Drops matrices, factors and what is known of them; the memories of effects stay. */
void flesh_newton_forget(flesh_newton *newton);
/* Archives the memory that lasts from stage to stage; not within one. FLESH_ERR_MEMORY. */
int flesh_newton_archive(flesh_newton *newton, flesh_archive *archive);

/* The answer of flesh_stop in this stage, of all ranks together; FLESH_OK: go on. `newton`: a flesh_newton. */
int flesh_newton_asked_to_stop(void *newton);

/* Sets the stage, finds the dofs that are constrained at its time, and clears what was cached. */
void flesh_newton_set_stage(flesh_newton *newton, const flesh_stage *stage);
/* The frozen state of effects that have one becomes the point of u [n] (flesh_stage.frozen_at_solution). */
void flesh_newton_freeze(flesh_newton *newton, const double *u);
/* Remembers what is known at u [n], where the stage ends. */
void flesh_newton_end_stage(flesh_newton *newton, const double *u);

/* K at the iterate u [n], assembled or kept. r [n] is the residual there; NULL: always assembled. */
int flesh_newton_matrix(flesh_newton *newton, const double *u, const double *r);
/* Prepares the solves with K. `usable`: K is the one that flesh_newton_matrix made. */
int flesh_newton_prepare(flesh_newton *newton, int usable);
/* The step p [n] from the iterate, where the residual is -b: 0 where that is at round-off. `weights` [n] of the
 * residual in linear solves, or NULL. FLESH_NOT_CONVERGED, FLESH_NOT_POSITIVE: there is none. */
int flesh_newton_step(flesh_newton *newton, const double *weights, const double *b, double tolerance, double *p);

/* The Newton step q [n] from u, where the residual is -b [n] of the given norm: with a matrix assembled there, filtered
 * where it must be, and unscaled. It counts as a Newton iteration. Another matrix is then K. */
int flesh_newton_step_from(flesh_newton *newton, const double *u, const double *b, double norm, double *q);

/* Parts of an iteration, in files of their own. */
/* The accepted step becomes one of less potential, where accelerators propose one (accelerators.c). */
void flesh_newton_accelerate(flesh_newton *newton, flesh_step *step);
/* Minimises the stage's potential over the few nodes that carry the residual r [n] at u, all others constrained. w [n] is 0
 * but there, and u + w decreases an approximate potential, with a model of what is no sum over elements. u is near the
 * iterate of K. FLESH_OK; FLESH_NOT_CONVERGED where the nodes would be no small part of the body; < 0: errors, also where
 * the reserve is full. Collective: of a body that ranks share out each has a subdomain of its own, and FLESH_NOT_CONVERGED
 * is of all of them. */
int flesh_subdomain_solve(flesh_newton *newton, const double *u, const double *r, double *w);
/* Room for the largest subdomain of the system, solved with PCG. Returns new; NULL: no memory. */
flesh_reserve *flesh_subdomain_reserve(const flesh_system *system);

/* p [n] = K^-1 b to a tenth, K being that of the last stage, whose last iterate is u [n], without what changes volumes that
 * multipliers hold. FLESH_NOT_CONVERGED, with the last iterate, or where b is 0; FLESH_NOT_POSITIVE. Adds to *stats.
 * Overwrites the scratch of the equations. */
int flesh_newton_filter_error(flesh_newton *newton, const double *u, const double *b, double *p, flesh_solve_stats *stats);
/* Takes from the displacement p [n], not 0, what changes volumes that multipliers hold at the last stage, and is no error, as
 * steps end where these are held: a penalty leaves a part of it, and would take that for a motion that is the faster, the
 * shorter steps are. A status leaves p as it is. Adds and overwrites the like. */
int flesh_newton_keep_volumes(flesh_newton *newton, const double *u, double *p, flesh_solve_stats *stats);

/* K has become another matrix than one of the iteration: nothing that is known of it holds. */
void flesh_newton_overwritten(flesh_newton *newton);
/* K at u [n] becomes the derivative of the residual itself, without filter or secants, and is factored. Overwrites what
 * the iteration knows of its matrix. Of a stage that goes on from the one before (policy.stage_continues) the preconditioner
 * is kept as long as it serves. A status > 0 where K has no value; FLESH_ERR_SOLVE with a sentence where it is singular. */
int flesh_newton_factor_tangent(flesh_newton *newton, const double *u);
/* p [n] = K^-1 b with that, until ||b - K p||_2 <= tolerance ||b||_2; 0 on constrained dofs, and b becomes so. By a
 * factorisation with pivots where K is indefinite or conjugate gradients do not converge; by MINRES where that takes more
 * than tangent.most operations. Overwrites the equations' scratch. FLESH_NONFINITE; FLESH_ERR_SOLVE likewise. */
int flesh_newton_solve_tangent(flesh_newton *newton, double *b, double tolerance, double *p);

/* The acceleration a [n] with r(t, x, v, a) = 0 over the free dofs, x, v and multipliers being the state's; dofs that
 * are constrained at t keep their given a. Overwrites K and the caches. Status > 0 where there is none. Adds to *stats. */
int flesh_newton_acceleration(flesh_newton *newton, const flesh_state *state, double t, double *a, flesh_solve_stats *stats);
/* The constrained dofs of x and v [n] take their prescribed values (read there only); a jump du_c moves the free ones
 * by M_ff du_f = -M_fc du_c, the limit of a short step: nothing with lumped mass. Overwrites and adds the like. */
int flesh_newton_apply_constraint_jump(flesh_newton *newton, double t, const double *x_prescribed,
                                       const double *v_prescribed, double *x, double *v, flesh_solve_stats *stats);

#endif
