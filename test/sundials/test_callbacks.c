// TEST quick seconds=60
/* test_callbacks.c: arguments of the callbacks: kinds of vectors and matrices, a user-defined user_data; and the KINSOL
 * and IDA that integrators provide. */
#include <ida/ida.h>
#include <kinsol/kinsol.h>
#include <nvector/nvector_serial.h>
#include <stdlib.h>
#include <sunmatrix/sunmatrix_sparse.h>
#ifdef HAVE_NVECOPENMP
#include <nvector/nvector_openmp.h>
#endif
#ifdef HAVE_NVECPTHREADS
#include <nvector/nvector_pthreads.h>
#endif
#ifdef HAVE_NVECMANYVECTOR
#include <nvector/nvector_manyvector.h>
#endif

#include "busy_bar.h"
#include "flesh/ida.h"
#include "flesh/kinsol.h"
#include "flesh/ode.h"
#include "sundials/compatibility.h"
#include "sundials/vector.h"

/* The three problems of one body, and a state in motion. */
typedef struct owned {
  test_body b;
  SUNContext context;
  flesh_problem *problem;
  flesh_ida_problem *ida;
  flesh_ode_problem *rhs;
  double *y; /* [2*n] */
} owned;

static void open_owned(owned *o)
{
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  *o = (owned){0};
  make_busy_bar(FLESH_MASS_LUMPED, &o->b);
  CHECK(!flesh_suncontext_create(&o->context));
  CHECK_OK(flesh_problem_create(o->b.system, &options, &o->problem));
  CHECK_OK(flesh_ida_problem_create(o->b.system, &options, &o->ida));
  CHECK_OK(flesh_ode_problem_create(o->b.system, &options, &o->rhs));
  test_jitter(o->b.n, 0.05, 5, o->b.state.x);
  test_jitter(o->b.n, 1, 6, o->b.state.v);
  flesh_stage stage = {
      .t = 0.01, .load = 1, .prescribed_fraction = 1, .shift = {.x = 1, .v = 100, .a = 1e4}, .x0 = o->b.state.x};
  CHECK_OK(flesh_problem_set_stage(o->problem, &stage));
  N_Vector y = N_VNew_Serial(2 * o->b.n, o->context), yp = N_VClone(y);
  CHECK_OK(flesh_ida_start(o->ida, &o->b.state, y, yp));
  CHECK_OK(flesh_ode_start(o->rhs, &o->b.state, y));
  o->y = malloc(2 * (size_t)o->b.n * sizeof *o->y);
  memcpy(o->y, N_VGetArrayPointer(y), 2 * (size_t)o->b.n * sizeof *o->y);
  N_VDestroy(y);
  N_VDestroy(yp);
}

static void close_owned(owned *o)
{
  flesh_problem_destroy(&o->problem);
  flesh_ida_problem_destroy(&o->ida);
  flesh_ode_problem_destroy(&o->rhs);
  free(o->y);
  test_body_destroy(&o->b);
  SUNContext_Free(&o->context);
}

/* Evaluates all three residuals with these vectors (of n, and of 2 n) into out [5*n]. Returns the first status that is
 * not 0. */
static int evaluate(owned *o, N_Vector u, N_Vector y, double *out)
{
  int n = o->b.n, status;
  N_Vector r = N_VClone(u), yp = N_VClone(y), F = N_VClone(y);
  if (N_VGetArrayPointer(u)) memcpy(N_VGetArrayPointer(u), o->y + n, (size_t)n * sizeof(double));
  if (N_VGetArrayPointer(y)) memcpy(N_VGetArrayPointer(y), o->y, 2 * (size_t)n * sizeof(double));
  N_VScale(0.01, u, u);
  status = flesh_kinsol_residual(u, r, o->problem);
  if (!status) status = flesh_ode_rhs(0.01, y, yp, o->rhs);
  if (!status) memcpy(out + 3 * n, N_VGetArrayPointer(yp), 2 * (size_t)n * sizeof(double));
  N_VConst(0.5, yp);
  if (!status) status = flesh_ida_residual(0.01, y, yp, F, o->ida);
  if (!status) memcpy(out, N_VGetArrayPointer(r), (size_t)n * sizeof(double));
  if (!status) memcpy(out + n, N_VGetArrayPointer(F), 2 * (size_t)n * sizeof(double));
  N_VDestroy(r);
  N_VDestroy(yp);
  N_VDestroy(F);
  return status;
}

/* Compares our vector operations with SUNDIALS' own, on a length that is no multiple of eight; also in place. */
static void quick_operations_are_the_same(void)
{
  enum { LENGTH = 1003 };
  owned o;
  open_owned(&o);
  N_Vector v[2][4];
  for (int quick = 0; quick < 2; quick++) {
    v[quick][0] = N_VNew_Serial(LENGTH, o.context);
    if (quick) flesh_vector_vectorise(v[quick][0], NULL);
    for (int k = 1; k < 4; k++) v[quick][k] = N_VClone(v[quick][0]);
    for (int k = 0; k < 4; k++)
      for (int d = 0; d < LENGTH; d++) N_VGetArrayPointer(v[quick][k])[d] = sin(1 + d * (k + 1));
    N_VLinearSum(2, v[quick][0], -0.5, v[quick][1], v[quick][2]);
    N_VLinearSum(3, v[quick][2], 1, v[quick][3], v[quick][2]);
    N_VProd(v[quick][2], v[quick][0], v[quick][3]);
    N_VScale(-0.3, v[quick][3], v[quick][3]);
    N_VAbs(v[quick][1], v[quick][1]); /* of sin(1 + 2 d), never 0 */
    N_VInv(v[quick][1], v[quick][0]);
    N_VDiv(v[quick][0], v[quick][1], v[quick][1]);
  }
  for (int k = 0; k < 2; k++)
    CHECK(!memcmp(N_VGetArrayPointer(v[0][k]), N_VGetArrayPointer(v[1][k]), LENGTH * sizeof(double)));
  CHECK(v[1][3]->ops->nvdotprod != v[0][3]->ops->nvdotprod);
  CHECK_BELOW(test_distance(LENGTH, N_VGetArrayPointer(v[0][3]), N_VGetArrayPointer(v[1][3])), 1e-14);
  CHECK(test_norm(LENGTH, N_VGetArrayPointer(v[1][3])) > 1);
  CHECK_NEAR(N_VDotProd(v[1][3], v[1][2]), N_VDotProd(v[0][3], v[0][2]), 1e-10);
  CHECK_NEAR(N_VWL2Norm(v[1][3], v[1][2]), N_VWL2Norm(v[0][3], v[0][2]), 1e-11);
  CHECK(v[1][3]->ops->nvmin != v[0][3]->ops->nvmin && N_VMin(v[1][3]) == N_VMin(v[0][3]));
  for (int quick = 0; quick < 2; quick++)
    for (int k = 0; k < 4; k++) N_VDestroy(v[quick][k]);
  close_owned(&o);
}

static void vectors_of_three_kinds(void)
{
  owned o;
  open_owned(&o);
  int n = o.b.n;
  size_t bytes = 5 * (size_t)n * sizeof(double);
  double *serial = malloc(bytes), *other = malloc(bytes);
  N_Vector u = N_VNew_Serial(n, o.context), y = N_VNew_Serial(2 * n, o.context);
  CHECK_OK(evaluate(&o, u, y, serial));
  CHECK(test_norm(5 * n, serial) > 1 && test_all_finite(5 * n, serial));
  N_VDestroy(u);
  N_VDestroy(y);
#ifdef HAVE_NVECOPENMP
  u = N_VNew_OpenMP(n, 2, o.context), y = N_VNew_OpenMP(2 * n, 2, o.context);
  CHECK_OK(evaluate(&o, u, y, other));
  CHECK(!memcmp(serial, other, bytes));
  N_VDestroy(u);
  N_VDestroy(y);
#else
  printf("# no OpenMP vectors here\n");
#endif
#ifdef HAVE_NVECPTHREADS
  u = N_VNew_Pthreads(n, 2, o.context), y = N_VNew_Pthreads(2 * n, 2, o.context);
  CHECK_OK(evaluate(&o, u, y, other));
  CHECK(!memcmp(serial, other, bytes));
  N_VDestroy(u);
  N_VDestroy(y);
#else
  printf("# no Pthreads vectors here\n");
#endif
  free(serial);
  free(other);
  close_owned(&o);
}

static void other_vectors_are_refused(void)
{
  owned o;
  open_owned(&o);
  int n = o.b.n;
  N_Vector right = N_VNew_Serial(2 * n, o.context), same = N_VClone(right), wrong = N_VNew_Serial(n + 3, o.context);
  char words[64];
  N_VConst(0, right);
  snprintf(words, sizeof words, "length %d; it must have %d", n + 3, 2 * n);
  CHECK(flesh_ida_residual(0, right, wrong, same, o.ida) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), words);
  CHECK(flesh_ode_rhs(0, right, wrong, o.rhs) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), words);
  CHECK(flesh_kinsol_residual(wrong, wrong, o.problem) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_ida_start(o.ida, &o.b.state, right, wrong) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_ode_start(o.rhs, &o.b.state, wrong) == FLESH_ERR_ARGUMENT);
#ifdef HAVE_NVECMANYVECTOR
  N_Vector halves[2] = {N_VNew_Serial(n, o.context), N_VNew_Serial(n, o.context)};
  N_Vector many = N_VNew_ManyVector(2, halves, o.context);
  CHECK(flesh_ida_residual(0, right, many, same, o.ida) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "ManyVector kind; it must be a serial, OpenMP or Pthreads vector");
  CHECK(flesh_ode_rhs(0, many, right, o.rhs) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "ManyVector");
  CHECK(flesh_kinsol_residual(many, right, o.problem) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "ManyVector");
  N_VDestroy(many);
  N_VDestroy(halves[0]);
  N_VDestroy(halves[1]);
#endif
  N_VDestroy(right);
  N_VDestroy(same);
  N_VDestroy(wrong);
  close_owned(&o);
}

static void foreign_matrices_are_refused(void)
{
  owned o;
  flesh_problem *second;
  flesh_solver_options options;
  SUNMatrix A, small;
  flesh_solver_options_default(&options);
  open_owned(&o);
  CHECK_OK(flesh_problem_create(o.b.system, &options, &second));
  CHECK_OK(flesh_sunmatrix_create(second, o.context, &A));
  small = SUNSparseMatrix(3, 3, 9, CSC_MAT, o.context);
  N_Vector u = N_VNew_Serial(o.b.n, o.context);
  N_VConst(0, u);
  CHECK(flesh_kinsol_jacobian(u, u, A, o.problem, u, u) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "this problem's own");
  CHECK(flesh_kinsol_jacobian(u, u, small, o.problem, u, u) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "3 x 3");
  SUNLinearSolver solver;
  CHECK_OK(flesh_sunlinsol_create(o.problem, o.context, &solver));
  for (int k = 0; k < 3; k++) {
    CHECK(SUNLinSolSetup(solver, (SUNMatrix[]){A, small, NULL}[k]) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "must be this problem's own of flesh_sunmatrix_create");
  }
  SUNLinSolFree(solver);
  N_VDestroy(u);
  SUNMatDestroy(A);
  SUNMatDestroy(small);
  flesh_problem_destroy(&second);
  close_owned(&o);
}

static void user_data_of_ones_own(void)
{
  owned o;
  open_owned(&o);
  int n = o.b.n;
  struct {
    flesh_problem *problem;
    double mine;
  } kinsol = {o.problem, 1};
  struct {
    flesh_ida_problem *problem;
    char mine[3];
  } ida = {o.ida, "ab"};
  N_Vector u = N_VNew_Serial(n, o.context), r = N_VClone(u), y = N_VNew_Serial(2 * n, o.context), F = N_VClone(y);
  N_Vector r2 = N_VClone(u), F2 = N_VClone(y);
  N_VConst(0.01, u);
  memcpy(N_VGetArrayPointer(y), o.y, 2 * (size_t)n * sizeof(double));
  CHECK_OK(flesh_kinsol_residual(u, r, o.problem));
  CHECK_OK(flesh_kinsol_residual(u, r2, &kinsol));
  CHECK(!memcmp(N_VGetArrayPointer(r), N_VGetArrayPointer(r2), (size_t)n * sizeof(double)));
  CHECK_OK(flesh_ida_residual(0.01, y, y, F, o.ida));
  CHECK_OK(flesh_ida_residual(0.01, y, y, F2, &ida));
  CHECK(!memcmp(N_VGetArrayPointer(F), N_VGetArrayPointer(F2), 2 * (size_t)n * sizeof(double)));
  CHECK(flesh_kinsol_residual(u, r, NULL) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "user_data is neither a flesh_problem nor");
  CHECK(flesh_ida_residual(0, y, y, F, NULL) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_ode_rhs(0, y, F, NULL) == FLESH_ERR_ARGUMENT);
  /* Kinds must not be mixed. */
  struct {
    void *wrong;
    void *zero[8];
  } wrong = {0};
  wrong.wrong = wrong.zero;
  CHECK(flesh_ode_rhs(0, y, F, &wrong) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "flesh_ode_problem");
  CHECK(flesh_ode_rhs(0, y, F, o.ida) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_kinsol_residual(u, r, &ida) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_ida_residual(0, y, y, F, o.rhs) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "flesh_ida_problem");
  N_VDestroy(u);
  N_VDestroy(r);
  N_VDestroy(r2);
  N_VDestroy(y);
  N_VDestroy(F);
  N_VDestroy(F2);
  close_owned(&o);
}

static void memory_handed_out(void)
{
  test_body b;
  flesh_solver_options options;
  flesh_integrator *integrator;
  flesh_solve_stats stats = {0};
  flesh_solver_options_default(&options);
  make_busy_bar(FLESH_MASS_LUMPED, &b);

  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_IDA, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.05, &stats));
  CHECK(stats.order == 2);
  CHECK(!IDASetMaxOrd(flesh_integrator_ida(integrator), 1) && !IDASetMaxStep(flesh_integrator_ida(integrator), 1e-3));
  b.state.t = 0; /* a new start */
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.05, &stats));
  CHECK(stats.order == 1);
  CHECK_BELOW(stats.h_last, 1.0000001e-3);
  flesh_integrator_destroy(&integrator);

  b.state.t = 0;
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  CHECK(!flesh_integrator_ida(integrator));
  long iterations = 0;
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, NULL));
  CHECK(!KINGetNumNonlinSolvIters(flesh_integrator_kinsol(integrator), &iterations));
  CHECK(iterations > 1);
  CHECK(!KINSetNumMaxIters(flesh_integrator_kinsol(integrator), 1));
  CHECK(flesh_integrator_step(integrator, &b.state, 1, NULL) == FLESH_ERR_SOLVE);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* Every counter of the struct is printed under its own name, in all layouts. */
static void statistics(void)
{
  flesh_solve_stats stats = {.solves = 1, .newton = 2, .linear = 3, .assemblies = 4, .projections = 5, .residuals = 6,
                             .potentials = 7, .backtracks = 8, .at_rounding = 9, .untanglings = 10,
                             .untangled_nodes = 11, .unconverged = 12, .steps = 13, .rejected = 14,
                             .convergence_failures = 15, .order = 16, .residual_first = 17.5, .residual_last = 18.5,
                             .residual_target = 19.5, .h_last = 20.5, .potential_rises = 21, .direct = 22,
                             .subdomains = 23, .subdomain_newton = 24, .subdomain_share = 25.5,
                             .watchdog_steps = 26, .linear_single = 27, .impact_steps = 28, .multiplier_updates = 29,
                             .damped_steps = 30};
  enum { FIGURES = 30 };
  FILE *file = tmpfile();
  char line[4096], names[FIGURES][64];
  double values[FIGURES], sum = 0;
  int count = 0;
  CHECK(file != NULL);
  if (!file) return;
  CHECK_OK(flesh_solve_stats_print(&stats, FLESH_STATS_TABLE, file));
  rewind(file);
  for (; count < FIGURES && fgets(line, sizeof line, file); count++) {
    CHECK(line[28] == ' ' && line[29] == '=');
    CHECK(sscanf(line, "%63[^=]= %lf", names[count], &values[count]) == 2);
    for (size_t end = strlen(names[count]); end > 0 && names[count][end - 1] == ' '; end--) names[count][end - 1] = 0;
    sum += values[count];
  }
  CHECK(count == FIGURES && !fgets(line, sizeof line, file));
  CHECK_NEAR(sum, 467.5, 0); /* 1 + 2 + ... + 30 and five halves */
  fclose(file);

  file = tmpfile();
  CHECK_OK(flesh_solve_stats_print(&stats, FLESH_STATS_CSV, file));
  CHECK_OK(flesh_solve_stats_print(&stats, FLESH_STATS_CSV_ROW, file));
  rewind(file);
  for (int row = 0; row < 3; row++) {
    CHECK(fgets(line, sizeof line, file) != NULL);
    int column = 0;
    for (char *field = strtok(line, ",\n"); field; field = strtok(NULL, ",\n"), column++) {
      if (column >= count) continue;
      if (row == 0) CHECK(!strcmp(field, names[column]));
      else CHECK_NEAR(strtod(field, NULL), values[column], 0);
    }
    CHECK(column == FIGURES);
  }
  CHECK(!fgets(line, sizeof line, file));
  fclose(file);
  CHECK(flesh_solve_stats_print(&stats, (flesh_stats_format)9, stdout) == FLESH_ERR_ARGUMENT);
}

/* With 32-bit indices SUNDIALS reports that it cannot count so far; with 64-bit ones it can. */
static void counts_beyond_the_indices_are_refused(void)
{
  const int64_t most = INT32_MAX;
  CHECK(flesh_sunindex(most) == most);
  if (sizeof(sunindextype) == 4) CHECK(flesh_sunindex(most + 1) == -1 && flesh_sunindex(3 * most) == -1);
  else CHECK(flesh_sunindex(most + 1) == most + 1);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(quick_operations_are_the_same), TEST(vectors_of_three_kinds),
                   TEST(other_vectors_are_refused), TEST(foreign_matrices_are_refused), TEST(user_data_of_ones_own),
                   TEST(memory_handed_out), TEST(statistics), TEST(counts_beyond_the_indices_are_refused));
}
