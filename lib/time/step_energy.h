/* step_energy.h: finds the work put in over the steps of fixed methods, for the balance of energy_watch.h. */
#ifndef FLESH_TIME_STEP_ENERGY_H
#define FLESH_TIME_STEP_ENERGY_H

#include "time/energy_watch.h"
#include "sundials/kinsol.h"
#include "time/prescribed.h"

/* A step whose stage has been solved. */
typedef struct flesh_step_energy {
  flesh_energy_watch *watch;
  flesh_nonlinear *nonlinear;
  const flesh_stage *stage;
  double *scratch[2]; /* [3*n] each; overwritten by methods of first order */
  int second;             /* of second order */
  double from, to;        /* s */
  const double *energies; /* [effects] energies at the end, but for the kinetic one, if that is not the stage */
  int stages;             /* number of stages; more than one: flesh_step_energy_add has added up the work */
  double work, power;     /* J, work; W, power of the last stage */
} flesh_step_energy;

/* Adds the work of the stage just solved, one of several: its power times `weight` of the step's length, and at the
 * first stage the power at the step's start with weight `start`. A negative status ends the run. */
int flesh_step_energy_add(flesh_step_energy *step, double weight, double start);

/* Finds the power that is put in at t, where a method starts that goes on from the acceleration a [3*n] there, with
 * steps of h. Overwrites r [3*n]. */
int flesh_step_energy_begin(flesh_energy_watch *watch, const flesh_prescribed *prescribed, const flesh_state *state,
                            double t, double h, const double *a, double *r);
/* Counts what is known before the state goes to the step's end; then takes in the end, and judges it. A negative status
 * ends the run; FLESH_ERR_ENERGY as flesh_energy_watch_judge. */
int flesh_step_energy_count(const flesh_step_energy *step, const flesh_state *state);
int flesh_step_energy_record(const flesh_step_energy *step, const flesh_state *start, const flesh_state *end);
int flesh_step_energy_judge(const flesh_step_energy *step, const flesh_state *end, const flesh_solve_stats *stats);

#endif
