/* ida.c: owns an IDA and lets it take its own steps; outputs are read from its interpolant. */
#include "time/ida.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "system/feasible_step.h"
#include "time/method.h"
#include "sundials/compatibility.h"
#include "sundials/vector.h"
#include "system/ranks.h"

enum { CLONES = 24 }; /* vectors made in advance, at least as many as IDAInit clones */

/* IDA has no stages of the method's own. */
const flesh_method_row flesh_method_ida = {0};

static int make_sundials(flesh_ida_steps *self)
{
  self->yp = flesh_vector_clone(self->y);
  self->atol = flesh_vector_clone(self->y);
  self->errors = flesh_vector_clone(self->y);
  self->rates = flesh_vector_clone(self->y);
  self->ida = IDACreate(self->context);
  if (!self->yp || !self->atol || !self->errors || !self->rates || !self->ida)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for IDA on %d unknowns", 2 * self->n);
  self->energy.ida = self->ida;
  self->energy.y = self->errors; /* needed only after failures */
  self->energy.yp = self->rates;
  flesh_ida_silence(self->context, self->ida);
  int status = flesh_ida_sunmatrix_create(self->problem, self->context, &self->matrix);
  if (!status) status = flesh_ida_sunlinsol_create(self->problem, self->context, &self->solver);
  return status ? status : flesh_vector_prepare(self->y, CLONES); /* those not taken are freed when others are made */
}

/* Local errors fall with h^(q+1), their sum with h^q. */
static double local_tolerance(const flesh_adaptive_options *options)
{
  return pow(options->tolerance, 1 + 1. / options->max_order);
}

/* Sets the options of IDA that stay until others are set. */
static int apply_options(flesh_ida_steps *self)
{
  static const double usual = 0.33, gap = 3.3e-4; /* IDA's default; over the body's length, as gaps of contact are */
  const flesh_adaptive_options *options = &self->options;
  int failed = IDASetMaxOrd(self->ida, options->max_order);
  /* IDA by default lengthens a step only where it can double it, so that errors lie up to eightfold below the
   * tolerance; at order 2 a step longer by a fifth is worth the change. At higher orders such steps press against the
   * limit of stability, and fail. */
  failed |= IDASetEtaFixedStepBounds(self->ida, 1, options->max_order > 2 ? 2 : 1.2);
  /* Newton's iterations leave errors in the velocities that would lead the next step through the obstacle, whose solve
   * then fails. */
  const double deep = flesh_system_has_role(self->system, FLESH_ROLE_CONTACT) ? gap / local_tolerance(options) : usual;
  failed |= IDASetNonlinConvCoef(self->ida, fmin(usual, deep));
  failed |= IDASetMaxStep(self->ida, isfinite(options->max_step) ? options->max_step : 0);
  return failed ? flesh_fail(FLESH_ERR_SUNDIALS, "IDA refused an option") : FLESH_OK;
}

/* Attaches all parts to IDA's memory, so that its owner can set anything that IDA can set. Each run is a new start. */
static int initialise(flesh_ida_steps *self)
{
  N_VConst(0, self->y);
  N_VConst(0, self->yp);
  N_VConst(1, self->atol);
  /* Each call needs what the calls before it have made; IDA clones the vector of tolerances at the first one. */
  int failed = IDAInit(self->ida, flesh_ida_residual, 0, self->y, self->yp) ||
               IDASVtolerances(self->ida, 0, self->atol) || IDASetUserData(self->ida, self->problem) ||
               IDASetLinearSolver(self->ida, self->solver, self->matrix) ||
               IDASetJacFn(self->ida, flesh_ida_jacobian);
  flesh_vector_drop();
  if (failed) return flesh_fail(FLESH_ERR_SUNDIALS, "IDA could not begin");
  failed |= IDASetMaxNumSteps(self->ida, -1); /* counted here */
  return failed ? flesh_fail(FLESH_ERR_SUNDIALS, "IDA refused an option") : apply_options(self);
}

int flesh_ida_steps_create_after(int status, flesh_evaluation *evaluation, const flesh_solver_options *solver,
                                 flesh_energy_watch *watch, flesh_ida_steps **steps)
{
  const flesh_system *system = evaluation->system;
  *steps = NULL;
  flesh_ida_steps *self = calloc(1, sizeof *self);
  if (self) {
    self->system = system;
    self->team = evaluation->team;
    self->n = flesh_system_unknowns(system);
    flesh_adaptive_options_default(&self->options);
    self->evaluation = evaluation;
  } else {
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for the steps of IDA");
  }
  if (self && flesh_suncontext_create(&self->context)) status = flesh_fail(FLESH_ERR_SUNDIALS, "SUNDIALS gave no context");
  flesh_ida_problem *problem;
  status = flesh_ida_problem_create_after(status, system, solver, &problem);
  if (self) self->problem = problem;
  if (!status) status = flesh_ida_vector_create(self->problem, self->context, &self->y);
  if (!status) status = flesh_ida_energy_create(self->problem, watch, &self->energy);
  if (!status) status = make_sundials(self);
  status = flesh_team_agree(evaluation->team, status);
  if (!status) flesh_ida_energy_tolerate(&self->energy, self->options.tolerance);
  if (!status) status = initialise(self); /* IDA asks for the smallest tolerance */
  if (status) {
    flesh_ida_steps_destroy(&self);
    return status;
  }
  *steps = self;
  return FLESH_OK;
}

void flesh_ida_steps_destroy(flesh_ida_steps **steps)
{
  if (!steps || !*steps) return;
  flesh_ida_steps *self = *steps;
  if (self->ida) IDAFree(&self->ida);
  if (self->solver) SUNLinSolFree(self->solver);
  if (self->matrix) SUNMatDestroy(self->matrix);
  N_Vector vectors[] = {self->y, self->yp, self->atol, self->errors, self->rates};
  for (size_t k = 0; k < sizeof vectors / sizeof vectors[0]; k++)
    if (vectors[k]) N_VDestroy(vectors[k]);
  if (self->context) SUNContext_Free(&self->context);
  flesh_ida_problem_destroy(&self->problem);
  flesh_ida_energy_clear(&self->energy);
  free(self);
  *steps = NULL;
}

int flesh_ida_steps_set_options(flesh_ida_steps *self, const flesh_adaptive_options *options)
{
  int status = flesh_adaptive_options_check(options);
  if (status) return status;
  self->options = *options;
  self->running = 0;
  flesh_ida_energy_tolerate(&self->energy, options->tolerance);
  return apply_options(self);
}

void flesh_ida_steps_progress(const flesh_ida_steps *self, flesh_progress *progress)
{
  progress->t = self->t_internal;
  IDAGetCurrentStep(self->ida, &progress->h);
}

/* (Re)starts IDA from the state. `ahead` [s]: the least time to go. */
static int start(flesh_ida_steps *self, flesh_state *state, double ahead)
{
  const flesh_adaptive_options *options = &self->options;
  const double local = local_tolerance(options);
  self->running = 0;
  self->rejected = self->unconverged = self->newton = 0;
  if (!flesh_energy_watch_knows(self->energy.watch)) flesh_energy_watch_jump(self->energy.watch, state->t, state);
  int status = flesh_ida_start(self->problem, state, self->y, self->yp);
  /* Passes an event that only rounding sets apart from t. */
  while (!status && flesh_ida_event(self->problem) - state->t < 1e-10 * self->h) {
    state->t = flesh_ida_event(self->problem);
    status = flesh_ida_start(self->problem, state, self->y, self->yp);
  }
  if (status) return status;
  double curvature = flesh_ida_curvature(self->problem, ahead, self->y, self->yp);
  if ((status = flesh_ida_tolerances(self->problem, local, self->atol))) return status;
  if (IDAReInit(self->ida, state->t, self->y, self->yp))
    return flesh_fail(FLESH_ERR_SUNDIALS, "IDA could not start anew");
  const double event = flesh_ida_event(self->problem);
  /* The first step has half the local error that one of order 1 may make; where nothing moves yet, a tenth of the
   * step asked for. */
  double first = fmin(sqrt(local / curvature), 0.1 * (event - state->t));
  if (!(first < INFINITY)) first = 0.1 * ahead;
  first = fmax(first, 1e-9 * fmin(ahead, event - state->t));
  int failed = IDASVtolerances(self->ida, 0, self->atol);
  failed |= IDASetInitStep(self->ida, fmin(first, options->max_step));
  failed |= IDASetStopTime(self->ida, fmin(event, 1e300));
  if (failed) return flesh_fail(FLESH_ERR_SUNDIALS, "IDA refused an option");
  self->running = 1;
  self->t = self->t_internal = state->t;
  self->failure = (flesh_failure){0};
  self->problem->accepted.limits = flesh_system_limits_step(self->system);
  flesh_ida_energy_start(&self->energy, state->t, N_VGetArrayPointer(self->y));
  return FLESH_OK;
}

static int returned(const flesh_ida_steps *self) { return self->serial == self->evaluation->serial; }

static void give_back(flesh_ida_steps *self, double t, flesh_state *state)
{
  flesh_ida_get_state(self->problem, t, self->y, state);
  flesh_evaluation_changed(self->evaluation);
  self->serial = self->evaluation->serial;
  self->t = t;
}

/* Brings IDA's counts into the statistics; adds those of the step just taken or tried to *step. */
static void count(flesh_ida_steps *self, flesh_solve_stats *stats, flesh_internal_step *step)
{
  long rejected = 0, unconverged = 0, newton = 0;
  IDAGetNumErrTestFails(self->ida, &rejected);
  IDAGetNumStepSolveFails(self->ida, &unconverged);
  IDAGetNumNonlinSolvIters(self->ida, &newton);
  step->rejected = (int)(rejected - self->rejected);
  step->convergence_failures = (int)(unconverged - self->unconverged);
  stats->rejected += step->rejected;
  stats->convergence_failures += step->convergence_failures;
  stats->newton += (int)(newton - self->newton);
  self->rejected = rejected;
  self->unconverged = unconverged;
  self->newton = newton;
}

static void add_problem_stats(flesh_ida_steps *self, flesh_solve_stats *stats)
{
  flesh_solve_stats *own = flesh_ida_stats(self->problem);
  stats->linear += own->linear;
  stats->assemblies += own->assemblies;
  stats->projections += own->projections;
  stats->residuals += own->residuals;
  memset(own, 0, sizeof *own);
}

/* Shows the step with its state. Uses the memory for local errors, which are needed only after failures. */
static int show(flesh_ida_steps *self, flesh_internal_step *step)
{
  double *room = N_VGetArrayPointer(self->errors);
  flesh_state state = {.t = step->t, .x = room, .v = room + self->n};
  flesh_ida_get_state(self->problem, step->t, self->y, &state);
  step->state = &state;
  return flesh_adaptive_options_show(&self->options, self->team, step);
}

/* Takes one internal step; *event is set when it ends at an event. */
static int advance(flesh_ida_steps *self, double toward, flesh_solve_stats *stats, int *event)
{
  const double before = self->t_internal;
  double reached = before;
  flesh_internal_step step = {0};
  int status = flesh_ida_energy_count(&self->energy, before); /* rest of the last step */
  if (status < 0) return status;
  int flag = IDASolve(self->ida, toward, &reached, self->y, self->yp, IDA_ONE_STEP);
  count(self, stats, &step);
  self->t_internal = reached;
  if (flag < 0) return flesh_ida_steps_fail_by_flag(self, flag);
  *event = flag == IDA_TSTOP_RETURN;
  if (!(reached > before) && !*event)
    return flesh_ida_steps_fail(self, before, self->problem->evaluation.x, FLESH_NOT_CONVERGED,
                                "the step is too short to change t");
  flesh_ida_accept(self->problem, reached, N_VGetArrayPointer(self->y), N_VGetArrayPointer(self->y) + self->n);
  IDAGetLastStep(self->ida, &step.h);
  IDAGetLastOrder(self->ida, &step.order);
  step.t = reached;
  stats->steps++;
  stats->order = step.order;
  stats->h_last = step.h;
  status = self->options.observe ? show(self, &step) : FLESH_OK;
  if (status < 0) return status;
  return reached < toward ? flesh_ask_together(self->team, self->stop.stop, self->stop.data) : FLESH_OK;
}

/* Returns whether there is spurious energy at the state, which is the one given back. */
static int watch_energy(flesh_ida_steps *self, const flesh_state *state)
{
  int status = flesh_ida_energy_judge(&self->energy, state);
  if (status != FLESH_ERR_ENERGY) return status;
  self->running = 0;
  flesh_ida_steps_record_failure(self, state->t, state->x, status);
  return status;
}

/* Steps on to `end`. The state becomes that at the end or, when something fails, at the last internal step. */
static int run_to(flesh_ida_steps *self, flesh_state *state, double end, flesh_solve_stats *stats)
{
  const double rounding = 1e-10 * self->h;
  int status = FLESH_OK;
  for (int steps = 0; !status; ) {
    int event = 0;
    while (!status && !event && self->t_internal < end) {
      if (steps++ == self->options.max_steps) {
        char cause[96];
        snprintf(cause, sizeof cause, "max_steps = %d internal steps did not lead to %.9g s",
                 self->options.max_steps, end);
        status = flesh_ida_steps_fail(self, self->t_internal, self->problem->evaluation.x, FLESH_NOT_CONVERGED, cause);
        break;
      }
      status = advance(self, end, stats, &event);
    }
    if (status) {
      /* the last state that IDA reached is in y */
      if (self->t_internal > state->t && self->t_internal <= end) give_back(self, self->t_internal, state);
      self->running = 0;
      break;
    }
    if (event && self->t_internal < end - rounding) {
      give_back(self, self->t_internal, state);
      if ((status = watch_energy(self, state))) break;
      status = start(self, state, end - state->t);
      if (status > 0) status = flesh_ida_steps_fail_start(self, state, status);
      continue;
    }
    if (self->t_internal > end && IDAGetDky(self->ida, end, 0, self->y))
      return flesh_fail(FLESH_ERR_SUNDIALS, "IDA could not interpolate at t = %.9g s", end);
    give_back(self, end, state);
    if (event) self->running = 0;
    return watch_energy(self, state);
  }
  return status;
}

int flesh_ida_steps_step(flesh_ida_steps *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  const double begin = state->t, end = begin + h;
  int status = FLESH_OK, fresh = !self->running || !returned(self);
  self->h = h;
  if (fresh) {
    status = start(self, state, h);
    if (status > 0) status = flesh_ida_steps_fail_start(self, state, status);
  }
  if (!status) status = run_to(self, state, end, stats);
  add_problem_stats(self, stats);
  return status;
}

void flesh_ida_steps_archive(flesh_ida_steps *self, flesh_archive *archive)
{
  FLESH_ARCHIVE(archive, self->t);
  FLESH_ARCHIVE(archive, self->h);
  FLESH_ARCHIVE(archive, self->serial);
  if (archive->mode == FLESH_ARCHIVE_LOAD) self->running = 0;
}
