/* ida.h: variable steps and orders by IDA behind flesh_integrator_step. */
#ifndef FLESH_TIME_IDA_H
#define FLESH_TIME_IDA_H

#include <stddef.h>

#include "base/archive.h"
#include "flesh/integrator.h"
#include "newton/newton.h"
#include "sundials/ida_problem.h"
#include "time/ida_energy.h"
#include "time/recovery/recovery.h"

typedef struct flesh_ida_steps {
  const flesh_system *system;
  const flesh_team *team; /* the system's; NULL: none */
  flesh_adaptive_options options;
  flesh_ida_problem *problem;
  int n;
  SUNContext context;
  void *ida;
  SUNMatrix matrix;
  SUNLinearSolver solver;
  N_Vector y, yp, atol, errors, rates; /* the last for the energy's interpolant */
  flesh_evaluation *evaluation; /* the run's, borrowed */
  /* The state given back last, at t with a step of h, to which IDA's memory belongs. */
  int running; /* IDA has a history */
  long serial; /* of that state */
  double t, h;
  double t_internal;      /* IDA's own time, at or beyond t */
  long rejected, unconverged, newton; /* IDA's counts that are in the statistics already */
  flesh_stop stop;
  flesh_ida_energy energy;
  flesh_failure failure; /* the last one */
} flesh_ida_steps;

/* Borrows the run's evaluation and the watch; copies the options. Returns new, unless a rank comes with a `status` other
 * than FLESH_OK, of what it has made before; it may fail on one rank alone. Collective. */
int flesh_ida_steps_create_after(int status, flesh_evaluation *evaluation, const flesh_solver_options *solver,
                                 flesh_energy_watch *watch, flesh_ida_steps **steps);
void flesh_ida_steps_destroy(flesh_ida_steps **steps);
/* FLESH_ERR_ARGUMENT where a value is out of its range. */
int flesh_adaptive_options_check(const flesh_adaptive_options *options);
/* Shows an internal step to who observes them; the status is that of all ranks. */
int flesh_adaptive_options_show(const flesh_adaptive_options *options, const flesh_team *team,
                                const flesh_internal_step *step);
int flesh_ida_steps_set_options(flesh_ida_steps *steps, const flesh_adaptive_options *options);

/* Takes the state to t+h by internal steps, starting anew at events and when the state is not the one it was given
 * back. FLESH_ERR_INTEGRATOR with what is known in `failure`; the state is then the last one reached. */
int flesh_ida_steps_step(flesh_ida_steps *steps, flesh_state *state, double h, flesh_solve_stats *stats);

/* t and h of IDA's internal step. */
void flesh_ida_steps_progress(const flesh_ida_steps *steps, flesh_progress *progress);
/* But for IDA's history, which it does not take back: loaded, it starts anew from the state given back last. */
void flesh_ida_steps_archive(flesh_ida_steps *steps, flesh_archive *archive);

/* Failures are told by ida_failure.c. */
/* Records what is known of a failure at t with the body at x, of all ranks. */
void flesh_ida_steps_record_failure(flesh_ida_steps *steps, double t, const double *x, int status);
/* Records a failure with words; returns FLESH_ERR_INTEGRATOR. */
int flesh_ida_steps_fail(flesh_ida_steps *steps, double t, const double *x, int status, const char *cause);
/* No start from the state. */
int flesh_ida_steps_fail_start(flesh_ida_steps *steps, const flesh_state *state, int status);
/* IDA's words for why it stopped, in ours. Returns a status. */
int flesh_ida_steps_fail_by_flag(flesh_ida_steps *steps, int flag);

#endif
