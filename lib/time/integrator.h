/* integrator.h: the parts of an integrator, shared by its life (integrator.c), its steps in time (steps.c, start.c), its
 * equilibria (equilibrium.c), and runs, which ask it for near pairs; by nothing else. */
#ifndef FLESH_TIME_INTEGRATOR_H
#define FLESH_TIME_INTEGRATOR_H

#include <stdatomic.h>

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

/* Sources of first iterates. */
typedef struct flesh_first_iterates {
  flesh_extrapolation extrapolation; /* first iterates of stages, which IDA does not have */
  flesh_rigid_parts parts;
} flesh_first_iterates;

/* How often a stage is solved, each time with what is lagged as the last solve left it. */
typedef struct flesh_lag {
  int iterations;    /* number from the options, or the one that keeps the method's order */
  int most;          /* number while friction is off by more than little */
  int controlled, most_controlled; /* both, in steps whose length the error chooses */
  double *x, *v, *u; /* [n] end of the last solve, and its unknowns; NULL: one solve a stage at most */
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
  double gap;              /* gaps of constraints left by a step whose error is not judged; 0: the options' */
  /* [n] Start of a static solve with increments; end of a solve with softer materials, until that of the true ones
   * ends. Else room, as `room` below: mostly for the end that a solved stage leads to. */
  double *x;
  double *energies;        /* [effects] energies at the end of a step that is not its stage, J */
  double *energies_before; /* [effects] energies where the step began, J */
} flesh_part_tried;

struct flesh_integrator {
  atomic_int steps; /* a step is being taken: its memory serves one caller at a time */
  flesh_evaluation *evaluation; /* the run's memory: that of `nonlinear` */
  const flesh_method_row *row;
  int second; /* steps end at events, and constrained dofs follow the prescribed motion itself */
  flesh_method_memory memory;
  flesh_solver_options options;
  flesh_nonlinear *nonlinear;
  flesh_recovery recovery;
  flesh_continuation continuation;
  flesh_prescribed prescribed; /* order > 1 */
  flesh_first_iterates first;
  /* [n] First iterates of a stage, until its solve ends. Else room, which nobody needs after returning. */
  double *room[2];
  flesh_lag lag;
  flesh_followers followers; /* of equilibria */
  flesh_last_stage last_stage;
  flesh_part_tried part;
  flesh_error_control control; /* for methods that estimate their error; off unless asked for */
  flesh_ahead ahead;           /* of such methods */
  flesh_costs costs;
  flesh_ida_steps *ida; /* NULL: another method */
  flesh_energy_watch watch; /* for methods that step in time */
  flesh_multipliers multipliers;
  flesh_internals internals;
  double residual_last, residual_target; /* N, of the last solve */
  flesh_tape *tape; /* borrowed; NULL: no tape */
};

/* Sets view = *state, with the integrator's own multipliers and internal variables if it has none. FLESH_ERR_ARGUMENT for
 * a wrong number of them. */
int flesh_integrator_view(const flesh_integrator *integrator, const flesh_state *state, flesh_state *view);

/* Takes in that the run is at this state, from which a step will start. FLESH_ERR_NONFINITE, FLESH_ERR_MEMORY. */
int flesh_integrator_begin(flesh_integrator *integrator, const flesh_state *state);

/* Takes in that an accepted step, or a part of one, has led to this state. *changed: whether forces differ from now on;
 * the energy that this dissipates is booked. FLESH_ERR_NONFINITE, FLESH_ERR_MEMORY. */
int flesh_integrator_arrive(flesh_integrator *integrator, const flesh_state *state, int *changed);

/* Loads what `data`, of flesh_integrator_save, has of nodes, tets and the motion as a whole, saved by one rank (or a
 * process by itself) of `others` that share out the same body. Called once for each of these ranks; what solvers have
 * learned is not loaded. FLESH_ERR_FILE, FLESH_ERR_ARGUMENT. */
int flesh_integrator_take(flesh_integrator *integrator, const void *data, size_t size, const flesh_archive_others *others);

/* Returns the difference [s] below which times are the same in a step of h from t: grids of steps and times of events
 * carry rounding. */
double flesh_rounding_of_time(double t, double h);

/* Goes from the place, where the state is, to the step's end: in one piece or, for methods of order 2, in pieces
 * between events. A status > 0 comes with the recovery's failure. */
int flesh_integrator_step_in_time(flesh_integrator *integrator, flesh_state *state, flesh_step_place *place,
                                  flesh_solve_stats *stats);
/* Takes the state, which was saved at the place together with the integrator, to the step's end. The state has the
 * multipliers and internal variables of the system. The errors of flesh_integrator_step. */
int flesh_integrator_resume(flesh_integrator *integrator, const flesh_step_place *place, flesh_state *state);
/* Drops matrices, factors, and displacements to extrapolate, so that little is left to be saved: the next step begins
 * as the first one does. */
void flesh_integrator_forget(flesh_integrator *integrator);
/* Tells the tape, if there is one, that the run is between two parts. Returns the tape's status. */
int flesh_integrator_pass(flesh_integrator *integrator, const flesh_state *state, flesh_step_place *place);
/* Solves for equilibrium at state->t + h, by others before it if an obstacle cannot move so far at once; one that is a
 * tangle is untangled and solved again. Status as above. */
int flesh_integrator_find_equilibrium(flesh_integrator *integrator, flesh_state *state, double h,
                                      flesh_solve_stats *stats);

/* Solves for equilibrium with the load increment->to < 1 of that at state->t + h, from the equilibrium `state` with
 * increment->from, whose shape decides the direction of loads that follow it. state->t stays. Status as above. */
int flesh_integrator_find_at_load(flesh_integrator *integrator, flesh_state *state, const flesh_load_increment *increment,
                                  double h, flesh_solve_stats *stats);

/* Collects everything that is known of a solve of the stage, with h, that failed. */
void flesh_integrator_record_failure(flesh_integrator *integrator, const flesh_stage *stage, double h, int halvings,
                                     int status, const flesh_solve_stats *stats);
/* Returns the state at which the forces of the last step balance: before the step's end, or `state` itself. */
const flesh_state *flesh_integrator_stage(const flesh_integrator *integrator, const flesh_state *state);

/* Returns how often every effect was evaluated since creation; set `timed` to have CPU times as well. Owned by the
 * integrator. */
flesh_costs *flesh_integrator_costs(flesh_integrator *integrator);

/* Returns whether a run is one step from its start to its end, whatever h is: an equilibrium in which nothing changes
 * with time. */
int flesh_run_is_single(const flesh_system *system, flesh_method method);
/* FLESH_ERR_ARGUMENT if a run, of a `single` step or not, cannot go from `t` to `end` in steps of h, of which `step`
 * from `begin` have led to t. */
int flesh_run_check_times(int single, double h, double end, int step, double begin, double t);

#endif
