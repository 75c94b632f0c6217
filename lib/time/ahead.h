/* ahead.h: a run whose steps need not end where its states are shown. */
#ifndef FLESH_TIME_AHEAD_H
#define FLESH_TIME_AHEAD_H

#include "base/archive.h"
#include "time/error_control.h"

typedef struct flesh_ahead {
  double limit;         /* s, end of the run, which steps may reach; -INFINITY: steps end where the caller's do */
  int shown;            /* the caller's state lies between `from` and `to` */
  int balances;         /* interpolated states have forces that are off: shown states are solved for */
  double target;        /* N, norm of their residuals that is small enough */
  double corrected;     /* error of the cubic, over the step's factor, where it was last corrected; 0: nowhere yet */
  double *correction;   /* [n] there */
  flesh_state from, to; /* start and end of the last step; from.x NULL: not kept */
  double *a, *between;  /* [n] accelerations at the start, and of the state shown */
  /* The integrator's, borrowed. */
  flesh_error_control *control;
  const uint8_t *fixed;       /* [n] */
  const double *acceleration; /* [n] acceleration at the end of the last step; NULL: not known */
} flesh_ahead;

/* Returns whether states between two solved ones cannot be interpolated: an effect bars some positions, or a state has
 * multipliers or internal variables. */
int flesh_ahead_is_limited(const flesh_system *system);
/* Makes room. FLESH_ERR_MEMORY. */
int flesh_ahead_create(flesh_error_control *control, const uint8_t *fixed, const double *acceleration, flesh_ahead *ahead);
void flesh_ahead_clear(flesh_ahead *ahead);
void flesh_ahead_archive(flesh_ahead *ahead, int n, flesh_archive *archive);

/* Notes that a step which may lead beyond the end asked for begins at the state. */
void flesh_ahead_remember(flesh_ahead *ahead, const flesh_state *state);
/* Takes in that steps have led to the state; if that lies beyond `end`, it becomes the state at `end`. Overwrites room
 * [n]. A negative status ends the run. */
int flesh_ahead_show(flesh_ahead *ahead, double end, double *room, flesh_state *state, flesh_solve_stats *stats);
/* If steps have reached `end`, but for rounding, the caller's state becomes the one there, and *shown is 1; else it
 * becomes the state from which steps go on. Status as above. */
int flesh_ahead_go_on(flesh_ahead *ahead, double end, double rounding, double *room, flesh_state *state, int *shown,
                      flesh_solve_stats *stats);

#endif
