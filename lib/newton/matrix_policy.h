/* matrix_policy.h: when an older K or its preconditioner is kept, how exactly linear systems are solved, and whether in
 * single precision: everything that depends on the age of a matrix is here. */
#ifndef FLESH_NEWTON_MATRIX_POLICY_H
#define FLESH_NEWTON_MATRIX_POLICY_H

#include "newton/direction.h"

typedef struct flesh_matrix_policy {
  flesh_equations *equations;          /* borrowed */
  flesh_direction *direction;          /* borrowed */
  float *inertia;           /* [n] diagonal of the mass matrix; NULL: with a direct solver */
  int stage_continues;      /* the next stage continues smoothly from this one: what was prepared may be kept for it */
  flesh_shift prepared_for; /* the shift that the preconditioner was made for */
  int kept;                 /* K is that of an earlier iterate of the stage, and its factor is kept, too */
  /* How many stages ago K was assembled (-1: it is no stage's matrix), and its model error per stage of age, over the
   * residual before (0: not known). */
  int age;
  double drift;
  /* For kept matrices: the factor by which a model error may exceed its prediction, and the predicted next one. */
  double safety_factor, predicted_error;
  double curvature;     /* 1/N, the model error of a new K, over the square of the residual before (0: not known) */
  double target;        /* N, of the nonlinear solve; 0: not known */
  double previous_norm; /* N, of the residual at the linear solve before this one of the same stage; 0 at first */
  double smallest_norm; /* N, of the residuals at the linear solves of the stage; 0 at first */
  double round_off;     /* N, of the residual, as last measured at the stage's shift, in statics in the stage; 0: not yet */
} flesh_matrix_policy;

/* FLESH_ERR_MEMORY. */
int flesh_matrix_policy_init(flesh_equations *equations, flesh_direction *direction, flesh_matrix_policy *policy);
/* Finds the inertia at rest, dof by dof, once all ranks have room; 0 where it has no value, so that nothing is rounded. */
void flesh_matrix_policy_measure(flesh_matrix_policy *policy);
void flesh_matrix_policy_clear(flesh_matrix_policy *policy);

/* A new stage has been set. `constraints_changed`: other dofs are constrained than before; `last`: what the stage
 * before it took. */
void flesh_matrix_policy_begin_stage(flesh_matrix_policy *policy, int constraints_changed,
                                     const flesh_solve_stats *last);
/* The stage ends at u [n]: measures the model error of K. */
void flesh_matrix_policy_end_stage(flesh_matrix_policy *policy, const double *u);

/* Whether K, assembled at an earlier iterate of this stage or of one that it continues, is kept where the residual is
 * r [n]: when its predicted model error is so small that the iteration reaches the target in as many steps as with a new
 * K, or in one more. `usable`: the last direction was a plain Newton one. */
int flesh_matrix_policy_keep(flesh_matrix_policy *policy, int usable, const double *r);
/* K has been assembled anew, for this stage's equations. */
void flesh_matrix_policy_assembled(flesh_matrix_policy *policy);
/* K holds another matrix than the stage's. */
void flesh_matrix_policy_overwritten(flesh_matrix_policy *policy);

/* Factors K, or makes its preconditioner. */
int flesh_matrix_policy_refresh(flesh_matrix_policy *policy);
/* Like flesh_matrix_policy_refresh without keeping the older one: a preconditioner of an earlier iterate is kept until
 * the excess iterations due to its age have cost as much as a new one. */
int flesh_matrix_policy_prepare(flesh_matrix_policy *policy);

/* The tolerance [N] of a linear solve at a residual of `norm`, asked for with `tolerance`. */
double flesh_matrix_policy_tolerance(flesh_matrix_policy *policy, double norm, double tolerance);
/* Whether a residual of `norm` at u [n] is one that round-off alone would leave. */
int flesh_matrix_policy_at_round_off(flesh_matrix_policy *policy, double norm, const double *u);

#endif
