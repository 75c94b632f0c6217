/* owned_integrator.h: runs an IDA, ARKODE or CVODE that the test owns through all events to an end, with flesh's Newton
 * or with SUNDIALS'. */
#ifndef FLESH_TEST_OWNED_INTEGRATOR_H
#define FLESH_TEST_OWNED_INTEGRATOR_H

#include <arkode/arkode_arkstep.h>
#include <cvode/cvode.h>
#include <ida/ida.h>
#include <math.h>

#include "flesh/sunnonlinsol.h"
#include "sundials/compatibility.h"
#include "test.h"

/* Before SUNDIALS 7.1, the names of ARKODE's functions contain that of the stepper. */
#if SUNDIALS_VERSION_MAJOR * 100 + SUNDIALS_VERSION_MINOR < 701
#define OWNED_ARK(function) ARKStep##function
#else
#define OWNED_ARK(function) ARKode##function
#endif

typedef enum owned_kind { OWNED_IDA, OWNED_ARKODE, OWNED_CVODE, OWNED_KINDS } owned_kind;
static const char *const owned_names[OWNED_KINDS] = {"IDA", "ARKODE", "CVODE"};

typedef struct owned_integrator {
  owned_kind kind;
  int plain;   /* SUNDIALS' Newton with flesh's matrix and linear solver */
  int positions; /* errors are measured by flesh_sunnonlinsol_position_norm; o->y is not read then */
  int untold;  /* ARKODE does not call flesh_ode_accept */
  double tolerance, first_step; /* tolerance of a step, relative; first step, s, 0: the integrator's choice */
  double coefficient; /* tolerance of solves over that of steps; 0: the integrator's default */
  flesh_solver_options options;
  SUNContext context;
  N_Vector y; /* to be cloned */
  /* Counts over all runs. */
  long steps, newton, failures, rejected;
  /* Called after every accepted step unless NULL; y has positions and velocities. */
  void (*look)(void *data, double t, N_Vector y);
  void *data;
  /* The objects, during a run. */
  flesh_ida_problem *ida;
  flesh_ode_problem *ode;
  void *memory;
  SUNMatrix matrix;
  SUNLinearSolver linear;
  SUNNonlinearSolver newton_solver;
} owned_integrator;

/* Lets failures come back as flags only: nothing is printed. */
static inline void owned_silence(owned_integrator *o)
{
#if SUNDIALS_VERSION_MAJOR >= 7
  SUNContext_ClearErrHandlers(o->context);
#else
  if (o->kind == OWNED_IDA) IDASetErrHandlerFn(o->memory, flesh_sundials_ignore, NULL);
  else if (o->kind == OWNED_CVODE) CVodeSetErrHandlerFn(o->memory, flesh_sundials_ignore, NULL);
  else ARKStepSetErrHandlerFn(o->memory, flesh_sundials_ignore, NULL);
#endif
}

static inline owned_integrator owned_new(owned_kind kind, double tolerance, SUNContext context, N_Vector y)
{
  owned_integrator o = {.kind = kind, .tolerance = tolerance, .context = context, .y = y};
  flesh_solver_options_default(&o.options);
  return o;
}

static inline void owned_set_ida(owned_integrator *o, double t, N_Vector y, N_Vector yp)
{
  o->memory = IDACreate(o->context);
  CHECK(!IDAInit(o->memory, flesh_ida_residual, t, y, yp) && !IDASetUserData(o->memory, o->ida));
  CHECK(!IDASetMaxOrd(o->memory, 2) && !IDASetMaxNumSteps(o->memory, 1000000));
  if (o->plain) {
    CHECK_OK(flesh_ida_sunmatrix_create(o->ida, o->context, &o->matrix));
    CHECK_OK(flesh_ida_sunlinsol_create(o->ida, o->context, &o->linear));
    CHECK(!IDASetLinearSolver(o->memory, o->linear, o->matrix) && !IDASetJacFn(o->memory, flesh_ida_jacobian));
  } else {
    CHECK(!IDASetNonlinearSolver(o->memory, o->newton_solver));
  }
}

static inline void owned_set_cvode(owned_integrator *o, double t, N_Vector y)
{
  o->memory = CVodeCreate(CV_BDF, o->context);
  CHECK(!CVodeInit(o->memory, flesh_ode_rhs, t, y) && !CVodeSetUserData(o->memory, o->ode));
  CHECK(!CVodeSetMaxOrd(o->memory, 2) && !CVodeSetMaxNumSteps(o->memory, 1000000));
  if (o->plain) {
    CHECK(!CVodeSetLinearSolver(o->memory, o->linear, o->matrix) && !CVodeSetJacFn(o->memory, flesh_ode_jacobian));
  } else {
    CHECK(!CVodeSetNonlinearSolver(o->memory, o->newton_solver));
  }
}

static inline void owned_set_arkode(owned_integrator *o, double t, N_Vector y)
{
  o->memory = ARKStepCreate(NULL, flesh_ode_rhs, t, y, o->context);
  CHECK(!OWNED_ARK(SetUserData)(o->memory, o->ode) && !OWNED_ARK(SetMaxNumSteps)(o->memory, 1000000));
  CHECK(!ARKStepSetTableName(o->memory, "ARKODE_ESDIRK324L2SA_4_2_3", "ARKODE_ERK_NONE"));
  if (o->plain) {
    CHECK(!OWNED_ARK(SetLinearSolver)(o->memory, o->linear, o->matrix));
    CHECK(!OWNED_ARK(SetJacFn)(o->memory, flesh_ode_jacobian) && !OWNED_ARK(SetNonlinCRDown)(o->memory, 1));
  } else {
    CHECK(!OWNED_ARK(SetNonlinearSolver)(o->memory, o->newton_solver));
    CHECK(!OWNED_ARK(SetDeduceImplicitRhs)(o->memory, 1));
    if (!o->untold) CHECK(!OWNED_ARK(SetPostprocessStepFn)(o->memory, flesh_ode_accept));
  }
}

/* Creates the integrator at the first start, and reinitialises it later. */
static inline void owned_start(owned_integrator *o, double t, N_Vector y, N_Vector yp, N_Vector atol, double stop)
{
  const int first = !o->memory;
  const double h = o->first_step;
  if (o->kind == OWNED_IDA) {
    if (first) owned_set_ida(o, t, y, yp);
    else CHECK(!IDAReInit(o->memory, t, y, yp));
    CHECK(!IDASVtolerances(o->memory, 0, atol) && !IDASetStopTime(o->memory, stop) && !IDASetInitStep(o->memory, h));
    return;
  }
  if (first && o->plain) {
    CHECK_OK(flesh_ode_sunmatrix_create(o->ode, o->context, &o->matrix));
    CHECK_OK(flesh_ode_sunlinsol_create(o->ode, o->context, &o->linear));
  }
  if (o->kind == OWNED_CVODE) {
    if (first) owned_set_cvode(o, t, y);
    else CHECK(!CVodeReInit(o->memory, t, y));
    CHECK(!CVodeSVtolerances(o->memory, 0, atol) && !CVodeSetStopTime(o->memory, stop));
    CHECK(!CVodeSetInitStep(o->memory, h));
  } else {
    if (first) owned_set_arkode(o, t, y);
    else CHECK(!ARKStepReInit(o->memory, NULL, flesh_ode_rhs, t, y));
    CHECK(!OWNED_ARK(SVtolerances)(o->memory, 0, atol) && !OWNED_ARK(SetStopTime)(o->memory, stop));
    CHECK(!OWNED_ARK(SetInitStep)(o->memory, h));
  }
}

static inline void owned_set_coefficient(owned_integrator *o)
{
  const double c = o->coefficient;
  if (!(c > 0)) return;
  CHECK(!(o->kind == OWNED_IDA     ? IDASetNonlinConvCoef(o->memory, c)
          : o->kind == OWNED_CVODE ? CVodeSetNonlinConvCoef(o->memory, c)
                                   : OWNED_ARK(SetNonlinConvCoef)(o->memory, c)));
}

/* Takes one step. Returns the integrator's flag. */
static inline int owned_step(owned_integrator *o, double end, N_Vector y, N_Vector yp, double *t)
{
  if (o->kind == OWNED_IDA) return IDASolve(o->memory, end, t, y, yp, IDA_ONE_STEP);
  if (o->kind == OWNED_CVODE) return CVode(o->memory, end, y, t, CV_ONE_STEP);
  return OWNED_ARK(Evolve)(o->memory, end, y, t, ARK_ONE_STEP);
}

static inline void owned_count(owned_integrator *o)
{
  long c[4] = {0};
  if (o->kind == OWNED_IDA) {
    IDAGetNumSteps(o->memory, &c[0]), IDAGetNumNonlinSolvIters(o->memory, &c[1]);
    IDAGetNumStepSolveFails(o->memory, &c[2]), IDAGetNumErrTestFails(o->memory, &c[3]);
  } else if (o->kind == OWNED_CVODE) {
    CVodeGetNumSteps(o->memory, &c[0]), CVodeGetNumNonlinSolvIters(o->memory, &c[1]);
    CVodeGetNumStepSolveFails(o->memory, &c[2]), CVodeGetNumErrTestFails(o->memory, &c[3]);
  } else {
    OWNED_ARK(GetNumSteps)(o->memory, &c[0]), OWNED_ARK(GetNumNonlinSolvIters)(o->memory, &c[1]);
    OWNED_ARK(GetNumStepSolveFails)(o->memory, &c[2]), OWNED_ARK(GetNumErrTestFails)(o->memory, &c[3]);
  }
  o->steps += c[0], o->newton += c[1], o->failures += c[2], o->rejected += c[3];
}

static inline void owned_close(owned_integrator *o)
{
  if (o->kind == OWNED_IDA) IDAFree(&o->memory);
  else if (o->kind == OWNED_CVODE) CVodeFree(&o->memory);
  else OWNED_ARK(Free)(&o->memory);
  if (o->newton_solver) SUNNonlinSolFree(o->newton_solver);
  if (o->linear) SUNLinSolFree(o->linear);
  if (o->matrix) SUNMatDestroy(o->matrix);
  flesh_ida_problem_destroy(&o->ida);
  flesh_ode_problem_destroy(&o->ode);
}

/* Creates the problem and, except for a plain integrator, flesh's Newton. */
static inline void owned_open(owned_integrator *o, const flesh_system *system)
{
  if (o->kind == OWNED_IDA) CHECK_OK(flesh_ida_problem_create(system, &o->options, &o->ida));
  else CHECK_OK(flesh_ode_problem_create(system, &o->options, &o->ode));
  if (o->plain) return;
  if (o->kind == OWNED_IDA)
    CHECK_OK(flesh_ida_sunnonlinsol_create(o->ida, o->context, &o->newton_solver));
  else if (o->kind == OWNED_CVODE)
    CHECK_OK(flesh_cvode_sunnonlinsol_create(o->ode, CVodeGetNonlinearSystemData, o->context, &o->newton_solver));
  else
    CHECK_OK(flesh_arkode_sunnonlinsol_create(o->ode, OWNED_ARK(GetNonlinearSystemData), o->context, &o->newton_solver));
}

/* Creates the vector y. */
static inline N_Vector owned_vector(owned_integrator *o)
{
  N_Vector y = NULL;
  if (!o->positions) return N_VClone(o->y);
  if (o->ida) CHECK_OK(flesh_ida_vector_create(o->ida, o->context, &y));
  else CHECK_OK(flesh_ode_vector_create(o->ode, o->context, &y));
  CHECK_OK(flesh_sunnonlinsol_position_norm(o->newton_solver, y));
  return y;
}

/* Runs to the end. Returns the integrator's flag, negative if it gave up; the state is then the last one reached. */
static inline int owned_run(owned_integrator *o, const flesh_system *system, double end, flesh_state *state)
{
  owned_open(o, system);
  N_Vector y = owned_vector(o), yp = N_VClone(y), atol = N_VClone(y);
  int flag = 0;
  N_VConst(0, y);
  while (flag >= 0 && state->t < end) {
    if (o->ida) CHECK_OK(flesh_ida_start(o->ida, state, y, yp));
    else CHECK_OK(flesh_ode_start(o->ode, state, y));
    if (o->ida) CHECK_OK(flesh_ida_tolerances(o->ida, o->tolerance, atol));
    else CHECK_OK(flesh_ode_tolerances(o->ode, o->tolerance, atol));
    const double stop = fmin(end, o->ida ? flesh_ida_event(o->ida) : flesh_ode_event(o->ode));
    double t = state->t;
    owned_start(o, t, y, yp, atol, stop);
    owned_silence(o);
    owned_set_coefficient(o);
    while (flag >= 0 && t < stop) {
      flag = owned_step(o, stop, y, yp, &t);
      if (o->look && flag >= 0) o->look(o->data, t, y);
    }
    owned_count(o);
    if (o->ida) CHECK_OK(flesh_ida_get_state(o->ida, t, y, state));
    else CHECK_OK(flesh_ode_get_state(o->ode, t, y, state));
  }
  N_VDestroy(y);
  N_VDestroy(yp);
  N_VDestroy(atol);
  owned_close(o);
  return flag;
}

#endif
