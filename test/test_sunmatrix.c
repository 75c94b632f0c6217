/* test_sunmatrix.c: flesh's matrices as SUNMatrix objects behave as SUNDIALS' own tests ask of a matrix: identity of the
 * kind, zero, products against entries, refusal of what does not fit, destruction that leaves the problem whole. */
#include <nvector/nvector_serial.h>
#include <stdlib.h>
#include <sunmatrix/sunmatrix_sparse.h>

#include "busy_bar.h"
#include "flesh/ida.h"
#include "flesh/kinsol.h"
#include "sundials/compatibility.h"

/* A matrix of flesh, a full one of the same entries by way of SUNSparseMatrix, and what made them. */
typedef struct pair {
  test_body b;
  SUNContext context;
  flesh_problem *kinsol;
  flesh_ida_problem *ida;
  SUNMatrix own, sparse;
  N_Vector at, rate; /* where they are evaluated */
  int N;
} pair;

enum { of_kinsol, of_ida_lumped, of_ida_consistent, KINDS };
static const double cj = 37;

/* Fills the two. */
static void assemble(pair *p, SUNMatrix A)
{
  if (p->kinsol) CHECK_OK(flesh_kinsol_jacobian(p->at, p->at, A, p->kinsol, p->at, p->at));
  else CHECK_OK(flesh_ida_jacobian(0.15, cj, p->at, p->rate, p->rate, A, p->ida, p->at, p->at, p->at));
}

static void open_pair(int kind, pair *p)
{
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  *p = (pair){0};
  make_busy_bar(kind == of_ida_consistent ? FLESH_MASS_CONSISTENT : FLESH_MASS_LUMPED, &p->b);
  CHECK(!flesh_suncontext_create(&p->context));
  test_jitter(p->b.n, 0.05, 5, p->b.state.x);
  p->N = kind == of_kinsol ? p->b.n : 2 * p->b.n;
  p->at = N_VNew_Serial(p->N, p->context);
  p->rate = N_VClone(p->at);
  N_VConst(0, p->at);
  sunindextype entries;
  if (kind == of_kinsol) {
    const flesh_stage stage = {.load = 1, .share = 1, .shift = {1, 60, 3600, 0}, .x0 = p->b.state.x};
    CHECK_OK(flesh_problem_create(p->b.system, &options, &p->kinsol));
    CHECK_OK(flesh_problem_set_stage(p->kinsol, &stage));
    CHECK_OK(flesh_sunmatrix_create(p->kinsol, p->context, &p->own));
    entries = flesh_problem_entries(p->kinsol);
  } else {
    p->b.state.t = 0.14;
    CHECK_OK(flesh_ida_problem_create(p->b.system, &options, &p->ida));
    CHECK_OK(flesh_ida_start(p->ida, &p->b.state, p->at, p->rate));
    CHECK_OK(flesh_ida_sunmatrix_create(p->ida, p->context, &p->own));
    entries = flesh_ida_entries(p->ida);
  }
  p->sparse = SUNSparseMatrix(p->N, p->N, entries, CSC_MAT, p->context);
  assemble(p, p->sparse);
  assemble(p, p->own); /* last, as both live in the problem */
}

static void close_pair(pair *p)
{
  if (p->own) SUNMatDestroy(p->own);
  SUNMatDestroy(p->sparse);
  N_VDestroy(p->at);
  N_VDestroy(p->rate);
  flesh_problem_destroy(&p->kinsol);
  flesh_ida_problem_destroy(&p->ida);
  test_body_destroy(&p->b);
  SUNContext_Free(&p->context);
}

static void identity_of_the_kind(void)
{
  for (int kind = 0; kind < KINDS; kind++) {
    pair p;
    open_pair(kind, &p);
    CHECK(SUNMatGetID(p.own) == SUNMATRIX_CUSTOM);
    close_pair(&p);
  }
}

static double difference(N_Vector y, N_Vector z, int N)
{
  return test_distance(N, N_VGetArrayPointer(y), N_VGetArrayPointer(z));
}

/* y = A x is that of the entries, leaves x alone and does not read y. */
static void products(void)
{
  for (int kind = 0; kind < KINDS; kind++) {
    pair p;
    open_pair(kind, &p);
    N_Vector x = N_VClone(p.at), kept = N_VClone(p.at), y = N_VClone(p.at), z = N_VClone(p.at);
    N_VConst(0, x);
    test_jitter(p.N, 1, 9, N_VGetArrayPointer(x));
    N_VScale(1, x, kept);
    N_VConst(NAN, y);
    CHECK(!SUNMatMatvec(p.own, x, y));
    CHECK(!SUNMatMatvec(p.sparse, x, z));
    double off = difference(y, z, p.N), size = test_norm(p.N, N_VGetArrayPointer(z));
    printf("# kind %d: products differ by %.3g of %.3g\n", kind, off, size);
    CHECK_BELOW(off, 1e-13 * size);
    CHECK(difference(x, kept, p.N) == 0);
    N_VDestroy(x);
    N_VDestroy(kept);
    N_VDestroy(y);
    N_VDestroy(z);
    close_pair(&p);
  }
}

static void zero_until_filled_again(void)
{
  for (int kind = 0; kind < KINDS; kind++) {
    pair p;
    open_pair(kind, &p);
    N_Vector x = N_VClone(p.at), y = N_VClone(p.at), z = N_VClone(p.at);
    N_VConst(1, x);
    CHECK(!SUNMatMatvec(p.own, x, z));
    CHECK(!SUNMatZero(p.own));
    CHECK(!SUNMatMatvec(p.own, x, y));
    CHECK(test_norm(p.N, N_VGetArrayPointer(y)) == 0);
    assemble(&p, p.own);
    CHECK(!SUNMatMatvec(p.own, x, y));
    CHECK(difference(y, z, p.N) == 0 && test_norm(p.N, N_VGetArrayPointer(y)) > 1);
    N_VDestroy(x);
    N_VDestroy(y);
    N_VDestroy(z);
    close_pair(&p);
  }
}

static void vectors_that_do_not_fit(void)
{
  for (int kind = 0; kind < KINDS; kind++) {
    pair p;
    open_pair(kind, &p);
    N_Vector small = N_VNew_Serial(3, p.context), y = N_VClone(p.at);
    N_VConst(1, small);
    CHECK(SUNMatMatvec(p.own, small, y) != 0);
    CHECK_TEXT(flesh_error_text(), "length 3");
    CHECK(SUNMatMatvec(p.own, y, small) != 0);
    N_VDestroy(small);
    N_VDestroy(y);
    close_pair(&p);
  }
}

/* A SUNMatrix is a view: without it the problem goes on. */
static void destroyed_alone(void)
{
  for (int kind = 0; kind < KINDS; kind++) {
    pair p;
    open_pair(kind, &p);
    SUNMatDestroy(p.own);
    p.own = NULL;
    assemble(&p, p.sparse);
    close_pair(&p);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(identity_of_the_kind), TEST(products), TEST(zero_until_filled_again),
                   TEST(vectors_that_do_not_fit), TEST(destroyed_alone));
}
