/* internals.h: internal variables of effects over a run: constant within a step, updated once it is accepted. */
#ifndef FLESH_TIME_INTERNALS_H
#define FLESH_TIME_INTERNALS_H

#include "time/energy_watch.h"

typedef struct flesh_internals {
  const flesh_system *system;
  int count, n;      /* 0 variables: no effect has any, and nothing below is allocated */
  double *own;       /* [count] variables of states that come without any */
  double *next;      /* [count] values after an update */
  /* Start of a static step: [count], [n], [n], s. */
  double *before, *x, *v, t;
  int restart;       /* they have changed since the method started, and its acceleration with them */
} flesh_internals;

/* FLESH_ERR_MEMORY. */
int flesh_internals_create(const flesh_system *system, flesh_internals *internals);
void flesh_internals_clear(flesh_internals *internals);
/* Archives the internal variables of states that come without any. */
void flesh_internals_archive(flesh_internals *internals, flesh_archive *archive);

/* Sets view = *state, with the run's internal variables if it has none. FLESH_ERR_ARGUMENT for a wrong number of them. */
int flesh_internals_view(const flesh_internals *internals, flesh_state *view);

/* Finds the variables that an update at the state would give, in internals->next. A change that would bring in more
 * energy than steps may gain, as of a barrier that stiffens within a collision, waits for a later step; `tolerance`: of
 * the errors that choose steps, 0: their lengths are given; negative: nothing waits. A negative status ends the run. */
int flesh_internals_foresee(flesh_internals *internals, const flesh_energy_watch *watch, const flesh_state *state,
                            double tolerance, int *changed);

/* Updates the variables of an accepted state. *changed: whether forces or energies differ from before; the energy lost
 * by that is counted. A negative status ends the run. */
int flesh_internals_update(flesh_internals *internals, flesh_energy_watch *watch, flesh_state *state, double tolerance,
                           int *changed);

/* Remembers the state where a static step begins; goes back to it. */
void flesh_internals_remember(flesh_internals *internals, const flesh_state *state);
void flesh_internals_give_back(const flesh_internals *internals, flesh_state *state);

#endif
