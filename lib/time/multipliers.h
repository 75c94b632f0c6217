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
  int count, n;     /* 0 multipliers: there are no constraints, and nothing below is allocated */
  double tolerance; /* of gaps */
  double depth;     /* of gaps that solving on would not change */
  double allowed;   /* gaps that a step may leave whose error chooses its length; else 0 */
  double left;      /* the largest gap where the last solve ended without converging, though forces balanced; else 0 */
  double inertia;   /* kg/m: the body's density times the square of how far its inside is from its surface */
  double softest;   /* Pa; of the penalties */
  double *own;      /* [count] Pa, of states without multipliers */
  double *trial;    /* [count] Pa, of the solve under way, and where it ended */
  int goes_on;      /* the state's are those that the last solve gave it */
  double *lag;      /* [count] the gaps at that solve's stage, where it is not the end of the step */
  double *gaps, *stiffness; /* [count] */
  double *x, *u;            /* [n] the end of the step, and the unknowns of the last solve */
} flesh_multipliers;

/* Makes what this rank needs, without the others. Borrows the solver of the system. FLESH_ERR_MEMORY. To be cleared also
 * when it fails. */
int flesh_multipliers_create(const flesh_system *system, flesh_nonlinear *nonlinear, const flesh_solver_options *options,
                             flesh_multipliers *multipliers);
/* Measures the body, once all ranks have made theirs. Collective, and fails on all ranks or none. */
int flesh_multipliers_create_collective(flesh_multipliers *multipliers);
void flesh_multipliers_clear(flesh_multipliers *multipliers);
/* The state's are others than the last solve gave it. */
void flesh_multipliers_forget(flesh_multipliers *multipliers);
void flesh_multipliers_archive(flesh_multipliers *multipliers, flesh_archive *archive);

/* *view = *state, with multipliers of its own where it has none. FLESH_ERR_ARGUMENT for another number of them. */
int flesh_multipliers_view(const flesh_multipliers *multipliers, const flesh_state *state, flesh_state *view);

/* Finds the positions x [n] at which the constraints are to hold from a stage's unknowns u [n]. None where they are those
 * of the stage. */
typedef struct flesh_stage_end {
  void *data;
  void (*find)(void *data, const double *u, double *x);
} flesh_stage_end;

/* The largest gap of a tet, a share of its volume, where nodes are at x [n], m, on any rank, into *largest. FLESH_NONFINITE. */
int flesh_multipliers_gap(flesh_multipliers *multipliers, const double *x, double *largest);
/* Like flesh_nonlinear_solve, from the multipliers of the state, if something is held: until no gap at the end exceeds
 * a hundredth of newton_tolerance, or none exceeds newton_tolerance and the multipliers' change leaves the forces
 * balanced. FLESH_NOT_CONVERGED where gaps stay. */
int flesh_multipliers_solve(flesh_multipliers *multipliers, flesh_stage *stage, const flesh_state *state,
                            const flesh_stage_end *end, const double *const *guesses, int extensions,
                            flesh_solve_stats *stats);
/* The state takes over the pressures of the last solve, which has succeeded with this stage: where that holds
 * constraints at another place, the penalty's share as well. */
int flesh_multipliers_accept(flesh_multipliers *multipliers, const flesh_stage *stage, flesh_state *state);

#endif
