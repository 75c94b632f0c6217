// TEST quick seconds=60
/* test_sunmatrix.c: flesh's matrices as SUNMatrix objects pass the checks of SUNDIALS' own tests: identity of the kind,
 * clones, copies, zero, sums with matrices and the identity, products against entries, space; misfits are refused, and
 * destruction leaves the problem intact. */
#include <nvector/nvector_serial.h>
#include <stdlib.h>
#include <sunmatrix/sunmatrix_sparse.h>

#include "busy_bar.h"
#include "flesh/ida.h"
#include "flesh/kinsol.h"
#include "flesh/ode.h"
#include "sundials/compatibility.h"

/* A matrix of flesh, a full one with the same entries obtained through SUNSparseMatrix, and the objects they are made
 * from. */
typedef struct pair {
  test_body b;
  SUNContext context;
  flesh_problem *kinsol;
  flesh_ida_problem *ida;
  flesh_ode_problem *rhs;
  SUNMatrix own, sparse; /* sparse NULL: f with consistent mass has no sparse matrix */
  N_Vector at, rate; /* where they are evaluated */
  int N;
} pair;

enum { of_kinsol, of_ida_lumped, of_ida_consistent, of_rhs_lumped, of_rhs_consistent, KINDS };
static const double cj = 37;

/* Fills the two. */
static void assemble(pair *p, SUNMatrix A)
{
  if (p->kinsol) CHECK_OK(flesh_kinsol_jacobian(p->at, p->at, A, p->kinsol, p->at, p->at));
  else if (p->rhs) CHECK_OK(flesh_ode_jacobian(0.15, p->at, p->rate, A, p->rhs, p->at, p->at, p->at));
  else CHECK_OK(flesh_ida_jacobian(0.15, cj, p->at, p->rate, p->rate, A, p->ida, p->at, p->at, p->at));
}

static void open_pair(int kind, pair *p)
{
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  *p = (pair){0};
  make_busy_bar(kind == of_ida_consistent || kind == of_rhs_consistent ? FLESH_MASS_CONSISTENT : FLESH_MASS_LUMPED,
                &p->b);
  CHECK(!flesh_suncontext_create(&p->context));
  test_jitter(p->b.n, 0.05, 5, p->b.state.x);
  p->N = kind == of_kinsol ? p->b.n : 2 * p->b.n;
  p->at = N_VNew_Serial(p->N, p->context);
  p->rate = N_VClone(p->at);
  N_VConst(0, p->at);
  sunindextype entries = 0;
  if (kind == of_kinsol) {
    const flesh_stage stage = {.load = 1, .prescribed_fraction = 1, .shift = {1, 60, 3600, 0}, .x0 = p->b.state.x};
    CHECK_OK(flesh_problem_create(p->b.system, &options, &p->kinsol));
    CHECK_OK(flesh_problem_set_stage(p->kinsol, &stage));
    CHECK_OK(flesh_sunmatrix_create(p->kinsol, p->context, &p->own));
    entries = flesh_problem_entries(p->kinsol);
  } else if (kind >= of_rhs_lumped) {
    p->b.state.t = 0.14;
    CHECK_OK(flesh_ode_problem_create(p->b.system, &options, &p->rhs));
    CHECK_OK(flesh_ode_start(p->rhs, &p->b.state, p->at));
    CHECK_OK(flesh_ode_sunmatrix_create(p->rhs, p->context, &p->own));
    if (kind == of_rhs_lumped) entries = flesh_ode_entries(p->rhs);
  } else {
    p->b.state.t = 0.14;
    CHECK_OK(flesh_ida_problem_create(p->b.system, &options, &p->ida));
    CHECK_OK(flesh_ida_start(p->ida, &p->b.state, p->at, p->rate));
    CHECK_OK(flesh_ida_sunmatrix_create(p->ida, p->context, &p->own));
    entries = flesh_ida_entries(p->ida);
  }
  if (entries) p->sparse = SUNSparseMatrix(p->N, p->N, entries, CSC_MAT, p->context);
  if (p->sparse) assemble(p, p->sparse);
  assemble(p, p->own); /* last, because both live in the problem */
}

static void close_pair(pair *p)
{
  if (p->own) SUNMatDestroy(p->own);
  if (p->sparse) SUNMatDestroy(p->sparse);
  N_VDestroy(p->at);
  N_VDestroy(p->rate);
  flesh_problem_destroy(&p->kinsol);
  flesh_ida_problem_destroy(&p->ida);
  flesh_ode_problem_destroy(&p->rhs);
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

/* Computes y = A x without A: by the sparse matrix, or by the products for matrix-free solvers. */
static void product(pair *p, N_Vector x, N_Vector y)
{
  if (p->sparse) CHECK(!SUNMatMatvec(p->sparse, x, y));
  else {
    CHECK_OK(flesh_ode_jacobian_times_setup(0.15, p->at, p->rate, p->rhs));
    CHECK_OK(flesh_ode_jacobian_times(x, y, 0.15, p->at, p->rate, p->rhs, NULL));
  }
}

static double difference(N_Vector y, N_Vector z, int N)
{
  return test_distance(N, N_VGetArrayPointer(y), N_VGetArrayPointer(z));
}

/* Checks that y = A x agrees with the entries, leaves x unchanged and does not read y. */
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
    product(&p, x, z);
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

/* The product of A with a fixed vector, for comparisons. */
static N_Vector signature(const pair *p, SUNMatrix A)
{
  N_Vector x = N_VClone(p->at), y = N_VClone(p->at);
  N_VConst(0, x);
  test_jitter(p->N, 1, 13, N_VGetArrayPointer(x));
  CHECK(!SUNMatMatvec(A, x, y));
  N_VDestroy(x);
  return y;
}

/* Whether A is c times the matrix whose product is y, plus d times the identity. */
static double off(const pair *p, SUNMatrix A, double c, N_Vector y, double d)
{
  N_Vector x = N_VClone(p->at), found = signature(p, A);
  N_VConst(0, x);
  test_jitter(p->N, 1, 13, N_VGetArrayPointer(x));
  N_VLinearSum(d, x, c, y, x);
  double size = test_norm(p->N, N_VGetArrayPointer(x)), distance = difference(found, x, p->N);
  N_VDestroy(x);
  N_VDestroy(found);
  return size > 0 ? distance / size : distance;
}

static void clones_and_copies(void)
{
  for (int kind = 0; kind < KINDS; kind++) {
    pair p;
    open_pair(kind, &p);
    N_Vector y = signature(&p, p.own);
    SUNMatrix clone = SUNMatClone(p.own), other = SUNMatClone(clone);
    CHECK(clone && other && clone != p.own && clone->content != p.own->content);
    CHECK(SUNMatGetID(clone) == SUNMATRIX_CUSTOM);
    CHECK(!SUNMatCopy(p.own, clone));
    CHECK_BELOW(off(&p, clone, 1, y, 0), 1e-13);
    CHECK_BELOW(off(&p, p.own, 1, y, 0), 1e-13); /* copied from, the same */
    CHECK(!SUNMatCopy(clone, other) && !SUNMatZero(clone));
    CHECK(off(&p, clone, 0, y, 0) == 0);
    CHECK_BELOW(off(&p, other, 1, y, 0), 1e-13);
    CHECK(!SUNMatZero(p.own) && !SUNMatCopy(other, p.own)); /* and back */
    CHECK_BELOW(off(&p, p.own, 1, y, 0), 1e-13);
    long reals = 0, integers = 0;
    /* The operation itself: the function that calls it is deprecated since SUNDIALS 7.3. */
    CHECK(!p.own->ops->space(p.own, &reals, &integers) && reals > p.N && integers > 0);
    SUNMatDestroy(clone);
    CHECK_BELOW(off(&p, p.own, 1, y, 0), 1e-13);
    SUNMatDestroy(other);
    N_VDestroy(y);
    close_pair(&p);
  }
}

static void sums(void)
{
  for (int kind = 0; kind < KINDS; kind++) {
    pair p;
    open_pair(kind, &p);
    N_Vector y = signature(&p, p.own);
    SUNMatrix A = SUNMatClone(p.own), B = SUNMatClone(p.own);
    CHECK(!SUNMatCopy(p.own, A) && !SUNMatCopy(p.own, B));
    CHECK(!SUNMatScaleAdd(-1, A, B)); /* zero, as SUNDIALS' test has it */
    CHECK(off(&p, A, 0, y, 0) == 0);
    CHECK(!SUNMatScaleAddI(1, A)); /* the identity, and minus it */
    CHECK_BELOW(off(&p, A, 0, y, 1), 1e-13);
    CHECK(!SUNMatScaleAddI(-1, A));
    CHECK_BELOW(off(&p, A, 0, y, 0), 1e-13);
    CHECK(!SUNMatCopy(B, A) && !SUNMatScaleAdd(2.5, A, p.own));
    CHECK_BELOW(off(&p, A, 3.5, y, 0), 1e-13);
    CHECK(!SUNMatScaleAdd(0.5, p.own, A)); /* also onto the problem's own matrix */
    CHECK_BELOW(off(&p, p.own, 4, y, 0), 1e-13);
    CHECK(!SUNMatScaleAddI(-0.001, B));
    CHECK_BELOW(off(&p, B, -0.001, y, 1), 1e-13);
    CHECK(!SUNMatCopy(B, p.own) && !SUNMatScaleAddI(3, p.own));
    CHECK_BELOW(off(&p, p.own, -0.003, y, 4), 1e-13);
    assemble(&p, p.own); /* nothing of it remains */
    CHECK_BELOW(off(&p, p.own, 1, y, 0), 1e-14);
    SUNMatDestroy(A);
    SUNMatDestroy(B);
    N_VDestroy(y);
    close_pair(&p);
  }
}

/* Matrices of two problems do not mix, nor do those of other kinds. */
static void matrices_that_do_not_fit(void)
{
  pair p[KINDS];
  for (int kind = 0; kind < KINDS; kind++) open_pair(kind, &p[kind]);
  for (int a = 0; a < KINDS; a++)
    for (int b = 0; b < KINDS; b++)
      if (a != b) {
        CHECK(p[a].own->ops->copy(p[a].own, p[b].own) == FLESH_ERR_ARGUMENT);
        CHECK_TEXT(flesh_error_text(), "not of one problem");
        CHECK(p[a].own->ops->scaleadd(1, p[a].own, p[b].own) == FLESH_ERR_ARGUMENT);
      }
  for (int kind = 0; kind < KINDS; kind++) close_pair(&p[kind]);
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

/* A SUNMatrix is a view: the problem survives it. */
static void destroyed_alone(void)
{
  for (int kind = 0; kind < KINDS; kind++) {
    pair p;
    open_pair(kind, &p);
    SUNMatDestroy(p.own);
    p.own = NULL;
    if (p.sparse) assemble(&p, p.sparse);
    close_pair(&p);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(identity_of_the_kind), TEST(products), TEST(zero_until_filled_again),
                   TEST(clones_and_copies), TEST(sums), TEST(matrices_that_do_not_fit),
                   TEST(vectors_that_do_not_fit), TEST(destroyed_alone));
}
