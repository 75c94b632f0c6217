/* ida_energy.h: finds the work put in along IDA's interpolant, for the balance of energy_watch.h. */
#ifndef FLESH_TIME_IDA_ENERGY_H
#define FLESH_TIME_IDA_ENERGY_H

#include "time/energy_watch.h"
#include "sundials/ida_problem.h"

typedef struct flesh_ida_energy {
  flesh_ida_problem *problem; /* this and the next four are borrowed */
  flesh_energy_watch *watch;
  void *ida;
  N_Vector y, yp; /* memory for interpolated states */
  double *x, *r;  /* [n] positions at t; a residual */
  double t;       /* s, time up to which work is counted */
  double power;   /* W, power of reactions and forces there; NaN: not known */
  int moves;      /* constrained nodes move until the next event */
} flesh_ida_energy;

int flesh_ida_energy_create(flesh_ida_problem *problem, flesh_energy_watch *watch, flesh_ida_energy *energy);
void flesh_ida_energy_clear(flesh_ida_energy *energy);
/* A gain is compared with no less than the energy of a motion as slow as this share of the scale of velocity. */
void flesh_ida_energy_tolerate(flesh_ida_energy *energy, double tolerance);

/* Starts the balance: IDA starts from y [2*n] at t. */
void flesh_ida_energy_start(flesh_ida_energy *energy, double t, double *y);
/* Counts the work up to t, within the last internal step. Returns a negative status of the system or of IDA; if the
 * work has no value, the balance restarts. */
int flesh_ida_energy_count(flesh_ida_energy *energy, double t);
/* Judges a state within the last internal step, after counting the work up to it. FLESH_ERR_ENERGY as
 * flesh_energy_watch_judge. */
int flesh_ida_energy_judge(flesh_ida_energy *energy, const flesh_state *state);

#endif
