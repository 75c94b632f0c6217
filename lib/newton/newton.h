/* newton.h: one Newton iteration, made of its parts: equations, direction, line search, accelerators, matrix policy.
 *
 * The owner of the iteration (KINSOL, through the adapters in lib/sundials) asks for the matrix at an iterate, has it
 * prepared, and takes the step. README.md has the theory. Nothing here depends on SUNDIALS. */
#ifndef FLESH_NEWTON_NEWTON_H
#define FLESH_NEWTON_NEWTON_H

#include "flesh/state.h"
#include "base/memory.h"
#include "newton/line_search.h"
#include "newton/matrix_policy.h"
#include "newton/volume_arc.h"

/* A callback that may end a solve, by returning a negative status. NULL: there is none. */
typedef struct flesh_stop {
  int (*stop)(void *data);
  void *data;
} flesh_stop;

/* A solver for the stages of small systems, of few nodes. */
typedef struct flesh_stage_solver {
  void *data;
  /* Solves the stage from u = 0: u [3*nodes] is the solution, or the last iterate after FLESH_NOT_CONVERGED. Adds to
   * *stats. The calling thread allocates from the system's reserve, and keeps nothing of it. NULL: there is none. */
  int (*solve)(void *data, const flesh_system *system, const flesh_solver_options *options, const flesh_stage *stage,
               flesh_stop stop, flesh_solve_stats *stats, double *u);
} flesh_stage_solver;

/* State of the watchdog in a stage. */
typedef struct flesh_watchdog {
  int cuts;              /* steps cut so far */
  int pause, next_pause; /* number of cuts to ignore before the next try, and after the next failed one */
  double length;         /* largest length of the next try, 2-norm; 0: not known */
} flesh_watchdog;

/* The exact derivative at a solution (tangent.c). */
typedef struct flesh_tangent {
  int known;            /* K is that of the last flesh_newton_factor_tangent */
  /* The preconditioner is that of an earlier K; number of coming K whose preconditioner must be new. */
  int kept, refreshes;
  int has_pivots;       /* K is factored in `pivots` */
  int indefinite;       /* K is solved with by MINRES, as a factorisation is too expensive */
  int patterns;         /* number of patterns that the equations had had when `pivots` was made */
  double most;          /* most operations for factoring `pivots`, which cannot be interrupted */
  flesh_direct *pivots; /* NULL: conjugate gradients, or the options' direct solver, were enough */
} flesh_tangent;

/* Targets of stages. The owner of the iteration sets them between stages. */
typedef struct flesh_newton_goal {
  double target;    /* N, for the residual; 0: it follows from the options */
  double of_first;  /* with a given target, also largest ratio of the residual to the first one, */
  double of_load;   /* and, if there is a load, to the larger of the load and the first residual */
  double node_mass; /* kg, mass of a node: a step whose inertia is at most the target ends the solve; 0: none does */
} flesh_newton_goal;

enum { FLESH_RUNS_FREE = 2 };

/* State of the iterations of one stage. It begins anew with each stage. */
typedef struct flesh_newton_iterations {
  const double *began;   /* the guess at which the stage began, to tell it from others; NULL: u = 0 */
  double first_load;     /* N, norm of the loads at the first iterate; NaN: not known */
  const double *weights; /* [n] weights of the residual in the step's linear solves, borrowed; NULL: ones */
  int must_filter;       /* K turned out indefinite when it was factored */
  int follow_curvature;  /* the next direction follows negative curvature, if there is any */
  double model_ratio;    /* actual over predicted decrease of the last filtered step; NaN: not known */
  flesh_watchdog watchdog;
  int moved_nothing;     /* the last step was cut although even the whole step was below the last digit of positions */
  int at_round_off;      /* a step was 0 because the residual is at round-off */
  int converged_by_step; /* the last step was so short that no other is needed */
  int ran_away;          /* loads stretched an equilibrium without bound, or carried it away (FLESH_RUNS_FREE) */
  int stopped;           /* status that `stop` returned; FLESH_OK: go on */
} flesh_newton_iterations;

typedef struct flesh_newton {
  /* Made once. */
  flesh_solver_options options;
  flesh_threads *threads;
  flesh_stage_solver solver; /* solver of small systems; none: no nonlinear elimination */
  flesh_reserve *reserve;    /* memory of the small systems; NULL: there are none */
  /* Set by the owner. */
  flesh_stop stop;
  flesh_newton_goal goal;
  /* Reset at each stage. */
  flesh_newton_iterations iterations;
  flesh_search search;
  /* Kept from stage to stage; flesh_newton_forget drops it. */
  flesh_solve_stats stats; /* counts of all parts */
  flesh_equations equations;
  flesh_direction direction;
  flesh_volume_arc arc;
  flesh_matrix_policy policy;
  flesh_tangent tangent;
  double edge_force;       /* N, force of the softest edge (system/edge_force.h); NaN: not known yet */
  double *u;               /* [n] iterate of the last flesh_newton_matrix */
  int negative_curvature;  /* the last direction followed negative curvature */
} flesh_newton;

/* Checks that the system can be solved on ranks. FLESH_ERR_ARGUMENT if it is shared out and that is not supported. */
int flesh_newton_check_team(const flesh_system *system, const flesh_solver_options *options);
/* Makes this rank's part, without the others; flesh_newton_init_collective comes next. Borrows `system` (finalized), copies
 * `options`. FLESH_ERR_ARGUMENT for options that are invalid or not built in, FLESH_ERR_MEMORY. The struct must not move
 * afterwards: its parts point to each other. */
int flesh_newton_init_local(const flesh_system *system, const flesh_solver_options *options, flesh_stage_solver solver,
                            flesh_newton *newton);
/* Finishes the initialisation together with the other ranks, unless one has a `status` other than FLESH_OK from
 * flesh_newton_init_local or other work of its caller. Fails on all ranks or none, and then clears `newton`, which may be
 * NULL on a rank whose status is not FLESH_OK. */
int flesh_newton_init_collective(const flesh_system *system, int status, flesh_newton *newton);
/* Initialises locally, then collectively. */
int flesh_newton_init(const flesh_system *system, const flesh_solver_options *options, flesh_stage_solver solver,
                      flesh_newton *newton);
/* Whether these options and this system need a solver of small systems. */
int flesh_newton_uses_elimination(const flesh_system *system, const flesh_solver_options *options);
/* Frees the parts, also after an initialisation that failed. */
void flesh_newton_clear(flesh_newton *newton);
/* Drops matrices, factors and what is known of them; the caches of effects stay. */
void flesh_newton_forget(flesh_newton *newton);
/* Archives the memory that lasts from stage to stage; not during a stage. FLESH_ERR_MEMORY. */
int flesh_newton_archive(flesh_newton *newton, flesh_archive *archive);

/* Returns the status of flesh_stop in this stage, agreed on by all ranks; FLESH_OK: go on. `newton`: a flesh_newton. */
int flesh_newton_asked_to_stop(void *newton);

/* Sets the stage, finds the dofs that are constrained at its time, and clears caches. */
void flesh_newton_set_stage(flesh_newton *newton, const flesh_stage *stage);
/* Sets the frozen state of effects that have one to the point of u [n] (flesh_stage.frozen_at_solution). */
void flesh_newton_freeze(flesh_newton *newton, const double *u);
/* Saves what is known at u [n], where the stage ends. */
void flesh_newton_end_stage(flesh_newton *newton, const double *u);

/* Assembles K at the iterate u [n], or keeps an earlier one. r [n] is the residual there; NULL: always assembles. */
int flesh_newton_matrix(flesh_newton *newton, const double *u, const double *r);
/* Prepares the solves with K. `usable`: K is the one that flesh_newton_matrix made. */
int flesh_newton_prepare(flesh_newton *newton, int usable);
/* Computes the step p [n] from the iterate, where the residual is -b; 0 if that is at round-off. `weights` [n] of the
 * residual in linear solves, or NULL. FLESH_NOT_CONVERGED, FLESH_NOT_POSITIVE: there is no step. */
int flesh_newton_step(flesh_newton *newton, const double *weights, const double *b, double tolerance, double *p);

/* Computes the Newton step q [n] from u, where the residual is -b [n] of the given norm, unscaled, with a matrix assembled
 * there, filtered where it must be, which is then K. Counts as a Newton iteration. */
int flesh_newton_step_from(flesh_newton *newton, const double *u, const double *b, double norm, double *q);

/* Parts of an iteration, in files of their own. */
/* Replaces the accepted step by one of lower potential, if an accelerator proposes one (accelerators.c). */
void flesh_newton_accelerate(flesh_newton *newton, flesh_step *step);
/* Minimises the stage's potential over the few nodes that carry the residual r [n] at u, all others constrained. w [n] is 0
 * elsewhere, and u + w decreases an approximate potential, in which effects that are no sum over elements are replaced by
 * quadratic models; the caller checks the true one. u is near the iterate of K. FLESH_OK; FLESH_NOT_CONVERGED if the nodes
 * are too large a part of the body; < 0: errors, also where the reserve is full. Collective: each rank has a subdomain of
 * its own, and FLESH_NOT_CONVERGED is returned if none has a correction. */
int flesh_subdomain_solve(flesh_newton *newton, const double *u, const double *r, double *w);
/* Makes room for the largest subdomain of the system, solved with PCG. Returns new; NULL: no memory. */
flesh_reserve *flesh_subdomain_reserve(const flesh_system *system);

/* Computes p [n] = K^-1 b to a relative residual of 0.1, without the part that changes volumes held by multipliers; K is
 * that of the last stage, u [n] its last iterate. FLESH_NOT_CONVERGED, with the last iterate, or where b is 0;
 * FLESH_NOT_POSITIVE. Adds to *stats. Overwrites the scratch of the equations. */
int flesh_newton_filter_error(flesh_newton *newton, const double *u, const double *b, double *p, flesh_solve_stats *stats);
/* Removes from the displacement p [n], not 0, the part that changes volumes held by multipliers at the last stage. That
 * part is no error, as steps end where volumes are held: a penalty leaves some of it, and would mistake it for a motion
 * that gets faster as steps get shorter. p is unchanged if it fails. Adds to *stats, overwrites scratch. */
int flesh_newton_keep_volumes(flesh_newton *newton, const double *u, double *p, flesh_solve_stats *stats);

/* Notes that K is no longer a matrix of the iteration: nothing known of it holds. */
void flesh_newton_overwritten(flesh_newton *newton);
/* Makes K at u [n] the exact derivative of the residual, without filter or secants, and factors it. Overwrites what the
 * iteration knows of its matrix. If the stage continues the one before (policy.stage_continues), the preconditioner is kept
 * while it serves. A status > 0 where K has no value; FLESH_ERR_SOLVE with a sentence where it is singular. */
int flesh_newton_factor_tangent(flesh_newton *newton, const double *u);
/* Solves K p = b [n] with that K until ||b - K p||_2 <= tolerance ||b||_2; sets p and b to 0 on constrained dofs. Uses a
 * factorisation with pivots where K is indefinite or conjugate gradients do not converge, or MINRES if that takes more than
 * tangent.most operations. Overwrites the equations' scratch. FLESH_NONFINITE; FLESH_ERR_SOLVE with a sentence. */
int flesh_newton_solve_tangent(flesh_newton *newton, double *b, double tolerance, double *p);

/* Computes the acceleration a [n] with r(t, x, v, a) = 0 over the free dofs, with the state's x, v and multipliers; dofs
 * constrained at t keep their given a. Overwrites K and the caches. Status > 0 where there is none. Adds to *stats. */
int flesh_newton_acceleration(flesh_newton *newton, const flesh_state *state, double t, double *a, flesh_solve_stats *stats);
/* Sets the constrained dofs of x and v [n] to those of x_prescribed and v_prescribed (read there only). Their jump du_c
 * moves the free dofs by M_ff du_f = -M_fc du_c, the limit of a short step (nothing with lumped mass). Overwrites K and the
 * caches. Adds to *stats. */
int flesh_newton_apply_constraint_jump(flesh_newton *newton, double t, const double *x_prescribed,
                                       const double *v_prescribed, double *x, double *v, flesh_solve_stats *stats);

#endif
