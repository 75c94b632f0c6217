/* internals.h: internal variables of effects over a run: constant within a step, updated once it is accepted. */
#ifndef FLESH_TIME_INTERNALS_H
#define FLESH_TIME_INTERNALS_H

#include "time/energy_watch.h"

typedef struct flesh_internals {
  const flesh_system *system;
  int count, n;      /* 0 variables: no effect has any, and nothing below is allocated */
  double *own;       /* [count] of states without any */
  double *next;      /* [count] what an update makes of them */
  /* The start of a static step: [count], [n], [n], s. */
  double *before, *x, *v, t;
  int restart;       /* they have changed since the method started: its acceleration is another one */
} flesh_internals;

/* FLESH_ERR_MEMORY. */
int flesh_internals_create(const flesh_system *system, flesh_internals *internals);
void flesh_internals_clear(flesh_internals *internals);
/* Archives the internal variables of states without any. */
void flesh_internals_archive(flesh_internals *internals, flesh_archive *archive);

/* *view gets internal variables of its own where it has none. FLESH_ERR_ARGUMENT for another number of them. */
int flesh_internals_view(const flesh_internals *internals, flesh_state *view);

/* Finds the variables that an update would make of those of the state, in internals->next. What would bring in more energy than
 * steps may gain, as a barrier that stiffens within a collision, waits for a later step; `tolerance`: of the errors that choose
 * steps, 0: their lengths are given; negative: nothing waits. A negative status ends the run. */
int flesh_internals_foresee(flesh_internals *internals, const flesh_energy_watch *watch, const flesh_state *state,
                            double tolerance, int *changed);

/* Updates those of an accepted state. *changed: forces or energies are others than before; what energy falls by is counted.
 * A negative status ends the run. */
int flesh_internals_update(flesh_internals *internals, flesh_energy_watch *watch, flesh_state *state, double tolerance,
                           int *changed);

/* The state where a static step begins, and the way back to it. */
void flesh_internals_remember(flesh_internals *internals, const flesh_state *state);
void flesh_internals_give_back(const flesh_internals *internals, flesh_state *state);

#endif
