// TEST quick seconds=60
/* test_sunlinsol.c: flesh's linear solvers as SUNLinearSolver objects pass the checks of SUNDIALS' own tests: type,
 * initialisation, set-up, a solution that the matrix maps back to the right-hand side, the last flag, statistics, and
 * flags of failures that SUNDIALS understands. */
#include <nvector/nvector_serial.h>
#include <stdlib.h>
#ifdef HAVE_SUNLINSOLSPGMR
#include <sunlinsol/sunlinsol_spgmr.h>
#endif

#include "busy_bar.h"
#include "flesh/ida.h"
#include "flesh/kinsol.h"
#include "flesh/ode.h"
#include "motion_reference.h"
#include "sundials/compatibility.h"
#include "sundials/ida_problem.h"
#include "sundials/ode_problem.h"

typedef struct owned {
  test_body b;
  SUNContext context;
  flesh_problem *kinsol;
  flesh_ida_problem *ida;
  flesh_ode_problem *rhs;
  SUNMatrix A;
  SUNLinearSolver S;
  N_Vector at, rate;
  int N;
} owned;

static const flesh_linear_solver solvers[] = {FLESH_LINEAR_PCG, FLESH_LINEAR_KLU,
#ifdef FLESH_HAVE_CHOLMOD
                                              FLESH_LINEAR_CHOLMOD,
#endif
};
enum { SOLVERS = sizeof solvers / sizeof solvers[0] };

enum { OF_KINSOL, OF_IDA, OF_RHS, KINDS };
static const char *const names[] = {"KINSOL", "IDA", "CVODE"};

/* df/dy, and I - gamma df/dy */
static void assemble_rhs(owned *o, double gamma)
{
  CHECK_OK(flesh_ode_jacobian(0.01, o->at, o->rate, o->A, o->rhs, o->at, o->at, o->at));
  CHECK(!SUNMatScaleAddI(-gamma, o->A));
}

static void open_owned(int kind, flesh_linear_solver linear, owned *o)
{
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  options.linear_solver = linear;
  options.linear_tolerance = 1e-12;
  options.line_search = FLESH_LINE_SEARCH_NONE; /* the plain solution, not a guarded step */
  *o = (owned){0};
  make_busy_bar(FLESH_MASS_CONSISTENT, &o->b);
  CHECK(!flesh_suncontext_create(&o->context));
  test_jitter(o->b.n, 0.01, 5, o->b.state.x);
  o->N = kind == OF_KINSOL ? o->b.n : 2 * o->b.n;
  o->at = N_VNew_Serial(o->N, o->context);
  o->rate = N_VClone(o->at);
  N_VConst(0, o->at);
  if (kind == OF_RHS) {
    CHECK_OK(flesh_ode_problem_create(o->b.system, &options, &o->rhs));
    CHECK_OK(flesh_ode_start(o->rhs, &o->b.state, o->at));
    CHECK_OK(flesh_ode_sunmatrix_create(o->rhs, o->context, &o->A));
    CHECK_OK(flesh_ode_sunlinsol_create(o->rhs, o->context, &o->S));
    assemble_rhs(o, 1. / 300);
  } else if (kind == OF_IDA) {
    CHECK_OK(flesh_ida_problem_create(o->b.system, &options, &o->ida));
    CHECK_OK(flesh_ida_start(o->ida, &o->b.state, o->at, o->rate));
    CHECK_OK(flesh_ida_sunmatrix_create(o->ida, o->context, &o->A));
    CHECK_OK(flesh_ida_sunlinsol_create(o->ida, o->context, &o->S));
    CHECK_OK(flesh_ida_jacobian(0.01, 300, o->at, o->rate, o->rate, o->A, o->ida, o->at, o->at, o->at));
  } else {
    const flesh_stage stage = {.load = 1, .prescribed_fraction = 1, .shift = {1, 60, 3600, 0}, .x0 = o->b.state.x};
    CHECK_OK(flesh_problem_create(o->b.system, &options, &o->kinsol));
    CHECK_OK(flesh_problem_set_stage(o->kinsol, &stage));
    CHECK_OK(flesh_sunmatrix_create(o->kinsol, o->context, &o->A));
    CHECK_OK(flesh_sunlinsol_create(o->kinsol, o->context, &o->S));
    CHECK_OK(flesh_kinsol_jacobian(o->at, o->at, o->A, o->kinsol, o->at, o->at));
  }
}

static void close_owned(owned *o)
{
  CHECK(!SUNLinSolFree(o->S));
  SUNMatDestroy(o->A);
  N_VDestroy(o->at);
  N_VDestroy(o->rate);
  flesh_problem_destroy(&o->kinsol);
  flesh_ida_problem_destroy(&o->ida);
  flesh_ode_problem_destroy(&o->rhs);
  test_body_destroy(&o->b);
  SUNContext_Free(&o->context);
}

static void types(void)
{
  for (int kind = 0; kind < KINDS; kind++)
    for (int k = 0; k < SOLVERS; k++) {
      owned o;
      open_owned(kind, solvers[k], &o);
      /* IDA would require an iterative solver to be more accurate than necessary; KINSOL's may return less than the
       * full step. */
      int direct = kind == OF_IDA || (kind == OF_RHS && solvers[k] != FLESH_LINEAR_PCG);
      CHECK(SUNLinSolGetType(o.S) == (direct ? SUNLINEARSOLVER_DIRECT : SUNLINEARSOLVER_MATRIX_ITERATIVE));
      close_owned(&o);
    }
}

/* x = A^-1 (A x) for any x; b is left alone. */
static void solutions(void)
{
  for (int kind = 0; kind < KINDS; kind++)
    for (int k = 0; k < SOLVERS; k++) {
      owned o;
      open_owned(kind, solvers[k], &o);
      N_Vector x = N_VClone(o.at), b = N_VClone(o.at), kept = N_VClone(o.at), found = N_VClone(o.at);
      N_VConst(0, x);
      test_jitter(o.N, 1, 9, N_VGetArrayPointer(x));
      CHECK(!SUNMatMatvec(o.A, x, b));
      N_VScale(1, b, kept);
      N_VConst(0, found);
      CHECK(!SUNLinSolInitialize(o.S));
      CHECK(!SUNLinSolSetup(o.S, o.A));
      CHECK(!SUNLinSolSolve(o.S, o.A, found, b, 1e-9));
      CHECK(SUNLinSolLastFlag(o.S) == 0);
      double off = test_distance(o.N, N_VGetArrayPointer(x), N_VGetArrayPointer(found));
      printf("# %s, solver %d: off by %.3g of 1\n", names[kind], (int)solvers[k], off);
      CHECK_BELOW(off, kind == OF_IDA ? 1e-7 : 1e-9);
      CHECK(test_distance(o.N, N_VGetArrayPointer(b), N_VGetArrayPointer(kept)) == 0);
      if (kind != OF_IDA && solvers[k] == FLESH_LINEAR_PCG) {
        CHECK(SUNLinSolNumIters(o.S) > 0);
        CHECK_BELOW(SUNLinSolResNorm(o.S), 1e-9);
      }
      N_VDestroy(x);
      N_VDestroy(b);
      N_VDestroy(kept);
      N_VDestroy(found);
      close_owned(&o);
    }
}

/* Set up and solved again after the matrix changed: the latest counts. */
static void set_up_again(void)
{
  for (int kind = 0; kind < KINDS + 2; kind++) { /* the last two: on the sum of matrices */
    owned o;
    open_owned(kind < KINDS ? kind : kind - 2, FLESH_LINEAR_KLU, &o);
    N_Vector x = N_VClone(o.at), b = N_VClone(o.at), found = N_VClone(o.at);
    N_VConst(0, x);
    test_jitter(o.N, 1, 9, N_VGetArrayPointer(x));
    CHECK(!SUNLinSolInitialize(o.S) && !SUNLinSolSetup(o.S, o.A));
    if (kind >= KINDS) {
      SUNMatrix B = SUNMatClone(o.A);
      CHECK(!SUNMatCopy(o.A, B) && !SUNMatScaleAddI(2, o.A) && !SUNMatScaleAdd(0.7, o.A, B));
      SUNMatDestroy(B);
    } else if (kind == OF_RHS) {
      assemble_rhs(&o, 0.02);
    } else if (kind == OF_IDA) {
      CHECK_OK(flesh_ida_jacobian(0.01, 50, o.at, o.rate, o.rate, o.A, o.ida, o.at, o.at, o.at));
    } else {
      test_jitter(o.N, 0.02, 3, N_VGetArrayPointer(o.at));
      CHECK_OK(flesh_kinsol_jacobian(o.at, o.at, o.A, o.kinsol, o.at, o.at));
    }
    CHECK(!SUNMatMatvec(o.A, x, b));
    CHECK(!SUNLinSolSetup(o.S, o.A) && !SUNLinSolSolve(o.S, o.A, found, b, 1e-9));
    CHECK_BELOW(test_distance(o.N, N_VGetArrayPointer(x), N_VGetArrayPointer(found)), 1e-9);
    N_VDestroy(x);
    N_VDestroy(b);
    N_VDestroy(found);
    close_owned(&o);
  }
}

/* A system that cannot be solved at present gives a positive flag (IDA, CVODE and KINSOL then try otherwise), one that
 * can never be solved a negative flag. */
static void failures(void)
{
  owned o;
  N_Vector b, x, small;
  for (int kind = OF_IDA; kind <= OF_RHS; kind++) {
    open_owned(kind, FLESH_LINEAR_PCG, &o);
    (kind == OF_IDA ? o.ida : o.rhs->motion)->options.max_linear = 1; /* one iteration is not enough */
    b = N_VClone(o.at), x = N_VClone(o.at), small = N_VNew_Serial(3, o.context);
    N_VConst(0, b);
    test_jitter(o.N, 1, 9, N_VGetArrayPointer(b));
    CHECK(!SUNLinSolInitialize(o.S) && !SUNLinSolSetup(o.S, o.A));
    CHECK(SUNLinSolSolve(o.S, o.A, x, b, 1e-9) > 0);
    CHECK(SUNLinSolLastFlag(o.S) == FLESH_NOT_CONVERGED);
    CHECK(SUNLinSolSolve(o.S, o.A, x, small, 1e-9) < 0);
    CHECK(SUNLinSolLastFlag(o.S) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "length 3");
    CHECK(!SUNMatZero(o.A));
    CHECK(SUNLinSolSetup(o.S, o.A) > 0);
    CHECK(SUNLinSolSolve(o.S, o.A, x, b, 1e-9) < 0);
    CHECK_TEXT(flesh_error_text(), "set-up");
    N_VDestroy(b);
    N_VDestroy(x);
    N_VDestroy(small);
    close_owned(&o);
  }

  open_owned(0, FLESH_LINEAR_PCG, &o);
  small = N_VNew_Serial(3, o.context);
  CHECK(!SUNLinSolInitialize(o.S));
  CHECK(!SUNLinSolSetup(o.S, o.A));
  CHECK(SUNLinSolSolve(o.S, o.A, o.at, small, 1e-9) < 0);
  CHECK(!SUNMatZero(o.A));
  CHECK(SUNLinSolSetup(o.S, o.A) >= 0); /* KINSOL requests a projected matrix during the solve */
  N_VDestroy(small);
  close_owned(&o);
}

/* A solve without a successful set-up is an error, not a crash. */
static void solves_without_a_set_up(void)
{
  for (int kind = OF_IDA; kind <= OF_RHS; kind++)
    for (int k = 0; k < SOLVERS; k++)
      for (int failed = 0; failed < 2; failed++) {
        owned o;
        open_owned(kind, solvers[k], &o);
        N_Vector b = N_VClone(o.at), x = N_VClone(o.at);
        N_VConst(1, b);
        CHECK(!SUNLinSolInitialize(o.S));
        CHECK(!failed || (!SUNMatZero(o.A) && SUNLinSolSetup(o.S, o.A) > 0));
        CHECK(SUNLinSolSolve(o.S, o.A, x, b, 1e-9) < 0);
        CHECK(SUNLinSolLastFlag(o.S) == FLESH_ERR_ARGUMENT);
        CHECK_TEXT(flesh_error_text(), "set-up");
        N_VDestroy(b);
        N_VDestroy(x);
        close_owned(&o);
      }
}

/* IDA's slots for matrix-free solvers: the preconditioner by a direct solver is the inverse. */
static void slots_without_a_matrix(void)
{
  owned o;
  open_owned(1, FLESH_LINEAR_KLU, &o);
  N_Vector x = N_VClone(o.at), b = N_VClone(o.at), found = N_VClone(o.at);
  N_VConst(0, x);
  test_jitter(o.N, 1, 9, N_VGetArrayPointer(x));
  CHECK(!SUNMatZero(o.A));
  CHECK(flesh_ida_jacobian_times(0.01, o.at, o.rate, o.rate, x, b, 300, o.ida, b, b) == FLESH_ERR_ARGUMENT);
  CHECK_OK(flesh_ida_preconditioner_setup(0.01, o.at, o.rate, o.rate, 300, o.ida));
  CHECK_OK(flesh_ida_jacobian_times(0.01, o.at, o.rate, o.rate, x, b, 300, o.ida, b, b));
  CHECK_OK(flesh_ida_preconditioner_solve(0.01, o.at, o.rate, o.rate, b, found, 300, 0, o.ida));
  CHECK_BELOW(test_distance(o.N, N_VGetArrayPointer(x), N_VGetArrayPointer(found)), 1e-9);
  N_VDestroy(x);
  N_VDestroy(b);
  N_VDestroy(found);
  close_owned(&o);
}

#ifdef HAVE_SUNLINSOLSPGMR
/* IDA by GMRES with flesh's preconditioner and products finds the same motion as by the condensed solver. */
static void ida_by_gmres(void)
{
  const double end = 0.09; /* before the first event */
  flesh_state ends[2];
  for (int gmres = 0; gmres < 2; gmres++) {
    owned o;
    open_owned(1, FLESH_LINEAR_PCG, &o);
    N_Vector atol = N_VClone(o.at);
    SUNLinearSolver S = gmres ? SUNLinSol_SPGMR(o.at, SUN_PREC_LEFT, 30, o.context) : o.S;
    void *ida = IDACreate(o.context);
    double t;
    long iterations = 0;
    CHECK_OK(flesh_ida_start(o.ida, &o.b.state, o.at, o.rate));
    CHECK_OK(flesh_ida_tolerances(o.ida, 1e-7, atol));
    CHECK(!IDAInit(ida, flesh_ida_residual, 0, o.at, o.rate) && !IDASetUserData(ida, o.ida));
    CHECK(!IDASVtolerances(ida, 0, atol) && !IDASetMaxOrd(ida, 2) && !IDASetMaxNumSteps(ida, 100000));
    CHECK(!IDASetLinearSolver(ida, S, gmres ? NULL : o.A));
    if (gmres) {
      CHECK(!IDASetPreconditioner(ida, flesh_ida_preconditioner_setup, flesh_ida_preconditioner_solve));
      CHECK(!IDASetJacTimes(ida, NULL, flesh_ida_jacobian_times));
    } else {
      CHECK(!IDASetJacFn(ida, flesh_ida_jacobian));
    }
    CHECK(IDASolve(ida, end, &t, o.at, o.rate, IDA_NORMAL) == IDA_SUCCESS);
    ends[gmres] = state_copy(o.b.n, &o.b.state);
    CHECK_OK(flesh_ida_get_state(o.ida, t, o.at, &ends[gmres]));
    IDAGetNumLinIters(ida, &iterations);
    CHECK(!gmres || iterations > 0);
    if (gmres) {
      double off = test_distance(o.b.n, ends[0].x, ends[1].x), moved = test_distance(o.b.n, ends[0].x, o.b.state.x);
      printf("# GMRES, %ld iterations: %.3g m from the condensed solver's, after %.3g m\n", iterations, off, moved);
      CHECK_BELOW(off, 1e-5);
      CHECK(moved > 0.01);
      SUNLinSolFree(S);
    }
    IDAFree(&ida);
    N_VDestroy(atol);
    close_owned(&o);
  }
  state_free(&ends[0]);
  state_free(&ends[1]);
}
#endif

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(types), TEST(solutions), TEST(set_up_again), TEST(failures),
                   TEST(solves_without_a_set_up), TEST(slots_without_a_matrix)
#ifdef HAVE_SUNLINSOLSPGMR
                       , TEST(ida_by_gmres)
#endif
  );
}
