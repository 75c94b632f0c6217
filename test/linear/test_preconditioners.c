// TEST quick each_set
/* test_preconditioners.c: preconditioners, and conjugate gradients with them, against full matrices and GSL. */
#include <malloc.h>
#include <stdlib.h>

#include "base/archive.h"
#include "matrices.h"
#include "preconditioners.h"
#include "linear/linear.h"
#include "system/pattern.h"
#include "test.h"

/* The linear solver of the instruction set that this test is compiled for. */
static const flesh_linear *const linear = &FLESH_OF_ISA(flesh_linear);

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
    CHECK_OK(linear->preconditioner_create(kinds[k], matrices[0], flesh_mesh_positions(b.mesh), 1, NULL, &preconditioner));
    for (int m = 0; m < 5; m++) {
      CHECK_OK(linear->preconditioner_setup(preconditioner, matrices[m], NULL));
      double *P = applied(linear, preconditioner, b.n), *r = malloc((size_t)b.n * sizeof *r),
             *z = malloc((size_t)b.n * sizeof *z);
      check_definite(b.n, P, 1e-6);
      randomise(b.n, r);
      linear->preconditioner_apply(preconditioner, r, z);
      linear->preconditioner_apply(preconditioner, r, r); /* in place gives the same */
      CHECK(test_distance(b.n, r, z) == 0);
      free(P);
      free(r);
      free(z);
    }
    matrices[4]->values[0] = NAN;
    CHECK(linear->preconditioner_setup(preconditioner, matrices[4], NULL) == FLESH_NONFINITE);
    matrices[4]->values[0] = 0;
    /* And none of it affects what comes next. */
    CHECK_OK(linear->preconditioner_setup(preconditioner, matrices[0], NULL));
    linear->preconditioner_destroy(&preconditioner);
    linear->preconditioner_destroy(&preconditioner);
  }
  for (int m = 0; m < 5; m++) flesh_block_matrix_destroy(&matrices[m]);
  test_body_destroy(&b);
}

/* The entries that the factorisation moves to the diagonal do not affect fixed components, which stay exactly
 * unchanged. */
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
      linear->preconditioner_create(FLESH_PRECONDITIONER_IC, A, flesh_mesh_positions(b.mesh), 1, NULL, &preconditioner));
  CHECK_OK(linear->preconditioner_setup(preconditioner, A, fixed));
  linear->preconditioner_apply(preconditioner, r, z);
  for (int d = 0; d < b.n; d++) CHECK((z[d] == 0) == fixed[d]);
  free(r);
  free(fixed);
  linear->preconditioner_destroy(&preconditioner);
  flesh_block_matrix_destroy(&A);
  test_body_destroy(&b);
}

/* The diagonal block of P at node i is that of A, plus the smallest shift, minus a share of the symmetric part of P's
 * entries outside the pattern in the same rows: all of it if that stiffens, else at most a twentieth of the trace of A.
 * Returns the deviation from this. */
static double off_the_diagonal(const double *P, const double *dense, const flesh_block_matrix *A, int i)
{
  const int n = 3 * A->rows;
  double outside[9] = {0}, taken[9], product = 0, square = 0, worst = 0, trace = 0, whole = 0;
  for (int j = 0; j < A->rows; j++) {
    const int low = i < j ? i : j, high = i < j ? j : i;
    if (flesh_block_find(A, low, high) >= 0) continue;
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
  if (trace < -1e-3) CHECK_NEAR(share, 1, 1e-3);
  if (trace > 1e-3) CHECK(share > 0.001 && share * trace < 0.0502 * whole);
  return worst;
}

/* The incomplete factorisation is defined by a product that is A on A's pattern off the diagonal. If no fill is
 * dropped, it is A. */
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
        linear->preconditioner_create(FLESH_PRECONDITIONER_IC, A, flesh_mesh_positions(b.mesh), 1, NULL, &preconditioner));
    CHECK_OK(linear->preconditioner_setup(preconditioner, A, NULL));
    double *inverse = applied(linear, preconditioner, b.n), *dense = test_dense(A), worst = 0, outside = 0;
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
        if (flesh_block_find(A, i, j) >= 0) worst = fmax(worst, off);
        else outside = fmax(outside, off);
      }
      free(unit);
      free(column);
    }
    for (int i = 0; i < A->rows; i++) worst = fmax(worst, off_the_diagonal(P, dense, A, i));
    printf("# off by %.2g on the pattern, %.2g outside\n", worst, outside);
    CHECK_BELOW(worst, 4e-5); /* sixteen binary digits */
    CHECK((outside > 1e-3) == (shape != PAIR));
    free(P);
    free(inverse);
    free(dense);
    linear->preconditioner_destroy(&preconditioner);
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

/* After negative curvature has been met, with x after `first` iterations, further iterations continue downhill. */
static void check_downhill(flesh_pcg_space *space, flesh_pcg_request request, int first, double *x, double *Ax)
{
  const flesh_block_matrix *A = request.A;
  const double *b = request.b;
  int n = 3 * A->rows, asked = 0;
  flesh_pcg_result result;
  double before = model(A, b, x, Ax);
  for (int more = 1; more <= 20; more += 19) {
    request.after_indefinite = more;
    CHECK(linear->pcg(space, &request, x, &result) == FLESH_NOT_POSITIVE);
    CHECK(result.iterations == first + more && test_all_finite(n, x));
    double slope = 0, value = model(A, b, x, Ax);
    for (int d = 0; d < n; d++) slope += b[d] * x[d];
    CHECK(slope > 0 && value < before);
    before = value;
  }
  request.after_indefinite = 5000, request.tolerance = 1e-30;
  request.stop = stop_at_third, request.stop_data = &asked;
  CHECK(linear->pcg(space, &request, x, &result) == FLESH_ERR_BUDGET);
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
  CHECK_OK(linear->pcg_space_create(A, 1, NULL, &space));
  int iterations[KINDS];
  randomise(n, right);
  double *dense = test_dense(A), *expected = solve_by_gsl(n, dense, right);
  for (int k = 0; k < KINDS; k++) {
    flesh_preconditioner_data *preconditioner = NULL;
    CHECK_OK(linear->preconditioner_create(kinds[k], A, flesh_mesh_positions(b.mesh), 1, NULL, &preconditioner));
    CHECK_OK(linear->preconditioner_setup(preconditioner, A, NULL));
    flesh_pcg_request request = {.A = A, .preconditioner = preconditioner, .b = right,
                                 .tolerance = 1e-12 * test_norm(n, right), .max_iterations = 5000};
    CHECK_OK(linear->pcg(space, &request, x, &result));
    CHECK_BELOW(test_distance(n, x, expected), 1e-8 * test_norm(n, expected));
    iterations[k] = result.iterations;
    flesh_block_multiply(A, x, Ax);
    for (int d = 0; d < n; d++) Ax[d] = right[d] - Ax[d];
    CHECK_NEAR(test_norm(n, Ax), result.residual, 1e-12 * test_norm(n, right));

    /* The norm is the weighted one, also if all weights are the same. */
    request.weights = weights, request.tolerance = 1e-3;
    for (int same = 0; same < 2; same++) {
      for (int d = 0; d < n; d++) weights[d] = 1 + 1000 * (d % 2 || same);
      CHECK_OK(linear->pcg(space, &request, x, &result));
      flesh_block_multiply(A, x, Ax);
      for (int d = 0; d < n; d++) Ax[d] = weights[d] * (right[d] - Ax[d]);
      CHECK_NEAR(test_norm(n, Ax), result.residual, 1e-9);
      CHECK_BELOW(result.residual, 1e-3);
    }

    /* The iteration limit leaves a descending iterate. */
    request.weights = NULL, request.tolerance = 0, request.max_iterations = 3;
    CHECK(linear->pcg(space, &request, x, &result) == FLESH_NOT_CONVERGED);
    CHECK(result.iterations == 3);
    double slope = 0, curvature = 0;
    flesh_block_multiply(A, x, Ax);
    for (int d = 0; d < n; d++) slope += right[d] * x[d], curvature += x[d] * Ax[d];
    CHECK(slope > 0 && curvature / 2 < slope);

    /* How far a residual is from the one predicted. */
    for (int d = 0; d < n; d++) Ax[d] += (d % 3 ? 2e-6 : 1e-6) - right[d];
    CHECK_NEAR(linear->pcg_model_error(space, NULL, Ax), 1e-6 * sqrt(3. * n), 1e-9);

    /* Nothing to do. */
    memset(Ax, 0, (size_t)n * sizeof *Ax);
    request.b = Ax;
    CHECK_OK(linear->pcg(space, &request, x, &result));
    CHECK(result.iterations == 0 && test_norm(n, x) == 0);

    /* Negative curvature is detected with any preconditioner. */
    CHECK_OK(linear->preconditioner_setup(preconditioner, indefinite, NULL));
    request.A = indefinite, request.b = right, request.tolerance = 1e-10, request.max_iterations = 5000;
    CHECK(linear->pcg(space, &request, x, &result) == FLESH_NOT_POSITIVE);
    CHECK(test_all_finite(n, x));
    check_downhill(space, request, result.iterations, x, Ax);
    CHECK_OK(linear->preconditioner_setup(preconditioner, A, NULL));
    right[4] = NAN;
    request.A = A;
    CHECK(linear->pcg(space, &request, x, &result) == FLESH_NONFINITE);
    right[4] = 0.5;
    free(expected);
    expected = solve_by_gsl(n, dense, right);
    linear->preconditioner_destroy(&preconditioner);
  }
  printf("# iterations: two levels %d, IC %d, Jacobi %d, none %d\n", iterations[0], iterations[1], iterations[2],
         iterations[3]);
  CHECK(iterations[1] < iterations[2] && iterations[2] < iterations[3]);
  free(dense);
  free(expected);
  free(right);
  free(x);
  linear->pcg_space_destroy(&space);
  free(Ax);
  free(weights);
  flesh_block_matrix_destroy(&A);
  flesh_block_matrix_destroy(&indefinite);
  test_body_destroy(&b);
}

/* || b - A x ||. */
static double residual_of(const flesh_block_matrix *A, const double *b, const double *x, double *Ax)
{
  flesh_block_multiply(A, x, Ax);
  for (int d = 0; d < 3 * A->rows; d++) Ax[d] = b[d] - Ax[d];
  return test_norm(3 * A->rows, Ax);
}

/* Solves in single precision take as many iterations and end as near, up to its rounding, in any units; they use double
 * precision if rounding would show, or if weights differ. */
static void conjugate_gradients_in_single_precision(void)
{
  test_body b;
  make(test_box(8, 3, 3, 2, 0.75, 0.75), FLESH_ENERGY_S, 0.45, &b);
  const int n = b.n;
  double *right = malloc((size_t)n * sizeof *right), *x = malloc((size_t)n * sizeof *x),
         *Ax = malloc((size_t)n * sizeof *Ax), *weights = malloc((size_t)n * sizeof *weights),
         *before = malloc((size_t)n * sizeof *before);
  randomise(n, right);
  for (int k = 0; k < KINDS; k++) {
    flesh_block_matrix *A = bar_matrix(&b, 0.05, 3600, 0);
    flesh_preconditioner_data *preconditioner = NULL;
    flesh_pcg_space *space = NULL;
    flesh_pcg_result exact, result;
    const int blocks = 9 * A->row_start[A->rows];
    const double norm = test_norm(n, right);
    CHECK_OK(linear->pcg_space_create(A, 1, NULL, &space));
    CHECK_OK(linear->preconditioner_create(kinds[k], A, flesh_mesh_positions(b.mesh), 1, NULL, &preconditioner));
    flesh_pcg_request request = {.A = A, .preconditioner = preconditioner, .max_iterations = 5000};
    for (int units = -1; units <= 1; units++) { /* scale of the matrix, and the inverse for the right-hand side */
      const double scale = pow(1e25, units), tolerance = request.tolerance = 1e-4 * norm / scale;
      double *b_scaled = malloc((size_t)n * sizeof *b_scaled);
      request.b = b_scaled, request.single = 0;
      for (int d = 0; d < n; d++) b_scaled[d] = right[d] / scale;
      for (int e = 0; e < blocks; e++) A->values[e] *= scale;
      CHECK_OK(linear->preconditioner_setup(preconditioner, A, NULL));
      CHECK_OK(linear->pcg(space, &request, before, &exact));
      request.single = 1;
      for (request.same = 0; request.same < 2; request.same++) { /* to be rounded, then already rounded */
        CHECK_OK(linear->pcg(space, &request, x, &result));
        CHECK(abs(result.iterations - exact.iterations) <= 1 + exact.iterations / 20);
        CHECK_NEAR(result.first, exact.first, 1e-6 * exact.first);
        CHECK(result.single && !exact.single);
        CHECK_NEAR(residual_of(A, b_scaled, x, Ax), result.residual, 1e-5 * result.first);
        CHECK_BELOW(test_distance(n, x, before), 1e-3 * test_norm(n, before));
      }
      /* How far a residual is from the one predicted. */
      for (int d = 0; d < n; d++) Ax[d] = 1e-3 * norm / scale - Ax[d];
      CHECK_NEAR(linear->pcg_model_error(space, NULL, Ax), 1e-3 * norm / scale * sqrt(n), 1e-4 * norm / scale);
      /* A preconditioner with another scale: the rounded numbers cannot be reused. */
      for (int e = 0; e < blocks; e++) A->values[e] *= 64;
      CHECK_OK(linear->preconditioner_setup(preconditioner, A, NULL));
      for (int e = 0; e < blocks; e++) A->values[e] /= 64;
      request.same = 1;
      CHECK_OK(linear->pcg(space, &request, x, &result));
      CHECK_BELOW(residual_of(A, b_scaled, x, Ax), 1.1 * tolerance);
      /* Another matrix. */
      for (int e = 0; e < blocks; e++) A->values[e] *= 1.5;
      request.same = 0;
      CHECK_OK(linear->pcg(space, &request, x, &result));
      CHECK_BELOW(residual_of(A, b_scaled, x, Ax), 1.1 * tolerance);
      for (int e = 0; e < blocks; e++) A->values[e] /= 1.5 * scale;
      free(b_scaled);
    }
    CHECK_OK(linear->preconditioner_setup(preconditioner, A, NULL));
    request.same = 0;
    request.b = right, request.tolerance = 1e-9 * norm;
    CHECK_OK(linear->pcg(space, &request, x, &result));
    CHECK(!result.single);
    CHECK_NEAR(residual_of(A, right, x, Ax), result.residual, 1e-12 * norm);
    for (int d = 0; d < n; d++) weights[d] = 1 + d % 2;
    request.weights = weights, request.tolerance = 1e-3 * norm;
    CHECK_OK(linear->pcg(space, &request, x, &result));
    CHECK(!result.single);
    residual_of(A, right, x, Ax);
    for (int d = 0; d < n; d++) Ax[d] *= weights[d];
    CHECK_NEAR(test_norm(n, Ax), result.residual, 1e-12 * norm);
    /* Negative curvature is detected and followed downhill. */
    flesh_block_matrix *indefinite = bar_matrix(&b, 0.3, 0, 0);
    request.A = indefinite, request.weights = NULL, request.tolerance = 1e-4 * norm;
    for (request.after_indefinite = 0; request.after_indefinite < 2; request.after_indefinite++) {
      CHECK_OK(linear->preconditioner_setup(preconditioner, indefinite, NULL));
      CHECK(linear->pcg(space, &request, x, &result) == FLESH_NOT_POSITIVE);
      CHECK(test_all_finite(n, x) && (request.after_indefinite == 0 || model(indefinite, right, x, Ax) < 0));
    }
    flesh_block_matrix_destroy(&indefinite);
    linear->preconditioner_destroy(&preconditioner);
    linear->pcg_space_destroy(&space);
    flesh_block_matrix_destroy(&A);
  }
  free(right);
  free(x);
  free(Ax);
  free(weights);
  free(before);
  test_body_destroy(&b);
}

/* The number of vertices that ranks share: that of one rank, as long as all can factor them in time; beyond that, ranks
 * have their own levels. More ranks never share more. */
static void ranks_share_what_they_can_factor(void)
{
  enum { BLOCKS = 8 /* for a node of four-node tets */, LARGE = 177552 };
  const flesh_levels one = flesh_levels_for(LARGE, (double)BLOCKS * LARGE, 1);
  CHECK(one.shared == 1598 || one.shared == 1599);
  CHECK(one.own == 0);
  for (int ranks = 2; ranks <= 64; ranks *= 2) { /* a million tets */
    const flesh_levels same = flesh_levels_for(LARGE, (double)BLOCKS * LARGE, ranks);
    CHECK(same.shared == one.shared && same.own == 0);
  }
  for (double nodes = 1e3; nodes < 1e9; nodes *= 10) {
    flesh_levels before = flesh_levels_for(nodes, BLOCKS * nodes, 1);
    for (int ranks = 2; ranks <= 4096; ranks *= 2) {
      const flesh_levels now = flesh_levels_for(nodes, BLOCKS * nodes, ranks);
      const flesh_levels weak = flesh_levels_for(nodes * ranks, BLOCKS * nodes * ranks, ranks);
      const double each = nodes * 6 / ranks; /* tets */
      CHECK(now.shared <= before.shared);
      CHECK((now.own > 0) == (now.shared < flesh_levels_for(nodes, BLOCKS * nodes, 1).shared));
      CHECK(now.own == 0 || now.own >= 50);
      if (each < 1e5) CHECK(now.shared <= 1600);
      if (nodes >= 1e4) CHECK(weak.shared <= fmax(1600, 42 * pow(nodes, 0.36)));
      before = now;
    }
  }
  /* Ten-node tets have longer rows, which makes everything else more expensive. */
  CHECK(flesh_levels_for(1e7, 14e7, 4096).shared > flesh_levels_for(1e7, 8e7, 4096).shared);
}

/* An archive of a preconditioner contains the numbers of its set-up: the same bytes, whatever the memory contained
 * before. */
static void saved_bytes_are_those_of_the_set_up(void)
{
  test_body b;
  make(test_box(6, 3, 2, 3, 1, 0.5), FLESH_ENERGY_E, 0.49, &b); /* arrays filled by malloc */
  flesh_block_matrix *A = bar_matrix(&b, 0, 0, 0);
  for (int k = 0; k < KINDS; k++) {
    flesh_archive archives[2];
    for (int fill = 0; fill < 2; fill++) {
#ifdef M_PERTURB
      mallopt(M_PERTURB, fill ? 0x5a : 0xa5);
#endif
      flesh_preconditioner_data *preconditioner = NULL;
      CHECK_OK(linear->preconditioner_create(kinds[k], A, flesh_mesh_positions(b.mesh), 1, NULL, &preconditioner));
      CHECK_OK(linear->preconditioner_setup(preconditioner, A, NULL));
      flesh_archive measured = {0};
      linear->preconditioner_archive(preconditioner, &measured);
      archives[fill] = (flesh_archive){.mode = FLESH_ARCHIVE_SAVE, .data = malloc(measured.at), .size = measured.at};
      linear->preconditioner_archive(preconditioner, &archives[fill]);
      linear->preconditioner_destroy(&preconditioner);
    }
    CHECK(archives[0].size == archives[1].size && !memcmp(archives[0].data, archives[1].data, archives[0].size));
    for (int fill = 0; fill < 2; fill++) free(archives[fill].data);
  }
#ifdef M_PERTURB
  mallopt(M_PERTURB, 0);
#endif
  flesh_block_matrix_destroy(&A);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(preconditioners_are_definite),
                   TEST(incomplete_cholesky_leaves_fixed_components_alone),
                   TEST(incomplete_cholesky_is_exact_on_the_pattern), TEST(conjugate_gradients),
                   TEST(conjugate_gradients_in_single_precision),
                   TEST(ranks_share_what_they_can_factor), TEST(saved_bytes_are_those_of_the_set_up));
}
