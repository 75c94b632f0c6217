/* integrator.h: what an integrator is made of: shared by its life (integrator.c), its steps in time (steps.c) and its
 * equilibria (equilibrium.c), and by nothing else but runs, which ask it for what is near. */
#ifndef FLESH_TIME_INTEGRATOR_H
#define FLESH_TIME_INTEGRATOR_H

#include <stdatomic.h>
#include <stdint.h>

#include "sundials/kinsol.h"
#include "system/system.h"
#include "time/ahead.h"
#include "time/ida.h"
#include "time/energy_watch.h"
#include "time/error_control.h"
#include "time/extrapolation.h"
#include "time/followers.h"
#include "time/internals.h"
#include "time/method.h"
#include "time/multipliers.h"
#include "time/prescribed.h"
#include "time/recovery/continuation.h"
#include "time/recovery/recovery.h"
#include "time/rigid_guess.h"
#include "time/step_place.h"
#include "time/tape.h"

/* Sources of a step's first iterates. */
typedef struct flesh_first_iterates {
  flesh_extrapolation extrapolation; /* of stages, which IDA has none of */
  flesh_rigid_parts parts;
} flesh_first_iterates;

/* Solves of a stage with what is lagged as the last one has left it. */
typedef struct flesh_lag {
  int iterations;    /* the options', or what keeps the method's order */
  int most;          /* while friction is off by more than little */
  int controlled, most_controlled; /* both, of a step whose length its error chooses */
  double *x, *v, *u; /* [n] where the last solve has ended, and its unknowns; NULL with one solve at most */
} flesh_lag;

/* The stage that has led to the run's state; order > 1. */
typedef struct flesh_last_stage {
  int known;      /* it is before that step's end */
  flesh_state at; /* {t, x, v} where its forces balance */
} flesh_last_stage;

/* The part of a step, or the equilibrium, under way. */
typedef struct flesh_part_tried {
  flesh_span span;
  int softer;              /* its stages go through softer materials */
  int blocked;             /* an obstacle bars its end, though not its stage */
  double gap;              /* of constraints, that a step may leave whose error is not judged; 0: that of the options */
  /* [n] Where a static solve with increments began; where a solve of softer materials has ended, until that of the true ones
   * ends. Else room, as `room` below: mostly for the end that a solved stage leads to. */
  double *x;
  double *energies;        /* [effects] at the end of a step that is not its stage, J */
  double *energies_before; /* [effects] where the step began, J */
} flesh_part_tried;

struct flesh_integrator {
  atomic_int steps; /* a step is being made: its memory serves one at a time */
  flesh_evaluation *evaluation; /* the run's: that of `nonlinear` */
  const flesh_method_row *row;
  int second; /* steps end at events, and constrained dofs follow the prescribed motion itself */
  flesh_method_memory memory;
  flesh_solver_options options;
  flesh_nonlinear *nonlinear;
  flesh_recovery recovery;
  flesh_continuation continuation;
  flesh_prescribed prescribed; /* order > 1 */
  flesh_first_iterates first;
  /* [n] The first iterates of a stage, until its solve ends. Else room: whoever fills it is done with it on return. */
  double *room[2];
  flesh_lag lag;
  flesh_followers followers; /* of equilibria */
  flesh_last_stage last_stage;
  flesh_part_tried part;
  flesh_error_control control; /* of methods that estimate their error; off unless asked for */
  flesh_ahead ahead;           /* of such methods */
  flesh_costs costs;
  flesh_ida_steps *ida; /* NULL: another method */
  flesh_energy_watch watch; /* of methods that step in time */
  flesh_multipliers multipliers;
  flesh_internals internals;
  double residual_last, residual_target; /* N, of the last solve */
  flesh_tape *tape; /* borrowed; NULL: nobody listens */
};

/* The run is at this state, from which a step will start. FLESH_ERR_NONFINITE, FLESH_ERR_MEMORY. */
int flesh_integrator_begin(flesh_integrator *integrator, const flesh_state *state);

/* A step, or a part of one, that was accepted has led to this state. *changed: whether forces there are others from now
 * on; the energy that goes is booked. FLESH_ERR_NONFINITE, FLESH_ERR_MEMORY. */
int flesh_integrator_arrive(flesh_integrator *integrator, const flesh_state *state, int *changed);

/* Takes what `data`, of flesh_integrator_save, has of nodes, of tets and of the motion as a whole, where a rank or a
 * process by itself has saved it that has `others` of the same body. Once for each rank that has saved; what solvers
 * have learned is left out. FLESH_ERR_FILE, FLESH_ERR_ARGUMENT. */
int flesh_integrator_take(flesh_integrator *integrator, const void *data, size_t size, const flesh_archive_others *others);

/* Times closer than this [s] are the same in a step of h from t: grids of steps and times of events carry rounding. */
double flesh_rounding_of_time(double t, double h);

/* From the place, where the state is, to the step's end: in one piece or, for methods of order 2, in pieces between
 * events. A status > 0 with the recovery's failure. */
int flesh_integrator_step_in_time(flesh_integrator *integrator, flesh_state *state, flesh_step_place *place,
                                  flesh_solve_stats *stats);
/* Takes the state, which was saved at the place together with the integrator, to the step's end. It has the multipliers
 * and internal variables of the system. The errors of flesh_integrator_step. */
int flesh_integrator_resume(flesh_integrator *integrator, const flesh_step_place *place, flesh_state *state);
/* Drops matrices, factors, and displacements to extrapolate: the next step begins as the first one does, and so little is
 * left to be saved. */
void flesh_integrator_forget(flesh_integrator *integrator);
/* Tells the tape, if there is one, that the run is between two parts. Returns the status of the tape. */
int flesh_integrator_pass(flesh_integrator *integrator, const flesh_state *state, flesh_step_place *place);
/* Equilibrium at state->t + h, by others before it where an obstacle cannot move so far at once; one that is a tangle is
 * untangled and solved again. Status as above. */
int flesh_integrator_find_equilibrium(flesh_integrator *integrator, flesh_state *state, double h,
                                      flesh_solve_stats *stats);

/* Everything that is known about a solve of the stage, with h, that failed. */
void flesh_integrator_record_failure(flesh_integrator *integrator, const flesh_stage *stage, double h, int halvings,
                                     int status, const flesh_solve_stats *stats);
/* The state at which the forces of the last step balance: before the step's end, or `state` itself. */
const flesh_state *flesh_integrator_stage(const flesh_integrator *integrator, const flesh_state *state);

/* How often every effect was evaluated since creation; set `timed` to have CPU times as well.
 * Owned by the integrator. */
flesh_costs *flesh_integrator_costs(flesh_integrator *integrator);

/* Whether a run is one step from its start to its end, whatever h is: an equilibrium in which nothing changes with time. */
int flesh_run_is_single(const flesh_system *system, flesh_method method);
/* FLESH_ERR_ARGUMENT where a run, of a `single` step or not, cannot go from `t` to `end` in steps of h, of which `step` from
 * `begin` have led to t. */
int flesh_run_check_times(int single, double h, double end, int step, double begin, double t);

#endif
