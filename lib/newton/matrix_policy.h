/* matrix_policy.h: decides when an older K or preconditioner is kept, and how exactly and in which precision linear systems
 * are solved: everything that depends on the age of a matrix. */
#ifndef FLESH_NEWTON_MATRIX_POLICY_H
#define FLESH_NEWTON_MATRIX_POLICY_H

#include "newton/direction.h"

typedef struct flesh_matrix_policy {
  flesh_equations *equations;          /* borrowed */
  flesh_direction *direction;          /* borrowed */
  float *inertia;           /* [n] diagonal of the mass matrix; NULL with a direct solver */
  int stage_continues;      /* the next stage continues smoothly from this one, so that it may keep K and preconditioner */
  flesh_shift prepared_for; /* the shift that the preconditioner was made for */
  int kept;                 /* K is that of an earlier iterate of the stage, and so is its factor */
  /* Number of stages since K was assembled (-1: K is no stage's matrix), and K's model error per stage of age, relative to
   * the residual before (0: not known). */
  int age;
  double drift;
  /* For kept matrices: the factor by which a model error may exceed its prediction, and the predicted next one. */
  double safety_factor, predicted_error;
  double curvature;     /* 1/N, model error of a new K over the square of the residual before (0: not known) */
  double target;        /* N, target of the nonlinear solve; 0: not known */
  double previous_norm; /* N, norm of the residual at the previous linear solve of the stage; 0 at first */
  double smallest_norm; /* N, smallest norm of the residual at the linear solves of the stage; 0 at first */
  /* N, round-off of the residual when last measured at the stage's shift (in statics, in this stage); 0: not yet */
  double round_off;
} flesh_matrix_policy;

/* FLESH_ERR_MEMORY. */
int flesh_matrix_policy_init(flesh_equations *equations, flesh_direction *direction, flesh_matrix_policy *policy);
/* Finds the inertia at rest for each dof, once all ranks have room; 0 where it has no value, so that nothing is rounded. */
void flesh_matrix_policy_measure(flesh_matrix_policy *policy);
void flesh_matrix_policy_clear(flesh_matrix_policy *policy);

/* Starts a new stage that has been set. `constraints_changed`: other dofs are constrained than before; `last`: counts of
 * the previous stage. */
void flesh_matrix_policy_begin_stage(flesh_matrix_policy *policy, int constraints_changed,
                                     const flesh_solve_stats *last);
/* Measures the model error of K where the stage ends, at u [n]. */
void flesh_matrix_policy_end_stage(flesh_matrix_policy *policy, const double *u);

/* Whether to keep K, assembled at an earlier iterate of this stage or of one that it continues, at an iterate with the
 * residual r [n]: if its predicted model error is so small that the iteration reaches the target in as many steps as with a
 * new K, or in one more. `usable`: the last direction was a plain Newton one. */
int flesh_matrix_policy_keep(flesh_matrix_policy *policy, int usable, const double *r);
/* Notes that K has been assembled anew, for this stage's equations. */
void flesh_matrix_policy_assembled(flesh_matrix_policy *policy);
/* Notes that K holds another matrix than the stage's. */
void flesh_matrix_policy_overwritten(flesh_matrix_policy *policy);

/* Factors K, or makes its preconditioner. */
int flesh_matrix_policy_refresh(flesh_matrix_policy *policy);
/* Prepares the solves like flesh_matrix_policy_refresh, but keeps the preconditioner of an earlier iterate until the excess
 * iterations due to its age have cost as much as a new one. */
int flesh_matrix_policy_prepare(flesh_matrix_policy *policy);

/* Returns the tolerance [N] of a linear solve at a residual of `norm`, given the `tolerance` asked for. */
double flesh_matrix_policy_tolerance(flesh_matrix_policy *policy, double norm, double tolerance);
/* Whether a residual of `norm` at u [n] may be round-off alone. */
int flesh_matrix_policy_at_round_off(flesh_matrix_policy *policy, double norm, const double *u);

#endif
