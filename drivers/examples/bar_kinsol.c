/* bar_kinsol.c: finds an equilibrium by a KINSOL that the program owns, with flesh's callbacks.
 *
 * A bar, held at one end, sags under its weight: r(x) = dV/dx = 0, where V is the elastic energy less the work of
 * gravity, x = X + u are the positions and u is KINSOL's unknown. The program solves twice from u = 0:
 *   - with flesh's block matrix and linear solver (preconditioned conjugate gradients, steps guarded by V),
 *   - with SUNDIALS' sparse matrix, KLU and KINSOL's own line search.
 * `bar_kinsol FILE` writes the equilibrium as a state file, from which a scene may start.
 *
 * Sample output:
 *   flesh's matrix and solver:     tip at (1.8786, 0.3957, -0.4389) m
 *   SUNSparseMatrix and KLU:       tip at (1.8786, 0.3957, -0.4389) m
 */
#include <flesh/kinsol.h>
#include <kinsol/kinsol.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_klu.h>
#include <sunmatrix/sunmatrix_sparse.h>

#include "bar.h"

static void solve(bar *b, SUNContext context, int by_klu)
{
  /* 1. Flesh's side of the problem: options, and a stage, in which the positions are x0 + shift.x u. */
  const int n = flesh_system_unknowns(b->system);
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  if (by_klu) options.line_search = FLESH_LINE_SEARCH_RESIDUAL;
  flesh_problem *problem;
  TRY(flesh_problem_create(b->system, &options, &problem));
  const flesh_stage stage = {
      .load = 1, .prescribed_fraction = 1, .shift = {.x = 1}, .x0 = flesh_mesh_positions(b->mesh)};
  TRY(flesh_problem_set_stage(problem, &stage));

  /* 2. Vectors: the unknown, which starts at 0 except in constrained components, and scales of 1. */
  N_Vector u = N_VNew_Serial(n, context), ones = N_VClone(u);
  N_VConst(1, ones);
  flesh_problem_start(problem, N_VGetArrayPointer(u));

  /* 3. Matrix and linear solver, by flesh or by SUNDIALS. */
  SUNMatrix A;
  SUNLinearSolver solver;
  if (by_klu) {
    A = SUNSparseMatrix(n, n, flesh_problem_entries(problem), CSC_MAT, context);
    solver = SUNLinSol_KLU(u, A, context);
  } else {
    TRY(flesh_sunmatrix_create(problem, context, &A));
    TRY(flesh_sunlinsol_create(problem, context, &solver));
  }

  /* 4. KINSOL with flesh's residual and Jacobian. */
  void *kinsol = KINCreate(context);
  TRY(KINInit(kinsol, flesh_kinsol_residual, u));
  TRY(KINSetUserData(kinsol, problem));
  TRY(KINSetLinearSolver(kinsol, solver, A));
  TRY(KINSetJacFn(kinsol, flesh_kinsol_jacobian));
  TRY(KINSetMaxSetupCalls(kinsol, 1));      /* a fresh Jacobian in every iteration */
  TRY(KINSetMaxNewtonStep(kinsol, 1e300));  /* KINSOL would limit steps to a multiple of |u|, which starts at 0 */
  TRY(KINSetFuncNormTol(kinsol, 1e-6));     /* N */
  TRY(KINSetScaledStepTol(kinsol, 1e-14));
  TRY(KINSol(kinsol, u, by_klu ? KIN_LINESEARCH : KIN_NONE, ones, ones) < 0);

  /* 5. The result. */
  for (int i = 0; i < n; i++) b->state.x[i] = stage.x0[i] + N_VGetArrayPointer(u)[i];
  const double *tip = b->state.x + 3 * b->tip;
  printf("%s tip at (%.4f, %.4f, %.4f) m\n",
         by_klu ? "SUNSparseMatrix and KLU:      " : "flesh's matrix and solver:    ", tip[0], tip[1], tip[2]);

  KINFree(&kinsol);
  SUNLinSolFree(solver);
  SUNMatDestroy(A);
  N_VDestroy(u);
  N_VDestroy(ones);
  flesh_problem_destroy(&problem);
}

int main(int argc, char **argv)
{
  bar b;
  bar_begin(&b, FLESH_ELEMENT_TET4, bar_soft(), 0);
  bar_gravity(&b, -1);
  bar_finish(&b);
  SUNContext context;
  TRY(SUNContext_Create(SUN_COMM_NULL, &context));
  solve(&b, context, 0);
  solve(&b, context, 1);
  if (argc > 1) TRY(flesh_state_write(argv[1], b.nodes, &b.state));
  SUNContext_Free(&context);
  bar_destroy(&b);
  return 0;
}
