/* energy_watch.h: notices energy that nothing has put in. */
#ifndef FLESH_TIME_ENERGY_WATCH_H
#define FLESH_TIME_ENERGY_WATCH_H

#include "base/archive.h"
#include "flesh/integrator.h"
#include "system/evaluation.h"

/* number of steps in a row that must have an excess for it to count */
enum { FLESH_ENERGY_STEPS = 3 };

/* See energy_watch.c for the balance. */
typedef struct flesh_energy_watch {
  const flesh_system *system;
  flesh_evaluation *evaluation; /* the run's, borrowed */
  int n, effects;
  int kinds;               /* flesh_system_work_kinds */
  double limit;            /* gain that ends a step */
  double *energies;        /* [effects] energies of the known state, J */
  double *scratch;         /* [2*n] where forces may put in work; else NULL */
  /* The state that `energies` belong to. */
  int known;
  long serial; /* the evaluation's */
  double t;
  double energy, kinetic; /* J */
  /* Since the first state: least energy less work; lowest potential energy; rounding, and work of the residuals that
   * solves left, since that least. J. */
  double least, lowest, rounding, unbalanced;
  double floor;           /* J, lower bound of the motion's energy: that of the errors which choose steps */
  double doubt;           /* share of the work that steps chosen by errors may miscount; 0: no errors choose steps */
  double worked, counted; /* J, work put in and taken out, all positive, up to `counted` of `supplied` */
  double rate, rate_t;    /* W, power at a stage, and its time; NaN: not known */
  int turned;             /* the step being counted rotates so far that its work is unknown */
  double step;            /* s, length of the step asked of the integrator, which may take it in parts */
  struct {
    int count, next;                  /* of `least` */
    double least[FLESH_ENERGY_STEPS]; /* J, least excess within each of the last steps */
    int parts;                        /* states since the last of these steps */
    double part, t;                   /* J, least excess of these states; s, when they began */
  } lasting;
  double reported;        /* J, largest excess that a warning has reported */
  flesh_energy_balance balance;
  char warning[400];
} flesh_energy_watch;

/* Creates the watch over a run; borrows `evaluation`. FLESH_ERR_MEMORY. */
int flesh_energy_watch_create(flesh_evaluation *evaluation, flesh_energy_watch *watch);
void flesh_energy_watch_clear(flesh_energy_watch *watch);
/* Archives the watch, except for the limit. */
void flesh_energy_watch_archive(flesh_energy_watch *watch, flesh_archive *archive);

/* Returns the point at the state's positions and velocities at time t, with accelerations a [n] (NULL: 0). */
flesh_point flesh_energy_watch_point(const flesh_energy_watch *watch, double t, const flesh_state *state,
                                     const double *a);

/* Returns whether the known energies are those of the run's state. */
int flesh_energy_watch_knows(const flesh_energy_watch *watch);

/* Takes in that the body has come from the known state to this one, at time t (the state's time, or the moment before),
 * by other means than motion: constraints taken up, effects switched on or off, a change by the caller. The change of
 * its energy counts as put in. The first state starts the balance. */
void flesh_energy_watch_jump(flesh_energy_watch *watch, double t, const flesh_state *state);

/* Takes in the power `rate` [W] at t, where a step begins whose stages go on from there (0: nothing is moved). */
void flesh_energy_watch_begin(flesh_energy_watch *watch, double t, double rate);

/* Adds the work of a step from t_from to t_to to the work put in: `work` is the power of its stage, at t_stage, times
 * the step. A method of first order counts just that; others interpolate the power at the step's middle between this
 * stage and the one before. */
void flesh_energy_watch_add_work(flesh_energy_watch *watch, double t_from, double t_to, double t_stage, double work,
                                 int first_order);

/* Takes in the state at the end of a step, at time t (or the moment before an event there). `energies` [effects] are
 * all energies but the kinetic one; NULL: they are evaluated, except for the strain energy if `by_position` (may be
 * NULL) knows it. Returns the status of the energies; after a failure no state is known. */
int flesh_energy_watch_record_state(flesh_energy_watch *watch, double t, const flesh_state *state,
                                    const flesh_position_potential *by_position, const double *energies);
/* Takes in that the known state has changed only in the velocities that constrained dofs were given: the kinetic energy
 * of that is external work. Status as of energies. */
int flesh_energy_watch_kick(flesh_energy_watch *watch, const flesh_state *state);
/* Takes in that the internal variables of effects have changed from `before` to the state's, at this state, which may
 * be the known one: the energy lost by that was dissipated. */
int flesh_energy_watch_release(flesh_energy_watch *watch, const double *before, const flesh_state *state);
/* Adds the second half of the energy that changes with time at fixed positions: at the step's end, which is the known
 * state, since t_from. */
int flesh_energy_watch_add_work_in_time(flesh_energy_watch *watch, double t_from, const flesh_state *state);
/* Returns whether the step from `before`, a copy of the watch at its start, to the known state has gained so much
 * energy that shorter steps must be taken; `tolerance`: that of the error that chooses the step's length, else 0. */
int flesh_energy_watch_refuses(const flesh_energy_watch *watch, const flesh_energy_watch *before, double tolerance);
/* Returns whether internal variables that become `next` at the state would bring in more energy than steps may gain;
 * `tolerance` as in flesh_energy_watch_refuses. Collective. */
int flesh_energy_watch_puts_off(const flesh_energy_watch *watch, const flesh_state *state, const double *next, double tolerance);
/* Judges the known state; `unbalanced` [J] is the most work that the residual left by the step's solve can do.
 * FLESH_ERR_ENERGY, with a sentence, if the limit is exceeded. */
int flesh_energy_watch_judge(flesh_energy_watch *watch, const flesh_state *state, double unbalanced);
/* Judges the known state when no step follows it: its excess counts as it is. */
void flesh_energy_watch_last(flesh_energy_watch *watch, const flesh_state *state);

#endif
