/* bar_cvode_arkode.c: computes one motion by CVODE (BDF), ARKODE (implicit and explicit Runge-Kutta) and IDA.
 *
 * A bar of ten-node tets, held at one end, falls under gravity: y' = f(t, y), y = (x, v), f = (v, -M^-1 r(t, x, v, 0)).
 * The callbacks are the same as for four-node tets. CVODE and ARKODE's implicit method solve with flesh's df/dy and
 * flesh's linear solver, which eliminates one half of y; CVODE solves a second time with GMRES and flesh's
 * preconditioner. The reference is computed by IDA through the integrator layer.
 *
 * Sample output:
 *   IDA, reference            tip at z = 0.0538 m
 *   CVODE, BDF                tip at z = 0.0538 m, within 1e-5 m of it
 *   CVODE, BDF, by GMRES      tip at z = 0.0538 m, within 1e-5 m of it
 *   ARKODE, implicit order 4  tip at z = 0.0538 m, within 1e-5 m of it
 *   ARKODE, explicit order 4  tip at z = 0.0538 m, within 1e-5 m of it
 */
#include <arkode/arkode_arkstep.h>
#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <flesh/ode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_spgmr.h>

#include "bar.h"

/* Before SUNDIALS 7.1, the names of ARKODE's functions begin with that of the stepper. */
#if SUNDIALS_VERSION_MAJOR * 100 + SUNDIALS_VERSION_MINOR < 701
#define ARK(stepper, function) stepper##function
#else
#define ARK(stepper, function) ARKode##function
#endif

static const double end = 0.2, tolerance = 1e-6;

static void report(const char *name, const bar *b, const double *x, double exact)
{
  const double z = x[3 * b->tip + 2], off = fabs(z - exact);
  printf("%-25s tip at z = %.4f m, within %s of it\n", name, z,
         off < 1e-5 ? "1e-5 m" : off < 1e-4 ? "1e-4 m" : off < 1e-3 ? "1e-3 m" : "more than 1e-3 m");
}

/* 1. The reference, by IDA through the integrator layer. */
static double reference(const bar *b)
{
  flesh_solver_options options;
  flesh_adaptive_options adaptive;
  flesh_integrator *integrator;
  flesh_solver_options_default(&options);
  flesh_adaptive_options_default(&adaptive);
  options.linear_tolerance = 1e-6;
  adaptive.tolerance = 1e-6;
  TRY(flesh_integrator_create(b->system, FLESH_METHOD_IDA, &options, &integrator));
  TRY(flesh_integrator_set_adaptive(integrator, &adaptive));
  flesh_state state = bar_rest(b->mesh);
  TRY(flesh_integrator_step(integrator, &state, end, NULL));
  const double z = state.x[3 * b->tip + 2];
  printf("%-25s tip at z = %.4f m\n", "IDA, reference", z);
  free(state.x);
  free(state.v);
  flesh_integrator_destroy(&integrator);
  return z;
}

int main(void)
{
  bar b;
  bar_begin(&b, FLESH_ELEMENT_TET10_MEAN, bar_soft(), 1);
  bar_gravity(&b, -9.81);
  bar_finish(&b);
  const double exact = reference(&b);

  /* 2. Flesh's side of y' = f(t, y). */
  SUNContext context;
  TRY(SUNContext_Create(SUN_COMM_NULL, &context));
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  flesh_ode_problem *problem;
  TRY(flesh_ode_problem_create(b.system, &options, &problem));
  N_Vector y = N_VNew_Serial(6 * (sunindextype)b.nodes, context), atol = N_VClone(y);
  double t;

  /* 3. CVODE, limited to order 2: above it, BDF is not A-stable. */
  TRY(flesh_ode_start(problem, &b.state, y));
  TRY(flesh_ode_tolerances(problem, tolerance, atol));
  void *cvode = CVodeCreate(CV_BDF, context);
  SUNMatrix J;
  SUNLinearSolver solver;
  TRY(flesh_ode_sunmatrix_create(problem, context, &J));
  TRY(flesh_ode_sunlinsol_create(problem, context, &solver));
  TRY(CVodeInit(cvode, flesh_ode_rhs, 0, y));
  TRY(CVodeSetUserData(cvode, problem));
  TRY(CVodeSVtolerances(cvode, 0, atol));
  TRY(CVodeSetMaxOrd(cvode, 2));
  TRY(CVodeSetMaxNumSteps(cvode, 100000));
  TRY(CVodeSetLinearSolver(cvode, solver, J));
  TRY(CVodeSetJacFn(cvode, flesh_ode_jacobian));
  TRY(CVodeSetStopTime(cvode, end)); /* steps exactly to the end instead of interpolating there */
  TRY(CVode(cvode, end, y, &t, CV_NORMAL) < 0);
  report("CVODE, BDF", &b, N_VGetArrayPointer(y), exact);

  /* CVODE again, without a matrix. */
  TRY(flesh_ode_start(problem, &b.state, y));
  SUNLinearSolver gmres = SUNLinSol_SPGMR(y, SUN_PREC_LEFT, 20, context);
  TRY(CVodeReInit(cvode, 0, y));
  TRY(CVodeSetLinearSolver(cvode, gmres, NULL));
  TRY(CVodeSetPreconditioner(cvode, flesh_ode_preconditioner_setup, flesh_ode_preconditioner_solve));
  TRY(CVodeSetJacTimes(cvode, flesh_ode_jacobian_times_setup, flesh_ode_jacobian_times));
  TRY(CVodeSetStopTime(cvode, end));
  TRY(CVode(cvode, end, y, &t, CV_NORMAL) < 0);
  report("CVODE, BDF, by GMRES", &b, N_VGetArrayPointer(y), exact);
  CVodeFree(&cvode);
  SUNLinSolFree(gmres);

  /* 4. ARKODE, a diagonally implicit method of order 4. */
  TRY(flesh_ode_start(problem, &b.state, y));
  void *ark = ARKStepCreate(NULL, flesh_ode_rhs, 0, y, context);
  TRY(ARK(ARKStep, SetUserData)(ark, problem));
  TRY(ARK(ARKStep, SVtolerances)(ark, 0, atol));
  TRY(ARK(ARKStep, SetOrder)(ark, 4));
  TRY(ARK(ARKStep, SetMaxNumSteps)(ark, 100000));
  TRY(ARK(ARKStep, SetLinearSolver)(ark, solver, J) || ARK(ARKStep, SetJacFn)(ark, flesh_ode_jacobian));
  TRY(ARK(ARKStep, SetNonlinCRDown)(ark, 1)); /* ode.h: why */
  TRY(ARK(ARKStep, SetStopTime)(ark, end));
  TRY(ARK(ARKStep, Evolve)(ark, end, y, &t, ARK_NORMAL) < 0);
  report("ARKODE, implicit order 4", &b, N_VGetArrayPointer(y), exact);
  ARK(ARKStep, Free)(&ark);
  SUNLinSolFree(solver);
  SUNMatDestroy(J);

  /* 5. ARKODE, an explicit method of order 4: it needs no solver, but steps so small that they resolve sound waves. */
  TRY(flesh_ode_start(problem, &b.state, y));
  ark = ERKStepCreate(flesh_ode_rhs, 0, y, context);
  TRY(ARK(ERKStep, SetUserData)(ark, problem));
  TRY(ARK(ERKStep, SVtolerances)(ark, 0, atol));
  TRY(ARK(ERKStep, SetOrder)(ark, 4));
  TRY(ARK(ERKStep, SetMaxNumSteps)(ark, 100000));
  TRY(ARK(ERKStep, SetStopTime)(ark, end));
  TRY(ARK(ERKStep, Evolve)(ark, end, y, &t, ARK_NORMAL) < 0);
  report("ARKODE, explicit order 4", &b, N_VGetArrayPointer(y), exact);
  ARK(ERKStep, Free)(&ark);

  N_VDestroy(y);
  N_VDestroy(atol);
  flesh_ode_problem_destroy(&problem);
  SUNContext_Free(&context);
  bar_destroy(&b);
  return 0;
}
