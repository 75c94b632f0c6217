// TEST quick each_set
/* test_sparse.c: block products, constraints and factorisations against full matrices and GSL. */
#include <stdlib.h>

#include "matrices.h"
#include "linear/block_matrix.h"
#include "linear/direct.h"
#include "linear/linear.h"
#include "linear/sliced_ell.h"
#include "linear/scalar_view.h"
#include "linear/triangle.h"
#include "system/pattern.h"
#include "test.h"

/* The linear solver of the instruction set that this test is compiled for. */
static const flesh_linear *const linear = &FLESH_OF_ISA(flesh_linear);

static void dense_times(int n, const double *A, const double *x, double *y)
{
  for (int i = 0; i < n; i++) {
    y[i] = 0;
    for (int j = 0; j < n; j++) y[i] += A[i * n + j] * x[j];
  }
}

static void products_and_constraints(void)
{
  test_body b;
  make(test_box(2, 2, 1, 1, 1, 1), FLESH_ENERGY_S, 0.4, &b);
  flesh_block_matrix *A = random_matrix(&b, 0);
  double *dense = test_dense(A), *x = malloc((size_t)b.n * sizeof *x), *y = malloc((size_t)b.n * sizeof *y),
         *z = malloc((size_t)b.n * sizeof *z);
  randomise(b.n, x);
  flesh_block_multiply(A, x, y);
  dense_times(b.n, dense, x, z);
  CHECK_BELOW(test_distance(b.n, y, z), 1e-13);
  uint8_t fixed[3 * 18];
  CHECK(b.n == sizeof fixed);
  for (int d = 0; d < b.n; d++) fixed[d] = d % 5 == 0 || (d >= 12 && d < 15);
  flesh_block_fix(A, fixed, 42, NULL);
  double *after = test_dense(A);
  int wrong = 0;
  for (int i = 0; i < b.n; i++)
    for (int j = 0; j < b.n; j++) {
      double expected = !fixed[i] && !fixed[j] ? dense[i * b.n + j] : i == j ? 42 : 0;
      wrong += after[i * b.n + j] != expected;
    }
  CHECK(wrong == 0);
  for (int i = 0; i < A->rows; i++)
    for (int j = i; j < A->rows; j++) {
      int k = flesh_block_find(A, i, j), there = 0;
      for (int l = A->row_start[i]; l < A->row_end[i]; l++) there |= A->column[l] == j;
      CHECK(there ? k >= A->row_start[i] && k < A->row_end[i] && A->column[k] == j : k == -1);
    }
  free(dense);
  free(after);
  free(x);
  free(y);
  free(z);
  flesh_block_matrix_destroy(&A);
  test_body_destroy(&b);
}

static int coupled(const flesh_block_matrix *A, int i, int j)
{
  const int row = i < j ? i : j, column = i < j ? j : i;
  return flesh_block_find(A, row, column) >= 0;
}

/* Both halves run along the body, so that coupled nodes lie near each other, and nodes rarely wait for the previous
 * one. */
static void halves_go_along_the_body(void)
{
  enum { ACROSS = 9 * 9, NEAR = 7 * ACROSS / 2 };
  test_body b;
  make(test_box(60, 8, 8, 8, 1, 1), FLESH_ENERGY_S, 0.45, &b);
  flesh_block_matrix *A = random_matrix(&b, 0);
  flesh_bisection bisection;
  CHECK_OK(flesh_bisection_create(A, NULL, &bisection));
  int *place = malloc((size_t)A->rows * sizeof *place), farthest = 0, waiting = 0;
  for (int p = 0; p < A->rows; p++) place[p] = -1;
  for (int p = 0; p < A->rows; p++) place[bisection.order[p]] = p;
  for (int p = 0; p < A->rows; p++) waiting += p > 0 && coupled(A, bisection.order[p], bisection.order[p - 1]);
  for (int i = 0; i < A->rows; i++) {
    CHECK(place[i] >= 0);
    for (int k = A->row_start[i]; k < A->row_end[i]; k++) {
      const int j = A->column[k], separator = place[i] >= bisection.begin[2] || place[j] >= bisection.begin[2];
      if (!separator && abs(place[i] - place[j]) > farthest) farthest = abs(place[i] - place[j]);
    }
  }
  printf("# halves of %d and %d nodes: coupled ones at most %d places apart, %d of %d with the one before\n",
         bisection.begin[1], bisection.begin[2] - bisection.begin[1], farthest, waiting, A->rows);
  CHECK(bisection.begin[1] > 2 * NEAR && bisection.begin[2] - bisection.begin[1] > 2 * NEAR);
  CHECK(farthest < NEAR);
  CHECK_BELOW(waiting, 0.1 * A->rows);
  free(place);
  flesh_bisection_clear(&bisection);
  flesh_block_matrix_destroy(&A);
  test_body_destroy(&b);
}

/* A chain with three leaves at its end, 0-1-2-{3, 4, 5}. The order of Cuthill & McKee is 5 2 4 | 3 1 0, with 3 and 5
 * exchanged if numbers are reversed; 2 is the separator, and 0 is eliminated from the far end. */
static void numbers_decide_between_alike(void)
{
  int start[] = {0, 2, 4, 8, 9, 10, 11}, column[] = {0, 1, 1, 2, 2, 3, 4, 5, 3, 4, 5};
  const int reversed[] = {5, 4, 3, 2, 1, 0}, expected[2][6] = {{5, 4, 0, 3, 1, 2}, {3, 4, 0, 5, 1, 2}};
  const flesh_block_matrix A = {.rows = 6, .row_start = start, .row_end = start + 1, .column = column};
  for (int k = 0; k < 2; k++) {
    flesh_bisection bisection;
    CHECK_OK(flesh_bisection_create(&A, k ? reversed : NULL, &bisection));
    CHECK(!memcmp(bisection.order, expected[k], sizeof expected[k]));
    flesh_bisection_clear(&bisection);
  }
}

static void twice(void *data, int begin, int end)
{
  double *x = data;
  for (int d = 4 * begin; d < 4 * end; d++) x[d] *= 2;
}

static void twice_single(void *data, int begin, int end)
{
  float *x = data;
  for (int d = 4 * begin; d < 4 * end; d++) x[d] *= 2;
}

/* Checks the products in single precision: of a matrix being rounded, and of the rounded one again. `terms`: the sum of
 * the magnitudes of the curvature's terms. */
static void check_single(flesh_product *product, const flesh_block_matrix *A, flesh_threads *threads, const int *order,
                         const double *x, const double *y, double expected, double terms, float *first)
{
  const size_t bytes = 4 * (size_t)product->nodes * sizeof(float);
  float *lanes = aligned_alloc(16, bytes), *out = aligned_alloc(16, bytes);
  for (int again = 0; again < 2; again++) {
    memset(lanes, 0, bytes);
    for (int p = 0; p < A->rows; p++)
      for (int c = 0; c < 3; c++) lanes[4 * p + c] = (float)x[3 * order[p] + c] / 2;
    const double curvature = linear->product_multiply_single(product, again ? NULL : A, 8, threads,
                                                             &(flesh_product_maker){twice_single, lanes}, lanes, out);
    CHECK_NEAR(curvature, 8 * expected, 0x1p-25 * 8 * terms);
    if (first[0] == 0) memcpy(first, out, 4 * (size_t)A->rows * sizeof *out);
    for (int p = 0; p < A->rows; p++) {
      for (int c = 0; c < 3; c++) CHECK_NEAR((double)out[4 * p + c], 8 * y[3 * order[p] + c], 1e-4);
      CHECK(!memcmp(out + 4 * p, first + 4 * p, 3 * sizeof *out));
    }
  }
  free(lanes);
  free(out);
}

/* Products by halves, on vectors of four lanes, ready in their order or converted, against the plain product: bodies
 * with two halves and too small ones, regular or not; the same bits for any number of threads. */
static void products_by_halves(void)
{
  static const int cells[][3] = {{1, 1, 1}, {12, 2, 3}, {5, 4, 4}, {24, 7, 7}};
  for (int size = 0; size < 5; size++) {
    test_body b;
    flesh_mesh *mesh = NULL;
    if (size < 4) mesh = test_box(cells[size][0], cells[size][1], cells[size][2], 1, 1, 1);
    else CHECK_OK(flesh_mesh_read("../data/meshes/limb.msh", &mesh)); /* rows of all lengths */
    make(mesh, FLESH_ENERGY_S, 0.45, &b);
    flesh_block_matrix *A = random_matrix(&b, 0);
    flesh_bisection bisection;
    flesh_product product;
    CHECK_OK(flesh_bisection_create(A, NULL, &bisection));
    CHECK_OK(linear->product_create(A, &bisection, 1, &product));
    /* Numbers that have not been rounded may be anything, including NaN. */
    memset(product.rounded, 0xff, FLESH_SLICE * (9 * (size_t)product.column[product.slices[3]] +
                                                 6 * (size_t)product.slices[3]) * sizeof *product.rounded);
    CHECK(size != 1 || (bisection.begin[1] > 0 && bisection.begin[2] > bisection.begin[1] &&
                        bisection.begin[3] > bisection.begin[2]));
    for (int p = 0; p < A->rows; p++) /* rows are consecutive, as in vectors */
      CHECK(A->row_start[bisection.order[p]] == (p > 0 ? A->row_end[bisection.order[p - 1]] : 0));
    const size_t numbers = 4 * (size_t)product.nodes, bytes = numbers * sizeof(double);
    double *x = malloc((size_t)b.n * sizeof *x), *y = malloc((size_t)b.n * sizeof *y);
    double *lanes = aligned_alloc(32, bytes), *out = aligned_alloc(32, bytes), *first = malloc(bytes);
    float *single = calloc(numbers, sizeof *single);
    randomise(b.n, x);
    flesh_block_multiply(A, x, y);
    for (int threads = 1; threads < 4; threads++) {
      flesh_threads *pool = NULL;
      double curvature[2] = {NAN, NAN};
      CHECK_OK(flesh_threads_create(threads, &pool));
      memset(lanes, 0, bytes);
      for (int p = 0; p < A->rows; p++) memcpy(lanes + 4 * p, x + 3 * bisection.order[p], 3 * sizeof *x);
      curvature[0] = linear->product_multiply(&product, A, pool, NULL, lanes, out);
      if (threads == 1) memcpy(first, out, 4 * (size_t)A->rows * sizeof *out);
      for (int p = 0; p < A->rows; p++) {
        CHECK_BELOW(test_distance(3, out + 4 * p, y + 3 * bisection.order[p]), 1e-13);
        CHECK(!memcmp(out + 4 * p, first + 4 * p, 3 * sizeof *out));
      }
      double expected = 0, terms = 0;
      for (int d = 0; d < b.n; d++) expected += x[d] * y[d], terms += fabs(x[d] * y[d]);
      CHECK_NEAR(curvature[0], expected, 1e-10);
      for (int d = 0; d < 4 * A->rows; d++) lanes[d] = lanes[d] / 2;
      curvature[1] = linear->product_multiply(&product, A, pool, &(flesh_product_maker){twice, lanes}, lanes, out);
      for (int p = 0; p < A->rows; p++) {
        CHECK(!memcmp(lanes + 4 * p, x + 3 * bisection.order[p], 3 * sizeof *x));
        CHECK(!memcmp(out + 4 * p, first + 4 * p, 3 * sizeof *out));
      }
      CHECK(curvature[1] == curvature[0]);
      check_single(&product, A, pool, bisection.order, x, y, expected, terms, single);
      flesh_threads_destroy(&pool);
    }
    free(x);
    free(y);
    free(lanes);
    free(out);
    free(first);
    free(single);
    linear->product_clear(&product);
    flesh_bisection_clear(&bisection);
    flesh_block_matrix_destroy(&A);
    test_body_destroy(&b);
  }
}

static void block_inverses(void)
{
  for (int trial = 0; trial < 1000; trial++) {
    double L[9], A[9] = {0}, B[9];
    randomise(9, L);
    for (int p = 0; p < 9; p++) {
      for (int k = 0; k < 3; k++) A[p] += L[3 * (p / 3) + k] * L[3 * (p % 3) + k];
      A[p] += p % 4 == 0 ? 0.1 : 0;
    }
    CHECK(flesh_block_invert(A, B));
    for (int p = 0; p < 9; p++) {
      double sum = 0;
      for (int k = 0; k < 3; k++) sum += A[3 * (p / 3) + k] * B[3 * k + p % 3];
      CHECK_NEAR(sum, p % 4 == 0, 1e-12);
    }
    for (int c = 0; c < 3; c++) { /* indefinite or singular matrices are refused */
      double C[9];
      memcpy(C, A, sizeof C);
      C[4 * c] = -C[4 * c];
      CHECK(!flesh_block_invert(C, B));
      for (int k = 0; k < 3; k++) C[3 * c + k] = C[3 * k + c] = 0;
      CHECK(!flesh_block_invert(C, B));
      C[4 * c] = NAN;
      CHECK(!flesh_block_invert(C, B));
    }
  }
}

static void scalar_view_is_the_matrix(void)
{
  test_body b;
  flesh_scalar_view view;
  make(test_box(2, 1, 2, 1, 1, 1), FLESH_ENERGY_S, 0.4, &b);
  flesh_block_matrix *A = random_matrix(&b, 0);
  CHECK_OK(flesh_scalar_view_create(A, &view));
  double *values = malloc((size_t)view.entries * sizeof *values), *dense = test_dense(A);
  CHECK(view.n == b.n && view.starts[view.n] == view.entries);
  for (int pass = 0; pass < 2; pass++) {
    for (int64_t k = 0; k < view.entries; k++) values[k] = NAN;
    flesh_scalar_view_fill(&view, A, values);
    int wrong = 0;
    for (int64_t j = 0; j < view.n; j++)
      for (int64_t k = view.starts[j]; k < view.starts[j + 1]; k++) {
        wrong += k > view.starts[j] && view.indices[k] <= view.indices[k - 1];
        wrong += values[k] != dense[view.indices[k] * b.n + j];
        dense[view.indices[k] * b.n + j] = 0;
      }
    for (int k = 0; k < b.n * b.n; k++) wrong += dense[k] != 0; /* nothing was left out */
    CHECK(wrong == 0);
    free(dense);
    randomise(9 * A->row_start[A->rows], A->values);
    for (int i = 0; i < A->rows; i++)
      for (int p = 0; p < 9; p++) {
        double *block = A->values + 9 * (size_t)A->row_start[i];
        block[3 * (p / 3) + p % 3] = block[3 * (p % 3) + p / 3];
      }
    dense = test_dense(A);
  }
  free(dense);
  free(values);
  flesh_scalar_view_clear(&view);
  flesh_block_matrix_destroy(&A);
  test_body_destroy(&b);
}

static void check_direct(flesh_linear_solver kind, const flesh_block_matrix *A, flesh_direct *direct, flesh_exact *exact,
                         double tolerance)
{
  int n = 3 * A->rows;
  double *b = malloc((size_t)n * sizeof *b), *x = malloc((size_t)n * sizeof *x), *dense = test_dense(A);
  randomise(n, b);
  CHECK_OK(exact ? linear->exact->factor(exact, A) : flesh_direct_factor(direct, A));
  if (exact) linear->exact->solve(exact, b, x);
  else CHECK_OK(flesh_direct_solve(direct, b, x));
  double *expected = solve_by_gsl(n, dense, b), size = test_norm(n, expected);
  if (!(test_distance(n, x, expected) <= tolerance * size)) printf("# solver %d\n", kind);
  CHECK_BELOW(test_distance(n, x, expected), tolerance * size);
  free(expected);
  free(dense);
  free(b);
  free(x);
}

/* The factor replaces stalled conjugate gradients: entries over sixteen powers of ten. */
static void symmetric_factors_tell_what_is_indefinite(void)
{
  test_body b;
  make(test_box(3, 2, 2, 1.5, 1, 1), FLESH_ENERGY_S, 0.45, &b);
  flesh_block_matrix *A = bar_matrix(&b, 0.02, 0, 0);
  const double *X = flesh_mesh_positions(flesh_system_mesh(b.system)), n = 3. * A->rows;
  flesh_exact *exact = NULL;
  CHECK_OK(linear->exact->create(A, X, 1e3, &exact)); /* the factor takes more than 10^5 operations */
  CHECK(exact == NULL);
  CHECK_OK(linear->exact->create(A, X, 1e9, &exact));
  printf("# %.3g operations for %g rows\n", linear->exact->operations(exact), n);
  CHECK(linear->exact->operations(exact) > n * n);
  CHECK_BELOW(linear->exact->operations(exact), n * n * n / 3); /* a full matrix takes that */
  check_direct(FLESH_LINEAR_KLU, A, NULL, exact, 1e-12);
  const int node = A->rows / 2;
  double *corner = A->values + 9 * (size_t)A->row_start[node];
  for (int sign = 1; sign >= -1; sign -= 2) { /* one eigenvalue of the opposite sign, then none again */
    corner[0] = -corner[0];
    CHECK(linear->exact->factor(exact, A) == (sign > 0 ? FLESH_NOT_POSITIVE : FLESH_OK));
  }
  /* One node 10^8 times stiffer: still definite. */
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i]; k < A->row_end[i]; k++)
      for (int e = 0; e < 9; e++)
        A->values[9 * (size_t)k + e] *= (i == node ? 1e4 : 1) * (A->column[k] == node ? 1e4 : 1);
  CHECK_OK(linear->exact->factor(exact, A));
  corner = A->values + 9 * (size_t)A->row_start[0];
  corner[4] = -corner[4];
  CHECK(linear->exact->factor(exact, A) == FLESH_NOT_POSITIVE);
  /* Eigenvalues 1 and -1. */
  uint8_t *fixed = calloc((size_t)b.n, 1);
  fixed[0] = fixed[1] = 1;
  flesh_block_fix(A, fixed, 1, NULL);
  CHECK_OK(linear->exact->factor(exact, A));
  corner[0] = corner[4] = 0;
  corner[1] = corner[3] = 1;
  CHECK(linear->exact->factor(exact, A) == FLESH_NOT_POSITIVE);
  free(fixed);
  linear->exact->destroy(&exact);
  flesh_block_matrix_destroy(&A);
  test_body_destroy(&b);
}

static void direct_solvers_solve(void)
{
  test_body b;
  make(test_box(3, 2, 2, 1.5, 1, 1), FLESH_ENERGY_S, 0.45, &b);
  const flesh_linear_solver kinds[] = {FLESH_LINEAR_KLU, FLESH_LINEAR_CHOLMOD};
  for (int k = 0; k < 2; k++) {
    flesh_block_matrix *A = bar_matrix(&b, 0.02, 0, 0);
    flesh_direct *direct = NULL;
    int status = flesh_direct_create(kinds[k], A, &direct);
    if (kinds[k] == FLESH_LINEAR_CHOLMOD && status) {
      printf("# CHOLMOD is not built in\n");
      CHECK(status == FLESH_ERR_ARGUMENT && direct == NULL);
      CHECK_TEXT(flesh_error_text(), "which this build lacks");
      flesh_block_matrix_destroy(&A);
      continue;
    }
    CHECK_OK(status);
    check_direct(kinds[k], A, direct, NULL, 1e-9);
    /* Another matrix of the same pattern, whose pivots need another order in KLU. */
    flesh_block_matrix *B = random_matrix(&b, kinds[k] == FLESH_LINEAR_KLU ? 0 : 1.1);
    check_direct(kinds[k], B, direct, NULL, 1e-9);
    check_direct(kinds[k], A, direct, NULL, 1e-9);
    if (kinds[k] == FLESH_LINEAR_KLU) { /* A's pivots, on the diagonal, would leave only rounding here */
      for (int i = 0; i < B->rows; i++)
        for (int c = 0; c < 3; c++) B->values[9 * (size_t)B->row_start[i] + 4 * c] *= 1e-12;
      check_direct(kinds[k], B, direct, NULL, 1e-9);
    }
    memset(B->values, 0, 9 * (size_t)B->row_start[B->rows] * sizeof *B->values);
    CHECK(flesh_direct_factor(direct, B) == FLESH_NOT_POSITIVE);
    /* After a matrix that cannot be factored, the next one is solved as usual. */
    check_direct(kinds[k], A, direct, NULL, 1e-9);
    flesh_direct_destroy(&direct);
    CHECK(direct == NULL);
    flesh_direct_destroy(&direct);
    flesh_block_matrix_destroy(&A);
    flesh_block_matrix_destroy(&B);
  }
  test_body_destroy(&b);
}

/* Rows of none to five blocks with eight binary digits, against sums of the original numbers: within a unit of the last
 * digit, and with exactly the same result whether a block is the first or the second of a pair. */
static void triangles_round_alike(void)
{
  enum { ROWS = 6, MOST = 5 };
  static const int count[ROWS] = {0, 1, 2, 3, 4, 5}, order[ROWS] = {2, 0, 5, 1, 4, 3};
  flesh_triangle triangle;
  flesh_float4 y[ROWS];
  double number[4 * ROWS + 9 * MOST];
  CHECK_OK(flesh_triangle_create(ROWS, count, order, 0, &triangle));
  randomise(4 * ROWS + 9 * MOST, number);
  for (int k = 0; k < 4 * ROWS; k++) y[k / 4][k % 4] = (float)number[k];
  for (int p = 0; p < ROWS; p++) {
    double expected[3] = {0}, size[3] = {0};
    for (int n = 0; n < count[p]; n++) {
      float block[9];
      flesh_triangle_set_column(&triangle, p, n, n);
      for (int e = 0; e < 9; e++) {
        block[e] = (float)(number[4 * ROWS + 9 * n + e] * pow(10, e - 4));
        expected[e / 3] += (double)block[e] * (double)y[n][e % 3];
        size[e / 3] += fabs((double)block[e] * (double)y[n][e % 3]);
      }
      flesh_triangle_set(&triangle, flesh_triangle_place(&triangle, p, n), block);
    }
    const int q = triangle.at[p];
    CHECK(triangle.row[q] == p && order[q] == p);
    const flesh_float4 sum =
        flesh_triangle_product(&triangle, triangle.start[q], triangle.start[q + 1], (const float *)y);
    for (int r = 0; r < 3; r++) CHECK_NEAR((double)sum[r], expected[r], 0x1p-8 * size[r]);
  }
  /* The first of row 1 and the second of row 2, if the first is zero and the vector the same. */
  const float zero[9] = {0}, block[9] = {1.23f, -4.56e-7f, 7.89e3f, 0.1f, 1e-20f, -1e20f, 3.3f, -0.7f, 2.2f};
  y[1] = y[0];
  flesh_triangle_set(&triangle, flesh_triangle_place(&triangle, 1, 0), block);
  flesh_triangle_set(&triangle, flesh_triangle_place(&triangle, 2, 0), zero);
  flesh_triangle_set(&triangle, flesh_triangle_place(&triangle, 2, 1), block);
  const int *one = triangle.start + triangle.at[1], *two = triangle.start + triangle.at[2];
  const flesh_float4 first = flesh_triangle_product(&triangle, one[0], one[1], (const float *)y),
                     second = flesh_triangle_product(&triangle, two[0], two[1], (const float *)y);
  CHECK(!memcmp(&first, &second, 3 * sizeof(float)) && first[0] != 0);
  flesh_triangle_clear(&triangle);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(products_and_constraints), TEST(halves_go_along_the_body),
                   TEST(numbers_decide_between_alike), TEST_OF_THREADS(products_by_halves),
                   TEST(triangles_round_alike), TEST(block_inverses), TEST(scalar_view_is_the_matrix), TEST(direct_solvers_solve),
                   TEST(symmetric_factors_tell_what_is_indefinite));
}
