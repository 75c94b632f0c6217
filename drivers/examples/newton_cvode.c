/* newton_cvode.c: computes a motion by a CVODE that the program owns, with flesh's Newton, through an event.
 *
 * A bar, held at one end, falls and swings under gravity; a spring pulls its free end from t = 0.2 s to 0.4 s. At both
 * times the right-hand side jumps and CVODE is restarted; flesh's Newton then takes its data from the new start.
 *
 * Sample output:
 *   t = 0.20 s: tip at z = 0.054 m
 *   t = 0.40 s: tip at z = 0.433 m
 *   t = 0.60 s: tip at z = -0.263 m
 */
#include <cvode/cvode.h>
#include <flesh/sunnonlinsol.h>
#include <nvector/nvector_serial.h>

#include "bar.h"

int main(void)
{
  /* 1. The body, and a spring of 2000 N/m from its end to a point above it. */
  bar b;
  bar_begin(&b, FLESH_ELEMENT_TET4, bar_soft(), 1);
  bar_gravity(&b, -9.81);
  bar_pull(&b);
  bar_finish(&b);

  /* 2. Flesh's side of y' = f(t, y), and its Newton. */
  SUNContext context;
  TRY(SUNContext_Create(SUN_COMM_NULL, &context));
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  flesh_ode_problem *problem;
  SUNNonlinearSolver newton;
  TRY(flesh_ode_problem_create(b.system, &options, &problem));
  TRY(flesh_cvode_sunnonlinsol_create(problem, CVodeGetNonlinearSystemData, context, &newton));

  /* 3. CVODE, limited to order 2: above it, BDF is not A-stable. */
  N_Vector y = N_VNew_Serial(6 * (sunindextype)b.nodes, context), atol = N_VClone(y);
  TRY(flesh_ode_start(problem, &b.state, y));
  TRY(flesh_ode_tolerances(problem, 1e-6, atol));
  void *cvode = CVodeCreate(CV_BDF, context);
  TRY(CVodeInit(cvode, flesh_ode_rhs, 0, y) || CVodeSetUserData(cvode, problem));
  TRY(CVodeSVtolerances(cvode, 0, atol) || CVodeSetMaxOrd(cvode, 2) || CVodeSetMaxNumSteps(cvode, 100000));
  TRY(CVodeSetNonlinearSolver(cvode, newton));

  /* 4. Integrates to each output; restarts at an event. */
  for (int k = 1; k <= 3; k++) {
    const double out = 0.2 * k;
    while (b.state.t < out - 1e-12) {
      double t;
      if (flesh_ode_event(problem) < INFINITY) TRY(CVodeSetStopTime(cvode, flesh_ode_event(problem)));
      const int flag = CVode(cvode, out, y, &t, CV_NORMAL);
      TRY(flag < 0);
      TRY(flesh_ode_get_state(problem, t, y, &b.state));
      if (flag == CV_TSTOP_RETURN) TRY(flesh_ode_start(problem, &b.state, y) || CVodeReInit(cvode, t, y));
    }
    printf("t = %.2f s: tip at z = %.3f m\n", out, b.state.x[3 * b.tip + 2]);
  }

  CVodeFree(&cvode);
  SUNNonlinSolFree(newton);
  N_VDestroy(y), N_VDestroy(atol);
  flesh_ode_problem_destroy(&problem);
  SUNContext_Free(&context);
  bar_destroy(&b);
  return 0;
}
