/* bar_ida.c: computes a motion by an IDA that the program owns, with flesh's callbacks, through an event.
 *
 * A bar, held at one end, falls and swings under gravity: x' = v, r(t, x, v, v') = 0. A spring pulls its free end from
 * t = 0.2 s to 0.4 s; at both times the residual jumps and IDA is restarted. y = (x, v); its tolerances are absolute,
 * fractions of the body's length and of its typical velocity. The program passes IDA a user_data struct of its own.
 *
 * Sample output:
 *       t     tip x     tip z
 *   0.10    2.0000    0.2009
 *   0.20    2.0005    0.0537
 *   0.30    1.9704    0.3589
 *   0.40    1.8156    0.4331
 *   0.50    1.5762    0.0798
 *   0.60    1.5914   -0.2634
 */
#include <flesh/ida.h>
#include <ida/ida.h>

#include "bar.h"

/* IDA's user_data: any struct whose first member points to the problem. */
typedef struct experiment {
  flesh_ida_problem *problem;
  long residuals; /* counted by the program */
} experiment;

static int counted_residual(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r, void *data)
{
  ((experiment *)data)->residuals++;
  return flesh_ida_residual(t, y, yp, r, data);
}

int main(void)
{
  /* 1. The body, and a spring of 2000 N/m from its end to a point above it. */
  bar b;
  bar_begin(&b, FLESH_ELEMENT_TET4, bar_soft(), 1);
  bar_gravity(&b, -9.81);
  bar_pull(&b);
  bar_finish(&b);

  /* 2. Flesh's side of the problem. */
  SUNContext context;
  TRY(SUNContext_Create(SUN_COMM_NULL, &context));
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  experiment mine = {0};
  TRY(flesh_ida_problem_create(b.system, &options, &mine.problem));

  /* 3. Vectors, matrix and linear solver. */
  N_Vector y;
  SUNMatrix A;
  SUNLinearSolver solver;
  TRY(flesh_ida_vector_create(mine.problem, context, &y));
  N_Vector yp = N_VClone(y), atol = N_VClone(y);
  TRY(flesh_ida_sunmatrix_create(mine.problem, context, &A));
  TRY(flesh_ida_sunlinsol_create(mine.problem, context, &solver));

  /* 4. IDA, with consistent initial values. */
  void *ida = IDACreate(context);
  TRY(flesh_ida_start(mine.problem, &b.state, y, yp));
  TRY(flesh_ida_tolerances(mine.problem, 1e-6, atol));
  TRY(IDAInit(ida, counted_residual, 0, y, yp));
  TRY(IDASetUserData(ida, &mine));
  TRY(IDASVtolerances(ida, 0, atol));
  TRY(IDASetMaxOrd(ida, 2));
  TRY(IDASetMaxNumSteps(ida, 100000));
  TRY(IDASetLinearSolver(ida, solver, A));
  TRY(IDASetJacFn(ida, flesh_ida_jacobian));

  /* 5. Integrates to each output; stops at an event before it and restarts there. */
  printf("    t     tip x     tip z\n");
  for (int k = 1; k <= 6; k++) {
    const double out = 0.1 * k;
    while (b.state.t < out - 1e-12) {
      double t;
      if (flesh_ida_event(mine.problem) < INFINITY) TRY(IDASetStopTime(ida, flesh_ida_event(mine.problem)));
      int flag = IDASolve(ida, out, &t, y, yp, IDA_NORMAL);
      TRY(flag < 0);
      TRY(flesh_ida_get_state(mine.problem, t, y, &b.state));
      if (flag == IDA_TSTOP_RETURN) {
        TRY(flesh_ida_start(mine.problem, &b.state, y, yp));
        TRY(IDAReInit(ida, t, y, yp));
      }
    }
    printf("%.2f %9.4f %9.4f\n", out, b.state.x[3 * b.tip], b.state.x[3 * b.tip + 2]);
  }
  if (mine.residuals < 100) printf("only %ld residuals?\n", mine.residuals);

  IDAFree(&ida);
  SUNLinSolFree(solver);
  SUNMatDestroy(A);
  N_VDestroy(y);
  N_VDestroy(yp);
  N_VDestroy(atol);
  flesh_ida_problem_destroy(&mine.problem);
  SUNContext_Free(&context);
  bar_destroy(&b);
  return 0;
}
