/* test_sparse.c: block products, constraints, factorisations, preconditioners and conjugate gradients against
 * full matrices and GSL. */
#include <gsl/gsl_eigen.h>
#include <gsl/gsl_linalg.h>
#include <stdlib.h>

#include "body.h"
#include "sparse/block_matrix.h"
#include "sparse/direct.h"
#include "sparse/pcg.h"
#include "sparse/product.h"
#include "sparse/scalar_view.h"
#include "system/pattern.h"
#include "test.h"

static unsigned long long seed = 1;

static void randomise(int n, double *x)
{
  for (int d = 0; d < n; d++) x[d] = 2 * test_uniform(&seed) - 1;
}

/* A matrix of a mesh's pattern with random entries, its diagonal raised by `dominance` times the row's sum. */
static flesh_block_matrix *random_matrix(const test_body *b, double dominance)
{
  flesh_block_matrix *A = NULL;
  CHECK_OK(flesh_system_matrix_create(b->system, &A));
  double *sums = calloc((size_t)b->n, sizeof *sums);
  randomise(9 * A->row_start[A->rows], A->values);
  for (int i = 0; i < A->rows; i++) {
    double *block = A->values + 9 * (size_t)A->row_start[i];
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < r; c++) block[3 * r + c] = block[3 * c + r];
    for (int k = A->row_start[i]; k < A->row_end[i]; k++)
      for (int p = 0; p < 9; p++) {
        sums[3 * i + p / 3] += fabs(A->values[9 * (size_t)k + p]);
        sums[3 * A->column[k] + p % 3] += fabs(A->values[9 * (size_t)k + p]);
      }
  }
  for (int d = 0; d < b->n; d++)
    A->values[9 * (size_t)A->row_start[d / 3] + 4 * (d % 3)] += dominance * sums[d];
  free(sums);
  return A;
}

static void make(flesh_mesh *mesh, flesh_energy energy, double poisson, test_body *b)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_young(energy, FLESH_CONSTANTS_MATCHED, 1e5, poisson, &material));
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_LUMPED, 1, b));
  CHECK_OK(flesh_system_finish(b->system));
}

/* The backward-Euler matrix of a bar that is bent out of shape, clamped at one end. */
static flesh_block_matrix *bar_matrix(const test_body *b, double jitter, double inertia, int project)
{
  flesh_block_matrix *A = NULL;
  uint8_t *fixed = calloc((size_t)b->n, 1);
  double *x = malloc((size_t)b->n * sizeof *x);
  memcpy(x, b->state.x, (size_t)b->n * sizeof *x);
  test_jitter(b->n, jitter, 5, x);
  flesh_point point = {.load = 1, .x = x, .v = b->state.v, .a = b->state.v};
  CHECK_OK(flesh_system_matrix_create(b->system, &A));
  CHECK_OK(flesh_system_jacobian(b->system, &point, &(flesh_shift){1, 0, inertia, project}, A));
  for (int d = 0; d < b->n; d++) fixed[d] = flesh_mesh_positions(b->mesh)[d - d % 3] == 0;
  flesh_block_fix(A, fixed, 1e4, NULL);
  free(fixed);
  free(x);
  return A;
}

static void dense_times(int n, const double *A, const double *x, double *y)
{
  for (int i = 0; i < n; i++) {
    y[i] = 0;
    for (int j = 0; j < n; j++) y[i] += A[i * n + j] * x[j];
  }
}

/* x of A x = b by GSL's LU. */
static double *solve_by_gsl(int unknowns, const double *A, const double *b)
{
  size_t n = (size_t)unknowns;
  double *x = calloc(n, sizeof *x);
  gsl_matrix *matrix = gsl_matrix_alloc(n, n);
  memcpy(matrix->data, A, n * n * sizeof *A);
  gsl_vector_const_view right = gsl_vector_const_view_array(b, n);
  gsl_vector_view solution = gsl_vector_view_array(x, n);
  gsl_permutation *order = gsl_permutation_alloc(n);
  int sign;
  gsl_linalg_LU_decomp(matrix, order, &sign);
  gsl_linalg_LU_solve(matrix, order, &right.vector, &solution.vector);
  gsl_permutation_free(order);
  gsl_matrix_free(matrix);
  return x;
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
      int k = flesh_pattern_find(A->column, A->row_start[i], A->row_end[i], j), there = 0;
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

/* Products by halves, on vectors of four lanes in their order, and the step of conjugate gradients, against the plain
 * product: bodies with two halves and such that are too small for them; the same bits for any number of threads. */
static void products_by_halves(void)
{
  static const int cells[][3] = {{1, 1, 1}, {12, 2, 3}, {5, 4, 4}};
  for (int size = 0; size < 3; size++) {
    test_body b;
    make(test_box(cells[size][0], cells[size][1], cells[size][2], 1, 1, 1), FLESH_ENERGY_S, 0.45, &b);
    flesh_block_matrix *A = random_matrix(&b, 0);
    flesh_halves halves;
    flesh_product product;
    CHECK_OK(flesh_halves_create(A, &halves));
    CHECK_OK(flesh_product_create(A, &halves, &product));
    CHECK(size != 1 || (halves.begin[1] > 0 && halves.begin[2] > halves.begin[1] && halves.begin[3] > halves.begin[2]));
    for (int p = 0; p < A->rows; p++) /* rows follow one another as vectors do */
      CHECK(A->row_start[halves.stored[p]] == (p > 0 ? A->row_end[halves.stored[p - 1]] : 0));
    const size_t numbers = 4 * (size_t)product.nodes, bytes = numbers * sizeof(double);
    double *x = malloc((size_t)b.n * sizeof *x), *y = malloc((size_t)b.n * sizeof *y);
    double *lanes = aligned_alloc(32, bytes), *out = aligned_alloc(32, bytes), *first = malloc(bytes);
    randomise(b.n, x);
    flesh_block_multiply(A, x, y);
    for (int threads = 1; threads < 4; threads++) {
      flesh_threads *pool = NULL;
      double curvature[2] = {NAN, NAN};
      CHECK_OK(flesh_threads_create(threads, &pool));
      memset(lanes, 0, bytes);
      for (int p = 0; p < A->rows; p++) memcpy(lanes + 4 * p, x + 3 * halves.stored[p], 3 * sizeof *x);
      flesh_product_multiply(&product, A, pool, lanes, out, &curvature[0]);
      if (threads == 1) memcpy(first, out, 4 * (size_t)A->rows * sizeof *out);
      for (int p = 0; p < A->rows; p++) {
        CHECK_BELOW(test_distance(3, out + 4 * p, y + 3 * halves.stored[p]), 1e-13);
        CHECK(!memcmp(out + 4 * p, first + 4 * p, 3 * sizeof *out));
      }
      double expected = 0;
      for (int d = 0; d < b.n; d++) expected += x[d] * y[d];
      CHECK_NEAR(curvature[0], expected, 1e-10);
      /* With p = z = x / 2 and beta = 1, p becomes x. */
      for (int d = 0; d < 4 * A->rows; d++) out[d] = lanes[d] = lanes[d] / 2;
      flesh_product_turn(&product, A, pool, 1, lanes, out, &curvature[1]);
      for (int p = 0; p < A->rows; p++) {
        CHECK(!memcmp(lanes + 4 * p, x + 3 * halves.stored[p], 3 * sizeof *x));
        CHECK(!memcmp(out + 4 * p, first + 4 * p, 3 * sizeof *out));
      }
      CHECK(curvature[1] == curvature[0]);
      flesh_threads_destroy(&pool);
    }
    free(x);
    free(y);
    free(lanes);
    free(out);
    free(first);
    flesh_product_clear(&product);
    flesh_halves_clear(&halves);
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
    for (int c = 0; c < 3; c++) { /* made indefinite or singular, it is refused */
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

static void check_direct(flesh_linear_solver kind, const flesh_block_matrix *A, flesh_direct *direct, double tolerance)
{
  int n = 3 * A->rows;
  double *b = malloc((size_t)n * sizeof *b), *x = malloc((size_t)n * sizeof *x), *dense = test_dense(A);
  randomise(n, b);
  CHECK_OK(flesh_direct_factor(direct, A));
  CHECK_OK(flesh_direct_solve(direct, b, x));
  double *expected = solve_by_gsl(n, dense, b), size = test_norm(n, expected);
  if (!(test_distance(n, x, expected) <= tolerance * size)) printf("# solver %d\n", kind);
  CHECK_BELOW(test_distance(n, x, expected), tolerance * size);
  free(expected);
  free(dense);
  free(b);
  free(x);
}

/* KLU with pivots on the diagonal, in place of conjugate gradients that stall: entries over sixteen powers of ten. */
static void symmetric_factors_tell_what_is_indefinite(void)
{
  test_body b;
  make(test_box(3, 2, 2, 1.5, 1, 1), FLESH_ENERGY_S, 0.45, &b);
  flesh_block_matrix *A = bar_matrix(&b, 0.02, 0, 0);
  flesh_direct *direct = NULL;
  CHECK_OK(flesh_direct_create_symmetric(A, 1e3, &direct)); /* it takes more than 10^5 */
  CHECK(direct == NULL);
  CHECK_OK(flesh_direct_create_symmetric(A, 1e9, &direct));
  check_direct(FLESH_LINEAR_KLU, A, direct, 1e-9);
  const int node = A->rows / 2;
  double *corner = A->values + 9 * (size_t)A->row_start[node];
  for (int sign = 1; sign >= -1; sign -= 2) { /* one eigenvalue of the other sign, then none again */
    corner[0] = -corner[0];
    CHECK(flesh_direct_factor(direct, A) == (sign > 0 ? FLESH_NOT_POSITIVE : FLESH_OK));
  }
  /* One node 10^8 times stiffer, which the rows of its neighbours are scaled by: no less definite. */
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i]; k < A->row_end[i]; k++)
      for (int e = 0; e < 9; e++)
        A->values[9 * (size_t)k + e] *= (i == node ? 1e4 : 1) * (A->column[k] == node ? 1e4 : 1);
  flesh_direct_destroy(&direct); /* and with it pivots that were chosen before */
  CHECK_OK(flesh_direct_create_symmetric(A, 1e9, &direct));
  CHECK_OK(flesh_direct_factor(direct, A));
  corner = A->values + 9 * (size_t)A->row_start[0];
  corner[4] = -corner[4];
  CHECK(flesh_direct_factor(direct, A) == FLESH_NOT_POSITIVE);
  /* Eigenvalues 1 and -1, of which pivots off the diagonal would tell nothing. */
  uint8_t *fixed = calloc((size_t)b.n, 1);
  fixed[0] = fixed[1] = 1;
  flesh_block_fix(A, fixed, 1, NULL);
  CHECK_OK(flesh_direct_factor(direct, A));
  corner[0] = corner[4] = 0;
  corner[1] = corner[3] = 1;
  CHECK(flesh_direct_factor(direct, A) == FLESH_NOT_POSITIVE);
  free(fixed);
  flesh_direct_destroy(&direct);
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
    check_direct(kinds[k], A, direct, 1e-9);
    /* Another matrix of the same pattern, whose pivots want another order for KLU. */
    flesh_block_matrix *B = random_matrix(&b, kinds[k] == FLESH_LINEAR_KLU ? 0 : 1.1);
    check_direct(kinds[k], B, direct, 1e-9);
    check_direct(kinds[k], A, direct, 1e-9);
    if (kinds[k] == FLESH_LINEAR_KLU) { /* A's pivots, of the diagonal, would leave nothing but rounding here */
      for (int i = 0; i < B->rows; i++)
        for (int c = 0; c < 3; c++) B->values[9 * (size_t)B->row_start[i] + 4 * c] *= 1e-12;
      check_direct(kinds[k], B, direct, 1e-9);
    }
    memset(B->values, 0, 9 * (size_t)B->row_start[B->rows] * sizeof *B->values);
    CHECK(flesh_direct_factor(direct, B) == FLESH_NOT_POSITIVE);
    /* After what cannot be factored, the next matrix is solved as ever. */
    check_direct(kinds[k], A, direct, 1e-9);
    CHECK(flesh_direct_memory(direct) > 0);
    flesh_direct_destroy(&direct);
    CHECK(direct == NULL);
    flesh_direct_destroy(&direct);
    flesh_block_matrix_destroy(&A);
    flesh_block_matrix_destroy(&B);
  }
  test_body_destroy(&b);
}

/* P^-1 as a full matrix, column by column. */
static double *applied(flesh_preconditioner_data *preconditioner, int n)
{
  double *P = malloc((size_t)n * n * sizeof *P), *unit = calloc((size_t)n, sizeof *unit),
         *column = malloc((size_t)n * sizeof *column);
  for (int d = 0; d < n; d++) {
    unit[d] = 1;
    flesh_preconditioner_apply(preconditioner, unit, column);
    for (int e = 0; e < n; e++) P[e * n + d] = column[e];
    unit[d] = 0;
  }
  free(unit);
  free(column);
  return P;
}

/* Symmetric and positive definite, whatever the matrix is. */
static void check_definite(int n, const double *P)
{
  double asymmetry = 0, size = 0;
  for (int k = 0; k < n * n; k++) {
    asymmetry = fmax(asymmetry, fabs(P[k] - P[k % n * n + k / n]));
    size = fmax(size, fabs(P[k]));
  }
  CHECK_BELOW(asymmetry, 1e-6 * size); /* incomplete Cholesky is in single precision */
  gsl_matrix *A = gsl_matrix_alloc((size_t)n, (size_t)n);
  gsl_vector *values = gsl_vector_alloc((size_t)n);
  gsl_eigen_symm_workspace *work = gsl_eigen_symm_alloc((size_t)n);
  memcpy(A->data, P, (size_t)n * n * sizeof *P);
  gsl_eigen_symm(A, values, work);
  CHECK(gsl_vector_min(values) > 0);
  gsl_eigen_symm_free(work);
  gsl_vector_free(values);
  gsl_matrix_free(A);
}

static const flesh_preconditioner kinds[] = {FLESH_PRECONDITIONER_TWO_LEVEL, FLESH_PRECONDITIONER_IC,
                                             FLESH_PRECONDITIONER_JACOBI, FLESH_PRECONDITIONER_NONE};
enum { KINDS = sizeof kinds / sizeof kinds[0] };

static void preconditioners_are_definite(void)
{
  test_body b;
  make(test_box(3, 2, 1, 1.5, 1, 0.5), FLESH_ENERGY_E, 0.49, &b);
  /* At rest, crumpled (indefinite), crumpled and projected, random (indefinite diagonal blocks), zero. */
  flesh_block_matrix *matrices[] = {bar_matrix(&b, 0, 0, 0), bar_matrix(&b, 0.3, 0, 0), bar_matrix(&b, 0.3, 0, 1),
                                    random_matrix(&b, 0), random_matrix(&b, 0)};
  memset(matrices[4]->values, 0, 9 * (size_t)matrices[4]->row_start[b.n / 3] * sizeof(double));
  for (int k = 0; k < KINDS; k++) {
    flesh_preconditioner_data *preconditioner = NULL;
    CHECK_OK(flesh_preconditioner_create(kinds[k], matrices[0], flesh_mesh_positions(b.mesh), NULL, &preconditioner));
    for (int m = 0; m < 5; m++) {
      CHECK_OK(flesh_preconditioner_setup(preconditioner, matrices[m], NULL));
      double *P = applied(preconditioner, b.n), *r = malloc((size_t)b.n * sizeof *r),
             *z = malloc((size_t)b.n * sizeof *z);
      check_definite(b.n, P);
      randomise(b.n, r);
      flesh_preconditioner_apply(preconditioner, r, z);
      flesh_preconditioner_apply(preconditioner, r, r); /* in place gives the same */
      CHECK(test_distance(b.n, r, z) == 0);
      free(P);
      free(r);
      free(z);
    }
    if (kinds[k] != FLESH_PRECONDITIONER_NONE) {
      matrices[4]->values[0] = NAN;
      CHECK(flesh_preconditioner_setup(preconditioner, matrices[4], NULL) == FLESH_NONFINITE);
      matrices[4]->values[0] = 0;
      /* And none of it spoils what comes next. */
      CHECK_OK(flesh_preconditioner_setup(preconditioner, matrices[0], NULL));
    }
    CHECK(flesh_preconditioner_memory(preconditioner) > 0);
    flesh_preconditioner_destroy(&preconditioner);
    flesh_preconditioner_destroy(&preconditioner);
  }
  for (int m = 0; m < 5; m++) flesh_block_matrix_destroy(&matrices[m]);
  test_body_destroy(&b);
}

/* What the factorisation moves to the diagonal leaves fixed components alone: they stay exactly where they are. */
static void incomplete_cholesky_leaves_fixed_components_alone(void)
{
  test_body b;
  make(test_box(3, 3, 3, 1, 1, 1), FLESH_ENERGY_S, 0.4, &b);
  flesh_block_matrix *A = random_matrix(&b, 1.1);
  flesh_preconditioner_data *preconditioner = NULL;
  uint8_t *fixed = calloc((size_t)b.n, 1);
  double *r = calloc((size_t)b.n, 2 * sizeof *r), *z = r + b.n;
  for (int d = 0; d < b.n; d++) fixed[d] = d % 7 == 1, r[d] = fixed[d] ? 0 : sin(d);
  flesh_block_fix(A, fixed, 100, NULL);
  CHECK_OK(
      flesh_preconditioner_create(FLESH_PRECONDITIONER_IC, A, flesh_mesh_positions(b.mesh), NULL, &preconditioner));
  CHECK_OK(flesh_preconditioner_setup(preconditioner, A, fixed));
  flesh_preconditioner_apply(preconditioner, r, z);
  for (int d = 0; d < b.n; d++) CHECK((z[d] == 0) == fixed[d]);
  free(r);
  free(fixed);
  flesh_preconditioner_destroy(&preconditioner);
  flesh_block_matrix_destroy(&A);
  test_body_destroy(&b);
}

/* The diagonal block of P at node i takes from that of A, plus the smallest shift, a share of the symmetric part of what P
 * has outside the pattern in the same rows: all of it where that stiffens, else at most a tenth of A's own trace. Returns
 * by how much it is off. */
static double off_the_diagonal(const double *P, const double *dense, const flesh_block_matrix *A, int i)
{
  const int n = 3 * A->rows;
  double outside[9] = {0}, taken[9], product = 0, square = 0, worst = 0, trace = 0, whole = 0;
  for (int j = 0; j < A->rows; j++) {
    const int low = i < j ? i : j, high = i < j ? j : i;
    if (flesh_pattern_find(A->column, A->row_start[low], A->row_end[low], high) >= 0) continue;
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < 3; c++) {
        outside[3 * r + c] += P[(3 * i + r) * n + 3 * j + c] / 2;
        outside[3 * c + r] += P[(3 * i + r) * n + 3 * j + c] / 2;
      }
  }
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++) {
      const int at = (3 * i + r) * n + 3 * i + c;
      taken[3 * r + c] = (r == c ? 1.004 : 1) * dense[at] - P[at];
      product += taken[3 * r + c] * outside[3 * r + c];
      square += outside[3 * r + c] * outside[3 * r + c];
      trace += r == c ? outside[3 * r + c] : 0;
      whole += r == c ? dense[at] : 0;
    }
  const double share = square > 1e-12 ? product / square : 1;
  for (int e = 0; e < 9; e++) worst = fmax(worst, fabs(taken[e] - share * outside[e]));
  if (trace < -1e-3) CHECK_NEAR(share, 1, 1e-4);
  if (trace > 1e-3) CHECK(share > 0.001 && share * trace < 0.1004 * whole);
  return worst;
}

/* What defines the incomplete factorisation: its product is A on A's pattern beside the diagonal. Where no fill is dropped
 * it is A. */
static void incomplete_cholesky_is_exact_on_the_pattern(void)
{
  enum { BLOCK, LONG, PAIR, SHAPES }; /* the long one is eliminated from both ends */
  for (int shape = 0; shape < SHAPES; shape++) {
    test_body b;
    flesh_mesh *mesh = NULL;
    if (shape == PAIR) CHECK_OK(flesh_mesh_create(5, (double[]){0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1}, 2,
                                           (int[]){0, 1, 2, 3, 1, 2, 3, 4}, NULL, &mesh));
    else mesh = shape == LONG ? test_box(8, 1, 1, 8, 1, 1) : test_box(3, 2, 2, 1.5, 1, 1);
    make(mesh, FLESH_ENERGY_S, 0.4, &b);
    flesh_block_matrix *A = random_matrix(&b, 1.1);
    flesh_preconditioner_data *preconditioner = NULL;
    CHECK_OK(
        flesh_preconditioner_create(FLESH_PRECONDITIONER_IC, A, flesh_mesh_positions(b.mesh), NULL, &preconditioner));
    CHECK_OK(flesh_preconditioner_setup(preconditioner, A, NULL));
    double *inverse = applied(preconditioner, b.n), *dense = test_dense(A), worst = 0, outside = 0;
    double *P = malloc((size_t)b.n * (size_t)b.n * sizeof *P);
    for (int d = 0; d < b.n; d++) {
      double *unit = calloc((size_t)b.n, sizeof *unit);
      unit[d] = 1;
      double *column = solve_by_gsl(b.n, inverse, unit);
      for (int e = 0; e < b.n; e++) {
        int i = e / 3 < d / 3 ? e / 3 : d / 3, j = e / 3 < d / 3 ? d / 3 : e / 3;
        double off = fabs(column[e] - dense[e * b.n + d]);
        P[e * b.n + d] = column[e];
        if (i == j) continue;
        if (flesh_pattern_find(A->column, A->row_start[i], A->row_end[i], j) >= 0) worst = fmax(worst, off);
        else outside = fmax(outside, off);
      }
      free(unit);
      free(column);
    }
    for (int i = 0; i < A->rows; i++) worst = fmax(worst, off_the_diagonal(P, dense, A, i));
    printf("# off by %.2g on the pattern, %.2g outside\n", worst, outside);
    CHECK_BELOW(worst, 1e-5); /* single precision */
    CHECK((outside > 1e-3) == (shape != PAIR));
    free(P);
    free(inverse);
    free(dense);
    flesh_preconditioner_destroy(&preconditioner);
    flesh_block_matrix_destroy(&A);
    test_body_destroy(&b);
  }
}

static double model(const flesh_block_matrix *A, const double *b, const double *x, double *Ax)
{
  double value = 0;
  flesh_block_multiply(A, x, Ax);
  for (int d = 0; d < 3 * A->rows; d++) value += x[d] * (Ax[d] / 2 - b[d]);
  return value;
}

static int stop_at_third(void *data) { return ++*(int *)data == 3 ? FLESH_ERR_BUDGET : FLESH_OK; }

/* Where negative curvature has been met after `first` iterations with x, more of them go on downhill. */
static void check_downhill(flesh_pcg_space *space, const flesh_block_matrix *A,
                           flesh_preconditioner_data *preconditioner, const double *b, int first, double *x,
                           double *Ax)
{
  int n = 3 * A->rows, asked = 0;
  flesh_pcg_result result;
  double before = model(A, b, x, Ax);
  for (int beyond = 1; beyond <= 20; beyond += 19) {
    flesh_pcg_guide guide = {.beyond = beyond};
    CHECK(flesh_pcg_guided(space, A, preconditioner, &guide, NULL, 1e-10, 5000, b, x, &result) ==
          FLESH_NOT_POSITIVE);
    CHECK(result.iterations == first + beyond && test_all_finite(n, x));
    double slope = 0, value = model(A, b, x, Ax);
    for (int d = 0; d < n; d++) slope += b[d] * x[d];
    CHECK(slope > 0 && value < before);
    before = value;
  }
  flesh_pcg_guide guide = {5000, stop_at_third, &asked};
  CHECK(flesh_pcg_guided(space, A, preconditioner, &guide, NULL, 1e-30, 5000, b, x, &result) == FLESH_ERR_BUDGET);
  CHECK(asked == 3 && result.iterations == 32);
}

static void conjugate_gradients(void)
{
  test_body b;
  make(test_box(4, 2, 2, 2, 1, 1), FLESH_ENERGY_S, 0.45, &b);
  int n = b.n;
  double *right = malloc((size_t)n * sizeof *right), *x = malloc((size_t)n * sizeof *x),
         *Ax = malloc((size_t)n * sizeof *Ax),
         *weights = malloc((size_t)n * sizeof *weights);
  flesh_block_matrix *A = bar_matrix(&b, 0.05, 3600, 0), *indefinite = bar_matrix(&b, 0.3, 0, 0);
  flesh_pcg_result result;
  flesh_pcg_space *space = NULL;
  CHECK_OK(flesh_pcg_space_create(A, NULL, &space));
  int iterations[KINDS];
  randomise(n, right);
  double *dense = test_dense(A), *expected = solve_by_gsl(n, dense, right);
  for (int k = 0; k < KINDS; k++) {
    flesh_preconditioner_data *preconditioner = NULL;
    CHECK_OK(flesh_preconditioner_create(kinds[k], A, flesh_mesh_positions(b.mesh), NULL, &preconditioner));
    CHECK_OK(flesh_preconditioner_setup(preconditioner, A, NULL));
    CHECK_OK(flesh_pcg(space, A, preconditioner, NULL, 1e-12 * test_norm(n, right), 5000, right, x, &result));
    CHECK_BELOW(test_distance(n, x, expected), 1e-8 * test_norm(n, expected));
    iterations[k] = result.iterations;
    flesh_block_multiply(A, x, Ax);
    for (int d = 0; d < n; d++) Ax[d] = right[d] - Ax[d];
    CHECK_NEAR(test_norm(n, Ax), result.residual, 1e-12 * test_norm(n, right));

    /* The norm is the weighted one, also where all weights are the same. */
    for (int same = 0; same < 2; same++) {
      for (int d = 0; d < n; d++) weights[d] = 1 + 1000 * (d % 2 || same);
      CHECK_OK(flesh_pcg(space, A, preconditioner, weights, 1e-3, 5000, right, x, &result));
      flesh_block_multiply(A, x, Ax);
      for (int d = 0; d < n; d++) Ax[d] = weights[d] * (right[d] - Ax[d]);
      CHECK_NEAR(test_norm(n, Ax), result.residual, 1e-9);
      CHECK_BELOW(result.residual, 1e-3);
    }

    /* The limit leaves an iterate that descends. */
    CHECK(flesh_pcg(space, A, preconditioner, NULL, 0, 3, right, x, &result) == FLESH_NOT_CONVERGED);
    CHECK(result.iterations == 3);
    double slope = 0, curvature = 0;
    flesh_block_multiply(A, x, Ax);
    for (int d = 0; d < n; d++) slope += right[d] * x[d], curvature += x[d] * Ax[d];
    CHECK(slope > 0 && curvature / 2 < slope);

    /* Nothing to do. */
    memset(Ax, 0, (size_t)n * sizeof *Ax);
    CHECK_OK(flesh_pcg(space, A, preconditioner, NULL, 0, 10, Ax, x, &result));
    CHECK(result.iterations == 0 && test_norm(n, x) == 0);

    /* Negative curvature is seen, whatever preconditions. */
    CHECK_OK(flesh_preconditioner_setup(preconditioner, indefinite, NULL));
    CHECK(flesh_pcg(space, indefinite, preconditioner, NULL, 1e-10, 5000, right, x, &result) == FLESH_NOT_POSITIVE);
    CHECK(test_all_finite(n, x));
    check_downhill(space, indefinite, preconditioner, right, result.iterations, x, Ax);
    CHECK_OK(flesh_preconditioner_setup(preconditioner, A, NULL));
    right[4] = NAN;
    CHECK(flesh_pcg(space, A, preconditioner, NULL, 1e-10, 5000, right, x, &result) == FLESH_NONFINITE);
    right[4] = 0.5;
    free(expected);
    expected = solve_by_gsl(n, dense, right);
    flesh_preconditioner_destroy(&preconditioner);
  }
  printf("# iterations: two levels %d, IC %d, Jacobi %d, none %d\n", iterations[0], iterations[1], iterations[2],
         iterations[3]);
  CHECK(iterations[1] < iterations[2] && iterations[2] < iterations[3]);
  free(dense);
  free(expected);
  free(right);
  free(x);
  flesh_pcg_space_destroy(&space);
  free(Ax);
  free(weights);
  flesh_block_matrix_destroy(&A);
  flesh_block_matrix_destroy(&indefinite);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(products_and_constraints), TEST(products_by_halves), TEST(block_inverses),
                   TEST(scalar_view_is_the_matrix), TEST(direct_solvers_solve),
                   TEST(symmetric_factors_tell_what_is_indefinite), TEST(preconditioners_are_definite),
                   TEST(incomplete_cholesky_leaves_fixed_components_alone),
                   TEST(incomplete_cholesky_is_exact_on_the_pattern), TEST(conjugate_gradients));
}
