/* ahead.h: a run whose steps need not end where its states are shown. */
#ifndef FLESH_TIME_AHEAD_H
#define FLESH_TIME_AHEAD_H

#include "base/archive.h"
#include "flesh/state.h"
#include "system/system.h"

typedef struct flesh_ahead {
  double limit;         /* s, the run's end, up to which steps may lead; -INFINITY: they end with the caller's */
  int shown;            /* the caller's state is one between `from` and `to` */
  flesh_state from, to; /* where the last step has begun and ended; from.x NULL: they are not kept */
} flesh_ahead;

/* Whether states of the system between two that were solved cannot be interpolated: something keeps it from places, or
 * multipliers or internal variables go with its states. */
int flesh_ahead_is_limited(const flesh_system *system);
/* Makes room for n unknowns. FLESH_ERR_MEMORY. */
int flesh_ahead_create(int n, flesh_ahead *ahead);
void flesh_ahead_clear(flesh_ahead *ahead);
size_t flesh_ahead_memory(const flesh_ahead *ahead, int n);
void flesh_ahead_archive(flesh_ahead *ahead, int n, flesh_archive *archive);

/* A step that may lead behind the end asked for begins at the state. */
void flesh_ahead_remember(flesh_ahead *ahead, int n, const flesh_state *state);
/* Steps have led to the state, which becomes that at `end` where it lies behind it. Overwrites room [3*n]. */
void flesh_ahead_show(flesh_ahead *ahead, const flesh_system *system, double end, double *room, flesh_state *state);
/* The caller's state becomes that at `end` if steps have led as far, but for rounding, and 1 is returned; else that from which
 * they go on. */
int flesh_ahead_go_on(flesh_ahead *ahead, const flesh_system *system, double end, double rounding, double *room,
                      flesh_state *state);

#endif
