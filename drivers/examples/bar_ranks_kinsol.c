/* bar_ranks_kinsol.c: finds an equilibrium by the program's own KINSOL: mpirun -n 3 example_bar_ranks_kinsol
 *
 * A bar sags under its weight, on ranks of MPI, with vectors of N_VNew_Parallel. A rank's part of a vector has the
 * numbers of its own nodes; flesh's callbacks fetch the values of ghosts. The program solves twice from u = 0:
 *   - with flesh's block matrix and linear solver,
 *   - with SUNDIALS' conjugate gradients and no matrix; flesh gives products with the Jacobian and the preconditioner.
 *
 * Sample output:
 *   384 tets on 3 ranks
 *   flesh's matrix and solver:     tip at (1.963, 0.223, -0.224) m
 *   SUNLinSol_PCG, no matrix:      tip at (1.963, 0.223, -0.224) m
 */
#include <flesh/kinsol.h>
#include <kinsol/kinsol.h>
#include <nvector/nvector_parallel.h>
#include <sunlinsol/sunlinsol_pcg.h>

#include "bar_ranks.h"

static void solve(const bar_ranks *b, SUNContext context, int without_matrix)
{
  /* 1. Flesh's side of the problem, as on one rank. */
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  flesh_problem *problem;
  TRY(flesh_problem_create(b->system, &options, &problem));
  const flesh_stage stage = {
      .load = 1, .prescribed_fraction = 1, .shift = {.x = 1}, .x0 = flesh_mesh_positions(b->mesh)};
  TRY(flesh_problem_set_stage(problem, &stage));

  /* 2. Vectors of own nodes: a rank's length and the total. Pinned nodes are at their rest positions: u = 0 will do. */
  const int own = 3 * flesh_rank_part_own(b->part), all = 3 * flesh_mesh_node_count(b->whole);
  N_Vector u = N_VNew_Parallel(MPI_COMM_WORLD, own, all, context), ones = N_VClone(u);
  N_VConst(0, u);
  N_VConst(1, ones);

  /* 3. Matrix and linear solver: flesh's, or SUNDIALS' without a matrix. */
  SUNMatrix A = NULL;
  SUNLinearSolver solver;
  if (without_matrix) {
    solver = SUNLinSol_PCG(u, SUN_PREC_RIGHT, 1000, context);
  } else {
    TRY(flesh_sunmatrix_create(problem, context, &A));
    TRY(flesh_sunlinsol_create(problem, context, &solver));
  }

  /* 4. KINSOL with flesh's callbacks. */
  void *kinsol = KINCreate(context);
  TRY(KINInit(kinsol, flesh_kinsol_residual, u));
  TRY(KINSetUserData(kinsol, problem));
  TRY(KINSetLinearSolver(kinsol, solver, A));
  if (without_matrix) {
    TRY(KINSetJacTimesVecFn(kinsol, flesh_kinsol_jacobian_times));
    TRY(KINSetPreconditioner(kinsol, flesh_kinsol_preconditioner_setup, flesh_kinsol_preconditioner_solve));
  } else {
    TRY(KINSetJacFn(kinsol, flesh_kinsol_jacobian));
  }
  TRY(KINSetEtaForm(kinsol, KIN_ETACONSTANT));
  TRY(KINSetEtaConstValue(kinsol, 1e-3));
  TRY(KINSetMaxSetupCalls(kinsol, 1));     /* a fresh Jacobian in every iteration */
  TRY(KINSetMaxNewtonStep(kinsol, 1e300)); /* KINSOL would limit steps to a multiple of |u|, which starts at 0 */
  TRY(KINSetFuncNormTol(kinsol, 1e-6));    /* N */
  TRY(KINSetScaledStepTol(kinsol, 1e-14));
  TRY(KINSol(kinsol, u, KIN_NONE, ones, ones) < 0);

  /* 5. The result. */
  flesh_state state = bar_ranks_rest(b);
  for (int d = 0; d < own; d++) state.x[d] += N_VGetArrayPointer(u)[d];
  bar_ranks_print_tip(b, without_matrix ? "SUNLinSol_PCG, no matrix:     " : "flesh's matrix and solver:    ", state.x);
  free(state.x);
  free(state.v);

  KINFree(&kinsol);
  SUNLinSolFree(solver);
  if (A) SUNMatDestroy(A);
  N_VDestroy(u);
  N_VDestroy(ones);
  flesh_problem_destroy(&problem);
}

int main(int argc, char **argv)
{
  bar_ranks b;
  SUNContext context;
  MPI_Init(&argc, &argv);
  bar_ranks_begin(&b, 0, 0.3);
  TRY(SUNContext_Create(SUN_COMM_NULL, &context));
  solve(&b, context, 0);
  solve(&b, context, 1);
  SUNContext_Free(&context);
  bar_ranks_end(&b);
  MPI_Finalize();
  return 0;
}
