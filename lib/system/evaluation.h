/* evaluation.h: one object of a run: the point evaluated last, values known there, the effects' caches of near pairs, and
 * the run's state with a serial number that changes with the state, as in PETSc's PetscObjectState. Code that caches
 * something of a state keeps the number with it and compares numbers. Arrays are compared only here, where they come from
 * outside: a caller's state, and iterates, which KINSOL forms in vectors of its own. */
#ifndef FLESH_SYSTEM_EVALUATION_H
#define FLESH_SYSTEM_EVALUATION_H

#include "base/archive.h"
#include "base/team.h"
#include "effect/environment.h"
#include "flesh/state.h"
#include "flesh/system.h"
#include "system/clearance.h"
#include "system/position_potential.h"
#include "system/proximity.h"

/* A known residual, with its unknowns. */
typedef struct flesh_known_residual {
  int known;
  double *u, *r;     /* [n] */
  double *reactions; /* [n] forces of the constraints on the constrained dofs, in their order, N */
} flesh_known_residual;

/* A known potential, with its unknowns. */
typedef struct flesh_known_potential {
  int known;
  int with_residual; /* 1: it is at the residual's u, not at this one */
  double *u;         /* [n] */
  double value, magnitude;
  flesh_position_potential by_position; /* its part that depends on positions alone */
} flesh_known_potential;

/* The part of the potential that depends on positions alone, at the end of a stage with shift.x = 1, where the next stage
 * mostly starts. */
typedef struct flesh_known_end {
  flesh_position_potential potential;
  double *x; /* [n] */
} flesh_known_end;

typedef struct flesh_evaluation {
  const flesh_system *system;    /* borrowed */
  flesh_threads *threads;        /* borrowed, may be NULL */
  const flesh_team *team;        /* the system's, borrowed; NULL: none */
  int n, own;                    /* number of unknowns; of those of nodes that this rank owns, which come first */
  double all;                    /* number of unknowns of the body */
  double *x, *v, *a;             /* [n] point evaluated last */
  flesh_environment environment; /* environment of any point: costs (borrowed; NULL: not counted) and proximity */
  long serial;                   /* serial number of the run's state, from 1 on */
  flesh_state returned;          /* state that the caller got last; see flesh_evaluation_keep_state */
  /* The rest is for stages; see flesh_evaluation_keep_places. */
  flesh_known_residual residual;
  flesh_known_potential potential;
  flesh_known_end known_end;
  double *frozen; /* [2*n] x and v of the frozen state; NULL: no effect freezes */
  int is_frozen;  /* 1: `frozen` is this stage's */
  double *zeros;  /* [n] lagged velocities for stages that have none */
  flesh_clearance clearance;
  flesh_proximity proximity;
  flesh_environment at_stage; /* environment of the stage's points */
} flesh_evaluation;

/* Makes an evaluation of the finalized system, which it borrows, as it does the threads (NULL: the caller's).
 * FLESH_ERR_MEMORY. */
int flesh_evaluation_create(const flesh_system *system, flesh_threads *threads, flesh_evaluation *evaluation);
/* Returns the body's number of the node with the largest |y| over `scale` (NULL: 1) in y [parts*n]; if several ranks have
 * it, the last one's. Collective. */
int flesh_evaluation_worst_node(const flesh_evaluation *evaluation, int parts, const double *y, const double *scale);
/* Checks that x and v of all nodes are finite. FLESH_ERR_NONFINITE, naming the first node where they are not. Collective. */
int flesh_evaluation_check_state(const flesh_evaluation *evaluation, const flesh_state *state);
/* Makes room for the state that a run returns. FLESH_ERR_MEMORY. */
int flesh_evaluation_keep_state(flesh_evaluation *evaluation);
/* Makes room for values known at the points of a stage. The evaluation must not move afterwards. FLESH_ERR_MEMORY. */
int flesh_evaluation_keep_places(flesh_evaluation *evaluation);
/* Frees the arrays, also after a creation that failed. */
void flesh_evaluation_clear(flesh_evaluation *evaluation);
/* Saves or loads the run's state. */
void flesh_evaluation_archive(flesh_evaluation *evaluation, flesh_archive *archive);

/* Returns a point with the run's threads and environment. */
flesh_point flesh_evaluation_point(const flesh_evaluation *evaluation, double t, const double *x, const double *v,
                                   const double *a);

/* Whether the residual, or the potential, is known at u [n]. */
int flesh_evaluation_knows_residual(const flesh_evaluation *evaluation, const double *u);
int flesh_evaluation_knows_potential(const flesh_evaluation *evaluation, const double *u);
/* Whether the point's positions are those at which the last stage has ended. */
int flesh_evaluation_is_at_known_end(const flesh_evaluation *evaluation);
/* Records that the residual is now known at u [n], or the potential, unless it is with the residual. */
void flesh_evaluation_take_residual(flesh_evaluation *evaluation, const double *u);
void flesh_evaluation_take_potential(flesh_evaluation *evaluation, const double *u);
/* Drops the residual; a known potential stays known. */
void flesh_evaluation_drop_residual(flesh_evaluation *evaluation);
/* Drops all known values. */
void flesh_evaluation_forget(flesh_evaluation *evaluation);

/* Records a change of the run's state: values known of the old state are not those of the new one. */
void flesh_evaluation_changed(flesh_evaluation *evaluation);
/* Records that forces and energies at the run's positions have changed, as internal variables have. */
void flesh_evaluation_forces_changed(flesh_evaluation *evaluation);
/* Whether the caller's state is the one that the run has returned, bit by bit, with a time that differs by at most
 * `tolerance` [s], on all ranks. */
int flesh_evaluation_is_at(const flesh_evaluation *evaluation, const flesh_state *state, double tolerance);
/* Records the state as the one returned. */
void flesh_evaluation_remember(flesh_evaluation *evaluation, const flesh_state *state);
/* Sets the state's positions and velocities to those recorded. */
void flesh_evaluation_restore(const flesh_evaluation *evaluation, flesh_state *state);

#endif
