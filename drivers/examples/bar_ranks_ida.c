/* bar_ranks_ida.c: computes a motion by the program's own IDA on ranks of MPI: mpirun -n 3 example_bar_ranks_ida
 *
 * A bar, held at one end, falls and swings under gravity: F(t, y, y') = 0 with y = (x, v) in vectors of
 * N_VNew_Parallel. A rank's part of a vector has the positions of its own nodes, then their velocities; flesh's
 * callbacks fetch the values of ghosts. IDA chooses its steps by norms, which N_VNew_Parallel sums over the ranks, so
 * that all ranks take the same steps. The program solves twice:
 *   - with flesh's matrix and linear solver, which eliminates the velocities,
 *   - with SUNDIALS' GMRES and no matrix; flesh gives products with the Jacobian and the preconditioner.
 *
 * Sample output:
 *   384 tets on 3 ranks
 *   flesh's matrix and solver, t = 0.25 s: tip at (2.000, 0.125, 0.062) m
 *   flesh's matrix and solver, t = 0.50 s: tip at (1.987, 0.109, -0.163) m
 *   SUNLinSol_SPGMR, no matrix, t = 0.25 s: tip at (2.000, 0.125, 0.062) m
 *   SUNLinSol_SPGMR, no matrix, t = 0.50 s: tip at (1.987, 0.109, -0.163) m
 */
#include <flesh/ida.h>
#include <ida/ida.h>
#include <nvector/nvector_parallel.h>
#include <sunlinsol/sunlinsol_spgmr.h>

#include "bar_ranks.h"

static void swing(const bar_ranks *b, SUNContext context, const char *way, int without_matrix)
{
  /* 1. Flesh's side of F, as on one rank. */
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  flesh_ida_problem *problem;
  TRY(flesh_ida_problem_create(b->system, &options, &problem));

  /* 2. Vectors with 6 numbers for each own node. The state has the ghosts, too. */
  const int own = 6 * flesh_rank_part_own(b->part), all = 6 * flesh_mesh_node_count(b->whole);
  N_Vector y = N_VNew_Parallel(MPI_COMM_WORLD, own, all, context), yp = N_VClone(y), atol = N_VClone(y);
  flesh_state state = bar_ranks_rest(b);

  /* 3. Consistent initial values, and the tolerances of positions and velocities. */
  TRY(flesh_ida_start(problem, &state, y, yp));
  TRY(flesh_ida_tolerances(problem, 1e-6, atol));

  /* 4. IDA with flesh's callbacks. */
  void *ida = IDACreate(context);
  TRY(IDAInit(ida, flesh_ida_residual, state.t, y, yp));
  TRY(IDASVtolerances(ida, 0, atol));
  TRY(IDASetUserData(ida, problem));
  TRY(IDASetMaxOrd(ida, 2)); /* A-stable */
  TRY(IDASetMaxNumSteps(ida, 100000));
  SUNMatrix A = NULL;
  SUNLinearSolver solver;
  if (without_matrix) {
    solver = SUNLinSol_SPGMR(y, SUN_PREC_LEFT, 20, context);
    TRY(IDASetLinearSolver(ida, solver, NULL));
    TRY(IDASetPreconditioner(ida, flesh_ida_preconditioner_setup, flesh_ida_preconditioner_solve));
    TRY(IDASetJacTimes(ida, NULL, flesh_ida_jacobian_times));
  } else {
    TRY(flesh_ida_sunmatrix_create(problem, context, &A));
    TRY(flesh_ida_sunlinsol_create(problem, context, &solver));
    TRY(IDASetLinearSolver(ida, solver, A));
    TRY(IDASetJacFn(ida, flesh_ida_jacobian));
  }

  /* 5. The motion, printed at two times. */
  for (int k = 1; k <= 2; k++) {
    char when[80];
    double t;
    TRY(IDASolve(ida, 0.25 * k, &t, y, yp, IDA_NORMAL) < 0);
    TRY(flesh_ida_get_state(problem, t, y, &state));
    snprintf(when, sizeof when, "%s, t = %.2f s:", way, t);
    bar_ranks_print_tip(b, when, state.x);
  }

  IDAFree(&ida);
  SUNLinSolFree(solver);
  if (A) SUNMatDestroy(A);
  N_VDestroy(y);
  N_VDestroy(yp);
  N_VDestroy(atol);
  free(state.x);
  free(state.v);
  flesh_ida_problem_destroy(&problem);
}

int main(int argc, char **argv)
{
  bar_ranks b;
  SUNContext context;
  MPI_Init(&argc, &argv);
  bar_ranks_begin(&b, 1, 2);
  TRY(SUNContext_Create(SUN_COMM_NULL, &context));
  swing(&b, context, "flesh's matrix and solver", 0);
  swing(&b, context, "SUNLinSol_SPGMR, no matrix", 1);
  SUNContext_Free(&context);
  bar_ranks_end(&b);
  MPI_Finalize();
  return 0;
}
