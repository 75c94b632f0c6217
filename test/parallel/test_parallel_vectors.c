// TEST full memory needs=ranks,nvecparallel ranks=1,2,3,5
/* test_parallel_vectors.c: programs on several ranks that own KINSOL and pass vectors of N_VNew_Parallel to
 * callbacks. */
#include "ranks.h"

#include <kinsol/kinsol.h>
#include <nvector/nvector_parallel.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_pcg.h>

#include "body.h"
#include "flesh/kinsol.h"
#include "sundials/compatibility.h"

/* A sagging bar: the whole on every rank, and this rank's part of it, whose own numbers are in u. */
typedef struct sagging {
  flesh_mesh *mesh;
  flesh_rank_part *part;
  test_body whole, own;
  flesh_problem *problem;
  SUNContext context;
  N_Vector u, ones;
  void *kin;
} sagging;

static int add_effects(test_body *b)
{
  int *nodes = malloc((size_t)b->n * sizeof *nodes), count = 0, status = test_body_gravity(b, 0, 0, -5);
  for (int i = 0; i < b->n / 3; i++)
    if (flesh_mesh_positions(b->mesh)[3 * i] <= 1e-9) nodes[count++] = i;
  if (!status && count) status = flesh_system_add_pin(b->system, count, nodes, FLESH_AXES_ALL, -INFINITY, INFINITY);
  free(nodes);
  return status ? status : flesh_system_finalize(b->system);
}

static N_Vector new_vector(const sagging *s, int own, double all)
{
  return N_VNew_Parallel(MPI_COMM_WORLD, own, (sunindextype)all, s->context);
}

static void make(flesh_preconditioner kind, sagging *s)
{
  const flesh_material material = test_material(FLESH_ENERGY_S, 0.4);
  const flesh_stage stage = {.load = 1, .prescribed_fraction = 1, .shift = {.x = 1}};
  flesh_solver_options options = test_options(1e-8);
  options.preconditioner = kind;
  *s = (sagging){.mesh = test_box(8, 3, 2, 1, 0.4, 0.3)};
  s->part = ranks_cut(s->mesh);
  CHECK_OK(test_body_create(s->mesh, material, 1000, FLESH_MASS_LUMPED, 0, &s->whole));
  CHECK_OK(test_body_create((flesh_mesh *)flesh_rank_part_mesh(s->part), material, 1000, FLESH_MASS_LUMPED, 0, &s->own));
  CHECK_OK(add_effects(&s->whole));
  CHECK_OK(add_effects(&s->own));
  CHECK_OK(flesh_system_set_part(s->own.system, s->part));
  CHECK_OK(flesh_problem_create(s->own.system, &options, &s->problem));
  flesh_stage own = stage;
  own.x0 = flesh_mesh_positions(s->own.mesh);
  CHECK_OK(flesh_problem_set_stage(s->problem, &own));
  CHECK(flesh_suncontext_create(&s->context) == 0);
  const flesh_team *team = flesh_rank_part_team(s->part);
  s->u = new_vector(s, 3 * team->own, 3 * team->all);
  s->ones = N_VClone(s->u);
  N_VConst(0, s->u);
  N_VConst(1, s->ones);
  s->kin = KINCreate(s->context);
  CHECK(KINInit(s->kin, flesh_kinsol_residual, s->u) == KIN_SUCCESS);
  CHECK(KINSetUserData(s->kin, s->problem) == KIN_SUCCESS);
  KINSetMaxSetupCalls(s->kin, 1);
  KINSetMaxNewtonStep(s->kin, 1e300);
  KINSetFuncNormTol(s->kin, 1e-8);
  KINSetScaledStepTol(s->kin, 1e-15);
  KINSetEtaForm(s->kin, KIN_ETACONSTANT);
  KINSetEtaConstValue(s->kin, 1e-2);
}

static void drop(sagging *s)
{
  KINFree(&s->kin);
  N_VDestroy(s->u);
  N_VDestroy(s->ones);
  SUNContext_Free(&s->context);
  flesh_problem_destroy(&s->problem);
  s->own.mesh = NULL; /* the part's */
  test_body_destroy(&s->own);
  test_body_destroy(&s->whole);
  flesh_rank_part_destroy(&s->part);
}

/* Returns the distance of x0 + u from the whole's equilibrium on one rank, in m. */
static double distance_from_whole(sagging *s)
{
  flesh_solver_options options = test_options(1e-10);
  flesh_integrator *integrator = NULL;
  double *x = malloc((size_t)s->own.n * sizeof *x), *all = malloc((size_t)s->whole.n * sizeof *all);
  memcpy(x, flesh_mesh_positions(s->own.mesh), (size_t)s->own.n * sizeof *x);
  for (int d = 0; d < 3 * flesh_rank_part_own(s->part); d++) x[d] += N_VGetArrayPointer(s->u)[d];
  CHECK_OK(flesh_rank_part_gather(s->part, x, all));
  CHECK_OK(flesh_integrator_create(s->whole.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &s->whole.state, 0, NULL));
  const double sag = test_distance(s->whole.n, s->whole.state.x, flesh_mesh_positions(s->mesh)),
               distance = test_distance(s->whole.n, s->whole.state.x, all);
  CHECK(sag > 0.1);
  flesh_integrator_destroy(&integrator);
  free(x);
  free(all);
  return distance;
}

static void with_our_matrix_and_solver(void)
{
  static const flesh_preconditioner kinds[] = {FLESH_PRECONDITIONER_JACOBI, FLESH_PRECONDITIONER_TWO_LEVEL};
  for (int k = 0; k < 2; k++) {
    sagging s;
    SUNMatrix A = NULL;
    SUNLinearSolver solver = NULL;
    make(kinds[k], &s);
    CHECK_OK(flesh_sunmatrix_create(s.problem, s.context, &A));
    CHECK_OK(flesh_sunlinsol_create(s.problem, s.context, &solver));
    CHECK(KINSetLinearSolver(s.kin, solver, A) == KIN_SUCCESS);
    CHECK(KINSetJacFn(s.kin, flesh_kinsol_jacobian) == KIN_SUCCESS);
    CHECK(KINSol(s.kin, s.u, KIN_NONE, s.ones, s.ones) >= 0);
    CHECK_BELOW(distance_from_whole(&s), 1e-8);
    SUNLinSolFree(solver);
    SUNMatDestroy(A);
    drop(&s);
  }
}

/* SUNDIALS' own linear solver uses products and the preconditioner from the callbacks. */
static void with_sundials_pcg(void)
{
  static const flesh_preconditioner kinds[] = {FLESH_PRECONDITIONER_IC, FLESH_PRECONDITIONER_TWO_LEVEL};
  for (int k = 0; k < 2; k++) {
    sagging s;
    long newton = 0, linear = 0;
    make(kinds[k], &s);
    SUNLinearSolver solver = SUNLinSol_PCG(s.u, SUN_PREC_RIGHT, 1000, s.context);
    CHECK(KINSetLinearSolver(s.kin, solver, NULL) == KIN_SUCCESS);
    CHECK(KINSetJacTimesVecFn(s.kin, flesh_kinsol_jacobian_times) == KIN_SUCCESS);
    CHECK(KINSetPreconditioner(s.kin, flesh_kinsol_preconditioner_setup, flesh_kinsol_preconditioner_solve) == KIN_SUCCESS);
    CHECK(KINSol(s.kin, s.u, KIN_NONE, s.ones, s.ones) >= 0);
    KINGetNumNonlinSolvIters(s.kin, &newton);
    KINGetNumLinIters(s.kin, &linear);
    if (flesh_communicator_rank(ranks) == 0)
      printf("# %d ranks, preconditioner %d: %ld Newton, %ld linear iterations\n", flesh_communicator_size(ranks), k, newton,
             linear);
    CHECK(linear < 40 * newton);
    CHECK_BELOW(distance_from_whole(&s), 1e-8);
    SUNLinSolFree(solver);
    drop(&s);
  }
}

/* The matrix as multiplied by SUNDIALS, and the callbacks' products, are those of the whole. */
static void products_are_those_of_one_rank(void)
{
  sagging s;
  SUNMatrix A = NULL;
  make(FLESH_PRECONDITIONER_IC, &s);
  N_Vector y = N_VClone(s.u), z = N_VClone(s.u);
  CHECK_OK(flesh_sunmatrix_create(s.problem, s.context, &A));
  CHECK_OK(flesh_kinsol_jacobian(s.u, NULL, A, s.problem, NULL, NULL));
  CHECK(SUNMatMatvec(A, s.ones, y) == 0);
  CHECK(flesh_kinsol_jacobian_times(s.ones, z, s.u, NULL, s.problem) >= 0);
  N_VLinearSum(1, y, -1, z, z);
  CHECK_BELOW(N_VMaxNorm(z), 1e-12 * N_VMaxNorm(y));
  /* A translation loads only constrained nodes and their neighbours. */
  const double *X = flesh_mesh_positions(s.own.mesh), *at = N_VGetArrayPointer(y);
  for (int d = 0; d < 3 * flesh_rank_part_own(s.part); d++)
    if (X[d - d % 3] > 0.13) CHECK_BELOW(fabs(at[d]), 1e-10 * 1e5);
  N_VDestroy(y);
  N_VDestroy(z);
  SUNMatDestroy(A);
  drop(&s);
}

/* A vector whose size is not that of the own nodes on one rank is refused on all. */
static void other_vectors_are_refused(void)
{
  sagging s;
  make(FLESH_PRECONDITIONER_IC, &s);
  const flesh_team *team = flesh_rank_part_team(s.part);
  const int first = flesh_communicator_rank(ranks) == 0, more = flesh_communicator_size(ranks) > 1 ? 3 : 0;
  const int last = flesh_communicator_rank(ranks) == flesh_communicator_size(ranks) - 1;
  N_Vector moved = new_vector(&s, 3 * team->own + (first ? more : 0) - (last ? more : 0), 3 * team->all),
           longer = new_vector(&s, 3 * team->own + (first ? 3 : 0), 3 * team->all + 3),
           serial = N_VNew_Serial(3 * team->own + 1, s.context), r = N_VClone(s.u);
  N_VConst(0, moved);
  N_VConst(0, longer);
  CHECK(flesh_kinsol_residual(s.u, r, s.problem) == FLESH_OK);
  CHECK(flesh_kinsol_residual(moved, r, s.problem) == (more ? FLESH_ERR_ARGUMENT : FLESH_OK));
  if (more) CHECK_TEXT(flesh_error_text(), "of own nodes");
  CHECK(flesh_kinsol_residual(longer, r, s.problem) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "of own nodes");
  CHECK(flesh_kinsol_residual(s.u, longer, s.problem) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_kinsol_residual(serial, r, s.problem) == FLESH_ERR_ARGUMENT);
  N_VDestroy(moved);
  N_VDestroy(longer);
  N_VDestroy(serial);
  N_VDestroy(r);
  drop(&s);
}

int main(int argc, char **argv)
{
  return RUN_TESTS_ON_RANKS(argc, argv, TEST(with_our_matrix_and_solver), TEST(with_sundials_pcg),
                            TEST(products_are_those_of_one_rank), TEST(other_vectors_are_refused));
}
