// TEST full memory needs=ranks ranks=1,2,3,5
/* test_shared_volume.c: the volume projection of nearly incompressible ten-node tets with rows on several ranks,
 * against one rank: corrections of the rows, iterations of solves, equilibria and motions. */
#include "ranks.h"

#include "body.h"
#include "linear/block_matrix.h"
#include "linear/linear.h"
#include "system/stiff_rows.h"

/* A whole body of ten-node tets, which every rank has, and this rank's part of it. */
typedef struct bodies {
  flesh_mesh *mesh;
  flesh_rank_part *part;
  test_body both[2];
} bodies;

enum { WHOLE, PART };

/* Whether a tet of two bars has four nodes, and thus no row: those of the second bar, beside the first. */
static int is_linear(const double *X, const int *corners) { return X[3 * corners[0] + 1] > 0.3; }

/* Gives the last rank the second of two bars, and so no rows; the others share the first. Every rank has some of its
 * mid-edge nodes as ghosts, as if an effect coupled them. */
static flesh_rank_part *cut_between(const flesh_mesh *mesh)
{
  flesh_rank_part *part = NULL;
  const int tets = flesh_mesh_tet_count(mesh), others = flesh_communicator_size(ranks) - 1,
            *edges = flesh_mesh_tet_edges(mesh);
  const flesh_rank_tie tie = {1, 3, (const int[]){edges[0], edges[6 * (tets / 4)], edges[6 * (tets / 2) - 1]}, 1};
  int *of = malloc((size_t)tets * sizeof *of);
  for (int t = 0; t < tets; t++) {
    const int linear = is_linear(flesh_mesh_positions(mesh), flesh_mesh_tets(mesh) + 4 * t);
    of[t] = linear || !others ? others : (int)(2L * t * others / tets);
  }
  CHECK_OK(flesh_rank_part_create_tied(ranks, mesh, of, 1, &tie, &part));
  free(of);
  return part;
}

/* Makes a body held at x = 0, under gravity. Takes the mesh, of order 2. */
static void make(flesh_mesh *mesh, double poisson, int two, bodies *b)
{
  *b = (bodies){.mesh = mesh, .part = two ? cut_between(mesh) : ranks_cut(mesh)};
  flesh_mesh *meshes[2] = {mesh, (flesh_mesh *)flesh_rank_part_mesh(b->part)};
  for (int k = 0; k < 2; k++) {
    test_body *own = &b->both[k];
    CHECK_OK(test_body_create(meshes[k], test_material(FLESH_ENERGY_S, poisson), 1000, FLESH_MASS_LUMPED, 1, own));
    CHECK_OK(test_body_gravity(own, 0, 0, -0.5));
    int *nodes = malloc((size_t)own->n * sizeof *nodes), count = 0;
    for (int i = 0; i < own->n / 3; i++)
      if (flesh_mesh_positions(own->mesh)[3 * i] <= 1e-9) nodes[count++] = i;
    if (count) CHECK_OK(flesh_system_add_pin(own->system, count, nodes, FLESH_AXES_ALL, -INFINITY, INFINITY));
    free(nodes);
    CHECK_OK(flesh_system_finalize(own->system));
  }
  CHECK_OK(flesh_system_set_part(b->both[PART].system, b->part));
}

static void drop(bodies *b)
{
  b->both[PART].mesh = NULL; /* the part's */
  for (int k = 0; k < 2; k++) test_body_destroy(&b->both[k]);
  flesh_rank_part_destroy(&b->part);
}

/* Ten-node tets, and four-node ones in the second of two bars. */
static flesh_mesh *raise(const flesh_mesh *corners)
{
  flesh_mesh *raised = NULL, *some = NULL;
  CHECK_OK(flesh_mesh_raise_order(corners, &raised));
  const int tets = flesh_mesh_tet_count(raised), *of = flesh_mesh_tets(raised), *edges = flesh_mesh_tet_edges(raised);
  const double *X = flesh_mesh_positions(raised);
  int *nodes = malloc(10 * (size_t)tets * sizeof *nodes);
  for (int t = 0; t < tets; t++)
    for (int a = 0; a < 10; a++)
      nodes[10 * t + a] = a < 4 ? of[4 * t + a] : is_linear(X, of + 4 * t) ? -1 : edges[6 * t + a - 4];
  CHECK_OK(flesh_mesh_create_quadratic(flesh_mesh_node_count(raised), X, tets, nodes, NULL, &some));
  flesh_mesh_destroy(&raised);
  free(nodes);
  return some;
}

/* Makes a bar; if `irregular`, corners are moved by a random part of a cell. Optionally with a copy beside it. */
static flesh_mesh *bar(const int cells[3], int irregular, int two)
{
  flesh_mesh *box = NULL, *moved = NULL;
  CHECK_OK(flesh_mesh_box(cells, (const double[]){1, 0.25, 0.25}, (const double[]){0, 0, 0}, &box));
  const int bars = two ? 2 : 1, nodes = flesh_mesh_node_count(box), tets = flesh_mesh_tet_count(box);
  double *x = malloc(2 * 3 * (size_t)nodes * sizeof *x);
  int *corners = malloc(2 * 4 * (size_t)tets * sizeof *corners);
  memcpy(x, flesh_mesh_positions(box), 3 * (size_t)nodes * sizeof *x);
  if (irregular) test_jitter(3 * nodes, 0.2 / cells[0], 9, x);
  for (int i = 0; i < nodes; i++)
    if (flesh_mesh_positions(box)[3 * i] == 0) x[3 * i] = 0;
  for (int d = 0; d < 3 * nodes; d++) x[3 * nodes + d] = flesh_mesh_positions(box)[d] + (d % 3 == 1 ? 0.4 : 0);
  for (int k = 0; k < 8 * tets; k++) corners[k] = flesh_mesh_tets(box)[k % (4 * tets)] + (k < 4 * tets ? 0 : nodes);
  CHECK_OK(flesh_mesh_create(bars * nodes, x, bars * tets, corners, NULL, &moved));
  flesh_mesh *raised = raise(moved);
  flesh_mesh_destroy(&box);
  flesh_mesh_destroy(&moved);
  free(corners);
  free(x);
  return raised;
}

/* Finds the row of the whole for each of this rank's, [rows of the part]: rows and their nodes are ordered
 * differently. */
static void find_rows(const bodies *b, const flesh_stiff_rows rows[2], int *of)
{
  const int *nodes = flesh_rank_part_nodes(b->part), m = rows[WHOLE].nodes_per_row;
  for (int e = 0; e < rows[PART].count; e++) {
    int found = -1;
    for (int f = 0; f < rows[WHOLE].count && found < 0; f++) {
      int same = 0;
      for (int a = 0; a < m; a++)
        for (int c = 0; c < m; c++) same += nodes[rows[PART].nodes[m * e + a]] == rows[WHOLE].nodes[m * f + c];
      if (same == m) found = f;
    }
    CHECK(found >= 0);
    of[e] = found;
  }
}

/* A preconditioner of the body at a disturbed position, with polynomials on one rank, too. */
typedef struct solver {
  const flesh_linear *linear;
  flesh_threads *threads;
  flesh_block_matrix *K;
  flesh_stiff_rows rows;
  flesh_preconditioner_data *preconditioner;
} solver;

static void set_up(const bodies *b, int which, solver *s)
{
  const test_body *own = &b->both[which];
  const double *X = flesh_mesh_positions(own->mesh);
  const int *nodes = which == PART ? flesh_rank_part_nodes(b->part) : NULL;
  double *x = malloc((size_t)own->n * sizeof *x), *whole = malloc(3 * (size_t)flesh_mesh_node_count(b->mesh) * sizeof *x);
  uint8_t *fixed = calloc((size_t)own->n, 1);
  memcpy(whole, flesh_mesh_positions(b->mesh), 3 * (size_t)flesh_mesh_node_count(b->mesh) * sizeof *whole);
  test_jitter(3 * flesh_mesh_node_count(b->mesh), 0.002, 3, whole);
  for (int d = 0; d < own->n; d++) x[d] = whole[nodes ? 3 * nodes[d / 3] + d % 3 : d];
  for (int d = 0; d < own->n; d++) fixed[d] = X[d - d % 3] <= 1e-9;
  const flesh_point point = flesh_point_at(0, x, own->state.v, own->state.v);
  const flesh_shift shift = {.x = 1, .filter = FLESH_FILTER_CLAMP};
  s->linear = flesh_linear_for(FLESH_INSTRUCTIONS_AUTO);
  CHECK_OK(flesh_threads_create(1, &s->threads));
  if (which == PART) flesh_threads_set_team(s->threads, flesh_rank_part_team(b->part));
  CHECK_OK(flesh_system_stiff_rows_create(own->system, &s->rows));
  flesh_system_stiff_rows_unite(own->system, &s->rows);
  CHECK_OK(flesh_system_matrix_create(own->system, &s->K));
  CHECK_OK(flesh_system_jacobian(own->system, &point, &shift, s->K));
  flesh_system_stiff_values(own->system, &point, &shift, &s->rows);
  flesh_block_fix(s->K, fixed, 1e4, NULL);
  CHECK_OK(s->linear->preconditioner_create(FLESH_PRECONDITIONER_TWO_LEVEL, s->K, X, 1, s->threads, &s->preconditioner));
  CHECK_OK(s->linear->preconditioner_project(s->preconditioner, s->K, &s->rows, X, 1));
  CHECK_OK(s->linear->preconditioner_setup(s->preconditioner, s->K, fixed));
  free(whole);
  free(fixed);
  free(x);
}

static void tear_down(solver *s)
{
  s->linear->preconditioner_destroy(&s->preconditioner);
  flesh_system_stiff_rows_clear(&s->rows);
  flesh_block_matrix_destroy(&s->K);
  flesh_threads_destroy(&s->threads);
}

/* The polynomial of the body's S is the same however its rows are distributed: the corrections of given errors, P S^-1
 * of them, agree to rounding. */
static void check_restored(bodies *b, int two)
{
  solver s[2];
  flesh_stiff_rows rows[2];
  const int n = b->both[WHOLE].n, own = b->both[PART].n, *nodes = flesh_rank_part_nodes(b->part);
  unsigned long long seed = 7;
  double *step[2] = {calloc((size_t)n, sizeof(double)), calloc((size_t)own, sizeof(double))}, off = 0, size = 0;
  for (int k = 0; k < 2; k++) {
    set_up(b, k, &s[k]);
    rows[k] = s[k].rows;
  }
  CHECK(rows[PART].ratio == rows[WHOLE].ratio && rows[PART].modulus == rows[WHOLE].modulus);
  CHECK(rows[PART].nodes_per_row == rows[WHOLE].nodes_per_row && rows[PART].first_main == rows[WHOLE].first_main);
  double count = rows[PART].count;
  flesh_communicator_sum(ranks, 1, &count);
  CHECK((int)count == rows[WHOLE].count);
  if (two && flesh_communicator_rank(ranks) == flesh_communicator_size(ranks) - 1 && flesh_communicator_size(ranks) > 1)
    CHECK(rows[PART].count == 0);
  int *of = malloc(((size_t)rows[PART].count + 1) * sizeof *of);
  float *error[2];
  for (int k = 0; k < 2; k++) error[k] = calloc((size_t)rows[k].count + 1, sizeof(float));
  find_rows(b, rows, of);
  for (int e = 0; e < rows[WHOLE].count; e++) error[WHOLE][e] = (float)(test_uniform(&seed) - 0.3);
  for (int e = 0; e < rows[PART].count; e++) error[PART][e] = error[WHOLE][of[e]];
  for (int k = 0; k < 2; k++) {
    CHECK(s[k].linear->preconditioner_correct_volumes(s[k].preconditioner, error[k], step[k]) == 1);
    CHECK_NEAR(s[k].linear->preconditioner_drift(s[k].preconditioner), 0, 1e-12);
  }
  for (int d = 0; d < own; d++) {
    const double expected = step[WHOLE][3 * nodes[d / 3] + d % 3];
    off = fmax(off, fabs(step[PART][d] - expected));
    size = fmax(size, fabs(expected));
  }
  double most[] = {off, size};
  flesh_communicator_largest(ranks, 2, most);
  if (flesh_communicator_rank(ranks) == 0) printf("# off by %.2g of %.2g\n", most[0], most[1]);
  CHECK_BELOW(most[0], 3e-5 * most[1]);
  /* Rows count as turned for all ranks together: by the mean of their energies. */
  double turned[2];
  for (int k = 0; k < 2; k++) {
    const size_t values = 3 * (size_t)s[k].rows.count * (size_t)s[k].rows.nodes_per_row;
    for (size_t d = 0; d < values; d++) s[k].rows.values[d] *= 1.1f;
    turned[k] = s[k].linear->preconditioner_drift(s[k].preconditioner);
  }
  CHECK(turned[WHOLE] > 1e-3);
  CHECK_NEAR(turned[PART], turned[WHOLE], 1e-4 * turned[WHOLE]);
  for (int k = 0; k < 2; k++) {
    tear_down(&s[k]);
    free(error[k]);
    free(step[k]);
  }
  free(of);
}

/* Whether the data that solves use are wrong on any rank: they would then take long. */
static int broken;

static void look_back(void)
{
  double failures = test_failures;
  flesh_communicator_sum(ranks, 1, &failures);
  broken |= failures > 0;
}

static void rows_are_moved_as_on_one_rank(void)
{
  static const double poisson[] = {0.49, 0.499, 0.4999};
  for (int k = 0; k < 3; k++)
    for (int two = 0; two <= (k == 1); two++) {
      bodies b;
      make(bar((const int[]){8, 2, 2}, k, two), poisson[k], two, &b);
      check_restored(&b, two);
      drop(&b);
    }
  look_back();
}

/* The preconditioner is a symmetric positive definite operator of all ranks, and gives the same bits again. */
static void it_is_symmetric_and_definite(void)
{
  enum { VECTORS = 4 };
  bodies b;
  solver s;
  unsigned long long seed = 11;
  make(bar((const int[]){12, 3, 3}, 1, 0), 0.499, 0, &b);
  set_up(&b, PART, &s);
  const int n = b.both[PART].n, own = 3 * flesh_rank_part_own(b.part), *nodes = flesh_rank_part_nodes(b.part);
  double *r[VECTORS], *z[VECTORS], *again = calloc((size_t)n, sizeof *again), products[VECTORS][VECTORS] = {{0}};
  for (int k = 0; k < VECTORS; k++) {
    double *whole = malloc((size_t)b.both[WHOLE].n * sizeof *whole);
    r[k] = calloc((size_t)n, sizeof(double));
    z[k] = calloc((size_t)n, sizeof(double));
    for (int d = 0; d < b.both[WHOLE].n; d++) whole[d] = test_uniform(&seed) - 0.5;
    for (int d = 0; d < own; d++) r[k][d] = whole[3 * nodes[d / 3] + d % 3]; /* collected: zero at ghosts */
    free(whole);
    s.linear->preconditioner_apply(s.preconditioner, r[k], z[k]);
    s.linear->preconditioner_apply(s.preconditioner, r[k], again);
    CHECK(!memcmp(z[k], again, (size_t)n * sizeof *again));
  }
  for (int j = 0; j < VECTORS; j++)
    for (int k = 0; k < VECTORS; k++)
      for (int d = 0; d < own; d++) products[j][k] += r[j][d] * z[k][d];
  flesh_communicator_sum(ranks, VECTORS * VECTORS, products[0]);
  for (int j = 0; j < VECTORS; j++) {
    CHECK(products[j][j] > 0);
    for (int k = 0; k < j; k++) CHECK_NEAR(products[j][k], products[k][j], 1e-5 * (products[j][j] + products[k][k]));
  }
  /* Ghosts have their owners' values. */
  for (int k = 0; k < VECTORS; k++) {
    memcpy(again, z[k], (size_t)n * sizeof *again);
    flesh_team_update_ghosts(flesh_rank_part_team(b.part), again);
    CHECK(!memcmp(z[k], again, (size_t)n * sizeof *again));
    free(r[k]);
    free(z[k]);
  }
  free(again);
  tear_down(&s);
  drop(&b);
  look_back();
}

/* Takes some steps from rest; x is the result of `which`. */
static void run(bodies *b, int which, flesh_preconditioner kind, int moves, flesh_solve_stats *stats)
{
  test_body *own = &b->both[which];
  flesh_solver_options options = test_options(1e-7);
  flesh_integrator *integrator = NULL;
  options.preconditioner = kind;
  options.max_linear = 300; /* wrong setups fail soon */
  options.max_cutbacks = 1;
  *stats = (flesh_solve_stats){0};
  memcpy(own->state.x, flesh_mesh_positions(own->mesh), (size_t)own->n * sizeof(double));
  memset(own->state.v, 0, (size_t)own->n * sizeof(double));
  own->state.t = 0;
  CHECK_OK(flesh_integrator_create(own->system, moves ? FLESH_METHOD_BDF2 : FLESH_METHOD_STATIC, &options, &integrator));
  for (int k = 0; k < (moves ? 4 : 1); k++) CHECK_OK(flesh_integrator_step(integrator, &own->state, 1. / 60, stats));
  flesh_integrator_destroy(&integrator);
}

/* Solves end where one rank's do, in not many more iterations. Whether requested or automatic, the projection has the
 * same bits. */
static void compare(flesh_mesh *mesh, double poisson, int two, int repeats, const char *what)
{
  bodies b;
  flesh_solve_stats stats[2];
  make(mesh, poisson, two, &b);
  const test_body *own = &b.both[PART], *whole = &b.both[WHOLE];
  const int *nodes = flesh_rank_part_nodes(b.part);
  double *first = malloc((size_t)own->n * sizeof *first);
  for (int moves = 0; moves <= 1; moves++) {
    run(&b, PART, FLESH_PRECONDITIONER_VOLUME_PROJECTION, moves, &stats[PART]);
    memcpy(first, own->state.x, (size_t)own->n * sizeof *first);
    if (repeats) run(&b, PART, FLESH_PRECONDITIONER_AUTO, moves, &stats[PART]);
    CHECK(!memcmp(first, own->state.x, (size_t)own->n * sizeof *first));
    run(&b, WHOLE, FLESH_PRECONDITIONER_VOLUME_PROJECTION, moves, &stats[WHOLE]);
    double off = 0, size = 0;
    for (int d = 0; d < own->n; d++) {
      const int i = 3 * nodes[d / 3] + d % 3;
      off = fmax(off, fabs(own->state.x[d] - whole->state.x[i]));
    }
    for (int d = 0; d < whole->n; d++) size = fmax(size, fabs(whole->state.x[d] - flesh_mesh_positions(whole->mesh)[d]));
    flesh_communicator_largest(ranks, 1, &off);
    if (flesh_communicator_rank(ranks) == 0)
      printf("# %s, nu %g, %s: %d Newton and %d linear iterations, on one rank %d and %d; off by %.2g of %.2g m\n", what,
             poisson, moves ? "in motion" : "at rest", stats[PART].newton, stats[PART].linear, stats[WHOLE].newton,
             stats[WHOLE].linear, off, size);
    CHECK_BELOW(off, 1e-5 * size);
    CHECK_BELOW(stats[PART].linear, 1.7 * stats[WHOLE].linear); /* without the projection 5 to 15 times as many */
  }
  free(first);
  drop(&b);
}

static void solves_are_those_of_one_rank(void)
{
  CHECK(!broken);
  if (broken) return;
  compare(bar((const int[]){6, 2, 2}, 0, 0), 0.49, 0, 0, "bar");
  compare(bar((const int[]){6, 2, 2}, 0, 0), 0.5, 0, 0, "bar");
  compare(bar((const int[]){12, 3, 3}, 1, 0), 0.499, 0, 1, "irregular bar");
  compare(bar((const int[]){5, 2, 2}, 0, 1), 0.499, 1, 0, "bar beside one without rows");
}

int main(int argc, char **argv)
{
  return RUN_TESTS_ON_RANKS(argc, argv, TEST(rows_are_moved_as_on_one_rank), TEST(it_is_symmetric_and_definite),
                            TEST(solves_are_those_of_one_rank));
}
