/* ida_parts.h: the members of flesh_ida_steps, and how failures are told: of ida.c and ida_failure.c alone. */
#ifndef FLESH_TIME_IDA_PARTS_H
#define FLESH_TIME_IDA_PARTS_H

#include "base/team.h"
#include "sundials/ida_problem.h"
#include "time/ida_energy.h"
#include "time/recovery/recovery.h"

struct flesh_ida_steps {
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
  int running;
  long serial; /* of that state */
  double t, h;
  double t_internal;      /* IDA's own time, at or beyond t */
  long rejected, unconverged, newton; /* IDA's counts that are in the statistics already */
  int (*stop)(void *data);
  void *stop_data;
  flesh_ida_energy energy;
  flesh_failure failure;
};

/* Records what is known of a failure at t with the body at x, of all ranks. */
void flesh_ida_steps_record_failure(struct flesh_ida_steps *steps, double t, const double *x, int status);
/* Records a failure with words; returns FLESH_ERR_INTEGRATOR. */
int flesh_ida_steps_fail(struct flesh_ida_steps *steps, double t, const double *x, int status, const char *cause);
/* No start from the state. */
int flesh_ida_steps_fail_start(struct flesh_ida_steps *steps, const flesh_state *state, int status);
/* IDA's words for why it stopped, in ours. Returns a status. */
int flesh_ida_steps_fail_by_flag(struct flesh_ida_steps *steps, int flag);

#endif
