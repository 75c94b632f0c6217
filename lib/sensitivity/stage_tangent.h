/* stage_tangent.h: the equations of a stage, linearised at their solution, with the Jacobian and the derivatives by lagged
 * or frozen states that effects read. */
#ifndef FLESH_SENSITIVITY_STAGE_TANGENT_H
#define FLESH_SENSITIVITY_STAGE_TANGENT_H

#include "flesh/sensitivity.h"
#include "sensitivity/coupling.h"
#include "sundials/problem.h"
#include "time/prescribed.h"

typedef struct flesh_stage_tangent {
  const flesh_system *system; /* borrowed */
  int n, multipliers;
  double tolerance;           /* relative tolerance of solves */
  flesh_problem *problem;
  flesh_newton *newton;       /* the problem's */
  flesh_stage stage;          /* its arrays are those that were given, borrowed */
  flesh_point point;          /* point of the solution, at which everything is evaluated */
  double *x, *v, *a;          /* [n] arrays of the point */
  flesh_couplings couplings;
  unsigned follows;           /* bits of flesh_argument whose state is the solution itself */
  double *room;               /* [6*n] */
  const flesh_prescribed *prescribed; /* motion of constrained dofs, borrowed; NULL: as the stage moves them */
  flesh_prescribed others;    /* work space: the same for a parameter's system */
  const double *held;         /* [n] positions at which multipliers enforce constraints: the point's x, or `end` */
  double *end;                /* [n] positions at the end of the step, if the stage is within it */
  double *pressed;            /* [n] in the last solve, the force of the constraints' multipliers, or of their adjoints */
  double *gaps;               /* [9*multipliers] */
  double *directions;         /* work space of solves with followed arguments; NULL: none yet */
  flesh_block_matrix products; /* matrix of K's pattern, with values of its own [product_room] */
  size_t product_room;
} flesh_stage_tangent;

/* Makes a tangent for the finalized system, which it borrows. FLESH_ERR_ARGUMENT for one that ranks share;
 * FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. Clear it also after a failure. */
int flesh_stage_tangent_create(const flesh_system *system, const flesh_solver_options *options, double tolerance,
                               flesh_stage_tangent *tangent);
void flesh_stage_tangent_clear(flesh_stage_tangent *tangent);

/* Linearises the stage (its arrays are borrowed) at u [n]. Multipliers enforce constraints at the stage's point or, for a
 * stage within the step, at tangent->end, which must be set before. FLESH_ERR_SOLVE with a sentence where the Jacobian is
 * singular or has no value; the errors of flesh_couplings_find. */
int flesh_stage_tangent_set(flesh_stage_tangent *tangent, const flesh_stage *stage, const double *u, unsigned follows);

/* Solves dr/du p = b [n], or the transposed system; p is 0 and b is not read on constrained dofs. With multipliers also
 * finds their change q: K p + G_s^T q = b and G_e (p + beside) = 0, where G_s and G_e are the derivatives of the
 * constraints at the stage and at the positions where they are enforced; the two change places in the transposed system.
 * `beside` [n], NULL: 0. FLESH_ERR_SOLVE, FLESH_ERR_MEMORY. */
int flesh_stage_tangent_solve(flesh_stage_tangent *tangent, int transposed, const double *b, const double *beside, double *p);

/* Compute y [n] = dr/da w, which is symmetric; dr/dv w or dr/dx w, or with `transposed` the transposed products; with
 * constrained rows. The last one is for stages whose velocities do not move with u. */
int flesh_stage_tangent_mass_times(flesh_stage_tangent *tangent, const double *w, double *y);
int flesh_stage_tangent_damping_times(flesh_stage_tangent *tangent, int transposed, const double *w, double *y);
int flesh_stage_tangent_stiffness_times(flesh_stage_tangent *tangent, int transposed, const double *w, double *y);

/* Computes by_x and by_v [n], the derivatives of w . r by x and v, including lagged and frozen terms, if all of these read
 * the stage's own state, whose velocities do not move with u. */
int flesh_stage_tangent_read(flesh_stage_tangent *tangent, const double *w, double *by_x, double *by_v);

/* Marks in same [effects] the system's effects that are known to be the same in all systems of the parameter; returns
 * whether there are any. */
int flesh_parameter_compare(const flesh_parameter *parameter, const flesh_system *system, unsigned char *same);

/* Computes force [n] = dr/dp at the solution, constrained rows included. Effects in `same` [effects] (NULL: not known) are
 * not evaluated. Constrained dofs move with p; `moves` (unless NULL) are set to the derivatives of their x, v and a [n].
 * FLESH_ERR_ARGUMENT if the systems do not fit; FLESH_ERR_SOLVE if one has no residual at the solution. */
int flesh_stage_tangent_force(flesh_stage_tangent *tangent, const flesh_parameter *parameter, const unsigned char *same,
                              double *force, double *const moves[3]);

/* Computes force [n] = dM/dp w, M being the mass: the change by p of the inertia of the accelerations w [n].
 * FLESH_ERR_ARGUMENT if the systems do not fit. */
int flesh_stage_tangent_mass_force(flesh_stage_tangent *tangent, const flesh_parameter *parameter, const double *w,
                                   double *force);

/* Finds these `moves` at the time t, by the motion of constrained dofs over the span of `own`, the state's system's;
 * *moved: whether they are not 0. FLESH_ERR_ARGUMENT if the systems do not fit, or p moves an event. */
int flesh_stage_tangent_moves(flesh_stage_tangent *tangent, const flesh_parameter *parameter, const flesh_prescribed *own,
                              double t, double *const moves[3], int *moved);

#endif
