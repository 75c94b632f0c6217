// TEST quick seconds=60
/* test_kinsol.c: a program that owns its KINSOL uses flesh's callbacks (flesh/kinsol.h): with flesh's matrix and linear
 * solver, with SUNDIALS' PCG, with SUNDIALS' KLU on its sparse matrix. All give the integrator's step. */
#include <kinsol/kinsol.h>
#include <nvector/nvector_serial.h>
#include <stdlib.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_klu.h>
#include <sunlinsol/sunlinsol_pcg.h>
#include <sunmatrix/sunmatrix_sparse.h>

#include "body.h"
#include "flesh/kinsol.h"
#include "test.h"

static const double h = 1. / 60;

/* A bar in motion, clamped at one end, with x and z of its other end prescribed. */
typedef struct set_up {
  test_body b;
  SUNContext context;
  void *kin;
  N_Vector u, ones;
  flesh_problem *problem;
  flesh_solver_options options;
  double *a0;
  flesh_stage stage;
  flesh_method method; /* backward Euler, unless a test says otherwise */
} set_up;

static void make_viscous(flesh_solver_options options, double viscosity, set_up *s)
{
  static const flesh_keyframe keys[] = {{.t = 0}, {.t = 1, .translation = {0.6, 0, -3}}};
  const flesh_motion motion = {.count = 2, .keyframes = keys};
  flesh_material material;
  *s = (set_up){.options = options};
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.45, &material));
  CHECK_OK(test_body_create(test_box(4, 2, 2, 2, 1, 1), material, 1000, FLESH_MASS_CONSISTENT, 1, &s->b));
  CHECK_OK(test_body_gravity(&s->b, 0, 0, -9.81));
  CHECK_OK(test_body_clamp(&s->b, 1e-9));
  CHECK_OK(test_body_hold(&s->b, 0, 2, FLESH_AXIS_X | FLESH_AXIS_Z, &motion, -INFINITY, INFINITY));
  flesh_effect *effect = NULL;
  if (viscosity > 0) {
    CHECK_OK(flesh_effect_viscosity(&s->b.body, viscosity, viscosity, &effect));
    CHECK_OK(flesh_system_add_effect(s->b.system, &effect));
  }
  CHECK_OK(flesh_system_finalize(s->b.system));
  for (int i = 0; i < s->b.n / 3; i++) {
    double *x = s->b.state.x + 3 * i;
    s->b.state.v[3 * i + 1] = x[0] * (1 + x[2]);
    s->b.state.v[3 * i + 2] = -2 * x[0];
  }
  /* Sets up backward Euler's stage, as any program would. */
  s->a0 = malloc((size_t)s->b.n * sizeof *s->a0);
  for (int d = 0; d < s->b.n; d++) s->a0[d] = -s->b.state.v[d] / h;
  s->stage = (flesh_stage){.t = h, .load = 1, .prescribed_fraction = 1, .shift = {.x = 1, .v = 1 / h, .a = 1 / (h * h)},
                           .x0 = s->b.state.x, .a0 = s->a0};
#if SUNDIALS_VERSION_MAJOR >= 7
  CHECK(SUNContext_Create(SUN_COMM_NULL, &s->context) == 0);
#else
  CHECK(SUNContext_Create(NULL, &s->context) == 0);
#endif
  s->u = N_VNew_Serial(s->b.n, s->context);
  s->ones = N_VClone(s->u);
  N_VConst(0, s->u);
  N_VConst(1, s->ones);
  s->kin = KINCreate(s->context);
}

static void make(flesh_solver_options options, set_up *s) { make_viscous(options, 0, s); }

static void drop(set_up *s)
{
  KINFree(&s->kin);
  flesh_problem_destroy(&s->problem);
  N_VDestroy(s->u);
  N_VDestroy(s->ones);
  SUNContext_Free(&s->context);
  free(s->a0);
  test_body_destroy(&s->b);
}

static flesh_solver_options defaults(void)
{
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  return options;
}

/* Returns the end of the integrator's own step, to be freed by the caller. */
static double *integrated(const set_up *s)
{
  flesh_solver_options options = defaults();
  flesh_integrator *integrator = NULL;
  options.newton_tolerance = 1e-12;
  options.linear_solver = FLESH_LINEAR_KLU;
  flesh_state state = {.t = 0,
                       .x = malloc((size_t)s->b.n * sizeof(double)),
                       .v = malloc((size_t)s->b.n * sizeof(double))};
  memcpy(state.x, s->b.state.x, (size_t)s->b.n * sizeof *state.x);
  memcpy(state.v, s->b.state.v, (size_t)s->b.n * sizeof *state.v);
  CHECK_OK(flesh_integrator_create(s->b.system, s->method, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &state, h, NULL));
  flesh_integrator_destroy(&integrator);
  free(state.v);
  return state.x;
}

static double distance_from_integrated(const set_up *s)
{
  double *x = integrated(s), worst = 0;
  for (int d = 0; d < s->b.n; d++)
    worst = fmax(worst, fabs(s->b.state.x[d] + N_VGetArrayPointer(s->u)[d] - x[d]));
  free(x);
  return worst;
}

/* Makes the calls of flesh/kinsol.h's comment, literally. */
static int as_the_header_says(set_up *s, SUNMatrix *matrix, SUNLinearSolver *linear_solver)
{
  const flesh_system *system = s->b.system;
  flesh_solver_options options = s->options;
  flesh_stage stage = s->stage;
  SUNContext context = s->context;
  flesh_problem *problem = NULL;
  SUNMatrix A = NULL;
  SUNLinearSolver solver = NULL;
  N_Vector u = s->u, ones = s->ones;
  void *kin = s->kin;

  flesh_problem_create(system, &options, &problem);
  flesh_problem_set_stage(problem, &stage);
  KINInit(kin, flesh_kinsol_residual, u);            KINSetUserData(kin, problem);
  flesh_sunmatrix_create(problem, context, &A);      flesh_sunlinsol_create(problem, context, &solver);
  KINSetLinearSolver(kin, solver, A);                KINSetJacFn(kin, flesh_kinsol_jacobian);
  KINSetMaxSetupCalls(kin, 1);                       KINSetMaxNewtonStep(kin, 1e300);
  KINSetEtaForm(kin, KIN_ETACONSTANT);               KINSetEtaConstValue(kin, 1e-2);
  int flag = KINSol(kin, u, KIN_NONE, ones, ones);

  s->problem = problem;
  *matrix = A;
  *linear_solver = solver;
  return flag;
}

static void our_solver(flesh_solver_options options)
{
  set_up s;
  SUNMatrix A;
  SUNLinearSolver solver;
  make(options, &s);
  int flag = as_the_header_says(&s, &A, &solver);
  printf("# as in the header: KINSol gave %d, %d Newton iterations, off by %.3g m\n", flag,
         flesh_problem_stats(s.problem)->newton, distance_from_integrated(&s));
  CHECK(flag >= 0);
  CHECK_BELOW(distance_from_integrated(&s), 1e-6);
  /* Again, with a tight tolerance, from the solution and from u = 0. */
  KINSetFuncNormTol(s.kin, 1e-8);
  for (int pass = 0; pass < 2; pass++) {
    CHECK(KINSol(s.kin, s.u, KIN_NONE, s.ones, s.ones) >= 0);
    CHECK_BELOW(distance_from_integrated(&s), 1e-9);
    N_VConst(0, s.u);
    flesh_problem_set_stage(s.problem, &s.stage);
  }
  CHECK(SUNLinSolGetType(solver) == SUNLINEARSOLVER_MATRIX_ITERATIVE);
  SUNLinSolFree(solver);
  SUNMatDestroy(A);
  drop(&s);
}

static void with_our_matrix_and_solver(void)
{
  flesh_solver_options options = defaults();
  our_solver(options);
  options.preconditioner = FLESH_PRECONDITIONER_JACOBI;
  our_solver(options);
  options.linear_solver = FLESH_LINEAR_KLU;
  our_solver(options);
  options.line_search = FLESH_LINE_SEARCH_NONE;
  our_solver(options);
}

static void common(set_up *s)
{
  CHECK_OK(flesh_problem_create(s->b.system, &s->options, &s->problem));
  CHECK_OK(flesh_problem_set_stage(s->problem, &s->stage));
  CHECK(KINInit(s->kin, flesh_kinsol_residual, s->u) == KIN_SUCCESS);
  CHECK(KINSetUserData(s->kin, s->problem) == KIN_SUCCESS);
  KINSetMaxSetupCalls(s->kin, 1);
  KINSetMaxNewtonStep(s->kin, 1e300);
  KINSetFuncNormTol(s->kin, 1e-8);
  KINSetScaledStepTol(s->kin, 1e-15);
}

static void with_sundials_pcg(void)
{
  for (int kind = 0; kind < 3; kind++) {
    flesh_solver_options options = defaults();
    options.preconditioner = (flesh_preconditioner)kind;
    set_up s;
    make(options, &s);
    common(&s);
    SUNLinearSolver solver = SUNLinSol_PCG(s.u, SUN_PREC_RIGHT, 1000, s.context);
    CHECK(KINSetLinearSolver(s.kin, solver, NULL) == KIN_SUCCESS);
    CHECK(KINSetJacTimesVecFn(s.kin, flesh_kinsol_jacobian_times) == KIN_SUCCESS);
    CHECK(KINSetPreconditioner(s.kin, flesh_kinsol_preconditioner_setup, flesh_kinsol_preconditioner_solve) ==
          KIN_SUCCESS);
    KINSetEtaForm(s.kin, KIN_ETACONSTANT);
    KINSetEtaConstValue(s.kin, 1e-2);
    int flag = KINSol(s.kin, s.u, KIN_NONE, s.ones, s.ones);
    long newton, linear;
    KINGetNumNonlinSolvIters(s.kin, &newton);
    KINGetNumLinIters(s.kin, &linear);
    printf("# SUNLinSol_PCG, preconditioner %d: KINSol gave %d, %ld Newton, %ld PCG iterations, off by %.3g m\n", kind,
           flag, newton, linear, distance_from_integrated(&s));
    CHECK(flag >= 0);
    CHECK_BELOW(distance_from_integrated(&s), 1e-9);
    SUNLinSolFree(solver);
    drop(&s);
  }
}

static void with_sundials_klu(void)
{
  for (int format = 0; format < 2; format++) {
    set_up s;
    make(defaults(), &s);
    common(&s);
    SUNMatrix A =
        SUNSparseMatrix(s.b.n, s.b.n, flesh_problem_entries(s.problem), format ? CSR_MAT : CSC_MAT, s.context);
    SUNLinearSolver solver = SUNLinSol_KLU(s.u, A, s.context);
    CHECK(KINSetLinearSolver(s.kin, solver, A) == KIN_SUCCESS);
    CHECK(KINSetJacFn(s.kin, flesh_kinsol_jacobian) == KIN_SUCCESS);
    int flag = KINSol(s.kin, s.u, KIN_NONE, s.ones, s.ones);
    long newton;
    KINGetNumNonlinSolvIters(s.kin, &newton);
    printf("# SUNLinSol_KLU: KINSol gave %d, %ld Newton iterations, off by %.3g m\n", flag, newton,
           distance_from_integrated(&s));
    CHECK(flag >= 0);
    CHECK_BELOW(distance_from_integrated(&s), 1e-9);
    SUNLinSolFree(solver);
    SUNMatDestroy(A);
    /* A matrix that is too small is refused instead of overrun. */
    A = SUNSparseMatrix(s.b.n, s.b.n, flesh_problem_entries(s.problem) - 1, CSC_MAT, s.context);
    CHECK(flesh_kinsol_jacobian(s.u, s.ones, A, s.problem, NULL, NULL) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "room for");
    SUNMatDestroy(A);
    drop(&s);
  }
}

/* A start that ignores the constraints is corrected. */
/* Solves and freezes in turn until a step of the midpoint rule agrees with the integrator's; one solve is not
 * enough. */
static void freezing_ends_at_the_midpoint_rule(void)
{
  set_up s;
  SUNMatrix A = NULL;
  SUNLinearSolver solver = NULL;
  make_viscous(defaults(), 3000, &s);
  s.method = FLESH_METHOD_MIDPOINT;
  for (int d = 0; d < s.b.n; d++) s.a0[d] = -2 * s.b.state.v[d] / h;
  s.stage.t = h / 2;
  s.stage.shift = (flesh_shift){.x = 0.5, .v = 1 / h, .a = 2 / (h * h)};
  s.stage.frozen_at_solution = 1;
  common(&s);
  CHECK_OK(flesh_sunmatrix_create(s.problem, s.context, &A));
  CHECK_OK(flesh_sunlinsol_create(s.problem, s.context, &solver));
  CHECK(KINSetLinearSolver(s.kin, solver, A) == KIN_SUCCESS && KINSetJacFn(s.kin, flesh_kinsol_jacobian) == KIN_SUCCESS);
  flesh_problem_start(s.problem, N_VGetArrayPointer(s.u));
  double first = 0;
  for (int pass = 0; pass < 8; pass++) {
    CHECK(KINSol(s.kin, s.u, KIN_NONE, s.ones, s.ones) >= 0);
    flesh_problem_freeze(s.problem, N_VGetArrayPointer(s.u));
    if (pass == 0) first = distance_from_integrated(&s);
  }
  printf("# the first solve is off by %.3g m, the last by %.3g m\n", first, distance_from_integrated(&s));
  CHECK(first > 1e-6);
  CHECK_BELOW(distance_from_integrated(&s), 1e-10);
  SUNLinSolFree(solver);
  SUNMatDestroy(A);
  drop(&s);
}

static void from_a_start_that_violates_the_constraints(void)
{
  set_up s;
  make(defaults(), &s);
  common(&s);
  SUNMatrix A;
  SUNLinearSolver solver;
  CHECK_OK(flesh_sunmatrix_create(s.problem, s.context, &A));
  CHECK_OK(flesh_sunlinsol_create(s.problem, s.context, &solver));
  CHECK(KINSetLinearSolver(s.kin, solver, A) == KIN_SUCCESS);
  CHECK(KINSetJacFn(s.kin, flesh_kinsol_jacobian) == KIN_SUCCESS);
  KINSetEtaForm(s.kin, KIN_ETACONSTANT);
  KINSetEtaConstValue(s.kin, 1e-2);
  test_jitter(s.b.n, 0.05, 3, N_VGetArrayPointer(s.u));
  CHECK(KINSol(s.kin, s.u, KIN_NONE, s.ones, s.ones) >= 0);
  CHECK_BELOW(distance_from_integrated(&s), 1e-9);
  /* If only the constraints are violated, by a lot, one or two steps repair them. */
  uint8_t *fixed = malloc((size_t)s.b.n);
  flesh_system_fixed(s.b.system, h, fixed);
  for (int d = 0; d < s.b.n; d++) N_VGetArrayPointer(s.u)[d] += 3 * fixed[d];
  flesh_problem_stats(s.problem)->newton = 0;
  CHECK(KINSol(s.kin, s.u, KIN_NONE, s.ones, s.ones) >= 0);
  printf("# %d Newton iterations\n", flesh_problem_stats(s.problem)->newton);
  CHECK(flesh_problem_stats(s.problem)->newton <= 8); /* of 1e-2 each by PCG */
  CHECK_BELOW(distance_from_integrated(&s), 1e-9);
  free(fixed);
  SUNLinSolFree(solver);
  SUNMatDestroy(A);
  drop(&s);
}

/* Compares the Jacobian in every form with differences of the residual, including constrained rows and columns. */
static void jacobian_is_the_residuals(void)
{
  set_up s;
  make(defaults(), &s);
  common(&s);
  int n = s.b.n;
  SUNMatrix sparse = SUNSparseMatrix(n, n, flesh_problem_entries(s.problem), CSC_MAT, s.context), block;
  CHECK_OK(flesh_sunmatrix_create(s.problem, s.context, &block));
  CHECK(SUNMatGetID(block) == SUNMATRIX_CUSTOM);
  N_Vector r = N_VClone(s.u), v = N_VClone(s.u), Jv = N_VClone(s.u), Av = N_VClone(s.u);
  double *u = N_VGetArrayPointer(s.u), *dense = calloc((size_t)n * n, sizeof *dense),
         *differences = calloc((size_t)n * n, sizeof *differences), worst = 0, size = 0;
  uint8_t *fixed = malloc((size_t)n);
  CHECK(flesh_system_fixed(s.b.system, h, fixed) == 9 * 3 + 9 * 2);
  flesh_problem_start(s.problem, u);
  for (int d = 0; d < n; d++) CHECK(fixed[d] || u[d] == 0);
  test_jitter(n, 0.03, 9, u);
  CHECK_OK(flesh_kinsol_jacobian(s.u, r, sparse, s.problem, NULL, NULL));
  CHECK_OK(flesh_kinsol_jacobian(s.u, r, block, s.problem, NULL, NULL));
  for (int64_t j = 0; j < n; j++)
    for (sunindextype k = SUNSparseMatrix_IndexPointers(sparse)[j]; k < SUNSparseMatrix_IndexPointers(sparse)[j + 1];
         k++)
      dense[SUNSparseMatrix_IndexValues(sparse)[k] * n + j] = SUNSparseMatrix_Data(sparse)[k];
  const double offsets[] = {-2, -1, 1, 2}, weights[] = {1. / 12, -2. / 3, 2. / 3, -1. / 12}, step = 2e-4;
  for (int d = 0; d < n; d++) {
    double before = u[d];
    for (int k = 0; k < 4; k++) {
      u[d] = before + offsets[k] * step;
      CHECK_OK(flesh_kinsol_residual(s.u, r, s.problem));
      for (int e = 0; e < n; e++) differences[e * n + d] += weights[k] * N_VGetArrayPointer(r)[e] / step;
    }
    u[d] = before;
  }
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) {
      double J = dense[i * n + j];
      size = fmax(size, fabs(J));
      CHECK((!fixed[i] && !fixed[j]) || (i == j ? J > 0 : J == 0)); /* identity rows, with their columns eliminated */
      worst = fmax(worst, fabs(J - differences[i * n + j]));
    }
  printf("# the Jacobian is off by %.2g of its largest entry\n", worst / size);
  CHECK_BELOW(worst, 1e-9 * size);
  N_VConst(0, v);
  test_jitter(n, 1, 4, N_VGetArrayPointer(v));
  flesh_sunboolean fresh = 1;
  CHECK(flesh_kinsol_jacobian_times(v, Jv, s.u, &fresh, s.problem) == 0);
  CHECK(SUNMatMatvec(block, v, Av) == 0);
  for (int i = 0; i < n; i++) {
    double sum = 0;
    for (int j = 0; j < n; j++) sum += dense[i * n + j] * N_VGetArrayPointer(v)[j];
    CHECK_NEAR(N_VGetArrayPointer(Jv)[i], sum, 1e-12 * size);
    CHECK_NEAR(N_VGetArrayPointer(Av)[i], sum, 1e-12 * size);
  }
  SUNMatDestroy(sparse);
  SUNMatDestroy(block);
  N_VDestroy(r);
  N_VDestroy(v);
  N_VDestroy(Jv);
  N_VDestroy(Av);
  free(dense);
  free(differences);
  free(fixed);
  drop(&s);
}

/* Statuses of the callbacks where a value is undefined. */
static void callbacks_say_what_is_undefined(void)
{
  for (int plain = 0; plain < 2; plain++) {
    flesh_solver_options options = defaults();
    if (plain) options.line_search = FLESH_LINE_SEARCH_NONE;
    set_up s;
    make(options, &s);
    common(&s);
    SUNMatrix A;
    CHECK_OK(flesh_sunmatrix_create(s.problem, s.context, &A));
    N_Vector r = N_VClone(s.u);
    N_VGetArrayPointer(s.u)[40] = NAN;
    int residual = flesh_kinsol_residual(s.u, r, s.problem);
    int jacobian = flesh_kinsol_jacobian(s.u, r, A, s.problem, NULL, NULL);
    int setup = flesh_kinsol_preconditioner_setup(s.u, s.ones, r, s.ones, s.problem);
    CHECK(plain ? residual < 0 && jacobian < 0 && setup < 0 : residual > 0 && jacobian > 0 && setup > 0);
    N_VGetArrayPointer(s.u)[40] = 0;
    CHECK(flesh_kinsol_residual(s.u, r, s.problem) == 0); /* and it was not stored */
    /* A direction of negative curvature stops SUNDIALS' PCG instead of corrupting it. */
    for (int i = 0; i < s.b.n / 3; i++) N_VGetArrayPointer(s.u)[3 * i] = -1.9 * s.b.state.x[3 * i];
    s.stage.shift = (flesh_shift){.x = 1};
    CHECK_OK(flesh_problem_set_stage(s.problem, &s.stage));
    CHECK_OK(flesh_kinsol_jacobian(s.u, r, A, s.problem, NULL, NULL));
    N_Vector v = N_VClone(s.u);
    flesh_sunboolean fresh = 0;
    int negative = 0;
    for (unsigned k = 0; k < 50; k++) {
      /* Rotates an inside-out body in the middle, with increasing noise, which is stiff. */
      for (int d = 0; d < s.b.n; d++) {
        const double *X = s.b.state.x + d - d % 3;
        double turn[3] = {-X[2], 0, X[0]};
        N_VGetArrayPointer(v)[d] = sin(M_PI / 2 * X[0]) * turn[d % 3];
      }
      test_jitter(s.b.n, 0.02 * k, k, N_VGetArrayPointer(v));
      int code = flesh_kinsol_jacobian_times(v, r, s.u, &fresh, s.problem);
      CHECK(code == (N_VDotProd(v, r) > 0 ? FLESH_OK : FLESH_NOT_POSITIVE));
      negative += code != FLESH_OK;
    }
    printf("# %d of 50 directions have negative curvature\n", negative);
    CHECK(negative > 0 && negative < 50);
    N_VConst(0, v);
    CHECK_OK(flesh_kinsol_jacobian_times(v, r, s.u, &fresh, s.problem));
    SUNMatDestroy(A);
    N_VDestroy(r);
    N_VDestroy(v);
    drop(&s);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(with_our_matrix_and_solver), TEST(with_sundials_pcg), TEST(with_sundials_klu),
                   TEST(freezing_ends_at_the_midpoint_rule),
                   TEST(from_a_start_that_violates_the_constraints), TEST(jacobian_is_the_residuals),
                   TEST(callbacks_say_what_is_undefined));
}
