// TEST quick needs=ranks ranks=1,2,3,5
/* test_shared_body.c: a body shared by ranks against the same body on one rank: forces, energies, products with the
 * matrix, equilibria and motions under KINSOL. */
#include "ranks.h"

#include "base/error.h"
#include "base/parallel_vector.h"
#include "body.h"
#include "linear/block_matrix.h"
#include "linear/overlap_vectors.h"
#include "sundials/kinsol.h"
#include "system/ranks.h"
#include "system/system.h"
#include "time/rigid_guess.h"

/* The whole body, which every rank has, and this rank's part of it. */
typedef struct bodies {
  flesh_mesh *mesh;
  flesh_rank_part *part;
  test_body whole, own;
  int nodes;
} bodies;

/* Adds the effects besides inertia and elasticity. */
static int add_effects(test_body *b)
{
  flesh_effect *effect = NULL;
  int *nodes = malloc((size_t)b->n * sizeof *nodes), count = 0, status = test_body_gravity(b, 0, 1, -9.81);
  if (!status) status = flesh_effect_damping(&b->body, 0.5, 1e-3, FLESH_STIFFNESS_CURRENT, &effect);
  if (!status) status = flesh_system_add_effect(b->system, &effect);
  if (!status) status = flesh_effect_viscosity(&b->body, 20, 10, &effect);
  if (!status) status = flesh_system_add_effect(b->system, &effect);
  for (int i = 0; i < b->n / 3; i++)
    if (flesh_mesh_positions(b->mesh)[3 * i] <= 1e-9) nodes[count++] = i;
  if (!status && count) status = flesh_system_add_pin(b->system, count, nodes, FLESH_AXES_ALL, -INFINITY, INFINITY);
  free(nodes);
  return status ? status : flesh_system_finalize(b->system);
}

static void make(int order, const int cells[3], double poisson, bodies *b)
{
  flesh_mesh *mesh = NULL;
  const double size[3] = {1, 0.4, 0.3};
  CHECK_OK(flesh_mesh_box(cells, size, (const double[]){0, 0, 0}, &mesh));
  if (order == 2) {
    flesh_mesh *corners = mesh;
    CHECK_OK(flesh_mesh_raise_order(corners, &mesh));
    flesh_mesh_destroy(&corners);
  }
  *b = (bodies){.mesh = mesh, .part = ranks_cut(mesh), .nodes = flesh_mesh_node_count(mesh)};
  const flesh_material material = test_material(FLESH_ENERGY_E, poisson);
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_CONSISTENT, 1, &b->whole));
  CHECK_OK(test_body_create((flesh_mesh *)flesh_rank_part_mesh(b->part), material, 1000, FLESH_MASS_CONSISTENT, 1, &b->own));
  CHECK_OK(add_effects(&b->whole));
  CHECK_OK(add_effects(&b->own));
  CHECK_OK(flesh_system_set_part(b->own.system, b->part));
}

static void drop(bodies *b)
{
  b->own.mesh = NULL; /* the part's */
  test_body_destroy(&b->own);
  test_body_destroy(&b->whole);
  flesh_rank_part_destroy(&b->part);
}

/* Copies this rank's part of a vector of the whole. */
static void take(const bodies *b, const double *whole, double *own)
{
  for (int d = 0; d < b->own.n; d++) own[d] = whole[3 * flesh_rank_part_nodes(b->part)[d / 3] + d % 3];
}

static double largest(int n, const double *x)
{
  double most = 0;
  for (int d = 0; d < n; d++) most = fmax(most, fabs(x[d]));
  return most;
}

/* Returns the difference of the ranks' vector from the whole's, over its largest number. */
static double difference(const bodies *b, const double *own, const double *whole)
{
  double *gathered = malloc(3 * (size_t)b->nodes * sizeof *gathered);
  flesh_rank_part_gather(b->part, own, gathered);
  for (int d = 0; d < 3 * b->nodes; d++) gathered[d] -= whole[d];
  const double worst = largest(3 * b->nodes, gathered) / largest(3 * b->nodes, whole);
  free(gathered);
  return worst;
}

static double *vector(int n) { return calloc((size_t)n + 1, sizeof(double)); }

/* Makes the body in some motion: x, v, a of the whole [3][3*nodes], and of the part. */
static void disturb(const bodies *b, double *whole[3], double *own[3])
{
  unsigned long long seed = 5;
  for (int k = 0; k < 3; k++) {
    whole[k] = vector(3 * b->nodes);
    own[k] = vector(b->own.n);
    for (int d = 0; d < 3 * b->nodes; d++)
      whole[k][d] = (k == 0 ? flesh_mesh_positions(b->mesh)[d] : 0) + 0.02 * (test_uniform(&seed) - 0.5);
    take(b, whole[k], own[k]);
  }
}

static flesh_point point_of(double *const vectors[3])
{
  return flesh_point_at(0, vectors[0], vectors[1], vectors[2]);
}

static void check_sums(const bodies *b, const flesh_point points[2])
{
  const flesh_shift shift = {.x = 1, .v = 60, .a = 3600};
  double *r[2] = {vector(3 * b->nodes), vector(b->own.n)}, phi[2], sizes[2], energies[2][5];
  const flesh_system *systems[2] = {b->whole.system, b->own.system};
  for (int k = 0; k < 2; k++) {
    CHECK_OK(flesh_system_residual(systems[k], &points[k], r[k]));
    CHECK_OK(flesh_system_potential(systems[k], &points[k], &shift, &phi[k], &sizes[k]));
    CHECK_OK(flesh_system_energies(systems[k], &points[k], energies[k]));
  }
  CHECK_BELOW(difference(b, r[1], r[0]), 1e-12);
  CHECK_NEAR(phi[1], phi[0], 1e-12 * sizes[0]);
  CHECK_NEAR(sizes[1], sizes[0], 1e-12 * sizes[0]);
  for (int k = 0; k < 5; k++) CHECK_NEAR(energies[1][k], energies[0][k], 1e-12 * sizes[0]);
  CHECK_OK(test_evaluate(b->own.system, &points[1], &shift, r[1], &phi[1], &sizes[1]));
  CHECK_BELOW(difference(b, r[1], r[0]), 1e-12);
  CHECK_NEAR(phi[1], phi[0], 1e-12 * sizes[0]);
  CHECK_OK(flesh_system_load(b->whole.system, &points[0], r[0]));
  CHECK_OK(flesh_system_load(b->own.system, &points[1], r[1]));
  CHECK_BELOW(difference(b, r[1], r[0]), 1e-12);
  free(r[0]);
  free(r[1]);
}

/* The matrix of a rank's overlap is that of the whole, in every block, wherever it was computed. */
static void check_overlap(const bodies *b, const flesh_block_matrix *whole, const flesh_block_matrix *own)
{
  const flesh_team *team = flesh_rank_part_team(b->part);
  const int *nodes = flesh_rank_part_nodes(b->part);
  int *place = malloc((size_t)b->nodes * sizeof *place), blocks = 0;
  double worst = 0, size = largest(9 * whole->row_start[whole->rows], whole->values);
  flesh_overlap overlap;
  CHECK_OK(flesh_overlap_create(own, team, NULL, &overlap));
  const flesh_block_matrix *A = flesh_overlap_update(&overlap, own);
  CHECK(A->rows == team->overlap);
  memset(place, -1, (size_t)b->nodes * sizeof *place);
  for (int i = 0; i < A->rows; i++) place[nodes[i]] = i;
  for (int i = 0; i < whole->rows; i++)
    for (int k = whole->row_start[i]; k < whole->row_end[i]; k++) {
      const int row = place[i], column = place[whole->column[k]], flipped = row > column;
      if (row < 0 || column < 0) continue;
      const int at = flesh_block_find(A, flipped ? column : row, flipped ? row : column);
      CHECK(at >= 0);
      for (int e = 0; e < 9 && at >= 0; e++)
        worst = fmax(worst, fabs(A->values[9 * at + (flipped ? 3 * (e % 3) + e / 3 : e)] - whole->values[9 * k + e]));
      blocks++;
    }
  CHECK(blocks == A->row_start[A->rows]);
  CHECK_BELOW(worst, 1e-13 * size);
  flesh_overlap_clear(&overlap);
  free(place);
}

/* The ranks' corrections are summed, for owners and ghosts alike, with weights k^(-1/4) on either side for a node in
 * the overlaps of k ranks. */
static void check_sum_of_overlaps(const bodies *b, const flesh_block_matrix *own)
{
  const flesh_team *team = flesh_rank_part_team(b->part);
  const int *nodes = flesh_rank_part_nodes(b->part);
  const size_t count = (size_t)team->overlap;
  double *times = vector(b->nodes);
  int *order = malloc(count * sizeof *order);
  float *r = calloc(4 * count, sizeof *r), *wide = calloc(4 * count, sizeof *wide);
  flesh_overlap overlap;
  CHECK_OK(flesh_overlap_create(own, team, NULL, &overlap));
  for (int i = 0; i < team->overlap; i++) times[nodes[i]] = 1, order[i] = i;
  flesh_communicator_sum(ranks, b->nodes, times);
  for (int i = 0; i < 4 * team->own; i++) r[i] = (float)(i % 4 < 3 ? 100 * nodes[i / 4] + i % 4 : 0);
  flesh_overlap_restrict(&overlap, order, r, order, wide);
  CHECK_OK(flesh_overlap_set_orders(&overlap, order, order));
  flesh_overlap_add_begin(&overlap, wide);
  flesh_overlap_add_end(&overlap, wide, r);
  for (int i = 0; i < 4 * team->nodes; i++) {
    const double sum = i % 4 < 3 ? sqrt(times[nodes[i / 4]]) * (100 * nodes[i / 4] + i % 4) : 0;
    CHECK_NEAR(r[i], sum, 1e-6 * (sum + 1));
  }
  flesh_overlap_clear(&overlap);
  free(times);
  free(order);
  free(r);
  free(wide);
}

/* The sum of the ranks' products is that of the whole's matrix. */
static void check_products(const bodies *b, const flesh_point points[2])
{
  const flesh_shift shift = {.x = 1, .v = 60, .a = 3600};
  const flesh_system *systems[2] = {b->whole.system, b->own.system};
  double *y[2] = {vector(3 * b->nodes), vector(b->own.n)};
  flesh_block_matrix *K[2] = {NULL};
  for (int k = 0; k < 2; k++) {
    CHECK_OK(flesh_system_matrix_create(systems[k], &K[k]));
    CHECK_OK(flesh_system_jacobian(systems[k], &points[k], &shift, K[k]));
    flesh_block_multiply(K[k], points[k].a, y[k]);
  }
  check_overlap(b, K[0], K[1]);
  check_sum_of_overlaps(b, K[1]);
  flesh_team_add_ghosts(flesh_rank_part_team(b->part), y[1]);
  CHECK_BELOW(difference(b, y[1], y[0]), 1e-12);
  for (int k = 0; k < 2; k++) {
    flesh_block_matrix_destroy(&K[k]);
    free(y[k]);
  }
}

/* Sums over vectors count ghosts once, although positions are consistent. */
static void check_vectors(const bodies *b, const flesh_point points[2])
{
  flesh_threads *threads = NULL;
  const int n[2] = {3 * b->nodes, b->own.n};
  double *y = vector(n[1]);
  CHECK_OK(flesh_threads_create(1, &threads));
  double whole[] = {flesh_dot(threads, n[0], points[0].x, points[0].v), flesh_norm(threads, n[0], points[0].x),
                    flesh_largest(threads, n[0], points[0].x), flesh_bound_apart(threads, n[0], points[0].x, points[0].v)};
  flesh_threads_set_team(threads, flesh_rank_part_team(b->part));
  const double own[] = {flesh_dot(threads, n[1], points[1].x, points[1].v), flesh_norm(threads, n[1], points[1].x),
                        flesh_largest(threads, n[1], points[1].x), flesh_bound_apart(threads, n[1], points[1].x, points[1].v)};
  for (int k = 0; k < 4; k++) CHECK_NEAR(own[k], whole[k], 1e-13 * whole[1]);
  /* A different number on one rank makes the vectors different on all. */
  memcpy(y, points[1].x, (size_t)n[1] * sizeof *y);
  CHECK(flesh_same(threads, n[1], points[1].x, y));
  if (flesh_communicator_rank(ranks) == flesh_communicator_size(ranks) - 1) y[0] += 1;
  CHECK(!flesh_same(threads, n[1], points[1].x, y));
  flesh_threads_destroy(&threads);
  free(y);
}

static void forces_energies_and_products_are_those_of_one_rank(void)
{
  for (int order = 1; order <= 2; order++) {
    bodies b;
    double *whole[3], *own[3];
    make(order, (const int[]){6, 3, 2}, 0.4, &b);
    disturb(&b, whole, own);
    const flesh_point points[2] = {point_of(whole), point_of(own)};
    check_sums(&b, points);
    check_products(&b, points);
    check_vectors(&b, points);
    for (int k = 0; k < 3; k++) free(whole[k]), free(own[k]);
    drop(&b);
  }
}

static flesh_solver_options options_of_ranks(void)
{
  flesh_solver_options options = test_options(1e-9);
  options.preconditioner = FLESH_PRECONDITIONER_IC;
  return options;
}

/* Computes the equilibrium under gravity: the difference of ranks from one rank, and their iterations. */
static void equilibria_are_those_of_one_rank(void)
{
  for (int order = 1; order <= 2; order++) {
    bodies b;
    make(order, (const int[]){8, 3, 2}, 0.45, &b);
    const flesh_solver_options options = options_of_ranks();
    test_body *both[2] = {&b.whole, &b.own};
    flesh_nonlinear *solvers[2] = {0};
    flesh_solve_stats stats[2] = {{0}};
    for (int k = 0; k < 2; k++) {
      const flesh_stage stage = {.t = 0, .load = 1, .prescribed_fraction = 1, .shift = {.x = 1}, .x0 = both[k]->state.x};
      CHECK_OK(flesh_nonlinear_create(both[k]->system, &options, &solvers[k]));
      CHECK_OK(flesh_nonlinear_solve(solvers[k], &stage, NULL, 0, &stats[k]));
    }
    CHECK_BELOW(difference(&b, solvers[1]->u, solvers[0]->u), 1e-7);
    CHECK_NEAR(stats[1].newton, stats[0].newton, 3);
    printf("# rank %d of %d, order %d: %d Newton and %d linear iterations; on one rank %d and %d\n",
           flesh_communicator_rank(ranks), flesh_communicator_size(ranks), order, stats[1].newton, stats[1].linear,
           stats[0].newton, stats[0].linear);
    for (int k = 0; k < 2; k++) flesh_nonlinear_destroy(&solvers[k]);
    drop(&b);
  }
}

/* Takes a few steps of a method, of the whole and of the ranks; with an initial velocity at the free end. */
static void compare_motions(flesh_method method, int steps, bodies *b)
{
  const flesh_solver_options options = options_of_ranks();
  test_body *both[2] = {&b->whole, &b->own};
  double energies[2];
  for (int d = 0; d < 3 * b->nodes; d++)
    b->whole.state.v[d] = d % 3 == 1 && method != FLESH_METHOD_STATIC ? flesh_mesh_positions(b->mesh)[d - 1] : 0;
  take(b, b->whole.state.v, b->own.state.v);
  for (int k = 0; k < 2; k++) {
    flesh_integrator *integrator = NULL;
    memcpy(both[k]->state.x, flesh_mesh_positions(both[k]->mesh), (size_t)both[k]->n * sizeof(double));
    both[k]->state.t = 0;
    CHECK_OK(flesh_integrator_create(both[k]->system, method, &options, &integrator));
    for (int i = 0; i < steps; i++) CHECK_OK(flesh_integrator_step(integrator, &both[k]->state, 0.02, NULL));
    energies[k] = flesh_integrator_energy_balance(integrator)->supplied;
    flesh_integrator_destroy(&integrator);
  }
  for (int d = 0; d < b->own.n; d++) b->own.state.x[d] -= flesh_mesh_positions(b->own.mesh)[d];
  for (int d = 0; d < 3 * b->nodes; d++) b->whole.state.x[d] -= flesh_mesh_positions(b->mesh)[d];
  CHECK_BELOW(difference(b, b->own.state.x, b->whole.state.x), 1e-7);
  if (method != FLESH_METHOD_STATIC) CHECK_BELOW(difference(b, b->own.state.v, b->whole.state.v), 1e-6);
  CHECK_NEAR(energies[1], energies[0], 1e-5); /* of some joules */
}

static void motions_are_those_of_one_rank(void)
{
  static const flesh_method methods[] = {FLESH_METHOD_STATIC, FLESH_METHOD_BACKWARD_EULER, FLESH_METHOD_MIDPOINT,
                                         FLESH_METHOD_NEWMARK, FLESH_METHOD_BDF2, FLESH_METHOD_HHT,
                                         FLESH_METHOD_GENERALIZED_ALPHA};
  bodies b;
  make(1, (const int[]){6, 2, 2}, 0.45, &b);
  for (size_t k = 0; k < sizeof methods / sizeof methods[0]; k++)
    compare_motions(methods[k], methods[k] == FLESH_METHOD_STATIC ? 1 : 5, &b);
  drop(&b);
}

/* Makes two boxes that share no node. */
static flesh_mesh *two_boxes(void)
{
  flesh_mesh *box = NULL, *both = NULL;
  CHECK_OK(flesh_mesh_box((const int[]){3, 2, 2}, (const double[]){1, 0.5, 0.4}, (const double[]){0, 0, 0}, &box));
  const size_t n = 3 * (size_t)flesh_mesh_node_count(box), m = 4 * (size_t)flesh_mesh_tet_count(box);
  double *X = malloc(2 * n * sizeof *X);
  int *tets = malloc(2 * m * sizeof *tets);
  for (size_t d = 0; d < 2 * n; d++) X[d] = flesh_mesh_positions(box)[d % n] + (d >= n && d % 3 == 1 ? 2 : 0);
  for (size_t k = 0; k < 2 * m; k++) tets[k] = flesh_mesh_tets(box)[k % m] + (k >= m ? (int)n / 3 : 0);
  CHECK_OK(flesh_mesh_create(2 * (int)n / 3, X, 2 * (int)m / 4, tets, NULL, &both));
  free(X);
  free(tets);
  flesh_mesh_destroy(&box);
  return both;
}

/* Bodies are found however scattered their tets are over the ranks. A body with a constrained dof on one rank stays. */
static void free_bodies_go_on_as_on_one_rank(void)
{
  bodies b = {.mesh = two_boxes()};
  double *whole[3], *own[3], *u[2];
  const int tets = flesh_mesh_tet_count(b.mesh), size = flesh_communicator_size(ranks);
  int *of = malloc((size_t)tets * sizeof *of);
  flesh_rigid_parts parts[2];
  for (int t = 0; t < tets; t++) of[t] = t % size;
  b.nodes = flesh_mesh_node_count(b.mesh);
  CHECK_OK(flesh_rank_part_create(ranks, b.mesh, of, &b.part));
  const flesh_material material = test_material(FLESH_ENERGY_E, 0.4);
  flesh_mesh *own_mesh = (flesh_mesh *)flesh_rank_part_mesh(b.part);
  CHECK_OK(test_body_create(b.mesh, material, 1000, FLESH_MASS_CONSISTENT, 1, &b.whole));
  CHECK_OK(test_body_create(own_mesh, material, 1000, FLESH_MASS_CONSISTENT, 1, &b.own));
  CHECK_OK(flesh_system_finalize(b.whole.system));
  CHECK_OK(flesh_system_finalize(b.own.system));
  CHECK_OK(flesh_system_set_part(b.own.system, b.part));
  disturb(&b, whole, own);
  const flesh_state states[2] = {{.x = whole[0], .v = whole[1]}, {.x = own[0], .v = own[1]}};
  const flesh_system *systems[2] = {b.whole.system, b.own.system};
  const int n[2] = {3 * b.nodes, b.own.n};
  for (int k = 0; k < 2; k++) {
    u[k] = vector(n[k]);
    CHECK_OK(flesh_rigid_parts_create(systems[k], FLESH_OK, &parts[k]));
    CHECK(parts[k].count == 2);
    for (int p = 0; p < 2; p++) CHECK_NEAR(parts[k].extent[p], parts[0].extent[0], 1e-12); /* of equal boxes */
  }
  for (int way = 0; way < 4; way++) { /* nearest or not; without and with a constrained node */
    uint8_t *fixed[2] = {calloc((size_t)n[0], 1), calloc((size_t)n[1], 1)};
    const int local = flesh_rank_part_find(b.part, b.nodes - 1), expected = way < 2 ? 2 : 1;
    fixed[0][n[0] - 1] = 1;
    if (local >= 0 && local < flesh_rank_part_own(b.part)) fixed[1][3 * local + 2] = 1;
    for (int k = 0; k < 2; k++)
      CHECK(flesh_rigid_guess(&parts[k], way < 2 ? NULL : fixed[k], &states[k], 0.5, way % 2, u[k]) == expected);
    CHECK_BELOW(difference(&b, u[1], u[0]), 1e-11);
    for (int i = 0; i < n[1]; i++) CHECK_NEAR(u[1][i], u[0][3 * flesh_rank_part_nodes(b.part)[i / 3] + i % 3], 1e-11);
    free(fixed[0]);
    free(fixed[1]);
  }
  for (int k = 0; k < 2; k++) flesh_rigid_parts_clear(&parts[k]), free(u[k]);
  for (int k = 0; k < 3; k++) free(whole[k]), free(own[k]);
  free(of);
  drop(&b);
}

/* An effect or option that cannot be shared is refused on all ranks, with one message; so is a failed solve. */
static void refusals_and_failures_are_everyones(void)
{
  bodies b;
  flesh_integrator *integrator = NULL;
  flesh_solver_options options = options_of_ranks();
  make(1, (const int[]){3, 1, 1}, 0.4, &b);
  options.linear_solver = FLESH_LINEAR_KLU;
  CHECK(flesh_integrator_create(b.own.system, FLESH_METHOD_STATIC, &options, &integrator) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "not run on several ranks");
  CHECK(flesh_integrator_create(b.own.system, FLESH_METHOD_IDA, &options, &integrator) == FLESH_ERR_ARGUMENT);
  options = options_of_ranks();
  options.max_newton = 1;
  options.max_cutbacks = 1;
  CHECK_OK(flesh_integrator_create(b.own.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK(flesh_integrator_step(integrator, &b.own.state, 0, NULL) == FLESH_ERR_SOLVE);
  CHECK_TEXT(flesh_error_text(), "smallest J");
  flesh_integrator_destroy(&integrator);
  /* If one rank's energy is undefined, the total is undefined on all. */
  double phi, size;
  const flesh_point point = flesh_point_at(0, b.own.state.x, b.own.state.v, b.own.state.v);
  if (flesh_communicator_rank(ranks) == flesh_communicator_size(ranks) - 1) b.own.state.x[0] = NAN;
  CHECK(flesh_system_potential(b.own.system, &point, &(flesh_shift){.x = 1}, &phi, &size) != FLESH_OK);
  drop(&b);
}

/* A failure of one rank before a collective creation ends it on all ranks, with the failing rank's message. */
static void creations_take_what_failed_before(void)
{
  bodies b;
  make(1, (const int[]){8, 3, 2}, 0.45, &b);
  const flesh_solver_options options = options_of_ranks();
  const int rank = flesh_communicator_rank(ranks), size = flesh_communicator_size(ranks);
  for (int failing = size; failing >= 0; failing--) { /* size: none */
    flesh_nonlinear *solver = NULL;
    flesh_rigid_parts parts;
    double sum = 1;
    const int expected = failing < size ? FLESH_ERR_MEMORY : FLESH_OK;
    int status = rank == failing ? flesh_fail(FLESH_ERR_MEMORY, "rank %d has no room", rank) : FLESH_OK;
    CHECK(flesh_nonlinear_create_after(status, b.own.system, &options, &solver) == expected);
    CHECK(!solver == (expected != FLESH_OK));
    CHECK(flesh_rigid_parts_create(b.own.system, status, &parts) == expected);
    CHECK(flesh_team_sum_agreed(flesh_system_team(b.own.system), status, 1, &sum) == expected);
    CHECK(sum == (expected ? 1 : size));
    if (expected) CHECK_TEXT(flesh_error_text(), "has no room");
    flesh_nonlinear_destroy(&solver);
    flesh_rigid_parts_clear(&parts);
  }
  drop(&b);
}

/* Smooth displacements are left to the coarse level of all ranks: without it iterations grow with the number of
 * ranks. */
static void the_coarse_level_is_that_of_all_ranks(void)
{
  static const flesh_preconditioner kinds[] = {FLESH_PRECONDITIONER_TWO_LEVEL, FLESH_PRECONDITIONER_IC};
  bodies b;
  flesh_solve_stats stats[2] = {{0}};
  make(1, (const int[]){24, 4, 4}, 0.45, &b);
  flesh_solver_options options = options_of_ranks();
  for (int k = 0; k < 2; k++) {
    flesh_nonlinear *solver = NULL;
    const flesh_stage stage = {.t = 0, .load = 0.2, .prescribed_fraction = 1, .shift = {.x = 1}, .x0 = b.own.state.x};
    options.preconditioner = kinds[k];
    CHECK_OK(flesh_nonlinear_create(b.own.system, &options, &solver));
    CHECK_OK(flesh_nonlinear_solve(solver, &stage, NULL, 0, &stats[k]));
    flesh_nonlinear_destroy(&solver);
  }
  CHECK_BELOW(stats[0].linear, stats[1].linear / 1.5);
  printf("# %d linear iterations with a coarse level, %d without\n", stats[0].linear, stats[1].linear);
  drop(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS_ON_RANKS(argc, argv, TEST(forces_energies_and_products_are_those_of_one_rank),
                            TEST(equilibria_are_those_of_one_rank), TEST(motions_are_those_of_one_rank),
                            TEST(free_bodies_go_on_as_on_one_rank),
                            TEST(refusals_and_failures_are_everyones), TEST(creations_take_what_failed_before),
                            TEST(the_coarse_level_is_that_of_all_ranks));
}
