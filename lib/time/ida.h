/* ida.h: variable steps and orders by IDA behind flesh_integrator_step. */
#ifndef FLESH_TIME_IDA_H
#define FLESH_TIME_IDA_H

#include "base/archive.h"
#include "flesh/integrator.h"
#include "newton/newton.h"
#include "sundials/ida_problem.h"
#include "time/ida_energy.h"
#include "time/recovery/recovery.h"

typedef struct flesh_ida_steps {
  const flesh_system *system;
  const flesh_team *team; /* the system's team; NULL: no ranks */
  flesh_adaptive_options options;
  flesh_ida_problem *problem;
  int n;
  SUNContext context;
  void *ida;
  SUNMatrix matrix;
  SUNLinearSolver solver;
  N_Vector y, yp, atol, errors, rates; /* rates: for the energy's interpolant */
  flesh_evaluation *evaluation; /* the run's, borrowed */
  /* The state given back last, at t after a step of h, to which IDA's history belongs. */
  int running; /* IDA has a history */
  long serial; /* of that state */
  double t, h;
  double t_internal;      /* IDA's own time, at or beyond t */
  long rejected, unconverged, newton; /* IDA's counts that the statistics have already */
  flesh_stop stop;
  flesh_ida_energy energy;
  flesh_failure failure; /* the last one */
} flesh_ida_steps;

/* Creates IDA for a run. Borrows the run's evaluation and the watch; copies the options. Returns new, unless a rank
 * comes with a `status` other than FLESH_OK from what it has made before; it may fail on one rank alone. Collective. */
int flesh_ida_steps_create_after(int status, flesh_evaluation *evaluation, const flesh_solver_options *solver,
                                 flesh_energy_watch *watch, flesh_ida_steps **steps);
void flesh_ida_steps_destroy(flesh_ida_steps **steps);
/* FLESH_ERR_ARGUMENT if a value is out of its range. */
int flesh_adaptive_options_check(const flesh_adaptive_options *options);
/* Shows an internal step to its observer; returns the status of all ranks. */
int flesh_adaptive_options_show(const flesh_adaptive_options *options, const flesh_team *team,
                                const flesh_internal_step *step);
int flesh_ida_steps_set_options(flesh_ida_steps *steps, const flesh_adaptive_options *options);

/* Takes the state to t+h by internal steps. Starts anew at events, and when the state is not the one given back last.
 * FLESH_ERR_INTEGRATOR, with the details in `failure`; the state is then the last one reached. */
int flesh_ida_steps_step(flesh_ida_steps *steps, flesh_state *state, double h, flesh_solve_stats *stats);

/* Finds t and h of IDA's internal step. */
void flesh_ida_steps_progress(const flesh_ida_steps *steps, flesh_progress *progress);
/* Archives everything but IDA's history, which IDA does not take back: after loading it starts anew from the state
 * given back last. */
void flesh_ida_steps_archive(flesh_ida_steps *steps, flesh_archive *archive);

/* Reports of failures, in ida_failure.c. */
/* Records what is known, on all ranks, of a failure at t with the body at x. */
void flesh_ida_steps_record_failure(flesh_ida_steps *steps, double t, const double *x, int status);
/* Records a failure with a sentence; returns FLESH_ERR_INTEGRATOR. */
int flesh_ida_steps_fail(flesh_ida_steps *steps, double t, const double *x, int status, const char *cause);
/* Records that no start from the state was found. */
int flesh_ida_steps_fail_start(flesh_ida_steps *steps, const flesh_state *state, int status);
/* Puts IDA's reason for a stop into a sentence. Returns a status. */
int flesh_ida_steps_fail_by_flag(flesh_ida_steps *steps, int flag);

#endif
