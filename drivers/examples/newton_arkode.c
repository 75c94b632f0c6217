/* newton_arkode.c: solves the stages of a Runge-Kutta method of ARKODE by flesh's Newton and by SUNDIALS'.
 *
 * A bar, held at one end, falls and swings under gravity. ESDIRK3(2)4L[2]SA (Kennedy & Carpenter 2019) has three
 * implicit stages with the same diagonal coefficient; the last is the end of the step. flesh's Newton starts each stage
 * from an extrapolated acceleration and decreases the potential; SUNDIALS' Newton starts from the end of the last step,
 * and some of its solves fail, so that ARKODE shortens its steps.
 *
 * Sample output:
 *   SUNDIALS' Newton: tip at z = -1.10 m
 *   flesh's Newton: tip at z = -1.10 m, no solve fails, less than half the iterations
 */
#include <arkode/arkode_arkstep.h>
#include <flesh/sunnonlinsol.h>
#include <nvector/nvector_serial.h>

#include "bar.h"

/* Before SUNDIALS 7.1, the names of ARKODE's functions begin with that of the stepper. */
#if SUNDIALS_VERSION_MAJOR * 100 + SUNDIALS_VERSION_MINOR < 701
#define ARK(function) ARKStep##function
#else
#define ARK(function) ARKode##function
#endif

static long swing(const bar *b, SUNContext context, long others)
{
  const int with_flesh = others > 0;
  /* 1. Flesh's side of y' = f(t, y). */
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  flesh_ode_problem *problem;
  TRY(flesh_ode_problem_create(b->system, &options, &problem));
  N_Vector y = N_VNew_Serial(6 * (sunindextype)b->nodes, context), atol = N_VClone(y);
  TRY(flesh_ode_start(problem, &b->state, y));
  TRY(flesh_ode_tolerances(problem, 1e-5, atol));

  /* 2. ARKODE. */
  void *ark = ARKStepCreate(NULL, flesh_ode_rhs, 0, y, context);
  TRY(ARK(SetUserData)(ark, problem));
  TRY(ARK(SVtolerances)(ark, 0, atol));
  TRY(ARK(SetMaxNumSteps)(ark, 100000));
  TRY(ARKStepSetTableName(ark, "ARKODE_ESDIRK324L2SA_4_2_3", "ARKODE_ERK_NONE"));

  /* 3. The nonlinear solver. flesh's is told of accepted steps, and f at a stage is deduced from its solution. */
  SUNNonlinearSolver newton = NULL;
  SUNMatrix J = NULL;
  SUNLinearSolver solver = NULL;
  if (with_flesh) {
    TRY(flesh_arkode_sunnonlinsol_create(problem, ARK(GetNonlinearSystemData), context, &newton));
    TRY(ARK(SetNonlinearSolver)(ark, newton) || ARK(SetDeduceImplicitRhs)(ark, 1));
    TRY(ARK(SetPostprocessStepFn)(ark, flesh_ode_accept));
  } else {
    TRY(flesh_ode_sunmatrix_create(problem, context, &J));
    TRY(flesh_ode_sunlinsol_create(problem, context, &solver));
    TRY(ARK(SetLinearSolver)(ark, solver, J) || ARK(SetJacFn)(ark, flesh_ode_jacobian));
    TRY(ARK(SetNonlinCRDown)(ark, 1)); /* ode.h: why */
  }

  /* 4. The motion. */
  double t;
  long iterations, failures;
  TRY(ARK(Evolve)(ark, 0.5, y, &t, ARK_NORMAL) < 0);
  TRY(ARK(GetNumNonlinSolvIters)(ark, &iterations) || ARK(GetNumStepSolveFails)(ark, &failures));
  printf("%s Newton: tip at z = %.2f m%s%s\n", with_flesh ? "flesh's" : "SUNDIALS'",
         N_VGetArrayPointer(y)[3 * b->tip + 2], with_flesh && !failures ? ", no solve fails" : "",
         with_flesh && 2 * iterations < others ? ", less than half the iterations" : "");
  ARK(Free)(&ark);
  if (newton) SUNNonlinSolFree(newton);
  if (solver) SUNLinSolFree(solver);
  if (J) SUNMatDestroy(J);
  N_VDestroy(y), N_VDestroy(atol);
  flesh_ode_problem_destroy(&problem);
  return iterations;
}

int main(void)
{
  bar b;
  SUNContext context;
  bar_begin(&b, FLESH_ELEMENT_TET4, bar_soft(), 1);
  bar_gravity(&b, -9.81);
  bar_finish(&b);
  TRY(SUNContext_Create(SUN_COMM_NULL, &context));
  swing(&b, context, swing(&b, context, 0));
  SUNContext_Free(&context);
  bar_destroy(&b);
  return 0;
}
