/* direction.h: solves K p = b for the direction of a Newton step: true or filtered Hessian, by preconditioned conjugate
 * gradients or a direct factorisation. Its callers decide which Hessian, how exactly and when to factor again. */
#ifndef FLESH_NEWTON_DIRECTION_H
#define FLESH_NEWTON_DIRECTION_H

#include "newton/equations.h"
#include "linear/direct.h"
#include "linear/linear.h"
#include "system/inertia_modulus.h"
#include "system/stiff_rows.h"

typedef enum flesh_direction_kind {
  FLESH_DIRECTION_NEWTON,            /* of the true Hessian */
  FLESH_DIRECTION_FILTERED,          /* of the Hessian without its elements' negative eigenvalues */
  FLESH_DIRECTION_NEGATIVE_CURVATURE /* of the true Hessian, downhill along negative curvature that it met */
} flesh_direction_kind;

/* The request for one solve. */
typedef struct flesh_direction_request {
  double tolerance;      /* N, of the residual's 2-norm */
  int max_iterations;
  int follow_curvature;  /* negative curvature of the true Hessian is followed, not refused */
  int gives_way;         /* the solve ends once it has cost as much as the fallback's factor */
  const double *weights; /* [n] of the residual; NULL: ones */
  int (*stop)(void *data); /* NULL: not asked. A status that is not FLESH_OK ends the solve with it. */
  void *stop_data;
} flesh_direction_request;

typedef struct flesh_direction {
  flesh_equations *equations; /* borrowed */
  const flesh_linear *linear;
  flesh_preconditioner_data *preconditioner;
  flesh_stiff_rows rows;    /* of K as last assembled, where the preconditioner may take them out; else all zero */
  double inertia;           /* kg/m, as system/inertia_modulus.h has it; 0 without rows */
  flesh_pcg_space *pcg;     /* NULL with a direct solver */
  flesh_direct *direct;     /* NULL with PCG */
  flesh_exact *fallback;    /* of linear solves that PCG cannot end; NULL: none was needed, or it costs too much */
  /* At hand: a solve has been so long that what a factor costs is worth knowing. Called: a solve of the stage gave way. In
   * use: so did another, or one has come to its last iteration, and the stage goes on by factors. */
  enum {
    FLESH_FALLBACK_TOO_EXPENSIVE = -1, FLESH_FALLBACK_UNUSED, FLESH_FALLBACK_AT_HAND, FLESH_FALLBACK_CALLED,
    FLESH_FALLBACK_IN_USE
  } fallback_state;
  flesh_eigenvalue_filter filter;   /* of K as last assembled */
  int patterns;             /* of the equations, when solvers were made */
  int assembled, prepared;  /* K has been, in some stage; what was factored is one of its K */
  /* K's number, counted as it changes; the numbers of the one that PCG has rounded and of the one that the fallback has
   * factored. */
  unsigned matrix, rounded_matrix, factor_matrix;
  int by_factor;            /* the fallback has made the last solve, which leaves no residual */
  int single;               /* the preconditioner's K is one that PCG may round to single precision */
  /* PCG's iterations per decade of reduction with the preconditioner when it was new, of solves by few decades and by
   * many (0: not known), and how many more than that the solves since then have taken in all. */
  double iterations_per_decade[2], excess_iterations;
  float *factored;          /* [nodes] N/m, sums of the diagonal of the K that was factored; NULL: no effect couples
                             * nodes that come near each other */
  int iterations;           /* of the last step's solves */
  double residual;          /* N, at the last solve's end */
} flesh_direction;

/* Lists the system's stiff rows. FLESH_ERR_MEMORY. To be cleared also when it fails. */
int flesh_direction_init(flesh_equations *equations, flesh_direction *direction);
/* Keeps the stiff rows where the preconditioner is to take them out in some stage, with figures of all ranks' rows.
 * Collective. */
void flesh_direction_unite_rows(flesh_direction *direction);
/* Makes the solvers for the pattern that K has, which the next solve tries again if there is no memory for them; `before`:
 * the status of what the rank has made since ranks agreed. Collective, and fails on all ranks or none: FLESH_ERR_ARGUMENT
 * where the options ask for a solver that is not built in, FLESH_ERR_MEMORY. */
int flesh_direction_make_solvers(flesh_direction *direction, int before);
void flesh_direction_clear(flesh_direction *direction);

/* A new stage: a direct fallback is no longer in use, and stiff rows are taken out or left in as the stage asks for. */
void flesh_direction_begin_stage(flesh_direction *direction);

/* Makes solvers anew where K has got another pattern: what was factored is lost. FLESH_ERR_MEMORY. */
int flesh_direction_follow_pattern(flesh_direction *direction);
/* Assembles K at u [n] with the filter. */
int flesh_direction_assemble(flesh_direction *direction, const double *u, flesh_eigenvalue_filter filter);
/* K is another matrix than flesh_direction_assemble made. */
void flesh_direction_overwritten(flesh_direction *direction);
/* Factors K, or makes its preconditioner; `single`: PCG may round K. FLESH_NOT_POSITIVE where a direct solver finds it
 * indefinite. */
int flesh_direction_factor(flesh_direction *direction, int single);

/* How many nodes are at least twice as stiff in K as in what was factored, or half: what touches or parts. */
int flesh_direction_stiffened(const flesh_direction *direction);

/* K p = b [n] with what was factored; b is not touched. FLESH_OK with the direction's kind; FLESH_NOT_CONVERGED, p
 * being the last iterate; FLESH_NOT_POSITIVE where K is indefinite and that is not followed. */
int flesh_direction_solve(flesh_direction *direction, const flesh_direction_request *request, const double *b,
                          double *p, flesh_direction_kind *kind);
/* Solves K p = b by a direct factorisation: meshes and materials so uneven that the preconditioner has lost its accuracy.
 * FLESH_NOT_CONVERGED where a factor costs more than max_linear iterations of PCG. */
int flesh_direction_solve_directly(flesh_direction *direction, const double *b, double *p);

/* z = P^-1 z [n] with what was factored. Overwrites the equations' scratch. */
int flesh_direction_precondition(flesh_direction *direction, double *z);

/* || r - (K p + r_before) ||_2 of the last solve's p: how far r [n] is from what the linear model predicts where p
 * leads; ||r||_2 where a factor has solved. */
double flesh_direction_model_error(const flesh_direction *direction, const double *r);

#endif
