/* step_energy.h: the work put in over the steps of fixed methods, for the balance of energy_watch.h. */
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
  double *scratch[2]; /* [3*n] each; of first order overwritten */
  int second;             /* of second order */
  double from, to;        /* s */
  const double *energies; /* [effects] at its end, but for the kinetic one, where that is not the stage */
} flesh_step_energy;

/* The power that is put in at t, where a method starts that goes on from the acceleration a [3*n] there, with steps of
 * h. Overwrites r [3*n]. */
int flesh_step_energy_begin(flesh_energy_watch *watch, const flesh_prescribed *prescribed, const flesh_state *state,
                            double t, double h, const double *a, double *r);
/* Counts what is known before the state goes to the step's end; then judges the end. A negative status ends the run,
 * FLESH_ERR_ENERGY as flesh_energy_watch_judge. */
int flesh_step_energy_count(const flesh_step_energy *step, const flesh_state *state);
int flesh_step_energy_judge(const flesh_step_energy *step, const flesh_state *state, const flesh_solve_stats *stats);

#endif
