/* stage_tangent.h: the equations of a stage, linearised at their solution: with the Jacobian, and with what effects read
 * of a lagged or frozen state. */
#ifndef FLESH_SENSITIVITY_STAGE_TANGENT_H
#define FLESH_SENSITIVITY_STAGE_TANGENT_H

#include "flesh/sensitivity.h"
#include "sensitivity/coupling.h"
#include "sundials/problem.h"
#include "time/prescribed.h"

typedef struct flesh_stage_tangent {
  const flesh_system *system; /* borrowed */
  int n, multipliers;
  double tolerance;           /* of solves, relative */
  flesh_problem *problem;
  flesh_newton *newton;       /* the problem's */
  flesh_stage stage;          /* borrows what was given */
  flesh_point point;          /* of the solution, where all is evaluated */
  double *x, *v, *a;          /* [n] its arrays */
  flesh_couplings couplings;
  unsigned follows;           /* bits of flesh_argument: what is read is the solution itself */
  double *room;               /* [6*n] */
  const flesh_prescribed *prescribed; /* how constrained dofs move, borrowed; NULL: as the stage moves them */
  flesh_prescribed others;    /* room: likewise, of a parameter's system */
  const double *held;         /* [n] the positions at which constraints of multipliers hold: its x, or `end` */
  double *end;                /* [n] those at the end of the step, where the stage is within it */
  double *pressed;            /* [n] of the last solve: the force of the constraints' multipliers, or adjoints of them */
  double *gaps;               /* [9*multipliers] */
  double *directions;         /* room for solves with what is followed, below; NULL: none yet */
  flesh_block_matrix products; /* of K's pattern, with values of its own [product_room] */
  size_t product_room;
} flesh_stage_tangent;

/* Borrows the finished system. FLESH_ERR_ARGUMENT for one that ranks share out; FLESH_ERR_MEMORY, FLESH_ERR_SUNDIALS. To be
 * cleared also when it fails. */
int flesh_stage_tangent_create(const flesh_system *system, const flesh_solver_options *options, double tolerance,
                               flesh_stage_tangent *tangent);
void flesh_stage_tangent_clear(flesh_stage_tangent *tangent);

/* Linearises the stage (its arrays are borrowed) at u [n]. Constraints of multipliers hold where it leads, or, of a stage
 * within the step, at tangent->end, which is set before. FLESH_ERR_SOLVE with a sentence where its Jacobian is singular or
 * has no value; what flesh_couplings_find returns. */
int flesh_stage_tangent_set(flesh_stage_tangent *tangent, const flesh_stage *stage, const double *u, unsigned follows);

/* Solves dr/du p = b [n], or the transposed system; 0 on constrained dofs, of which b is not read. With multipliers also
 * their change q: K p + G_s^T q = b and G_e (p + beside) = 0, where G are the derivatives of the constraints at the stage
 * and where they hold, which change places in the transposed system; `beside` [n], NULL: 0. FLESH_ERR_SOLVE,
 * FLESH_ERR_MEMORY. */
int flesh_stage_tangent_solve(flesh_stage_tangent *tangent, int transposed, const double *b, const double *beside, double *p);

/* y [n] = dr/da w, which is symmetric; dr/dv w or dr/dx w, or with `transposed` their transposed ones; with constrained rows.
 * The last one where the stage's velocities do not move with u. */
int flesh_stage_tangent_mass_times(flesh_stage_tangent *tangent, const double *w, double *y);
int flesh_stage_tangent_damping_times(flesh_stage_tangent *tangent, int transposed, const double *w, double *y);
int flesh_stage_tangent_stiffness_times(flesh_stage_tangent *tangent, int transposed, const double *w, double *y);

/* by_x and by_v [n]: the derivatives of w . r by x and v, that of what is lagged or frozen included, where all of it is the
 * stage's own state, whose velocities do not move with u. */
int flesh_stage_tangent_read(flesh_stage_tangent *tangent, const double *w, double *by_x, double *by_v);

/* Marks into same [effects] those of the system that are known to be the same in all systems of the parameter; whether
 * there are any. */
int flesh_parameter_compare(const flesh_parameter *parameter, const flesh_system *system, unsigned char *same);

/* force [n] = dr/dp at the solution, constrained rows included. Effects that are the `same` [effects] (NULL: nobody knows)
 * are not evaluated. Constrained dofs move with p; `moves` (unless NULL) become the derivatives of their x, v and a [n].
 * FLESH_ERR_ARGUMENT where the systems do not fit; FLESH_ERR_SOLVE where one has no residual at the solution. */
int flesh_stage_tangent_force(flesh_stage_tangent *tangent, const flesh_parameter *parameter, const unsigned char *same,
                              double *force, double *const moves[3]);

/* force [n] = dM/dp w, M being the mass: what p changes in the force of inertia by the accelerations w [n]. FLESH_ERR_ARGUMENT
 * where the systems do not fit. */
int flesh_stage_tangent_mass_force(flesh_stage_tangent *tangent, const flesh_parameter *parameter, const double *w,
                                   double *force);

/* Finds such `moves` at the time t, by the motion of constrained dofs over the span of `own`, the state's system's; *moved:
 * whether there are any. FLESH_ERR_ARGUMENT where the systems do not fit, or p moves an event. */
int flesh_stage_tangent_moves(flesh_stage_tangent *tangent, const flesh_parameter *parameter, const flesh_prescribed *own,
                              double t, double *const moves[3], int *moved);

#endif
