// TEST quick seconds=60
/* test_ida.c: the callbacks and solvers for IDA in a program that owns its IDA: derivatives, agreement of the linear
 * solvers, the sequence documented in ida.h. */
#include <ida/ida.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_klu.h>
#include <sunmatrix/sunmatrix_sparse.h>

#include "busy_bar.h"
#include "geometry/motion.h"
#include "motion_reference.h"
#include "sundials/compatibility.h"
#include "sundials/ida_problem.h"

/* Compares velocities and accelerations of a motion with differences of its positions. */
static void rates_of_motions(void)
{
  const flesh_keyframe keys[] = {{0, {0}, {0}}, {0.5, {1, 2, 3}, {0.3, -0.4, 0.2}}, {1.5, {0, 0, 1}, {2.5, 3, -4}}};
  const double X[3] = {0.7, -0.2, 1.1}, times[] = {0.01, 0.2, 0.45, 0.6, 1.1, 1.45, 2}, h = 1e-4;
  for (int smooth = 0; smooth < 2; smooth++)
    for (size_t k = 0; k < sizeof times / sizeof times[0]; k++) {
      const flesh_motion motion = {3, keys, {0.1, 0.2, -0.3}, smooth};
      double y[5][3], v[3], a[3];
      for (int j = 0; j < 5; j++) flesh_motion_apply(&motion, times[k] + (j - 2) * h, X, y[j]);
      flesh_motion_rates(&motion, times[k], X, v, a);
      for (int c = 0; c < 3; c++) {
        double rate = (y[0][c] - 8 * y[1][c] + 8 * y[3][c] - y[4][c]) / (12 * h);
        double second = (-y[0][c] + 16 * y[1][c] - 30 * y[2][c] + 16 * y[3][c] - y[4][c]) / (12 * h * h);
        CHECK_NEAR(v[c], rate, 1e-10);
        CHECK_NEAR(a[c], second, 2e-6);
      }
    }
}

typedef struct owned {
  SUNContext context;
  flesh_ida_problem *problem;
  void *ida;
  N_Vector y, yp, atol;
  SUNMatrix A;
  SUNLinearSolver solver;
} owned;

static void open_owned(const test_body *b, flesh_linear_solver linear, int sparse, owned *o)
{
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  options.linear_solver = linear;
  options.linear_tolerance = 1e-6;
  *o = (owned){0};
  CHECK(!flesh_suncontext_create(&o->context));
  CHECK_OK(flesh_ida_problem_create(b->system, &options, &o->problem));
  if (sparse) o->y = N_VNew_Serial(2 * b->n, o->context); /* any serves */
  else CHECK_OK(flesh_ida_vector_create(o->problem, o->context, &o->y));
  o->yp = N_VClone(o->y);
  o->atol = N_VClone(o->y);
  o->ida = IDACreate(o->context);
  if (sparse) {
    o->A = SUNSparseMatrix(2 * b->n, 2 * b->n, flesh_ida_entries(o->problem), CSC_MAT, o->context);
    o->solver = SUNLinSol_KLU(o->y, o->A, o->context);
  } else {
    CHECK_OK(flesh_ida_sunmatrix_create(o->problem, o->context, &o->A));
    CHECK_OK(flesh_ida_sunlinsol_create(o->problem, o->context, &o->solver));
  }
}

static void close_owned(owned *o)
{
  IDAFree(&o->ida);
  SUNLinSolFree(o->solver);
  SUNMatDestroy(o->A);
  N_VDestroy(o->y);
  N_VDestroy(o->yp);
  N_VDestroy(o->atol);
  flesh_ida_problem_destroy(&o->problem);
  SUNContext_Free(&o->context);
}

/* Follows ida.h's sequence from the state to `end` through all events. Returns the number of steps. */
static long run_owned(owned *o, double tolerance, int order, double end, flesh_state *state)
{
  long steps = 0;
  for (int begun = 0; state->t < end; begun = 1) {
    double t = state->t;
    CHECK_OK(flesh_ida_start(o->problem, state, o->y, o->yp));
    CHECK_OK(flesh_ida_tolerances(o->problem, tolerance, o->atol));
    if (!begun) {
      CHECK(!IDAInit(o->ida, flesh_ida_residual, state->t, o->y, o->yp));
      CHECK(!IDASetUserData(o->ida, o->problem) && !IDASetMaxOrd(o->ida, order));
      CHECK(!IDASetLinearSolver(o->ida, o->solver, o->A) && !IDASetJacFn(o->ida, flesh_ida_jacobian));
      CHECK(!IDASetMaxNumSteps(o->ida, 100000));
    } else {
      CHECK(!IDAReInit(o->ida, state->t, o->y, o->yp));
    }
    CHECK(!IDASVtolerances(o->ida, 0, o->atol));
    double event = flesh_ida_event(o->problem);
    if (event < INFINITY) CHECK(!IDASetStopTime(o->ida, event));
    int flag = IDASolve(o->ida, end, &t, o->y, o->yp, IDA_NORMAL);
    CHECK(flag == IDA_SUCCESS || flag == IDA_TSTOP_RETURN);
    if (flag < 0) break;
    CHECK_OK(flesh_ida_get_state(o->problem, t, o->y, state));
    long more = 0;
    IDAGetNumSteps(o->ida, &more);
    steps += more;
  }
  return steps;
}

/* Compares the 2N Jacobian with differences of F, and the condensed solve with a solve of the 2N matrix. */
static void check_jacobian(flesh_mass mass)
{
  test_body b;
  owned sparse, condensed;
  const double t = 0.15, cj = 37;
  make_busy_bar(mass, &b);
  open_owned(&b, FLESH_LINEAR_PCG, 1, &sparse);
  open_owned(&b, FLESH_LINEAR_PCG, 0, &condensed);
  condensed.problem->options.linear_tolerance = 1e-13;
  int N = 2 * b.n;
  test_jitter(b.n, 0.05, 5, b.state.x);
  test_jitter(b.n, 1, 6, b.state.v);
  b.state.t = 0.14;
  CHECK_OK(flesh_ida_start(sparse.problem, &b.state, sparse.y, sparse.yp));
  CHECK_OK(flesh_ida_start(condensed.problem, &b.state, condensed.y, condensed.yp));
  test_jitter(N, 0.02, 7, N_VGetArrayPointer(sparse.y)); /* also off the constraints */
  test_jitter(N, 0.5, 8, N_VGetArrayPointer(sparse.yp));
  memcpy(N_VGetArrayPointer(condensed.y), N_VGetArrayPointer(sparse.y), (size_t)N * sizeof(double));
  memcpy(N_VGetArrayPointer(condensed.yp), N_VGetArrayPointer(sparse.yp), (size_t)N * sizeof(double));
  CHECK_OK(flesh_ida_jacobian(t, cj, sparse.y, sparse.yp, NULL, sparse.A, sparse.problem, NULL, NULL, NULL));
  double *J = calloc((size_t)N * N, sizeof *J), *y = N_VGetArrayPointer(sparse.y), *yp = N_VGetArrayPointer(sparse.yp);
  sunindextype *starts = SUNSparseMatrix_IndexPointers(sparse.A), *rows = SUNSparseMatrix_IndexValues(sparse.A);
  CHECK(starts[N] == flesh_ida_entries(sparse.problem));
  for (int c = 0; c < N; c++)
    for (sunindextype k = starts[c]; k < starts[c + 1]; k++) J[rows[k] * N + c] += SUNSparseMatrix_Data(sparse.A)[k];
  double *F[4], worst = 0, largest = 0;
  for (int k = 0; k < 4; k++) F[k] = malloc((size_t)N * sizeof *F[k]);
  for (int c = 0; c < N; c++) {
    const double h = 1e-5, at[4] = {-2 * h, -h, h, 2 * h}, y0 = y[c], yp0 = yp[c];
    for (int k = 0; k < 4; k++) {
      y[c] = y0 + at[k];
      yp[c] = yp0 + cj * at[k];
      CHECK_OK(flesh_ida_evaluate(sparse.problem, t, y, yp, F[k]));
    }
    y[c] = y0, yp[c] = yp0;
    for (int r = 0; r < N; r++) {
      double slope = (F[0][r] - 8 * F[1][r] + 8 * F[2][r] - F[3][r]) / (12 * h), scale = r < b.n ? 1 : 1e5;
      worst = fmax(worst, fabs(slope - J[r * N + c]) / scale);
      largest = fmax(largest, fabs(J[r * N + c]) / scale);
    }
  }
  printf("# %s mass: Jacobian off by %.3g, largest entry %.3g\n", mass ? "consistent" : "lumped", worst, largest);
  CHECK_BELOW(worst, 1e-8 * largest);

  N_Vector right = N_VClone(sparse.y), x = N_VClone(sparse.y), z = N_VClone(sparse.y);
  N_VConst(0, right);
  test_jitter(N, 1, 9, N_VGetArrayPointer(right));
  for (int d = 0; d < b.n; d++) N_VGetArrayPointer(right)[b.n + d] *= 1e4;
  CHECK(!SUNLinSolInitialize(sparse.solver) && !SUNLinSolSetup(sparse.solver, sparse.A));
  CHECK(!SUNLinSolSolve(sparse.solver, sparse.A, x, right, 0));
  CHECK_OK(
      flesh_ida_jacobian(t, cj, condensed.y, condensed.yp, NULL, condensed.A, condensed.problem, NULL, NULL, NULL));
  CHECK(!SUNLinSolInitialize(condensed.solver) && !SUNLinSolSetup(condensed.solver, condensed.A));
  CHECK(!SUNLinSolSolve(condensed.solver, condensed.A, z, right, 0));
  double off = test_distance(N, N_VGetArrayPointer(x), N_VGetArrayPointer(z));
  printf("# condensed and 2N solutions differ by %.3g of %.3g\n", off, test_norm(N, N_VGetArrayPointer(x)));
  CHECK_BELOW(off, 1e-9 * test_norm(N, N_VGetArrayPointer(x)));
  N_VDestroy(right);
  N_VDestroy(x);
  N_VDestroy(z);
  for (int k = 0; k < 4; k++) free(F[k]);
  free(J);
  close_owned(&sparse);
  close_owned(&condensed);
  test_body_destroy(&b);
}

static void jacobians_are_derivatives(void)
{
  check_jacobian(FLESH_MASS_LUMPED);
  check_jacobian(FLESH_MASS_CONSISTENT);
}

/* One motion with all constraints and events, with every linear solver; the exact one by GSL (lumped mass). */
static void ways_to_solve_agree(void)
{
  for (int mass = 0; mass < 2; mass++) {
    test_body b;
    make_busy_bar((flesh_mass)mass, &b);
    flesh_state exact = state_copy(b.n, &b.state), first = state_copy(b.n, &b.state);
    if (mass == FLESH_MASS_LUMPED) motion_reference_run(&b, 0.5, 1e-12, &exact);
    const struct {
      const char *name;
      flesh_linear_solver linear;
      int sparse;
    } ways[] = {{"2N KLU", FLESH_LINEAR_PCG, 1}, {"condensed PCG", FLESH_LINEAR_PCG, 0},
                {"condensed KLU", FLESH_LINEAR_KLU, 0},
#ifdef FLESH_HAVE_CHOLMOD
                {"condensed CHOLMOD", FLESH_LINEAR_CHOLMOD, 0},
#endif
    };
    for (size_t k = 0; k < sizeof ways / sizeof ways[0]; k++) {
      owned o;
      flesh_state state = state_copy(b.n, &b.state);
      open_owned(&b, ways[k].linear, ways[k].sparse, &o);
      long steps = run_owned(&o, 1e-9, 5, 0.5, &state);
      if (k == 0) memcpy(first.x, state.x, (size_t)b.n * sizeof(double));
      double apart = motion_distance(b.n, state.x, first.x), off = motion_distance(b.n, state.x, exact.x);
      printf("# %s: %ld steps, from the first %.3g m", ways[k].name, steps, apart);
      if (mass == FLESH_MASS_LUMPED) printf(", from GSL %.3g m", off);
      printf("\n");
      CHECK_BELOW(apart, 1e-7);
      if (mass == FLESH_MASS_LUMPED) CHECK_BELOW(off, 1e-7);
      close_owned(&o);
      state_free(&state);
    }
    state_free(&exact);
    state_free(&first);
    test_body_destroy(&b);
  }
}

/* Consistent starts: F(t, y, y') = 0, constrained dofs in place, momentum conserved at jumps of prescribed
 * velocities. */
static void starts_are_consistent(void)
{
  for (int mass = 0; mass < 2; mass++) {
    test_body b;
    owned o;
    make_busy_bar((flesh_mass)mass, &b);
    open_owned(&b, FLESH_LINEAR_PCG, 0, &o);
    test_jitter(b.n, 0.05, 11, b.state.x);
    test_jitter(b.n, 1, 12, b.state.v);
    CHECK_OK(flesh_ida_start(o.problem, &b.state, o.y, o.yp));
    double *F = malloc(2 * (size_t)b.n * sizeof *F), *y = N_VGetArrayPointer(o.y), kinematic = 0, force = 0;
    CHECK_OK(flesh_ida_evaluate(o.problem, b.state.t, y, N_VGetArrayPointer(o.yp), F));
    for (int d = 0; d < b.n; d++) kinematic = fmax(kinematic, fabs(F[d])), force = fmax(force, fabs(F[b.n + d]));
    CHECK_BELOW(kinematic, 1e-14);
    CHECK_BELOW(force, 1e-8); /* of some 1e4 N */
    /* The jump is an impulse of the constraints: none acts on free dofs. */
    double *dv = malloc((size_t)b.n * sizeof *dv), *impulse = malloc((size_t)b.n * sizeof *impulse), largest = 0;
    uint8_t *fixed = malloc((size_t)b.n);
    flesh_system_fixed(b.system, 0, fixed);
    for (int d = 0; d < b.n; d++) dv[d] = y[b.n + d] - b.state.v[d];
    test_body_mass_times(&b, dv, impulse);
    for (int d = 0; d < b.n; d++)
      if (!fixed[d]) largest = fmax(largest, fabs(impulse[d]));
    CHECK_BELOW(largest, 1e-10);
    CHECK(test_norm(b.n, dv) > 0.1);
    double curvature = flesh_ida_curvature(o.problem, 1, o.y, o.yp);
    CHECK(curvature > 1 && curvature < INFINITY);
    free(F);
    free(dv);
    free(impulse);
    free(fixed);
    close_owned(&o);
    test_body_destroy(&b);
  }
}

/* At the event itself what acted before it still acts: the spring pulls, the roller is constrained. */
static void events_belong_to_what_was_before_them(void)
{
  test_body b;
  owned o;
  make_busy_bar(FLESH_MASS_CONSISTENT, &b);
  open_owned(&b, FLESH_LINEAR_PCG, 0, &o);
  const double events[] = {0.0913, 0.1307, 0.2617, 0.3111};
  for (size_t k = 0; k < sizeof events / sizeof events[0]; k++) {
    b.state.t = events[k] - 0.01;
    CHECK_OK(flesh_ida_start(o.problem, &b.state, o.y, o.yp));
    CHECK(flesh_ida_event(o.problem) == events[k]);
    double *at = malloc(2 * (size_t)b.n * sizeof *at), *before = malloc(2 * (size_t)b.n * sizeof *before);
    const double *y = N_VGetArrayPointer(o.y), *yp = N_VGetArrayPointer(o.yp);
    CHECK_OK(flesh_ida_evaluate(o.problem, events[k], y, yp, at));
    CHECK_OK(flesh_ida_evaluate(o.problem, events[k] - 1e-9, y, yp, before));
    CHECK_BELOW(test_distance(2 * b.n, at, before), 1e-2); /* forces are some 1e3 N, and 1e6 N/m m/s 1e-9 s */
    CHECK_OK(flesh_ida_get_state(o.problem, events[k], o.y, &b.state));
    CHECK(flesh_ida_get_state(o.problem, events[k] + 1e-6, o.y, &b.state) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "after the event");
    free(at);
    free(before);
  }
  close_owned(&o);
  test_body_destroy(&b);
}

/* IDA must get its own status for an indefinite matrix, or it takes an invalid step. */
static void indefinite_matrices_are_recoverable(void)
{
  test_body b;
  owned o;
  make_busy_bar(FLESH_MASS_LUMPED, &b);
  open_owned(&b, FLESH_LINEAR_PCG, 0, &o);
  for (int d = 0; d < b.n; d++) b.state.x[d] *= d % 3 == 0 ? 0.3 : 1; /* compressed: it would buckle */
  CHECK_OK(flesh_ida_start(o.problem, &b.state, o.y, o.yp));
  for (int k = 0; k < 3; k++) { /* no step has these */
    const double cj = (double[]){0, NAN, INFINITY}[k];
    CHECK(flesh_ida_jacobian(0, cj, o.y, o.yp, NULL, o.A, o.problem, NULL, NULL, NULL) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "it must be finite and not 0");
    CHECK(flesh_ida_preconditioner_setup(0, o.y, o.yp, NULL, cj, o.problem) == FLESH_ERR_ARGUMENT);
  }
  CHECK_OK(flesh_ida_jacobian(0, 1e-3, o.y, o.yp, NULL, o.A, o.problem, NULL, NULL, NULL));
  SUNMatrix other = SUNMatClone(o.A);
  CHECK(SUNLinSolSetup(o.solver, other) < 0);
  CHECK_TEXT(flesh_error_text(), "must be this problem's own of flesh_ida_sunmatrix_create");
  SUNMatDestroy(other);
  N_Vector right = N_VClone(o.y), x = N_VClone(o.y);
  N_VConst(1, right);
  test_jitter(2 * b.n, 1, 3, N_VGetArrayPointer(right));
  CHECK(!SUNLinSolInitialize(o.solver) && !SUNLinSolSetup(o.solver, o.A));
  CHECK(SUNLinSolSolve(o.solver, o.A, x, right, 0) == SUNLS_CONV_FAIL);
  CHECK(SUNLinSolLastFlag(o.solver) == FLESH_NOT_POSITIVE);
  N_VDestroy(right);
  N_VDestroy(x);
  close_owned(&o);
  test_body_destroy(&b);
}

/* The scale of velocity is that of the slowest bending mode: the frequency of free bending of a slender bar is
 * known. */
static void scales_are_the_bodys_own(void)
{
  double velocity[3], length[3];
  for (int k = 0; k < 3; k++) {
    test_body b;
    flesh_ida_problem *problem = NULL;
    flesh_solver_options options;
    flesh_material material;
    flesh_solver_options_default(&options);
    CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, k == 1 ? 4e5 : 1e5, 0.3, &material));
    double side = k == 2 ? 2 : 1;
    CHECK_OK(
        test_body_create(test_box(30, 3, 3, side, 0.1 * side, 0.1 * side), material, 1000, FLESH_MASS_LUMPED, 1, &b));
    CHECK_OK(flesh_system_finalize(b.system));
    CHECK_OK(flesh_ida_problem_create(b.system, &options, &problem));
    flesh_ida_scales(problem, &length[k], &velocity[k]);
    flesh_ida_problem_destroy(&problem);
    test_body_destroy(&b);
  }
  CHECK_NEAR(length[0], 1, 1e-15);
  CHECK_NEAR(length[2], 2, 1e-15);
  CHECK_NEAR(velocity[1], 2 * velocity[0], 1e-12 * velocity[1]); /* sqrt(E) */
  CHECK_NEAR(velocity[2], velocity[0], 1e-12 * velocity[0]);     /* larger and slower by the same factor */
  /* Euler-Bernoulli, free ends: omega = 22.37 sqrt(E I/(rho A L^4)), I/A = thickness^2/12. The mesh is stiffer. */
  double exact = 22.37 * sqrt(1e5 / 1000 * 0.1 * 0.1 / 12) / 6.283185307179586;
  printf("# velocity scale %.4g m/s, that of the beam %.4g m/s\n", velocity[0], exact);
  CHECK(velocity[0] > exact && velocity[0] < 2 * exact);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(rates_of_motions), TEST(jacobians_are_derivatives), TEST(starts_are_consistent),
                   TEST(events_belong_to_what_was_before_them), TEST(indefinite_matrices_are_recoverable),
                   TEST(scales_are_the_bodys_own), TEST(ways_to_solve_agree));
}
