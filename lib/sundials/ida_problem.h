/* ida_problem.h: the equations of motion as F(t, y, y') = 0 on plain arrays, for IDA's callbacks, the condensed linear
 * solver and the adaptive integrator. */
#ifndef FLESH_SUNDIALS_IDA_PROBLEM_H
#define FLESH_SUNDIALS_IDA_PROBLEM_H

#include <stdint.h>

#include "flesh/ida.h"
#include "linear/direct.h"
#include "linear/linear.h"
#include "linear/scalar_view.h"
#include "sundials/vector.h"
#include "system/evaluation.h"

/* The content of the matrix K. */
typedef enum flesh_ida_content {
  FLESH_IDA_NOTHING,
  FLESH_IDA_MASS,      /* M, factored */
  FLESH_IDA_CONDENSED, /* K + cj C + cj^2 M */
  FLESH_IDA_APART      /* K alone, and C + cj M in D, as in a 2N x 2N matrix */
} flesh_ida_content;

/* The constraints, and prescribed values at one time. */
typedef struct flesh_ida_constraints {
  double begin, event; /* s; they hold for begin <= t < event */
  int started;         /* 1: the problem has been started, and these constraints are those of the start */
  uint8_t *fixed;      /* [n] */
  double t, *x, *v, *a; /* s, and [n] prescribed values at that time, read where fixed */
} flesh_ida_constraints;

/* The rows of J above those of forces: from_x x + from_v v (cj and -1 when assembled); for constrained dofs, `identity` (1)
 * times x and v. */
typedef struct flesh_ida_rows {
  double from_x, from_v, identity;
} flesh_ida_rows;

/* The Jacobian of the last assembly. */
typedef struct flesh_ida_matrices {
  flesh_ida_content content;
  double cj; /* the cj of K and D */
  flesh_block_matrix *K;
  flesh_block_matrix *D; /* C + cj M, with zero rows and columns of fixed dofs */
  int D_is_diagonal;     /* 1: all blocks off the diagonal are zero now */
  int couples;           /* 1: C or M couples nodes, for which the sparse 2N x 2N pattern then has room */
  flesh_ida_rows rows;
} flesh_ida_matrices;

/* The options' solver for K. */
typedef struct flesh_ida_solver {
  const flesh_linear *linear;
  flesh_preconditioner_data *preconditioner;
  flesh_pcg_space *pcg;
  flesh_direct *direct;
  double *work;           /* [4*n] */
  double *right, *change; /* [n] */
} flesh_ida_solver;

/* K and D as scalar matrices; made when a sparse SUNMatrix is first filled. */
typedef struct flesh_ida_sparse {
  flesh_scalar_view view;
  double *K_values, *D_values;
} flesh_ida_sparse;

/* The last accepted state: the start, then that of the last flesh_ida_accept. A nonlinear solver of flesh (sunnonlinsol.h)
 * lags forces at it, and keeps the way from it clear of obstacles. */
typedef struct flesh_ida_accepted {
  int limits;        /* 1: residuals are refused where an effect limits the straight step from this state */
  long starts;       /* number of starts */
  double t, *x, *v;  /* s, [n], [n] */
} flesh_ida_accepted;

struct flesh_ida_problem {
  flesh_user_data head;        /* first */
  flesh_threads *threads;
  flesh_evaluation evaluation; /* y has twice its n numbers */
  double *room[3];             /* [2*n] each, for vectors of N_VNew_Parallel; NULL without a team */
  flesh_solver_options options;
  struct {
    double length, velocity, mass; /* m, m/s, kg; the mass is 0 where it has no value */
  } scale;
  flesh_ida_constraints constraints;
  flesh_ida_matrices jacobian;
  flesh_ida_solver solver;
  flesh_ida_sparse sparse;
  flesh_ida_accepted accepted;
  int refused; /* status of the last residual or matrix, if it had no value; 0: it had one */
  flesh_solve_stats stats;
};

/* Does what flesh_ida_problem_create does, unless a rank passes a `status` other than FLESH_OK from earlier work. */
int flesh_ida_problem_create_after(int status, const flesh_system *system, const flesh_solver_options *options,
                                   flesh_ida_problem **problem);
/* Do what flesh_vector_read, _open and _close do for vectors of 2*n, with the problem's `room` of that number. */
const double *flesh_ida_read(const flesh_ida_problem *problem, N_Vector v, int partial, int room);
/* Does what flesh_ida_read does for the y of a time that must be finite. NULL, with a sentence, if it is not. */
const double *flesh_ida_read_at(const flesh_ida_problem *problem, double t, N_Vector y);
double *flesh_ida_open(const flesh_ida_problem *problem, N_Vector v, int room);
void flesh_ida_close(const flesh_ida_problem *problem, N_Vector v, const double *written);
/* Refuses a system that is shared out among ranks. FLESH_ERR_ARGUMENT, with a sentence: a SUNSparseMatrix is that of one
 * rank. */
int flesh_ida_check_sparse(const flesh_ida_problem *problem);
/* Makes room for K and D as scalar matrices. FLESH_ERR_MEMORY. */
int flesh_ida_make_sparse(flesh_ida_problem *problem);
/* Returns the point of (t, y, y'), stored in x, v, a; without y' a is 0 on free dofs. */
flesh_point flesh_ida_point(flesh_ida_problem *problem, double t, const double *y, const double *yp);
/* Computes F [2*n] from y [2*n] and yp [2*n]. */
int flesh_ida_evaluate(flesh_ida_problem *problem, double t, const double *y, const double *yp,
                       double *F);
/* Assembles K and D at (t, y, y'): condensed for cj, or apart, as `content` says. */
int flesh_ida_assemble(flesh_ida_problem *problem, double t, double cj, const double *y,
                       const double *yp, flesh_ida_content content);
/* Whether constrained nodes move before the next event, on any rank. */
int flesh_ida_moves(flesh_ida_problem *problem);
/* Records that a step that ends at x, v [n] at t has been accepted. */
void flesh_ida_accept(flesh_ida_problem *problem, double t, const double *x, const double *v);
/* Finds the prescribed values at t, in problem->constraints; at an event, those just before it. Returns the time used. */
double flesh_ida_prescribe(flesh_ida_problem *problem, double t);
/* Splits a condensed K into K and D again (zeros if nothing is assembled), so that J can be added to other matrices. */
void flesh_ida_separate(flesh_ida_problem *problem);
/* Condenses K if it is apart; FLESH_NOT_POSITIVE if there is nothing to condense. */
int flesh_ida_condense(flesh_ida_problem *problem);
/* Prepares the linear solver for K. */
int flesh_ida_factor(flesh_ida_problem *problem);
/* Solves K x = b by the options' method to `tolerance` of |b|; > 0 where that fails. On a part of a body b is collected and
 * x consistent (base/team.h). */
int flesh_ida_solve(flesh_ida_problem *problem, double tolerance, const double *b, double *x);
/* Computes z = J x, all [2*n], with the condensed K and its cj. On a part of a body z is collected. */
void flesh_ida_multiply(flesh_ida_problem *problem, const double *x, double *z);
/* Solves J x = b by the options' solver or, `approximately`, by one application of its preconditioner (or a direct solver).
 * x and b must not overlap. */
int flesh_ida_solve_both(flesh_ida_problem *problem, const double *b, int approximately, double *x);
/* Computes y [n] += scale D v + K x / divisor, collected. x and v [n], which may be the same, are 0 at constrained dofs,
 * and their ghosts are updated. Overwrites n numbers of the solver's work, from n on. */
void flesh_ida_add_products(flesh_ida_problem *problem, double scale, double *v, double divisor, double *x, double *y);
double flesh_ida_scale_of_velocity(flesh_ida_problem *problem);

/* Returns ||y''|| at a start (y, y'), the root mean square over the free dofs in units of L and V [1/s^2], by a difference
 * along the motion over at most a thousandth of the time `ahead` [s]: the error of a step h of order 1 is h^2/2 times it.
 * INFINITY where it has no value. */
double flesh_ida_curvature(flesh_ida_problem *problem, double ahead, N_Vector y, N_Vector yp);

/* Gives L and V of flesh_ida_tolerances. */
void flesh_ida_scales(const flesh_ida_problem *problem, double *length, double *velocity);

#endif
