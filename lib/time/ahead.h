/* ahead.h: a run whose steps need not end where its states are shown. */
#ifndef FLESH_TIME_AHEAD_H
#define FLESH_TIME_AHEAD_H

#include "base/archive.h"
#include "time/error_control.h"

typedef struct flesh_ahead {
  double limit;         /* s, the run's end, up to which steps may lead; -INFINITY: they end with the caller's */
  int shown;            /* the caller's state is one between `from` and `to` */
  int balances;         /* forces of interpolated states are off: those shown are solved for */
  double target;        /* N, of their residuals */
  double corrected;     /* how far the cubic is off, over a factor of the step, where it was corrected last; 0: nowhere yet */
  double *correction;   /* [n] there */
  flesh_state from, to; /* where the last step has begun and ended; from.x NULL: they are not kept */
  double *a, *between;  /* [n] the accelerations where it has begun, and of the state shown */
  /* The integrator's, borrowed. */
  flesh_error_control *control;
  const uint8_t *fixed;       /* [n] */
  const double *acceleration; /* [n] where the last step has ended; NULL: it is not known */
} flesh_ahead;

/* Whether states of the system between two that were solved cannot be interpolated: something keeps it from places, or
 * multipliers or internal variables go with its states. */
int flesh_ahead_is_limited(const flesh_system *system);
/* Makes room. FLESH_ERR_MEMORY. */
int flesh_ahead_create(flesh_error_control *control, const uint8_t *fixed, const double *acceleration, flesh_ahead *ahead);
void flesh_ahead_clear(flesh_ahead *ahead);
void flesh_ahead_archive(flesh_ahead *ahead, int n, flesh_archive *archive);

/* A step that may lead behind the end asked for begins at the state. */
void flesh_ahead_remember(flesh_ahead *ahead, const flesh_state *state);
/* Steps have led to the state, which becomes that at `end` where it lies behind it. Overwrites room [n]. A negative status
 * ends the run. */
int flesh_ahead_show(flesh_ahead *ahead, double end, double *room, flesh_state *state, flesh_solve_stats *stats);
/* The caller's state becomes that at `end` if steps have led as far, but for rounding, and *shown is 1; else that from which
 * they go on. Status as above. */
int flesh_ahead_go_on(flesh_ahead *ahead, double end, double rounding, double *room, flesh_state *state, int *shown,
                      flesh_solve_stats *stats);

#endif
