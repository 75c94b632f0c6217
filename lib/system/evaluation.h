/* evaluation.h: one object of a run: the point that was evaluated last, and the run's state with a serial number that
 * changes with the state, as PETSc's PetscObjectState does. Whoever keeps something that belongs to a state keeps the
 * number with it, and compares numbers; arrays are compared here alone, where a caller hands one over. */
#ifndef FLESH_SYSTEM_EVALUATION_H
#define FLESH_SYSTEM_EVALUATION_H

#include "base/archive.h"
#include "base/team.h"
#include "effect/environment.h"
#include "flesh/state.h"
#include "flesh/system.h"

typedef struct flesh_evaluation {
  const flesh_system *system; /* borrowed */
  flesh_threads *threads;     /* borrowed, may be NULL */
  const flesh_team *team;     /* the system's, borrowed; NULL: none */
  flesh_environment environment; /* of any point of the run: its costs (borrowed; NULL: nobody counts) and proximity */
  int n;                      /* unknowns */
  double *x, *v, *a;          /* [n] the point evaluated last */
  long serial;                /* of the run's state, from 1 on */
  flesh_state returned;       /* the state as the caller got it last; NULL arrays without flesh_evaluation_keep_state */
} flesh_evaluation;

/* Borrows the finished system and the threads (NULL: the caller's). FLESH_ERR_MEMORY: there is nothing to clear. */
int flesh_evaluation_create(const flesh_system *system, flesh_threads *threads, flesh_evaluation *evaluation);
/* Makes room for the state that a run gives back. FLESH_ERR_MEMORY. */
int flesh_evaluation_keep_state(flesh_evaluation *evaluation);
void flesh_evaluation_clear(flesh_evaluation *evaluation);
size_t flesh_evaluation_memory(const flesh_evaluation *evaluation);
void flesh_evaluation_archive(flesh_evaluation *evaluation, flesh_archive *archive);

/* The run's state has become another: what was known of it is not known of this one. */
void flesh_evaluation_changed(flesh_evaluation *evaluation);
/* Whether the caller's state is the one that the run has given back, bit by bit and at its time within `tolerance` [s],
 * on all ranks. */
int flesh_evaluation_is_at(const flesh_evaluation *evaluation, const flesh_state *state, double tolerance);
/* Remembers the state as the one given back. */
void flesh_evaluation_remember(flesh_evaluation *evaluation, const flesh_state *state);
/* The state's positions and velocities become those that are remembered. */
void flesh_evaluation_restore(const flesh_evaluation *evaluation, flesh_state *state);

#endif
