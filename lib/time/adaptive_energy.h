/* adaptive_energy.h: the work put in over IDA's internal steps, for the balance of energy_watch.h. */
#ifndef FLESH_TIME_ADAPTIVE_ENERGY_H
#define FLESH_TIME_ADAPTIVE_ENERGY_H

#include "time/energy_watch.h"
#include "sundials/ida_problem.h"

typedef struct flesh_adaptive_energy {
  flesh_ida_problem *problem; /* borrowed, as is the watch */
  flesh_energy_watch *watch;
  double *x, *u;              /* [n] at the end of the last internal step, and over one */
  double t, before;           /* its end and its start, s */
  double supplied, later;     /* put in before it, and after the state judged last, J */
} flesh_adaptive_energy;

int flesh_adaptive_energy_create(flesh_ida_problem *problem, flesh_energy_watch *watch, flesh_adaptive_energy *energy);
void flesh_adaptive_energy_clear(flesh_adaptive_energy *energy);
/* What is reported is more than the energy of a motion as slow as this share of the scale of velocity. */
void flesh_adaptive_energy_tolerate(flesh_adaptive_energy *energy, double tolerance);

/* IDA starts from y [2*n] at t. */
void flesh_adaptive_energy_start(flesh_adaptive_energy *energy, double t, double *y);
/* An internal step has led to y [2*n] at t, where the residual was evaluated last. */
void flesh_adaptive_energy_count(flesh_adaptive_energy *energy, double t, const double *y);
/* Judges a state within the last internal step. FLESH_ERR_ENERGY as flesh_energy_watch_judge. */
int flesh_adaptive_energy_judge(flesh_adaptive_energy *energy, const flesh_state *state);

#endif
