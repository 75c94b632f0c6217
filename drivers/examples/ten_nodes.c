/* ten_nodes.c: ten-node tets under solvers that the program owns: KINSOL, IDA, CVODE and ARKODE.
 *
 * A bar of 192 tets, held at one end, of nearly incompressible flesh: nu = 0.49. Its equilibrium under a small weight is
 * found by KINSOL with four-node tets, which lock, and with ten-node ones of mean dilatation, which do not. Its fall is
 * followed by IDA, CVODE and ARKODE: the callbacks are those of four-node tets, whatever the element is.
 *
 * Sample output:
 *   KINSOL tet4           81 nodes: the tip sinks by 0.0315 m
 *   KINSOL tet10-mean    425 nodes: the tip sinks by 0.1911 m
 *   IDA    tet10-mean   after 0.1 s the tip has sunk by 0.0491 m
 *   CVODE  tet10-mean   the same within 1e-5 m
 *   ARKODE tet10-mean   the same within 1e-5 m
 */
#include <arkode/arkode_arkstep.h>
#include <cvode/cvode.h>
#include <flesh/ida.h>
#include <flesh/kinsol.h>
#include <flesh/ode.h>
#include <ida/ida.h>
#include <kinsol/kinsol.h>
#include <nvector/nvector_serial.h>

#include "bar.h"

/* Before SUNDIALS 7.1, ARKODE's functions bear the name of the stepper. */
#if SUNDIALS_VERSION_MAJOR * 100 + SUNDIALS_VERSION_MINOR < 701
#define ARK(function) ARKStep##function
#else
#define ARK(function) ARKode##function
#endif

static const double end = 0.1, tolerance = 1e-6;

static void make(flesh_element element, double weight, int moves, bar *b)
{
  flesh_material material;
  TRY(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 5e4, 0.49, &material));
  /* In statics the exact load, in motion masses at nodes. */
  bar_begin_with(b, element, &material, moves ? FLESH_MASS_LUMPED : FLESH_MASS_CONSISTENT, moves);
  bar_gravity(b, weight);
  bar_finish(b);
}

/* 1. Equilibrium. */
static void rest(flesh_element element, SUNContext context)
{
  bar b;
  flesh_solver_options options;
  flesh_problem *problem;
  SUNMatrix A;
  SUNLinearSolver solver;
  make(element, -0.1, 0, &b);
  flesh_solver_options_default(&options);
  TRY(flesh_problem_create(b.system, &options, &problem));
  const flesh_stage stage = {
      .load = 1, .prescribed_fraction = 1, .shift = {.x = 1}, .x0 = flesh_mesh_positions(b.mesh)};
  TRY(flesh_problem_set_stage(problem, &stage));
  N_Vector u = N_VNew_Serial(flesh_system_unknowns(b.system), context), ones = N_VClone(u);
  N_VConst(1, ones);
  flesh_problem_start(problem, N_VGetArrayPointer(u));
  TRY(flesh_sunmatrix_create(problem, context, &A));
  TRY(flesh_sunlinsol_create(problem, context, &solver));
  void *kinsol = KINCreate(context);
  TRY(KINInit(kinsol, flesh_kinsol_residual, u));
  TRY(KINSetUserData(kinsol, problem));
  TRY(KINSetLinearSolver(kinsol, solver, A));
  TRY(KINSetJacFn(kinsol, flesh_kinsol_jacobian));
  TRY(KINSetMaxSetupCalls(kinsol, 1));
  TRY(KINSetMaxNewtonStep(kinsol, 1e300));
  TRY(KINSetFuncNormTol(kinsol, 1e-6));
  TRY(KINSetScaledStepTol(kinsol, 1e-14));
  TRY(KINSol(kinsol, u, KIN_NONE, ones, ones) < 0);
  printf("KINSOL %-10s   %4d nodes: the tip sinks by %.4f m\n", flesh_element_name(element), b.nodes,
         -N_VGetArrayPointer(u)[3 * b.tip + 2]);
  KINFree(&kinsol);
  SUNLinSolFree(solver);
  SUNMatDestroy(A);
  N_VDestroy(u);
  N_VDestroy(ones);
  flesh_problem_destroy(&problem);
  bar_destroy(&b);
}

/* 2. The fall, by IDA. */
static double fall_by_ida(bar *b, SUNContext context)
{
  flesh_solver_options options;
  flesh_ida_problem *problem;
  SUNMatrix A;
  SUNLinearSolver solver;
  N_Vector y;
  double t;
  flesh_solver_options_default(&options);
  TRY(flesh_ida_problem_create(b->system, &options, &problem));
  TRY(flesh_ida_vector_create(problem, context, &y));
  N_Vector yp = N_VClone(y), atol = N_VClone(y);
  TRY(flesh_ida_sunmatrix_create(problem, context, &A));
  TRY(flesh_ida_sunlinsol_create(problem, context, &solver));
  void *ida = IDACreate(context);
  TRY(flesh_ida_start(problem, &b->state, y, yp));
  flesh_ida_tolerances(problem, tolerance, atol);
  TRY(IDAInit(ida, flesh_ida_residual, 0, y, yp));
  TRY(IDASetUserData(ida, &problem));
  TRY(IDASVtolerances(ida, 0, atol));
  TRY(IDASetMaxOrd(ida, 2));
  TRY(IDASetMaxNumSteps(ida, 100000));
  TRY(IDASetLinearSolver(ida, solver, A));
  TRY(IDASetJacFn(ida, flesh_ida_jacobian));
  TRY(IDASetStopTime(ida, end));
  TRY(IDASolve(ida, end, &t, y, yp, IDA_NORMAL) < 0);
  const double *X = flesh_mesh_positions(b->mesh);
  const size_t n = 3 * (size_t)b->nodes;
  flesh_state state = {.x = malloc(n * sizeof(double)), .v = malloc(n * sizeof(double))};
  flesh_ida_get_state(problem, t, y, &state);
  const double sunk = X[3 * b->tip + 2] - state.x[3 * b->tip + 2];
  free(state.x);
  free(state.v);
  IDAFree(&ida);
  SUNLinSolFree(solver);
  SUNMatDestroy(A);
  N_VDestroy(y);
  N_VDestroy(yp);
  N_VDestroy(atol);
  flesh_ida_problem_destroy(&problem);
  return sunk;
}

/* 3. By CVODE, or ARKODE's implicit method of order 4. */
static double fall_by_rhs(const bar *b, SUNContext context, int by_ark)
{
  flesh_solver_options options;
  flesh_ode_problem *problem;
  SUNMatrix J;
  SUNLinearSolver solver;
  double t;
  flesh_solver_options_default(&options);
  TRY(flesh_ode_problem_create(b->system, &options, &problem));
  N_Vector y = N_VNew_Serial(6 * (sunindextype)b->nodes, context), atol = N_VClone(y);
  TRY(flesh_ode_start(problem, &b->state, y));
  flesh_ode_tolerances(problem, tolerance, atol);
  TRY(flesh_ode_sunmatrix_create(problem, context, &J));
  TRY(flesh_ode_sunlinsol_create(problem, context, &solver));
  if (by_ark) {
    void *ark = ARKStepCreate(NULL, flesh_ode_rhs, 0, y, context);
    TRY(ARK(SetUserData)(ark, problem));
    TRY(ARK(SVtolerances)(ark, 0, atol));
    TRY(ARK(SetOrder)(ark, 4));
    TRY(ARK(SetMaxNumSteps)(ark, 100000));
    TRY(ARK(SetLinearSolver)(ark, solver, J));
    TRY(ARK(SetJacFn)(ark, flesh_ode_jacobian));
    TRY(ARK(SetNonlinCRDown)(ark, 1)); /* ode.h: why */
    TRY(ARK(SetStopTime)(ark, end));
    TRY(ARK(Evolve)(ark, end, y, &t, ARK_NORMAL) < 0);
    ARK(Free)(&ark);
  } else {
    void *cvode = CVodeCreate(CV_BDF, context);
    TRY(CVodeInit(cvode, flesh_ode_rhs, 0, y));
    TRY(CVodeSetUserData(cvode, problem));
    TRY(CVodeSVtolerances(cvode, 0, atol));
    TRY(CVodeSetMaxOrd(cvode, 2));
    TRY(CVodeSetMaxNumSteps(cvode, 100000));
    TRY(CVodeSetLinearSolver(cvode, solver, J));
    TRY(CVodeSetJacFn(cvode, flesh_ode_jacobian));
    TRY(CVodeSetStopTime(cvode, end));
    TRY(CVode(cvode, end, y, &t, CV_NORMAL) < 0);
    CVodeFree(&cvode);
  }
  const double sunk = flesh_mesh_positions(b->mesh)[3 * b->tip + 2] - N_VGetArrayPointer(y)[3 * b->tip + 2];
  SUNLinSolFree(solver);
  SUNMatDestroy(J);
  N_VDestroy(y);
  N_VDestroy(atol);
  flesh_ode_problem_destroy(&problem);
  return sunk;
}

int main(void)
{
  SUNContext context;
  TRY(SUNContext_Create(SUN_COMM_NULL, &context));
  rest(FLESH_ELEMENT_TET4, context);
  rest(FLESH_ELEMENT_TET10_MEAN, context);
  bar b;
  make(FLESH_ELEMENT_TET10_MEAN, -9.81, 1, &b);
  const double ida = fall_by_ida(&b, context);
  printf("IDA    tet10-mean   after %g s the tip has sunk by %.4f m\n", end, ida);
  static const char *const names[2] = {"CVODE", "ARKODE"};
  for (int k = 0; k < 2; k++)
    printf("%-6s tet10-mean   %s\n", names[k],
           fabs(fall_by_rhs(&b, context, k) - ida) < 1e-5 ? "the same within 1e-5 m" : "something else");
  bar_destroy(&b);
  SUNContext_Free(&context);
  return 0;
}
