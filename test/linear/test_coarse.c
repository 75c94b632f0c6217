// TEST quick each_set
/* test_coarse.c: the coarse level solves exactly within its space, and keeps the number of iterations from growing with
 * the mesh. */
#include "linear/coarse.c"
#include "linear/coarse_cholesky.c"
#include "linear/coarse_team.c"

#include "body.h"
#include "linear/block_matrix.h"
#include "linear/linear.h"
#include "system/layout.h"
#include "test.h"

/* The linear solver of the instruction set that this test is compiled for. */
static const flesh_linear *const linear = &FLESH_OF_ISA(flesh_linear);

/* Makes the stiffness plus `inertia` times the mass at a disturbed state, with the face x = 0 held if `fixed` is not
 * NULL. */
static flesh_block_matrix *matrix_of(test_body *b, double inertia, uint8_t *fixed)
{
  flesh_block_matrix *A = NULL;
  double *x = malloc((size_t)b->n * sizeof *x);
  memcpy(x, b->state.x, (size_t)b->n * sizeof *x);
  test_jitter(b->n, 1e-4, 5, x);
  flesh_point point = flesh_point_at(0, x, b->state.v, b->state.v);
  CHECK_OK(flesh_system_matrix_create(b->system, &A));
  CHECK_OK(flesh_system_jacobian(b->system, &point, &(flesh_shift){1, 0, inertia, 1}, A));
  for (int d = 0; fixed && d < b->n; d++) fixed[d] = flesh_mesh_positions(b->mesh)[d - d % 3] == 0;
  if (fixed) flesh_block_fix(A, fixed, 1e4, NULL);
  free(x);
  return A;
}

static void make(flesh_mesh *mesh, double poisson, test_body *b)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, poisson, &material));
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_LUMPED, 1, b));
  CHECK_OK(flesh_system_finalize(b->system));
}

/* Any scales will do: the result does not depend on them. */
static const double MATRIX_SCALE = 0x1p-9, VECTOR_SCALE = 0x1p-4;

/* Computes z = P (P^T A P)^-1 P^T r. */
static void apply(flesh_coarse *coarse, const flesh_bisection *bisection, const double *r, double *z)
{
  const int rows = bisection->begin[3];
  float *lanes = aligned_alloc(32, (size_t)rows * 8 * sizeof *lanes), *out = lanes + 4 * rows;
  memset(lanes, 0, (size_t)rows * 8 * sizeof *lanes);
  for (int p = 0; p < rows; p++)
    for (int c = 0; c < 3; c++) lanes[4 * p + c] = (float)(VECTOR_SCALE * r[3 * bisection->order[p] + c]);
  flesh_coarse_restrict(coarse, 1, rows / 4, rows, lanes);
  flesh_coarse_restrict(coarse, 0, 0, rows / 4, lanes);
  const float share = 0.5;
  const double product = flesh_coarse_solve(coarse) * (double)share;
  flesh_coarse_add(coarse, rows / 3, rows, share, out + 4 * (rows / 3), out + 4 * (rows / 3));
  flesh_coarse_add(coarse, 0, rows / 3, share, out, out);
  double expected = 0;
  for (int d = 0; d < 4 * rows; d++) expected += d % 4 < 3 ? (double)lanes[d] * (double)out[d] : 0;
  CHECK_NEAR(product, expected, 1e-5 * fabs(expected));
  const double back = MATRIX_SCALE / (VECTOR_SCALE * (double)share);
  for (int p = 0; p < rows; p++)
    for (int c = 0; c < 3; c++) z[3 * bisection->order[p] + c] = back * (double)out[4 * p + c];
  free(lanes);
}

/* Whether the coarse solve finds u, zero at the `fixed` dofs (NULL: none), from r = A u with at most this many
 * vertices. */
static void find(const test_body *b, const flesh_block_matrix *A, int vertices, const uint8_t *fixed, const double *u)
{
  double *r = malloc((size_t)b->n * sizeof *r), *z = malloc((size_t)b->n * sizeof *z);
  flesh_coarse *coarse = NULL;
  flesh_bisection bisection;
  flesh_block_multiply(A, u, r);
  CHECK_OK(flesh_bisection_create(A, NULL, &bisection));
  CHECK_OK(flesh_coarse_create(A, flesh_mesh_positions(b->mesh), vertices, &bisection, NULL, NULL, &coarse));
  CHECK_OK(flesh_coarse_setup(coarse, A, MATRIX_SCALE, fixed));
  apply(coarse, &bisection, r, z);
  CHECK_BELOW(test_distance(b->n, z, u), 1e-5 * test_norm(b->n, u)); /* in single precision */
  flesh_coarse_destroy(&coarse);
  CHECK(coarse == NULL);
  flesh_bisection_clear(&bisection);
  free(r);
  free(z);
}

/* u = B X + t on the free dofs is in the space of any grid, and a trilinear u is in that of a single cell. */
static void affine_displacements_are_found(void)
{
  static const int vertices[] = {1, 8, 12, 20, 60};
  test_body b;
  make(test_box(6, 3, 2, 3, 1.5, 1), 0.45, &b);
  const double *X = flesh_mesh_positions(b.mesh);
  double *u = malloc((size_t)b.n * sizeof *u);
  uint8_t *fixed = calloc((size_t)b.n, 1);
  for (int held = 0; held < 2; held++) {
    flesh_block_matrix *A = matrix_of(&b, 100, held ? fixed : NULL);
    const double B[9] = {0.3, -0.2, 0.7, 0.1, 0.5, -0.4, 0.9, 0.2, -0.6};
    for (int curved = 0; curved < 2; curved++) {
      for (int d = 0; d < b.n; d++) {
        const double *at = X + d - d % 3, *row = B + 3 * (d % 3);
        u[d] = fixed[d] ? 0 : 0.1 * (1 + d % 3) + row[0] * at[0] + row[1] * at[1] + row[2] * at[2];
        if (curved && !fixed[d])
          u[d] += row[1] * at[0] * at[1] + row[2] * at[1] * at[2] + row[0] * at[0] * at[1] * at[2];
      }
      for (size_t k = 0; k < (curved ? 2 : sizeof vertices / sizeof vertices[0]); k++)
        find(&b, A, vertices[k], held ? fixed : NULL, u);
    }
    flesh_block_matrix_destroy(&A);
  }
  free(u);
  free(fixed);
  test_body_destroy(&b);
}

/* A fork with two prongs, between x = 0 and 1 and between 2 and 3, from z = 1 to 4. */
static void make_fork(test_body *b)
{
  flesh_mesh *block = test_box(6, 2, 8, 3, 1, 4), *fork = NULL;
  const int tets = flesh_mesh_tet_count(block), nodes = flesh_mesh_node_count(block), *corners = flesh_mesh_tets(block);
  const double *X = flesh_mesh_positions(block);
  int *kept = malloc(4 * (size_t)tets * sizeof *kept), *number = malloc((size_t)nodes * sizeof *number);
  int count = 0, used = 0;
  double *x = malloc(3 * (size_t)nodes * sizeof *x);
  for (int i = 0; i < nodes; i++) number[i] = -1;
  for (int t = 0; t < tets; t++) {
    double middle[3] = {0};
    for (int a = 0; a < 4; a++)
      for (int c = 0; c < 3; c++) middle[c] += X[3 * corners[4 * t + a] + c] / 4;
    if (middle[0] > 1 && middle[0] < 2 && middle[2] > 1) continue;
    for (int a = 0; a < 4; a++) {
      const int i = corners[4 * t + a];
      if (number[i] < 0) {
        memcpy(x + 3 * (size_t)used, X + 3 * (size_t)i, 3 * sizeof *x);
        number[i] = used++;
      }
      kept[4 * count + a] = number[i];
    }
    count++;
  }
  CHECK_OK(flesh_mesh_create(used, x, count, kept, NULL, &fork));
  flesh_mesh_destroy(&block);
  make(fork, 0.45, b);
  free(x);
  free(kept);
  free(number);
}

/* The prongs of the fork move apart, independently of each other. */
static double *move_prongs(const test_body *b)
{
  const double *X = flesh_mesh_positions(b->mesh);
  double *u = calloc((size_t)b->n, sizeof *u);
  for (int i = 0; i < b->n; i += 3) u[i] = (X[i] < 1.5 ? -1 : 1) * fmax(X[i + 2] - 2, 0);
  return u;
}

/* Although they are in the same cells. */
static void unconnected_parts_move_by_themselves(void)
{
  test_body b;
  make_fork(&b);
  flesh_block_matrix *A = matrix_of(&b, 100, NULL);
  double *u = move_prongs(&b);
  find(&b, A, 12, NULL, u); /* two cells, from 0 to 2 and to 4 */
  flesh_block_matrix_destroy(&A);
  free(u);
  test_body_destroy(&b);
}

/* Prongs that have come near each other have common blocks, and still move independently: touching bodies can slide and
 * separate. */
static void parts_that_touch_move_by_themselves(void)
{
  test_body b;
  make_fork(&b);
  const double *X = flesh_mesh_positions(b.mesh);
  int pairs[2 * 64], count = 0;
  for (int i = 0; i < b.n / 3; i++)
    for (int j = i + 1; j < b.n / 3; j++)
      if (fabs(X[3 * i] - 1) < 0.1 && fabs(X[3 * j] - 2) < 0.1 && X[3 * i + 1] == X[3 * j + 1] &&
          X[3 * i + 2] == X[3 * j + 2] && X[3 * i + 2] > 1 && count < 64)
        pairs[2 * count] = i, pairs[2 * count++ + 1] = j;
  CHECK(count >= 12);
  const flesh_cells cells = {.count = count, .nodes_per_cell = 2, .nodes = pairs}, *all = &cells;
  flesh_layout layout;
  CHECK_OK(flesh_layout_create(b.system, 1, &all, &layout));
  const size_t blocks = (size_t)layout.pattern.row_start[layout.pattern.rows];
  flesh_block_matrix A = flesh_pattern_matrix(&layout.pattern, calloc(9 * blocks + 1, sizeof(double)));
  A.layout = &layout;
  A.own = layout.own;
  const flesh_point point = flesh_point_at(0, X, b.state.v, b.state.v);
  CHECK_OK(flesh_system_jacobian(b.system, &point, &(flesh_shift){1, 0, 100, 1}, &A));
  for (int k = 0; k < count; k++) { /* tied by springs along y, along which they cannot separate */
    const int i = pairs[2 * k], j = pairs[2 * k + 1];
    A.values[9 * (size_t)A.row_start[i] + 4] += 1e4;
    A.values[9 * (size_t)A.row_start[j] + 4] += 1e4;
    A.values[9 * (size_t)flesh_block_find(&A, i, j) + 4] -= 1e4;
  }
  double *u = move_prongs(&b);
  find(&b, &A, 12, NULL, u);
  free(A.values);
  flesh_layout_clear(&layout);
  free(u);
  test_body_destroy(&b);
}

/* Thousands of tets that do not touch each other do not get eight vertices each. */
static void crumbs_share_vertices(void)
{
  enum { SIDE = 14, TETS = SIDE * SIDE * SIDE };
  static double X[12 * TETS];
  static int corners[4 * TETS];
  test_body b;
  flesh_mesh *mesh = NULL;
  for (int t = 0; t < TETS; t++)
    for (int a = 0; a < 4; a++) {
      const int at[3] = {t % SIDE, t / SIDE % SIDE, t / SIDE / SIDE};
      for (int c = 0; c < 3; c++) X[12 * t + 3 * a + c] = at[c] + 0.5 * (a == c + 1);
      corners[4 * t + a] = 4 * t + a;
    }
  CHECK_OK(flesh_mesh_create(4 * TETS, X, TETS, corners, NULL, &mesh));
  make(mesh, 0.45, &b);
  flesh_block_matrix *A = matrix_of(&b, 100, NULL);
  double *u = calloc((size_t)b.n, sizeof *u);
  for (int d = 0; d < b.n; d++) u[d] = 1 + d % 3 + X[d - d % 3 + (d + 1) % 3];
  find(&b, A, 200, NULL, u);
  flesh_coarse *coarse = NULL;
  flesh_bisection bisection;
  CHECK_OK(flesh_bisection_create(A, NULL, &bisection));
  flesh_reserve *reserve = flesh_reserve_create((size_t)1 << 30);
  flesh_reserve_enter(reserve);
  CHECK_OK(flesh_coarse_create(A, X, 200, &bisection, NULL, NULL, &coarse));
  CHECK_BELOW((double)flesh_reserve_most(reserve), 1000. * b.n);
  flesh_coarse_destroy(&coarse);
  flesh_reserve_enter(NULL);
  flesh_reserve_destroy(&reserve);
  flesh_bisection_clear(&bisection);
  flesh_block_matrix_destroy(&A);
  free(u);
  test_body_destroy(&b);
}

/* Cells with few nodes have too many vertices, most of them without stiffness. */
static void cells_may_have_single_nodes(void)
{
  test_body b;
  make(test_box(1, 1, 1, 1, 1, 1), 0.3, &b);
  flesh_block_matrix *A = matrix_of(&b, 1, NULL);
  double u[24];
  for (int d = 0; d < 24; d++) u[d] = sin(1 + d); /* the space contains everything */
  find(&b, A, 8, NULL, u);
  find(&b, A, 100, NULL, u);
  for (int k = 0; k < 9; k++) A->values[k] = -A->values[k];
  flesh_coarse *coarse = NULL;
  flesh_bisection bisection;
  CHECK_OK(flesh_bisection_create(A, NULL, &bisection));
  CHECK_OK(flesh_coarse_create(A, flesh_mesh_positions(b.mesh), 8, &bisection, NULL, NULL, &coarse));
  CHECK(flesh_coarse_setup(coarse, A, MATRIX_SCALE, NULL) == FLESH_NOT_POSITIVE);
  flesh_bisection_clear(&bisection);
  flesh_coarse_destroy(&coarse);
  flesh_coarse_destroy(&coarse);
  flesh_block_matrix_destroy(&A);
  test_body_destroy(&b);
}

/* Returns the iterations to 1e-6 in statics under a load along y, and the bits of the solution. Takes the box. */
static int iterations(flesh_mesh *box, double poisson, flesh_preconditioner kind, int threads, double *sum)
{
  test_body b;
  make(box, poisson, &b);
  uint8_t *fixed = calloc((size_t)b.n, 1);
  flesh_block_matrix *A = matrix_of(&b, 0, fixed);
  double *right = calloc((size_t)b.n, sizeof *right), *x = malloc((size_t)b.n * sizeof *x);
  for (int d = 1; d < b.n; d += 3) right[d] = fixed[d] ? 0 : 1;
  flesh_threads *pool = NULL;
  flesh_preconditioner_data *preconditioner = NULL;
  flesh_pcg_space *space = NULL;
  flesh_pcg_result result;
  CHECK_OK(flesh_threads_create(threads, &pool));
  CHECK_OK(linear->preconditioner_create(kind, A, flesh_mesh_positions(b.mesh), 1, pool, &preconditioner));
  CHECK_OK(linear->preconditioner_setup(preconditioner, A, fixed));
  CHECK_OK(linear->pcg_space_create(A, 0, pool, &space));
  const flesh_pcg_request request = {.A = A, .preconditioner = preconditioner, .b = right,
                                     .tolerance = 1e-6 * test_norm(b.n, right), .max_iterations = 2000};
  CHECK_OK(linear->pcg(space, &request, x, &result));
  *sum = test_norm(b.n, x);
  linear->pcg_space_destroy(&space);
  linear->preconditioner_destroy(&preconditioner);
  flesh_threads_destroy(&pool);
  flesh_block_matrix_destroy(&A);
  free(right);
  free(x);
  free(fixed);
  test_body_destroy(&b);
  return result.iterations;
}

static flesh_mesh *bar(int cells) { return test_box(3 * cells, cells, cells, 3, 1, 1); }

/* Makes the bar with reversed node numbers, mirrored by y, or both. */
static flesh_mesh *other_bar(int cells, int backwards, int mirrored)
{
  flesh_mesh *mesh = bar(cells), *other = NULL;
  const int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  double *X = malloc(3 * (size_t)nodes * sizeof *X);
  int *corners = malloc(4 * (size_t)tets * sizeof *corners);
  for (int i = 0; i < nodes; i++) {
    double *to = X + 3 * (size_t)(backwards ? nodes - 1 - i : i);
    memcpy(to, flesh_mesh_positions(mesh) + 3 * (size_t)i, 3 * sizeof *to);
    if (mirrored) to[1] = 1 - to[1];
  }
  for (int k = 0; k < 4 * tets; k++) {
    const int from = mirrored && k % 4 < 2 ? k ^ 1 : k; /* two corners exchanged: the orientation stays */
    corners[k] = backwards ? nodes - 1 - flesh_mesh_tets(mesh)[from] : flesh_mesh_tets(mesh)[from];
  }
  CHECK_OK(flesh_mesh_create(nodes, X, tets, corners, NULL, &other));
  free(X);
  free(corners);
  flesh_mesh_destroy(&mesh);
  return other;
}

/* Which of two neighbours incomplete Cholesky eliminates first depends on their numbers. */
static void iterations_hardly_depend_on_numbers(void)
{
  double sum;
  for (int k = 0; k < 3; k++) {
    const double poisson = (double[]){0.45, 0.49, 0.499}[k];
    int count[4], most = 0, fewest = 10000;
    for (int way = 0; way < 4; way++) {
      count[way] = iterations(other_bar(10, way & 1, way >> 1), poisson, FLESH_PRECONDITIONER_TWO_LEVEL, 1, &sum);
      if (count[way] > most) most = count[way];
      if (count[way] < fewest) fewest = count[way];
    }
    printf("# nu %g: %d, %d backwards, %d mirrored, %d both\n", poisson, count[0], count[1], count[2], count[3]);
    CHECK(most < 1.15 * fewest);
  }
}

static void iterations_hardly_grow(void)
{
  double sum;
  for (int k = 0; k < 2; k++) {
    double poisson = k ? 0.49 : 0.45;
    int one[2], two[2];
    for (int size = 0; size < 2; size++) {
      one[size] = iterations(bar(size ? 14 : 7), poisson, FLESH_PRECONDITIONER_IC, 1, &sum);
      two[size] = iterations(bar(size ? 14 : 7), poisson, FLESH_PRECONDITIONER_TWO_LEVEL, 1, &sum);
    }
    printf("# nu %g: IC %d and %d, two levels %d and %d iterations at 1/8 and 1 of the tets\n", poisson, one[0], one[1],
           two[0], two[1]);
    CHECK(one[1] > 1.6 * one[0]);
    CHECK(two[1] < 1.35 * two[0] && two[1] < 0.5 * one[1]);
  }
}

static void threads_give_the_same_bits(void)
{
  double one, other;
  int first = iterations(bar(6), 0.45, FLESH_PRECONDITIONER_AUTO, 1, &one);
  for (int threads = 2; threads < 5; threads++) {
    CHECK(iterations(bar(6), 0.45, FLESH_PRECONDITIONER_AUTO, threads, &other) == first);
    CHECK(memcmp(&one, &other, sizeof one) == 0);
  }
}

/* The coarse level of a slender body of ten-node tets has enough cells along it. */
static void slender_bodies_bend(void)
{
  double sum;
  flesh_mesh *straight = test_box(12, 2, 2, 12, 1, 1), *slender = NULL;
  CHECK_OK(flesh_mesh_raise_order(straight, &slender));
  flesh_mesh_destroy(&straight);
  const int count = iterations(slender, 0.45, FLESH_PRECONDITIONER_TWO_LEVEL, 1, &sum);
  printf("# a slender bar of ten-node tets: %d iterations\n", count);
  CHECK(count < 60);
}

static void the_choice_goes_by_the_size(void)
{
  CHECK(flesh_preconditioner_choose(FLESH_PRECONDITIONER_AUTO, 599, 1) == FLESH_PRECONDITIONER_IC);
  CHECK(flesh_preconditioner_choose(FLESH_PRECONDITIONER_AUTO, 600, 1) == FLESH_PRECONDITIONER_TWO_LEVEL);
  CHECK(flesh_preconditioner_choose(FLESH_PRECONDITIONER_AUTO, 399, 2) == FLESH_PRECONDITIONER_IC);
  CHECK(flesh_preconditioner_choose(FLESH_PRECONDITIONER_AUTO, 400, 2) == FLESH_PRECONDITIONER_TWO_LEVEL);
  CHECK(flesh_preconditioner_choose(FLESH_PRECONDITIONER_JACOBI, 600, 1) == FLESH_PRECONDITIONER_JACOBI);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(affine_displacements_are_found), TEST(unconnected_parts_move_by_themselves),
                   TEST(parts_that_touch_move_by_themselves), TEST(crumbs_share_vertices),
                   TEST(cells_may_have_single_nodes), TEST(iterations_hardly_grow), TEST(slender_bodies_bend),
                   TEST(iterations_hardly_depend_on_numbers), TEST_OF_THREADS(threads_give_the_same_bits),
                   TEST(the_choice_goes_by_the_size));
}
