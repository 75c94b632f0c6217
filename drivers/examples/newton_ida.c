/* newton_ida.c: throws a cube at a sheet, by an IDA that the program owns, with flesh's Newton and with SUNDIALS'.
 *
 * The sheet is two triangles, without a thickness. A step of IDA that begins above the sheet and ends below it solves
 * r(t, x, v, v') = 0 as well as any other: SUNDIALS' Newton lets the cube pass, and IDA reports success. flesh's Newton
 * keeps the path of every node free of obstacles, from the last accepted step to each iterate; if it finds no such
 * solution, IDA shortens its step.
 *
 * Sample output:
 *   SUNDIALS' Newton: the cube passes through the sheet
 *   flesh's Newton: the cube bounces, its lowest node at least 0.1 mm above the sheet
 */
#include <flesh/sunnonlinsol.h>
#include <ida/ida.h>

#include "cube.h"

static void throw_cube(const bar *c, SUNContext context, int with_flesh)
{
  /* 1. Flesh's side of F(t, y, y') = 0. */
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  flesh_ida_problem *problem;
  TRY(flesh_ida_problem_create(c->system, &options, &problem));

  /* 2. Vectors and a consistent start. */
  N_Vector y;
  TRY(flesh_ida_vector_create(problem, context, &y));
  N_Vector yp = N_VClone(y), atol = N_VClone(y);
  TRY(flesh_ida_start(problem, &c->state, y, yp));
  TRY(flesh_ida_tolerances(problem, 3e-3, atol));

  /* 3. IDA. */
  void *ida = IDACreate(context);
  TRY(IDAInit(ida, flesh_ida_residual, 0, y, yp));
  TRY(IDASetUserData(ida, problem));
  TRY(IDASVtolerances(ida, 0, atol));
  TRY(IDASetMaxOrd(ida, 2));
  TRY(IDASetMaxNumSteps(ida, 100000));

  /* 4. The nonlinear solver: flesh's needs neither a matrix nor a linear solver of SUNDIALS. */
  SUNNonlinearSolver newton = NULL;
  SUNMatrix A = NULL;
  SUNLinearSolver solver = NULL;
  if (with_flesh) {
    TRY(flesh_ida_sunnonlinsol_create(problem, context, &newton));
    TRY(IDASetNonlinearSolver(ida, newton));
  } else {
    TRY(flesh_ida_sunmatrix_create(problem, context, &A));
    TRY(flesh_ida_sunlinsol_create(problem, context, &solver));
    TRY(IDASetLinearSolver(ida, solver, A));
    TRY(IDASetJacFn(ida, flesh_ida_jacobian));
  }

  /* 5. Integrates step by step, and looks at the lowest node after each. */
  double t = 0, lowest = INFINITY;
  while (t < 0.05) {
    TRY(IDASolve(ida, 0.05, &t, y, yp, IDA_ONE_STEP) < 0);
    lowest = fmin(lowest, cube_lowest(c, N_VGetArrayPointer(y)));
  }
  printf("%s Newton: the cube %s\n", with_flesh ? "flesh's" : "SUNDIALS'",
         lowest < 0 ? "passes through the sheet" : lowest > 1e-4 ? "bounces, its lowest node at least 0.1 mm above the sheet"
                                                                 : "comes too near");
  IDAFree(&ida);
  if (newton) SUNNonlinSolFree(newton);
  if (solver) SUNLinSolFree(solver);
  if (A) SUNMatDestroy(A);
  N_VDestroy(y), N_VDestroy(yp), N_VDestroy(atol);
  flesh_ida_problem_destroy(&problem);
}

int main(void)
{
  bar c;
  SUNContext context;
  cube_begin(&c);
  TRY(SUNContext_Create(SUN_COMM_NULL, &context));
  throw_cube(&c, context, 0);
  throw_cube(&c, context, 1);
  SUNContext_Free(&context);
  bar_destroy(&c);
  return 0;
}
