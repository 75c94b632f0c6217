/* multipliers.h: solves of stages whose effects hold constraints by multipliers, as incompressible tets hold their
 * volumes: the augmented Lagrangian method around Newton's. */
#ifndef FLESH_TIME_MULTIPLIERS_H
#define FLESH_TIME_MULTIPLIERS_H

#include "base/archive.h"
#include "base/team.h"
#include "flesh/state.h"
#include "sundials/kinsol.h"

typedef struct flesh_multipliers {
  const flesh_system *system;
  flesh_nonlinear *nonlinear; /* borrowed */
  const flesh_team *team; /* NULL: none */
  int count, n;     /* number of multipliers; 0: there are no constraints, and nothing below is allocated */
  double tolerance; /* of gaps */
  double depth;     /* rounding of gaps, which further solves would not change */
  double allowed;   /* gaps that a step may leave whose error chooses its length; else 0 */
  double left;      /* the largest gap after a solve that did not converge although forces balanced; else 0 */
  double inertia;   /* kg/m: density times the square of the distance from the inside of the body to its surface */
  double softest;   /* Pa, the least of the penalties */
  double *own;      /* [count] Pa, multipliers of states that come without any */
  double *trial;    /* [count] Pa, multipliers of the solve under way, and where it ended */
  int goes_on;      /* the state has those that the last solve gave it */
  double *lag;      /* [count] gaps at that solve's stage, if it is not the end of the step */
  double *gaps, *stiffness; /* [count] */
  double *x, *u;            /* [n] end of the step, and unknowns of the last solve */
} flesh_multipliers;

/* Makes what this rank needs, without the others. Borrows the solver of the system. FLESH_ERR_MEMORY; to be cleared
 * even then. */
int flesh_multipliers_create(const flesh_system *system, flesh_nonlinear *nonlinear, const flesh_solver_options *options,
                             flesh_multipliers *multipliers);
/* Measures the body, once all ranks have made their own. Collective; fails on all ranks or none. */
int flesh_multipliers_create_collective(flesh_multipliers *multipliers);
void flesh_multipliers_clear(flesh_multipliers *multipliers);
/* Takes in that the state's multipliers differ from those that the last solve gave it. */
void flesh_multipliers_forget(flesh_multipliers *multipliers);
void flesh_multipliers_archive(flesh_multipliers *multipliers, flesh_archive *archive);

/* Sets view = *state, with the run's multipliers if it has none. FLESH_ERR_ARGUMENT for a wrong number of them. */
int flesh_multipliers_view(const flesh_multipliers *multipliers, const flesh_state *state, flesh_state *view);

/* Finds the positions x [n] at which the constraints are to hold from a stage's unknowns u [n]. Not
 * needed (NULL) where they are those of the stage. */
typedef struct flesh_stage_end {
  void *data;
  void (*find)(void *data, const double *u, double *x);
} flesh_stage_end;

/* Finds the largest gap of a tet on any rank, a share of its volume, with nodes at x [n], m. FLESH_NONFINITE. */
int flesh_multipliers_gap(flesh_multipliers *multipliers, const double *x, double *largest);
/* Solves as flesh_nonlinear_solve does, from the multipliers of the state if there are constraints: until no gap at the
 * end exceeds a hundredth of newton_tolerance, or none exceeds newton_tolerance and the change of the multipliers
 * leaves the forces balanced. FLESH_NOT_CONVERGED if gaps stay. */
int flesh_multipliers_solve(flesh_multipliers *multipliers, flesh_stage *stage, const flesh_state *state,
                            const flesh_stage_end *end, const double *const *guesses, int extensions,
                            flesh_solve_stats *stats);
/* Gives the state the pressures of the last solve, which has succeeded with this stage; if the constraints hold at
 * another place than the stage, with the penalty's share. */
int flesh_multipliers_accept(flesh_multipliers *multipliers, const flesh_stage *stage, flesh_state *state);

#endif
