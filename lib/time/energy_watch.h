/* energy_watch.h: notices energy that nothing has put in. */
#ifndef FLESH_TIME_ENERGY_WATCH_H
#define FLESH_TIME_ENERGY_WATCH_H

#include "base/archive.h"
#include "flesh/integrator.h"
#include "system/evaluation.h"

/* An excess counts where that many steps in a row have it. */
enum { FLESH_ENERGY_STEPS = 3 };

/* See energy_watch.c for the balance. */
typedef struct flesh_energy_watch {
  const flesh_system *system;
  flesh_evaluation *evaluation; /* the run's, borrowed */
  int n, effects;
  int kinds;               /* flesh_system_work_kinds */
  double limit;            /* gain that ends a step */
  double *energies;        /* [effects] of the state known, J */
  double *scratch;         /* [2*n] where forces may put in work; else NULL */
  /* The state that `energies` belong to. */
  int known;
  long serial; /* the evaluation's */
  double t;
  double energy, kinetic; /* J */
  /* Since the first state: the least of energy less work, the lowest potential energy, what is in rounding and in what
   * the solves leave unbalanced since that least, J. */
  double least, lowest, rounding, unbalanced;
  double floor;           /* J, of which no less counts as the motion's energy: what errors that choose steps may be */
  double doubt;           /* the share of the work that such steps may miscount; 0: errors choose none */
  double worked, counted; /* J: the work put in and taken out since the first state, up to where `supplied` was that */
  double rate, rate_t;    /* W of work at a stage, and its time; NaN: not known */
  int turned;             /* the step that is counted turns so far that its work is not known */
  double step;            /* s, that is asked of the integrator, which may part it */
  struct {
    int count, next;                  /* of `least` */
    double least[FLESH_ENERGY_STEPS]; /* J, the least excess within each of the last steps */
    int parts;                        /* states since the last of them */
    double part, t;                   /* J, the least excess of these; s, when that began */
  } lasting;
  double reported;        /* J, the largest excess that a warning has reported */
  flesh_energy_balance balance;
  char warning[400];
} flesh_energy_watch;

/* Makes the watch over a run; `evaluation` is borrowed. FLESH_ERR_MEMORY. */
int flesh_energy_watch_create(flesh_evaluation *evaluation, flesh_energy_watch *watch);
void flesh_energy_watch_clear(flesh_energy_watch *watch);
/* But for the limit. */
void flesh_energy_watch_archive(flesh_energy_watch *watch, flesh_archive *archive);

/* The point at the state's positions and velocities at time t, with accelerations a [n] (NULL: 0). */
flesh_point flesh_energy_watch_point(const flesh_energy_watch *watch, double t, const flesh_state *state,
                                     const double *a);

/* Whether the energies known are those of the run's state. */
int flesh_energy_watch_knows(const flesh_energy_watch *watch);

/* The body has come from the state known to this one at time t (that of the state, or the moment before) by other means
 * than motion: constraints taken up, effects switched on or off, a caller's change. Its change of energy counts as put
 * in. The first state is where all begins. */
void flesh_energy_watch_jump(flesh_energy_watch *watch, double t, const flesh_state *state);

/* W of work at t, where a step begins whose stages go on from there (0: nothing is moved). */
void flesh_energy_watch_begin(flesh_energy_watch *watch, double t, double rate);

/* Adds to the work that has been put in that of a step from t_from to t_to: `work` is the power of its stage, at
 * t_stage, times the step. A method of first order counts just that, others interpolate the power at the step's middle
 * between this stage and the one before. */
void flesh_energy_watch_add_work(flesh_energy_watch *watch, double t_from, double t_to, double t_stage, double work,
                                 int first_order);

/* Takes in the state at the end of a step, at time t (or the moment before an event there). `energies` [effects] NULL:
 * they are evaluated, but for the strain energy where `by_position` (may be NULL) knows it; else all but the kinetic
 * energy are those given. Status as of energies; nothing is known then. */
int flesh_energy_watch_record_state(flesh_energy_watch *watch, double t, const flesh_state *state,
                                    const flesh_position_potential *by_position, const double *energies);
/* The state is the one at hand, but for velocities that constrained dofs are given: what kinetic energy that makes is
 * external work. Status as of energies. */
int flesh_energy_watch_kick(flesh_energy_watch *watch, const flesh_state *state);
/* The internal variables of effects have changed from `before` to the state's at the state at hand, which may be that
 * known: what energy falls by has been dissipated. */
int flesh_energy_watch_release(flesh_energy_watch *watch, const double *before, const flesh_state *state);
/* Adds the second half of what changes with time at a place: at the step's end, which is the state known, since t_from.
 * */
int flesh_energy_watch_add_work_in_time(flesh_energy_watch *watch, double t_from, const flesh_state *state);
/* Whether the step that has led from `before`, a copy of the watch as it was, to the state known has gained so much energy
 * that it is to be taken in shorter steps; `tolerance`: that of the error that chooses its length, else 0. */
int flesh_energy_watch_refuses(const flesh_energy_watch *watch, const flesh_energy_watch *before, double tolerance);
/* Whether internal variables that become `next` at the state would bring in more energy than steps may gain; `tolerance` as in
 * flesh_energy_watch_refuses. Collective. */
int flesh_energy_watch_puts_off(const flesh_energy_watch *watch, const flesh_state *state, const double *next, double tolerance);
/* Judges the state known; `unbalanced`: work that what the step's solve has left can do at most, J. FLESH_ERR_ENERGY
 * with words where the limit is passed. */
int flesh_energy_watch_judge(flesh_energy_watch *watch, const flesh_state *state, double unbalanced);
/* Judges the state known when no step leads on from it: its excess counts as it is. */
void flesh_energy_watch_last(flesh_energy_watch *watch, const flesh_state *state);

#endif
