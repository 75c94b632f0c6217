/* bar_ranks_kinsol.c: equilibrium by a KINSOL of the program, on ranks of MPI: mpirun -n 3 example_bar_ranks_kinsol
 *
 * A bar that sags under its weight, with vectors of N_VNew_Parallel. A rank's part of them has the numbers of its own
 * nodes; flesh's callbacks fetch those of ghosts. Solved twice from u = 0:
 *   - with flesh's block matrix and linear solver,
 *   - with SUNDIALS' conjugate gradients, to which flesh gives products and the preconditioner, and no matrix.
 *
 * Sample output:
 *   384 tets on 3 ranks
 *   flesh's matrix and solver:     tip at (1.963, 0.223, -0.224) m
 *   SUNLinSol_PCG, no matrix:      tip at (1.963, 0.223, -0.224) m
 */
#include <flesh/flesh.h>
#include <flesh/kinsol.h>
#include <kinsol/kinsol.h>
#include <math.h>
#include <mpi.h>
#include <nvector/nvector_parallel.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sunlinsol/sunlinsol_pcg.h>

#ifndef SUN_COMM_NULL /* SUNDIALS before 7 */
#define SUN_COMM_NULL NULL
#endif

/* Ends all ranks where a call fails. */
#define TRY(call)                                                                              \
  do {                                                                                         \
    if (call) {                                                                                \
      fprintf(stderr, "%s:%d: %s fails: %s\n", __FILE__, __LINE__, #call, flesh_error_text()); \
      MPI_Abort(MPI_COMM_WORLD, 1);                                                            \
    }                                                                                          \
  } while (0)

/* Elasticity and gravity on the part's tets, and pins where it has nodes of the held end. */
static flesh_system *make_system(const flesh_rank_part *part, const flesh_body *body)
{
  const flesh_mesh *mesh = flesh_rank_part_mesh(part);
  const int nodes = flesh_mesh_node_count(mesh);
  flesh_system *system;
  flesh_effect *effect;
  TRY(flesh_system_create(mesh, &system));
  TRY(flesh_system_set_part(system, part));
  TRY(flesh_effect_elasticity(body, &effect));
  TRY(flesh_system_add_effect(system, &effect));
  TRY(flesh_effect_gravity(body, (double[]){0, 0, -0.3}, &effect));
  TRY(flesh_system_add_effect(system, &effect));
  int *held = malloc((size_t)nodes * sizeof *held), count = 0;
  for (int i = 0; i < nodes; i++)
    if (flesh_mesh_positions(mesh)[3 * i] < 1e-9) held[count++] = i;
  if (count) TRY(flesh_system_add_pin(system, count, held, FLESH_AXES_ALL, -INFINITY, INFINITY));
  TRY(flesh_system_finalize(system));
  free(held);
  return system;
}

/* The first rank prints where the middle of the free end is, by u of each rank's own nodes. */
static void print_tip(const flesh_rank_part *part, const flesh_mesh *whole, const double *u, const char *how, int first)
{
  const int nodes = flesh_mesh_node_count(whole), own = flesh_rank_part_own(part), tip = (1 * 3 + 1) * 17 + 16;
  double *places = malloc(3 * (size_t)flesh_mesh_node_count(flesh_rank_part_mesh(part)) * sizeof *places);
  double *x = malloc(3 * (size_t)nodes * sizeof *x);
  for (int d = 0; d < 3 * own; d++) places[d] = flesh_mesh_positions(flesh_rank_part_mesh(part))[d] + u[d];
  TRY(flesh_rank_part_gather(part, places, x)); /* what ghosts have is not read */
  if (first) printf("%s tip at (%.3f, %.3f, %.3f) m\n", how, x[3 * tip], x[3 * tip + 1], x[3 * tip + 2]);
  free(places);
  free(x);
}

static void solve(const flesh_system *system, const flesh_rank_part *part, const flesh_mesh *whole, SUNContext context,
                  int without_matrix, int first)
{
  /* 1. Flesh's side of the problem, as on one rank. */
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  flesh_problem *problem;
  TRY(flesh_problem_create(system, &options, &problem));
  const flesh_stage stage = {
      .load = 1, .prescribed_fraction = 1, .shift = {.x = 1}, .x0 = flesh_mesh_positions(flesh_rank_part_mesh(part))};
  TRY(flesh_problem_set_stage(problem, &stage));

  /* 2. Vectors of own nodes: a rank's part, and all of it. The pins hold where the body is at rest, so u = 0 will do. */
  N_Vector u = N_VNew_Parallel(MPI_COMM_WORLD, 3 * flesh_rank_part_own(part), 3 * flesh_mesh_node_count(whole), context),
           ones = N_VClone(u);
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
  TRY(KINSetMaxNewtonStep(kinsol, 1e300)); /* KINSOL would limit steps by |u|, which starts at 0 */
  TRY(KINSetFuncNormTol(kinsol, 1e-6));    /* N */
  TRY(KINSetScaledStepTol(kinsol, 1e-14));
  TRY(KINSol(kinsol, u, KIN_NONE, ones, ones) < 0);
  print_tip(part, whole, N_VGetArrayPointer(u),
            without_matrix ? "SUNLinSol_PCG, no matrix:     " : "flesh's matrix and solver:    ", first);

  KINFree(&kinsol);
  SUNLinSolFree(solver);
  if (A) SUNMatDestroy(A);
  N_VDestroy(u);
  N_VDestroy(ones);
  flesh_problem_destroy(&problem);
}

int main(int argc, char **argv)
{
  MPI_Init(&argc, &argv);
  MPI_Comm world = MPI_COMM_WORLD;
  flesh_communicator *communicator;
  TRY(flesh_communicator_create(&world, &communicator));
  const int first = flesh_communicator_rank(communicator) == 0;
  flesh_mesh *whole;
  flesh_rank_part *part;
  TRY(flesh_mesh_box((int[]){16, 2, 2}, (double[]){2, 0.25, 0.25}, (double[]){0, 0, 0}, &whole));
  TRY(flesh_rank_part_create(communicator, whole, NULL, &part));
  if (first) printf("%d tets on %d ranks\n", flesh_mesh_tet_count(whole), flesh_communicator_size(communicator));

  const int tets = flesh_mesh_tet_count(flesh_rank_part_mesh(part));
  flesh_material material;
  TRY(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.45, &material));
  double *density = malloc((size_t)tets * sizeof *density);
  for (int e = 0; e < tets; e++) density[e] = 1000; /* kg/m^3 */
  const flesh_body body = {.mesh = flesh_rank_part_mesh(part), .density = density, .materials = &material};
  flesh_system *system = make_system(part, &body);
  SUNContext context;
  TRY(SUNContext_Create(SUN_COMM_NULL, &context));
  solve(system, part, whole, context, 0, first);
  solve(system, part, whole, context, 1, first);

  SUNContext_Free(&context);
  flesh_system_destroy(&system);
  flesh_rank_part_destroy(&part);
  flesh_mesh_destroy(&whole);
  free(density);
  flesh_communicator_destroy(&communicator);
  MPI_Finalize();
  return 0;
}
