/* evaluation.h: one object of a run: the point that was evaluated last, what is known there, what its effects remember of
 * what is near, and the run's state with a serial number that changes with the state, as PETSc's PetscObjectState does.
 * Whoever keeps something that belongs to a state keeps the number with it, and compares numbers. Arrays are compared
 * here alone, where they come from outside: a caller's state, and iterates, which KINSOL forms in vectors of its own. */
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

/* A residual that is known, of these unknowns. */
typedef struct flesh_known_residual {
  int known;
  double *u, *r;     /* [n] */
  double *reactions; /* [n] what constraints do to the constrained dofs, in their order, N */
} flesh_known_residual;

/* A potential that is known, of these unknowns. */
typedef struct flesh_known_potential {
  int known;
  int with_residual; /* at the residual's u, not at this one */
  double *u;         /* [n] */
  double value, magnitude;
  flesh_position_potential by_position; /* its part of positions alone */
} flesh_known_potential;

/* The part of the potential that depends on positions alone, at the end of a stage with shift.x = 1, where mostly the
 * next one starts. */
typedef struct flesh_known_end {
  flesh_position_potential potential;
  double *x; /* [n] */
} flesh_known_end;

typedef struct flesh_evaluation {
  const flesh_system *system;    /* borrowed */
  flesh_threads *threads;        /* borrowed, may be NULL */
  const flesh_team *team;        /* the system's, borrowed; NULL: none */
  int n, own;                    /* unknowns; those of nodes that this rank owns, the first ones */
  double all;                    /* unknowns of the body */
  double *x, *v, *a;             /* [n] the point evaluated last */
  flesh_environment environment; /* of any point: its costs (borrowed; NULL: nobody counts) and proximity */
  long serial;                   /* of the run's state, from 1 on */
  flesh_state returned;          /* the state as the caller got it last; see flesh_evaluation_keep_state */
  /* The rest is that of stages; see flesh_evaluation_keep_places. */
  flesh_known_residual residual;
  flesh_known_potential potential;
  flesh_known_end known_end;
  double *frozen; /* [2*n] x and v of the frozen state; NULL: no effect freezes */
  int is_frozen;  /* they are this stage's */
  double *zeros;  /* [n] the lagged velocities where the stage has none */
  flesh_clearance clearance;
  flesh_proximity proximity;
  flesh_environment at_stage; /* of the stage's points */
} flesh_evaluation;

/* Borrows the finished system and the threads (NULL: the caller's). FLESH_ERR_MEMORY. */
int flesh_evaluation_create(const flesh_system *system, flesh_threads *threads, flesh_evaluation *evaluation);
/* The body's number of the node with the largest |y| over `scale` (NULL: 1) in y [parts*n], of several ranks' the last.
 * Collective. */
int flesh_evaluation_worst_node(const flesh_evaluation *evaluation, int parts, const double *y, const double *scale);
/* FLESH_ERR_NONFINITE, with the first node whose x or v is not finite. Collective. */
int flesh_evaluation_check_state(const flesh_evaluation *evaluation, const flesh_state *state);
/* Makes room for the state that a run gives back. FLESH_ERR_MEMORY. */
int flesh_evaluation_keep_state(flesh_evaluation *evaluation);
/* Makes room for what is known at the places of a stage. The evaluation must not move afterwards. FLESH_ERR_MEMORY. */
int flesh_evaluation_keep_places(flesh_evaluation *evaluation);
/* Also after a creation that failed. */
void flesh_evaluation_clear(flesh_evaluation *evaluation);
/* Saves or loads the run's state. */
void flesh_evaluation_archive(flesh_evaluation *evaluation, flesh_archive *archive);

/* A point with the run's threads and environment. */
flesh_point flesh_evaluation_point(const flesh_evaluation *evaluation, double t, const double *x, const double *v,
                                   const double *a);

/* Whether the residual, or the potential, is known of u [n]. */
int flesh_evaluation_knows_residual(const flesh_evaluation *evaluation, const double *u);
int flesh_evaluation_knows_potential(const flesh_evaluation *evaluation, const double *u);
/* Whether the point's positions are those where the last stage has ended. */
int flesh_evaluation_is_at_known_end(const flesh_evaluation *evaluation);
/* The residual is now known of u [n], or the potential, unless it is with the residual. */
void flesh_evaluation_take_residual(flesh_evaluation *evaluation, const double *u);
void flesh_evaluation_take_potential(flesh_evaluation *evaluation, const double *u);
/* The residual will be another; the potential stays known where it was. */
void flesh_evaluation_drop_residual(flesh_evaluation *evaluation);
/* Nothing is known of any u. */
void flesh_evaluation_forget(flesh_evaluation *evaluation);

/* The run's state has become another: what was known of it is not known of this one. */
void flesh_evaluation_changed(flesh_evaluation *evaluation);
/* Forces and energies at the run's positions are others than before, as internal variables are. */
void flesh_evaluation_forces_changed(flesh_evaluation *evaluation);
/* Whether the caller's state is the one that the run has given back, bit by bit and at its time within `tolerance` [s],
 * on all ranks. */
int flesh_evaluation_is_at(const flesh_evaluation *evaluation, const flesh_state *state, double tolerance);
/* Remembers the state as the one given back. */
void flesh_evaluation_remember(flesh_evaluation *evaluation, const flesh_state *state);
/* The state's positions and velocities become those that are remembered. */
void flesh_evaluation_restore(const flesh_evaluation *evaluation, flesh_state *state);

#endif
