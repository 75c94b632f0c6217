/* direction.h: solves K p = b for the direction of a Newton step, with the true or the filtered Hessian, by preconditioned
 * conjugate gradients or a direct factorisation. Its callers choose the Hessian, the tolerance and when to factor again. */
#ifndef FLESH_NEWTON_DIRECTION_H
#define FLESH_NEWTON_DIRECTION_H

#include "newton/equations.h"
#include "linear/direct.h"
#include "linear/linear.h"
#include "system/inertia_modulus.h"
#include "system/stiff_rows.h"

typedef enum flesh_direction_kind {
  FLESH_DIRECTION_NEWTON,            /* by the true Hessian */
  FLESH_DIRECTION_FILTERED,          /* by the Hessian without negative eigenvalues of its elements */
  FLESH_DIRECTION_NEGATIVE_CURVATURE /* by the true Hessian, downhill along directions of negative curvature */
} flesh_direction_kind;

/* The request for one solve. */
typedef struct flesh_direction_request {
  double tolerance;      /* N, for the 2-norm of the residual */
  int max_iterations;
  int follow_curvature;  /* 1: negative curvature of the true Hessian is followed; 0: it is refused */
  int gives_way;         /* 1: the solve ends once it has cost as much as factoring the fallback */
  const double *weights; /* [n] weights of the residual; NULL: ones */
  /* Asked during the solve, which ends with its status unless that is FLESH_OK; NULL: not asked. */
  int (*stop)(void *data);
  void *stop_data;
} flesh_direction_request;

typedef struct flesh_direction {
  flesh_equations *equations; /* borrowed */
  const flesh_linear *linear;
  flesh_preconditioner_data *preconditioner;
  /* Stiff rows of K as last assembled, if the preconditioner may project them out; else all zero. */
  flesh_stiff_rows rows;
  double inertia;           /* kg/m, see system/inertia_modulus.h; 0 without stiff rows */
  flesh_pcg_space *pcg;     /* NULL with a direct solver */
  flesh_direct *direct;     /* NULL with PCG */
  /* Factorisation for linear solves that PCG cannot finish; NULL: none was needed, or it is too expensive. */
  flesh_exact *fallback;
  /* AT_HAND: a solve took so long that the cost of a factorisation is worth knowing. CALLED: one solve of the stage was
   * handed to the fallback. IN_USE: a second one was, or one reached its last iteration, and the stage continues with the
   * fallback. */
  enum {
    FLESH_FALLBACK_TOO_EXPENSIVE = -1, FLESH_FALLBACK_UNUSED, FLESH_FALLBACK_AT_HAND, FLESH_FALLBACK_CALLED,
    FLESH_FALLBACK_IN_USE
  } fallback_state;
  flesh_eigenvalue_filter filter;   /* filter of K as last assembled */
  int patterns;             /* number of patterns that the equations had had when the solvers were made */
  int assembled, prepared;  /* 1: K has been assembled, in some stage; 1: one of its K has been factored */
  /* Number of K, counted up when it changes, and the numbers of the K that PCG has rounded and that the fallback has
   * factored. */
  unsigned matrix, rounded_matrix, factor_matrix;
  int by_factor;            /* 1: the last solve was by the fallback, which leaves no residual */
  int single;               /* 1: PCG may round the preconditioner's K to single precision */
  /* PCG's iterations per decade of reduction with the preconditioner when it was new, for solves by few decades and by many
   * (0: not known), and the sum of the excess over that in all solves since. */
  double iterations_per_decade[2], excess_iterations;
  /* [nodes] N/m, sum of each node's diagonal in the K that was factored; NULL: no effect couples nodes that come near each
   * other. */
  float *factored;
  int iterations;           /* iterations of the last step's linear solves */
  double residual;          /* N, at the end of the last solve */
} flesh_direction;

/* Lists the system's stiff rows. Clear it also after a failure. FLESH_ERR_MEMORY. */
int flesh_direction_init(flesh_equations *equations, flesh_direction *direction);
/* Keeps the stiff rows if the preconditioner may project them out in some stage, and makes their figures those of all
 * ranks. Collective. */
void flesh_direction_unite_rows(flesh_direction *direction);
/* Makes the solvers for K's present pattern; without memory for them, the next solve tries again. `before`: the status of
 * what this rank has done since ranks last agreed. Collective, and fails on all ranks or none: FLESH_ERR_ARGUMENT where the
 * options ask for a solver that is not built in, FLESH_ERR_MEMORY. */
int flesh_direction_make_solvers(flesh_direction *direction, int before);
void flesh_direction_clear(flesh_direction *direction);

/* Starts a new stage: a direct fallback is no longer in use, and the stage decides whether stiff rows are projected out. */
void flesh_direction_begin_stage(flesh_direction *direction);

/* Makes new solvers if K has a new pattern; the factors are then lost. FLESH_ERR_MEMORY. */
int flesh_direction_follow_pattern(flesh_direction *direction);
/* Assembles K at u [n] with the filter. */
int flesh_direction_assemble(flesh_direction *direction, const double *u, flesh_eigenvalue_filter filter);
/* Notes that K is no longer the matrix that flesh_direction_assemble made. */
void flesh_direction_overwritten(flesh_direction *direction);
/* Factors K, or makes its preconditioner; `single`: PCG may round K. FLESH_NOT_POSITIVE where a direct solver finds K
 * indefinite. */
int flesh_direction_factor(flesh_direction *direction, int single);

/* Returns the number of nodes whose stiffness in K is at least twice that in the factored matrix, or at most half, because
 * they have come into or lost contact. */
int flesh_direction_stiffened(const flesh_direction *direction);

/* Solves K p = b [n] with the current factors; b is kept. FLESH_OK with the direction's kind; FLESH_NOT_CONVERGED with the
 * last iterate as p; FLESH_NOT_POSITIVE where K is indefinite and negative curvature is not followed. */
int flesh_direction_solve(flesh_direction *direction, const flesh_direction_request *request, const double *b,
                          double *p, flesh_direction_kind *kind);
/* Solves K p = b by a direct factorisation, for meshes and materials so uneven that the preconditioner has lost its
 * accuracy. FLESH_NOT_CONVERGED where a factorisation costs more than max_linear iterations of PCG. */
int flesh_direction_solve_directly(flesh_direction *direction, const double *b, double *p);

/* Computes z = P^-1 z [n] with the current factors. Overwrites the equations' scratch. */
int flesh_direction_precondition(flesh_direction *direction, double *z);

/* Returns || r - (K p + r_before) ||_2 for the last solve's p: the error of the linear model's prediction of the residual r
 * [n] at the end of p; ||r||_2 after a solve by the fallback. */
double flesh_direction_model_error(const flesh_direction *direction, const double *r);

#endif
