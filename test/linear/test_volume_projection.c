// TEST quick each_set
/* test_volume_projection.c: the volume projection of nearly incompressible ten-node tets against full matrices. */
#include <gsl/gsl_eigen.h>
#include <stdlib.h>

#include "matrices.h"
#include "preconditioners.h"
#include "element/element.h"
#include "linear/linear.h"
#include "system/stiff_rows.h"
#include "test.h"

/* The linear solver of the instruction set that this test is compiled for. */
static const flesh_linear *const linear = &FLESH_OF_ISA(flesh_linear);

/* A body of tet10-mean. */
typedef struct ten {
  test_body b;
  flesh_stiff_rows rows;
  flesh_block_matrix *K;
  uint8_t *fixed; /* [n] */
} ten;

/* Takes the mesh, of order 1; makes K and the rows at x [n] (NULL: at rest) with the first nodes along x held. */
static void assemble(ten *t, const double *x, double inertia, int filter)
{
  const flesh_point point = flesh_point_at(0, x ? x : t->b.state.x, t->b.state.v, t->b.state.v);
  const flesh_shift shift = {1, 0, inertia, filter};
  CHECK_OK(flesh_system_jacobian(t->b.system, &point, &shift, t->K));
  flesh_system_stiff_values(t->b.system, &point, &shift, &t->rows);
  flesh_block_fix(t->K, t->fixed, flesh_block_mean_diagonal(t->K), NULL);
}

static void make_ten(flesh_mesh *mesh, flesh_energy energy, double poisson, ten *t)
{
  flesh_mesh *raised = NULL;
  CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
  flesh_mesh_destroy(&mesh);
  make(raised, energy, poisson, &t->b);
  CHECK_OK(flesh_system_stiff_rows_create(t->b.system, &t->rows));
  CHECK(t->rows.count == flesh_mesh_tet_count(raised));
  CHECK_OK(flesh_system_matrix_create(t->b.system, &t->K));
  t->fixed = calloc((size_t)t->b.n, 1);
  double least = INFINITY;
  for (int d = 0; d < t->b.n; d += 3) least = fmin(least, t->b.state.x[d]);
  for (int d = 0; d < t->b.n; d++) t->fixed[d] = t->b.state.x[d - d % 3] < least + 1e-9;
  assemble(t, NULL, 0, 0);
}

static void clear_ten(ten *t)
{
  free(t->fixed);
  flesh_system_stiff_rows_clear(&t->rows);
  flesh_block_matrix_destroy(&t->K);
  test_body_destroy(&t->b);
}

static flesh_preconditioner_data *projection(const ten *t, flesh_preconditioner kind, int polynomial,
                                             flesh_threads *threads)
{
  flesh_preconditioner_data *p = NULL;
  const double *X = flesh_mesh_positions(t->b.mesh);
  CHECK_OK(linear->preconditioner_create(kind, t->K, X, 1, threads, &p));
  CHECK_OK(linear->preconditioner_project(p, t->K, &t->rows, X, polynomial));
  CHECK_OK(linear->preconditioner_setup(p, t->K, t->fixed));
  return p;
}

/* Computes B^T B [n][n], without fixed dofs. */
static double *stiff_part(const ten *t)
{
  const int n = t->b.n, m = t->rows.nodes_per_row;
  double *A = calloc((size_t)n * (size_t)n, sizeof *A);
  for (int e = 0; e < t->rows.count; e++)
    for (int i = 0; i < 3 * m; i++)
      for (int j = 0; j < 3 * m; j++) {
        const int row = 3 * t->rows.nodes[m * e + i / 3] + i % 3, column = 3 * t->rows.nodes[m * e + j / 3] + j % 3;
        const float *b = t->rows.values + 3 * (size_t)m * (size_t)e;
        if (!t->fixed[row] && !t->fixed[column]) A[n * row + column] += (double)b[i] * (double)b[j];
      }
  return A;
}

/* Without its rows a matrix is that of the same form with a lower bulk modulus: at rest, and for a body that is rotated
 * and stretched at constant volume. */
static void rows_are_what_is_stiffer(void)
{
  static const double F[2][9] = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, -1.6, 0, 1.25, 0.3, 0, 0, 0.2, 0.5}};
  for (int energy = 0; energy < 2; energy++)
    for (int state = 0; state < 2; state++) {
      ten t;
      make_ten(test_box(2, 1, 1, 2, 1, 1), energy ? FLESH_ENERGY_E : FLESH_ENERGY_S, 0.499, &t);
      const int n = t.b.n;
      double *x = malloc((size_t)n * sizeof *x);
      for (int d = 0; d < n; d++) {
        const double *X = t.b.state.x + d - d % 3, *row = F[state] + 3 * (d % 3);
        x[d] = row[0] * X[0] + row[1] * X[1] + row[2] * X[2];
      }
      assemble(&t, x, 0, 0);
      double *stiff = test_dense(t.K), *part = stiff_part(&t);
      flesh_volume_share share;
      CHECK_OK(flesh_volume_share_of(&t.b.material, &share));
      CHECK(t.rows.ratio > 50 && t.rows.ratio < 100);
      flesh_effect *effect = NULL;
      flesh_system *system = NULL;
      flesh_block_matrix *K = NULL;
      CHECK_OK(flesh_system_create(t.b.mesh, &system));
      flesh_material material;
      CHECK_OK(flesh_material_from_lame(t.b.material.energy, FLESH_CONSTANTS_RAW, t.b.material.mu,
                                        t.b.material.lambda - share.share + share.moderate, &material));
      flesh_body body = t.b.body;
      body.materials = &material;
      CHECK_OK(flesh_effect_elasticity(&body, &effect));
      CHECK_OK(flesh_system_add_effect(system, &effect));
      CHECK_OK(flesh_system_finalize(system));
      CHECK_OK(flesh_system_matrix_create(system, &K));
      const flesh_point point = flesh_point_at(0, x, t.b.state.v, t.b.state.v);
      CHECK_OK(flesh_system_jacobian(system, &point, &(flesh_shift){.x = 1}, K));
      double *soft = test_dense(K), off = 0, size = 0;
      for (int k = 0; k < n * n; k++) {
        if (t.fixed[k / n] || t.fixed[k % n]) continue;
        off = fmax(off, fabs(stiff[k] - part[k] - soft[k]));
        size = fmax(size, fabs(soft[k]));
      }
      printf("# state %d: off by %.2g of %.2g\n", state, off, size);
      CHECK_BELOW(off, 2e-5 * size); /* rows are in single precision */
      flesh_block_matrix_destroy(&K);
      flesh_system_destroy(&system);
      free(soft);
      free(stiff);
      free(part);
      free(x);
      clear_ten(&t);
    }
}

/* Finds the least and the largest eigenvalue of P A for symmetric positive definite A and P. */
static void eigenvalues(int n, const double *P, const double *A, double ends[2])
{
  gsl_matrix *a = gsl_matrix_alloc((size_t)n, (size_t)n), *b = gsl_matrix_alloc((size_t)n, (size_t)n);
  gsl_vector *values = gsl_vector_alloc((size_t)n);
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) {
      gsl_matrix_set(a, (size_t)i, (size_t)j, A[i * n + j]);
      gsl_matrix_set(b, (size_t)i, (size_t)j, 0.5 * (P[i * n + j] + P[j * n + i]));
    }
  gsl_matrix *inverse = gsl_matrix_alloc((size_t)n, (size_t)n);
  /* A x = k P^-1 x */
  gsl_linalg_cholesky_decomp1(b);
  gsl_matrix_memcpy(inverse, b);
  gsl_linalg_cholesky_invert(inverse);
  gsl_eigen_gensymm_workspace *work = gsl_eigen_gensymm_alloc((size_t)n);
  gsl_eigen_gensymm(a, inverse, values, work);
  ends[0] = gsl_vector_min(values);
  ends[1] = gsl_vector_max(values);
  gsl_eigen_gensymm_free(work);
  gsl_matrix_free(inverse);
  gsl_vector_free(values);
  gsl_matrix_free(a);
  gsl_matrix_free(b);
}

/* States that occur in solves: at rest, pulled, pressed flat, turned inside out, and with random nodes. */
enum { STATES = 5 };
static void deform(const ten *t, int state, double *x)
{
  static const double diagonal[STATES][3] = {{1, 1, 1}, {3, 0.6, 0.6}, {1, 1, 0.05}, {-1, 1, 1}, {1, 1, 1}};
  for (int d = 0; d < t->b.n; d++) x[d] = diagonal[state][d % 3] * t->b.state.x[d];
  test_jitter(t->b.n, state == STATES - 1 ? 0.4 : 0.01, 3, x);
}

static void check_definite_anywhere(int polynomial)
{
  ten t;
  make_ten(test_box(3, 1, 1, 3, 1, 1), FLESH_ENERGY_S, 0.499, &t);
  const int n = t.b.n;
  double *x = malloc((size_t)n * sizeof *x);
  flesh_preconditioner_data *p = projection(&t, FLESH_PRECONDITIONER_TWO_LEVEL, polynomial, NULL);
  for (int state = 0; state < STATES; state++)
    for (int filter = 0; filter < 2; filter++) { /* without it most are indefinite */
      deform(&t, state, x);
      assemble(&t, x, 0, filter);
      CHECK_OK(linear->preconditioner_setup(p, t.K, t.fixed));
      double *P = applied(linear, p, n);
      check_definite(n, P, 1e-5);
      free(P);
    }
  t.K->values[0] = NAN;
  CHECK(linear->preconditioner_setup(p, t.K, t.fixed) == FLESH_NONFINITE);
  linear->preconditioner_destroy(&p);
  free(x);
  clear_ten(&t);
}

static void it_is_definite_anywhere(void) { check_definite_anywhere(0); }

static void it_is_definite_with_polynomials(void) { check_definite_anywhere(1); }

/* Condition numbers of the preconditioned matrix stay constant as nu goes to 1/2, and a solve agrees with LU. */
static void check_conditions(int polynomial)
{
  static const double poisson[] = {0.49, 0.499, 0.4999, 0.49999};
  double first = 0;
  for (int k = 0; k < 4; k++) {
    ten t;
    make_ten(test_box(3, 1, 1, 3, 1, 1), FLESH_ENERGY_S, poisson[k], &t);
    const int n = t.b.n;
    flesh_preconditioner_data *p = projection(&t, FLESH_PRECONDITIONER_IC, polynomial, NULL);
    double *P = applied(linear, p, n), *dense = test_dense(t.K), ends[2], *right = malloc((size_t)n * sizeof *right),
           *x = malloc((size_t)n * sizeof *x);
    eigenvalues(n, P, dense, ends);
    printf("# nu %g: eigenvalues %.3g to %.3g\n", poisson[k], ends[0], ends[1]);
    if (!k) first = ends[1] / ends[0];
    CHECK_BELOW(ends[1] / ends[0], 1.5 * first);
    CHECK_BELOW(ends[1] / ends[0], 300);
    flesh_pcg_space *space = NULL;
    flesh_pcg_result result;
    CHECK_OK(linear->pcg_space_create(t.K, 0, NULL, &space));
    randomise(n, right);
    const flesh_pcg_request request = {.A = t.K, .preconditioner = p, .b = right,
                                       .tolerance = 1e-12 * test_norm(n, right), .max_iterations = 500};
    CHECK_OK(linear->pcg(space, &request, x, &result));
    double *expected = solve_by_gsl(n, dense, right);
    CHECK_BELOW(test_distance(n, x, expected), 1e-7 * test_norm(n, expected));
    linear->pcg_space_destroy(&space);
    linear->preconditioner_destroy(&p);
    free(P);
    free(dense);
    free(expected);
    free(right);
    free(x);
    clear_ten(&t);
  }
}

static void condition_does_not_feel_nu(void) { check_conditions(0); }

static void condition_with_polynomials(void) { check_conditions(1); }

/* Moves the corners of a box: to Cook's membrane (48 m long, 44 and 16 m high), or by a random part of a cell. */
static flesh_mesh *shaped(int shape)
{
  flesh_mesh *box = shape == 1 ? test_box(8, 8, 2, 1, 1, 1) : test_box(12, 3, 3, 4, 1, 1), *mesh = NULL;
  const int nodes = flesh_mesh_node_count(box);
  double *x = malloc(3 * (size_t)nodes * sizeof *x);
  memcpy(x, flesh_mesh_positions(box), 3 * (size_t)nodes * sizeof *x);
  if (shape == 2) test_jitter(3 * nodes, 0.1, 9, x);
  for (int i = 0; i < nodes && shape == 1; i++) {
    double *y = x + 3 * i;
    y[1] = 44 * y[0] + y[1] * (44 - 28 * y[0]);
    y[0] *= 48;
    y[2] *= 10;
  }
  for (int i = 0; i < nodes && shape == 2; i++)
    if (flesh_mesh_positions(box)[3 * i] == 0) x[3 * i] = 0;
  CHECK_OK(flesh_mesh_create(nodes, x, flesh_mesh_tet_count(box), flesh_mesh_tets(box), NULL, &mesh));
  flesh_mesh_destroy(&box);
  free(x);
  return mesh;
}

/* Returns the iterations to a thousandth of the body's weight, or to 1e-6 of it in motion. */
enum { AS_IT_IS, EXACTLY, BY_POLYNOMIALS };
static int solve_once(ten *t, int project, double inertia, int state, int filter)
{
  const int n = t->b.n;
  double *x = malloc((size_t)n * sizeof *x), *right = calloc((size_t)n, sizeof *right);
  if (state) deform(t, state, x);
  else memcpy(x, t->b.state.x, (size_t)n * sizeof *x);
  assemble(t, x, inertia, filter);
  flesh_preconditioner_data *p = NULL;
  if (project) p = projection(t, FLESH_PRECONDITIONER_AUTO, project == BY_POLYNOMIALS, NULL);
  else CHECK_OK(linear->preconditioner_create(FLESH_PRECONDITIONER_AUTO, t->K, flesh_mesh_positions(t->b.mesh), 1, NULL,
                                               &p));
  if (!project) CHECK_OK(linear->preconditioner_setup(p, t->K, t->fixed));
  flesh_pcg_space *space = NULL;
  flesh_pcg_result result;
  CHECK_OK(linear->pcg_space_create(t->K, 0, NULL, &space));
  for (int d = 1; d < n; d += 3) right[d] = t->fixed[d] ? 0 : 1;
  const flesh_pcg_request request = {.A = t->K, .preconditioner = p, .b = right,
                                     .tolerance = 1e-3 * test_norm(n, right), .max_iterations = 20000};
  CHECK_OK(linear->pcg(space, &request, x, &result));
  linear->pcg_space_destroy(&space);
  linear->preconditioner_destroy(&p);
  free(right);
  free(x);
  return result.iterations;
}

static void iterations_do_not_feel_nu(void)
{
  static const char *const names[] = {"bar", "Cook", "irregular"};
  static const double poisson[] = {0.49, 0.499, 0.4999};
  for (int shape = 0; shape < TEST_FEWER(3, 1); shape++)
    for (int moves = 0; moves < 2; moves++) {
      int iterations[3], nearly[3];
      for (int k = 0; k < 3; k++) {
        ten t;
        make_ten(shaped(shape), FLESH_ENERGY_S, poisson[k], &t);
        iterations[k] = solve_once(&t, EXACTLY, moves ? 3600 : 0, 0, 0);
        nearly[k] = solve_once(&t, BY_POLYNOMIALS, moves ? 3600 : 0, 0, 0);
        clear_ten(&t);
      }
      printf("# %s, %s: %d, %d, %d; by polynomials %d, %d, %d\n", names[shape], moves ? "in motion" : "at rest",
             iterations[0], iterations[1], iterations[2], nearly[0], nearly[1], nearly[2]);
      for (int k = 0; k < 3; k++) CHECK_BELOW(nearly[k], 1.25 * iterations[k] + 2);
      CHECK_BELOW(iterations[2], 1.5 * iterations[0]);
      CHECK_BELOW(iterations[2], moves ? 15 : 60);
    }
}

/* In states far from rest, with projected Hessians, pressures also stiffen the matrix and are not projected out: the
 * projection does no harm there. */
static void iterations_in_hard_states(void)
{
  ten t;
  make_ten(test_box(12, 3, 3, 4, 1, 1), FLESH_ENERGY_S, 0.4999, &t);
  for (int state = 0; state < TEST_FEWER(STATES, 2); state++)
    for (int moves = 0; moves < 2; moves++) {
      int iterations[3];
      for (int k = 0; k < 3; k++) iterations[k] = solve_once(&t, k, moves ? 3600 : 0, state, 1);
      printf("# state %d, %s: %d iterations, %d with the projection, %d by polynomials\n", state,
             moves ? "in motion" : "at rest", iterations[AS_IT_IS], iterations[EXACTLY], iterations[BY_POLYNOMIALS]);
      CHECK_BELOW(iterations[BY_POLYNOMIALS], 1.25 * iterations[EXACTLY] + 2);
      CHECK_BELOW(iterations[1], state ? 2 * iterations[0] + 10 : iterations[0] / 10);
      CHECK_BELOW(iterations[1], 250);
    }
  clear_ten(&t);
}

static void check_threads(int polynomial)
{
  ten t;
  make_ten(test_box(12, 4, 4, 3, 1, 1), FLESH_ENERGY_S, 0.499, &t);
  const size_t bytes = (size_t)t.b.n * sizeof(double);
  double *r = malloc(bytes), *z[2] = {malloc(bytes), malloc(bytes)};
  randomise(t.b.n, r);
  for (int count = 1; count <= 3; count++) {
    flesh_threads *threads = NULL;
    CHECK_OK(flesh_threads_create(count, &threads));
    flesh_preconditioner_data *p = projection(&t, FLESH_PRECONDITIONER_TWO_LEVEL, polynomial, threads);
    for (int round = 0; round < 20; round++) {
      linear->preconditioner_apply(p, r, z[count > 1 || round]);
      CHECK(!(count > 1 || round) || !memcmp(z[0], z[1], bytes));
    }
    linear->preconditioner_destroy(&p);
    flesh_threads_destroy(&threads);
  }
  free(r);
  free(z[0]);
  free(z[1]);
  clear_ten(&t);
}

static void threads_give_the_same_bits(void)
{
  check_threads(0);
  check_threads(1);
}

/* A set-up is restored from bytes into a preconditioner of another state. */
static void set_ups_are_saved_and_loaded(void)
{
  ten t;
  make_ten(test_box(6, 2, 2, 3, 1, 1), FLESH_ENERGY_S, 0.499, &t);
  const size_t bytes = (size_t)t.b.n * sizeof(double);
  double *x = malloc(bytes), *r = malloc(bytes), *z[3] = {malloc(bytes), malloc(bytes), malloc(bytes)};
  randomise(t.b.n, r);
  for (int polynomial = 0; polynomial < 2; polynomial++) {
    flesh_archive archive = {0};
    assemble(&t, NULL, 0, 0);
    flesh_preconditioner_data *p = projection(&t, FLESH_PRECONDITIONER_TWO_LEVEL, polynomial, NULL);
    linear->preconditioner_apply(p, r, z[0]);
    linear->preconditioner_archive(p, &archive);
    archive = (flesh_archive){.mode = FLESH_ARCHIVE_SAVE, .data = malloc(archive.at), .size = archive.at};
    linear->preconditioner_archive(p, &archive);
    deform(&t, 1, x);
    assemble(&t, x, 0, 1);
    CHECK_OK(linear->preconditioner_setup(p, t.K, t.fixed));
    linear->preconditioner_apply(p, r, z[1]);
    archive.mode = FLESH_ARCHIVE_LOAD, archive.at = 0;
    linear->preconditioner_archive(p, &archive);
    linear->preconditioner_apply(p, r, z[2]);
    CHECK(!archive.wrong && memcmp(z[0], z[1], bytes) && !memcmp(z[0], z[2], bytes));
    free(archive.data);
    linear->preconditioner_destroy(&p);
  }
  for (int k = 0; k < 3; k++) free(z[k]);
  free(r);
  free(x);
  clear_ten(&t);
}

static void kinds_that_project(void)
{
  flesh_stiff_rows rows = {.count = 1, .ratio = 1, .modulus = 1e5};
  CHECK(!flesh_preconditioner_projects(FLESH_PRECONDITIONER_AUTO, &rows, 0));
  CHECK(flesh_preconditioner_projects(FLESH_PRECONDITIONER_VOLUME_PROJECTION, &rows, 0));
  rows.ratio = 6; /* pays at rest, and for steps so long that inertia is negligible */
  CHECK(flesh_preconditioner_projects(FLESH_PRECONDITIONER_AUTO, &rows, 0));
  CHECK(flesh_preconditioner_projects(FLESH_PRECONDITIONER_AUTO, &rows, 1e-6 * rows.modulus));
  CHECK(!flesh_preconditioner_projects(FLESH_PRECONDITIONER_AUTO, &rows, 0.1 * rows.modulus));
  rows.ratio = 100;
  CHECK(flesh_preconditioner_projects(FLESH_PRECONDITIONER_AUTO, &rows, 0.1 * rows.modulus));
  CHECK(!flesh_preconditioner_projects(FLESH_PRECONDITIONER_TWO_LEVEL, &rows, 0));
  rows.count = 0;
  CHECK(!flesh_preconditioner_projects(FLESH_PRECONDITIONER_VOLUME_PROJECTION, &rows, 0));
  rows = (flesh_stiff_rows){.count = 10000, .ratio = 6}; /* polynomials pay for many rows, the more the stiffer */
  CHECK(!flesh_preconditioner_takes_polynomials(&rows));
  rows.count = 20000;
  CHECK(flesh_preconditioner_takes_polynomials(&rows));
  rows.ratio = 700;
  CHECK(!flesh_preconditioner_takes_polynomials(&rows));
  rows.count = 200000;
  CHECK(flesh_preconditioner_takes_polynomials(&rows));
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(rows_are_what_is_stiffer), TEST(kinds_that_project), TEST(set_ups_are_saved_and_loaded),
                   TEST(it_is_definite_with_polynomials), TEST(condition_with_polynomials),
                   TEST(it_is_definite_anywhere), TEST(condition_does_not_feel_nu), TEST(iterations_do_not_feel_nu),
                   TEST(iterations_in_hard_states), TEST_OF_THREADS(threads_give_the_same_bits));
}
