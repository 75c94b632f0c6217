// TEST full memory seconds=5
/* test_nonlinear_elimination.c: few nodes that carry a residual are solved for alone: with every effect, in fewer
 * iterations, with the same result, and not if everything converges anyway. */
#include "body.h"
#include "effect/private.h"
#include "newton/stage.h"
#include "sundials/kinsol.h"
#include "test.h"

enum { SIDE = 12, UNKNOWNS = 3 * (2 * SIDE + 1) * (SIDE + 1) * (SIDE + 1) };
static double with[UNKNOWNS], without[UNKNOWNS];

/* AUTO: four-node tets; otherwise half as many along each side, of ten nodes. */
static flesh_element element;

/* Makes a block clamped at x = 0, with a ball of nodes in its middle displaced randomly. */
static void make_block(flesh_mass mass, test_body *b)
{
  flesh_material material;
  const int side = element ? SIDE / 2 : SIDE;
  flesh_mesh *mesh = test_box(2 * side, side, side, 0.2, 0.1, 0.1), *raised = NULL;
  flesh_effect *elasticity = NULL;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.45, &material));
  if (element) {
    CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
    flesh_mesh_destroy(&mesh);
  }
  CHECK_OK(test_body_create(element ? raised : mesh, material, 1000, mass, 1, b));
  if (element) { /* with the requested element */
    flesh_system_destroy(&b->system);
    CHECK_OK(flesh_system_create(b->mesh, &b->system));
    b->body.element = element;
    CHECK_OK(flesh_effect_inertia(&b->body, &elasticity));
    CHECK_OK(flesh_system_add_effect(b->system, &elasticity));
    CHECK_OK(flesh_effect_elasticity(&b->body, &elasticity));
    CHECK_OK(flesh_system_add_effect(b->system, &elasticity));
  }
  CHECK_OK(test_body_gravity(b, 0, 0, -9.81));
  CHECK_OK(test_body_clamp(b, 1e-9));
}

static int in_ball(const double X[3]) { return hypot(hypot(X[0] - 0.1, X[1] - 0.05), X[2] - 0.05) < 0.016; }

/* How far a tangle's nodes are displaced, m: with twice that, rounding decides which of two solutions is found. */
static const double TANGLE = 0.03;

static void throw_about(const test_body *b, double amplitude, double *x)
{
  double *thrown = malloc((size_t)b->n * sizeof *thrown);
  const double *X = flesh_mesh_positions(b->mesh);
  memcpy(thrown, x, (size_t)b->n * sizeof *x);
  test_jitter(b->n, amplitude, 7, thrown);
  for (int i = 0; i < b->n / 3; i++)
    if (in_ball(X + 3 * i)) memcpy(x + 3 * i, thrown + 3 * i, 3 * sizeof *x);
  free(thrown);
}

/* Elements of two materials, restricted to two complementary subsets, add up to the whole. */
static void parts_add_up(void)
{
  flesh_mesh *mesh = test_box(3, 2, 2, 3, 2, 2);
  const int tets = flesh_mesh_tet_count(mesh), n = 3 * flesh_mesh_node_count(mesh);
  flesh_material materials[2];
  int *material = malloc((size_t)tets * sizeof *material), *chosen = malloc((size_t)tets * sizeof *chosen);
  int *nodes = malloc(4 * (size_t)tets * sizeof *nodes);
  double *x = malloc(3 * (size_t)n * sizeof *x), *whole = x + n, *sum = x + 2 * n;
  for (int k = 0; k < 2; k++)
    CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1 + 10 * k, 0.3, &materials[k]));
  for (int e = 0; e < tets; e++) material[e] = e % 3 == 0;
  const flesh_body body = {.mesh = mesh, .materials = materials, .tet_material = material};
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_effect_elasticity(&body, &effect));
  memcpy(x, flesh_mesh_positions(mesh), (size_t)n * sizeof *x);
  memset(whole, 0, 2 * (size_t)n * sizeof *whole);
  test_jitter(n, 0.3, 5, x);
  const flesh_point point = flesh_point_at(0, x, NULL, NULL);
  CHECK_OK(effect->operations->residual(effect, &point, whole));
  const flesh_cells *cells = effect->operations->cells(effect);
  for (int parity = 0; parity < 2; parity++) {
    int count = 0;
    for (int k = parity; k < tets; k += 2) {
      memcpy(nodes + 4 * (size_t)count, cells->nodes + 4 * (size_t)k, 4 * sizeof *nodes);
      chosen[count++] = k;
    }
    flesh_mesh *half = NULL;
    flesh_effect *part = NULL;
    CHECK_OK(flesh_mesh_create(n / 3, flesh_mesh_positions(mesh), count, nodes, NULL, &half));
    CHECK_OK(effect->operations->library->restrict_to_cells(effect, count, chosen, half, &part));
    CHECK_OK(part->operations->residual(part, &point, sum));
    flesh_effect_destroy(&part);
    flesh_mesh_destroy(&half);
  }
  for (int d = 0; d < n; d++) sum[d] -= whole[d];
  CHECK_BELOW(flesh_norm(NULL, n, sum), 1e-13 * flesh_norm(NULL, n, whole));
  flesh_effect_destroy(&effect);
  flesh_mesh_destroy(&mesh);
  free(material);
  free(chosen);
  free(nodes);
  free(x);
}

/* A separate KINSOL for a subdomain, as nonlinear solves have one; its memory is the system's. */
static int solve_stage(void *data, const flesh_system *system, const flesh_solver_options *options, const flesh_stage *stage,
                       flesh_stop stop, flesh_solve_stats *stats, double *u)
{
  flesh_nonlinear *nonlinear = NULL;
  flesh_reserve *reserve = flesh_reserve_enter(NULL);
  int status = flesh_nonlinear_create(system, options, &nonlinear);
  (void)data, (void)stop;
  if (status) return status;
  status = flesh_nonlinear_solve(nonlinear, stage, NULL, 0, stats);
  memcpy(u, nonlinear->u, (size_t)flesh_system_unknowns(system) * sizeof *u);
  flesh_nonlinear_destroy(&nonlinear);
  flesh_reserve_enter(reserve);
  return status;
}

/* Quadratic effects are represented exactly in the subdomain: its solution is one of the whole there. */
static void the_rest_of_the_body_is_there(void)
{
  test_body b;
  flesh_effect *effect = NULL;
  flesh_newton newton;
  flesh_equations *equations = &newton.equations;
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  options.eigenvalue_filter = FLESH_FILTER_TRUST_REGION_ALWAYS;
  make_block(FLESH_MASS_CONSISTENT, &b);
  CHECK_OK(flesh_effect_damping(&b.body, 2, 0.02, FLESH_STIFFNESS_CURRENT, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_effect_viscosity(&b.body, 100, 50, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  const flesh_motion target = {.count = 1, .keyframes = &(flesh_keyframe){.translation = {0.1, 0.05, 0.08}}};
  CHECK_OK(flesh_effect_spring(&b.body, (double[]){0.101, 0.051, 0.049}, 1e3, &target, -INFINITY, INFINITY, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  int held = 0; /* a node of the ball, in one direction */
  while (!in_ball(flesh_mesh_positions(b.mesh) + 3 * held)) held++;
  CHECK_OK(flesh_system_add_pin(b.system, 1, &held, FLESH_AXIS_Y, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_newton_init(b.system, &options, (flesh_stage_solver){NULL, solve_stage}, &newton));
  const double h = 1. / 60;
  double *u = calloc((size_t)b.n, sizeof *u), *r = malloc(4 * (size_t)b.n * sizeof *r), *w = r + b.n;
  double *after = r + 2 * b.n, *there = r + 3 * b.n;
  for (int d = 0; d < b.n; d++) b.state.v[d] = 0.1 * sin(d);
  const flesh_stage stage = {.t = h,
                             .load = 1,
                             .prescribed_fraction = 1,
                             .shift = {.x = 1, .v = 1 / h, .a = 1 / (h * h)},
                             .x0 = b.state.x,
                             .x_lag = b.state.x,
                             .v_lag = b.state.v};
  flesh_newton_set_stage(&newton, &stage);
  /* In balance everywhere except in the ball, which has moved since K was assembled. */
  for (int k = 0; k < 12; k++) {
    int status = flesh_equations_residual(equations, u, r);
    if (!status && k < 11) status = flesh_newton_matrix(&newton, u, NULL);
    if (!status && k < 11) status = flesh_matrix_policy_refresh(&newton.policy);
    flesh_direction_kind kind;
    const flesh_direction_request request = {.tolerance = 1e-8, .max_iterations = 2000};
    for (int d = 0; d < b.n; d++) r[d] = -r[d];
    if (!status && k < 11)
      status = flesh_direction_solve(&newton.direction, &request, r, w, &kind);
    CHECK_OK(status);
    for (int d = 0; d < b.n && k < 11; d++) u[d] += w[d];
  }
  CHECK_BELOW(flesh_norm(NULL, b.n, r), 1e-6);
  throw_about(&b, 0.002, u);
  u[3 * held + 1] = 0;
  double before, lower, size;
  CHECK_OK(flesh_equations_residual(equations, u, r));
  CHECK_OK(flesh_equations_potential(equations, u, &before, &size));
  CHECK_OK(flesh_subdomain_solve(&newton, u, r, w));
  /* The largest body that can be solved for alone has enough memory, many times over. */
  const size_t most = flesh_reserve_most(newton.reserve);
  flesh_reserve_enter(newton.reserve);
  CHECK(most > 0 && flesh_malloc(4 * most));
  flesh_reserve_enter(NULL);
  flesh_reserve_empty(newton.reserve);
  int moved = 0;
  for (int d = 0; d < b.n; d++) {
    there[d] = u[d] + w[d];
    moved += w[d] != 0;
  }
  CHECK(moved > 100 && moved < b.n / 4 && w[3 * held] != 0 && w[3 * held + 1] == 0);
  CHECK_OK(flesh_equations_residual(equations, there, after));
  CHECK_OK(flesh_equations_potential(equations, there, &lower, &size));
  CHECK(lower < before);
  for (int d = 0; d < b.n; d++)
    if (w[d] == 0) after[d] = 0;
  printf("# %d unknowns moved, residual %.3g, then %.3g\n", moved, flesh_norm(NULL, b.n, r),
         flesh_norm(NULL, b.n, after));
  CHECK_BELOW(flesh_norm(NULL, b.n, after), 0.01 * flesh_norm(NULL, b.n, r));
  free(u);
  free(r);
  flesh_newton_clear(&newton);
  test_body_destroy(&b);
}

/* Without memory there is no subdomain, and nothing else changes. */
static void a_used_up_reserve_is_no_harm(void)
{
  test_body b;
  flesh_newton newton;
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  make_block(FLESH_MASS_LUMPED, &b);
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_newton_init(b.system, &options, (flesh_stage_solver){NULL, solve_stage}, &newton));
  double *u = calloc((size_t)b.n, sizeof *u), *r = malloc(2 * (size_t)b.n * sizeof *r), *w = r + b.n;
  const flesh_stage stage = {
      .t = 0, .load = 1, .prescribed_fraction = 1, .shift = {.x = 1, .v = 60, .a = 3600}, .x0 = b.state.x};
  flesh_newton_set_stage(&newton, &stage);
  throw_about(&b, 0.002, u);
  CHECK_OK(flesh_equations_residual(&newton.equations, u, r));
  CHECK_OK(flesh_newton_matrix(&newton, u, r));
  CHECK_OK(flesh_subdomain_solve(&newton, u, r, w));
  const size_t needed = flesh_reserve_most(newton.reserve);
  flesh_reserve_destroy(&newton.reserve);
  /* A reserve has a whole number of 64 bytes. */
  for (size_t size = 0; size + 64 <= needed; size += needed / 40) {
    newton.reserve = flesh_reserve_create(size);
    CHECK(flesh_subdomain_solve(&newton, u, r, w) == FLESH_ERR_MEMORY && !flesh_reserve_entered());
    flesh_reserve_destroy(&newton.reserve);
  }
  newton.reserve = flesh_reserve_create(needed);
  CHECK_OK(flesh_subdomain_solve(&newton, u, r, w));
  free(u);
  free(r);
  flesh_newton_clear(&newton);
  test_body_destroy(&b);
}

static int lies;

/* A possible result of a subdomain's solve that raises the whole's potential. */
static int lie(void *data, const flesh_system *system, const flesh_solver_options *options, const flesh_stage *stage,
               flesh_stop stop, flesh_solve_stats *stats, double *u)
{
  (void)data, (void)options, (void)stage, (void)stop, (void)stats;
  lies++;
  for (int d = 0; d < flesh_system_unknowns(system); d++) u[d] = 1e-3 * (d % 3);
  return FLESH_OK;
}

/* A subdomain's result is added to a step only if it lowers the whole's potential. */
static void subdomains_that_raise_the_potential_are_refused(void)
{
  test_body b;
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  options.techniques &= ~(unsigned)FLESH_TECHNIQUE_WATCHDOG;
  make_block(FLESH_MASS_LUMPED, &b);
  CHECK_OK(flesh_system_finalize(b.system));
  double *u = calloc((size_t)b.n, sizeof *u), *r = malloc(2 * (size_t)b.n * sizeof *r), *p = r + b.n;
  const flesh_stage stage = {
      .t = 0, .load = 1, .prescribed_fraction = 1, .shift = {.x = 1, .v = 60, .a = 3600}, .x0 = b.state.x};
  throw_about(&b, 0.002, u);
  for (int k = 0; k < 2; k++) {
    flesh_newton newton;
    CHECK_OK(flesh_newton_init(b.system, &options, (flesh_stage_solver){NULL, k ? lie : NULL}, &newton));
    flesh_newton_set_stage(&newton, &stage);
    CHECK_OK(flesh_equations_residual(&newton.equations, u, r));
    CHECK_OK(flesh_newton_matrix(&newton, u, r));
    CHECK_OK(flesh_newton_prepare(&newton, 1));
    for (int d = 0; d < b.n; d++) r[d] = -r[d];
    CHECK_OK(flesh_newton_step(&newton, NULL, r, 1e-3, p));
    memcpy(k ? with : without, p, (size_t)b.n * sizeof *p);
    flesh_newton_clear(&newton);
  }
  CHECK(lies == 1 && !memcmp(with, without, (size_t)b.n * sizeof *p));
  free(u);
  free(r);
  test_body_destroy(&b);
}

/* m/s, velocity of the block towards a floor beneath it; 0: there is none */
static double fall;

/* Takes a step of backward Euler from the displaced ball, by the solve of its stage only: an integrator would use
 * softer materials first. Returns its cost; x [3*n] is its end. */
static flesh_solve_stats step(const flesh_solver_options *options, double amplitude, double *x)
{
  const double rate = 60;
  test_body b;
  flesh_nonlinear *nonlinear = NULL;
  flesh_solve_stats stats = {0};
  make_block(FLESH_MASS_LUMPED, &b);
  if (fall > 0) {
    flesh_effect *contact = NULL;
    flesh_contact_options law;
    flesh_contact_options_default(&law);
    flesh_obstacle *floor = NULL;
    CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, -1e-3}, (const double[]){0, 0, 1}, &floor));
    CHECK_OK(flesh_effect_obstacle_contact(&b.body, &law, &floor, &contact));
    CHECK_OK(flesh_system_add_effect(b.system, &contact));
  }
  for (int i = 0; i < b.n; i += 3) b.state.v[i + 2] = -fall;
  CHECK_OK(flesh_system_finalize(b.system));
  throw_about(&b, amplitude, b.state.x);
  const flesh_stage stage = {.t = 1 / rate,
                             .load = 1,
                             .prescribed_fraction = 1,
                             .shift = {.x = 1, .v = rate, .a = rate * rate},
                             .x0 = b.state.x,
                             .x_lag = b.state.x,
                             .v_lag = b.state.v};
  CHECK_OK(flesh_nonlinear_create(b.system, options, &nonlinear));
  CHECK_OK(flesh_nonlinear_solve(nonlinear, &stage, NULL, 0, &stats));
  CHECK(stats.potential_rises == 0);
  for (int d = 0; d < b.n; d++) x[d] = b.state.x[d] + nonlinear->u[d];
  flesh_nonlinear_destroy(&nonlinear);
  test_body_destroy(&b);
  return stats;
}

static void a_tangle_is_cheap_and_ends_the_same(void)
{
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  options.newton_tolerance = 1e-8; /* so that the ends are the same, not only near each other */
  flesh_solve_stats alone = step(&options, TANGLE, with);
  options.techniques &= ~(unsigned)FLESH_TECHNIQUE_NONLINEAR_ELIMINATION;
  flesh_solve_stats together = step(&options, TANGLE, without);
  double apart = 0;
  for (int d = 0; d < UNKNOWNS; d++) apart = fmax(apart, fabs(with[d] - without[d]));
  printf("# %d Newton iterations and %d in %d subdomains (as much as %.2f), else %d; ends %.2g m apart\n", alone.newton,
         alone.subdomain_newton, alone.subdomains, alone.subdomain_share, together.newton, apart);
  CHECK(alone.subdomains > 0 && alone.subdomain_newton >= alone.subdomains && together.subdomains == 0);
  CHECK(alone.subdomain_share > 0 && alone.subdomain_share < 0.5 * alone.subdomain_newton);
  CHECK(4 * alone.newton <= 3 * together.newton);
  CHECK_BELOW(apart, 1e-6);
}

/* With ten-node tets the subdomain also uses the body's own element. */
static void ten_node_tangles(void)
{
  for (element = FLESH_ELEMENT_TET10; element <= TEST_FEWER(FLESH_ELEMENT_TET10_MEAN, FLESH_ELEMENT_TET10); element++) {
    the_rest_of_the_body_is_there();
    a_used_up_reserve_is_no_harm();
    a_tangle_is_cheap_and_ends_the_same();
  }
  element = FLESH_ELEMENT_AUTO;
}

static void any_number_of_threads_gives_the_same_bits(void)
{
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  CHECK(step(&options, TANGLE, with).subdomains > 0);
  options.threads = 3;
  CHECK(step(&options, TANGLE, without).subdomains > 0);
  CHECK(!memcmp(with, without, sizeof with));
}

static void a_gentle_step_has_no_subdomain(void)
{
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  CHECK(step(&options, 0.0005, with).subdomains == 0);
  options.techniques &= ~(unsigned)FLESH_TECHNIQUE_NONLINEAR_ELIMINATION;
  step(&options, 0.0005, without);
  CHECK(!memcmp(with, without, sizeof with));
}

/* A body that falls onto a floor is not solved for in parts, because the mispredicted residual is that of the barrier,
 * of which a subdomain only has a quadratic model; a tangle in the same body still is. */
static void contact_has_no_subdomain(void)
{
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  fall = 3;
  const flesh_solve_stats gentle = step(&options, 0, with), tangled = step(&options, TANGLE, with);
  fall = 0;
  printf("# %d Newton iterations with %d subdomains, and %d with %d\n", gentle.newton, gentle.subdomains, tangled.newton,
         tangled.subdomains);
  CHECK(gentle.newton > 3 && gentle.subdomains == 0 && tangled.subdomains > 0);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(parts_add_up), TEST(the_rest_of_the_body_is_there),
                   TEST(a_used_up_reserve_is_no_harm),
                   TEST(subdomains_that_raise_the_potential_are_refused), TEST(a_tangle_is_cheap_and_ends_the_same),
                   TEST(ten_node_tangles), TEST_OF_THREADS(any_number_of_threads_gives_the_same_bits), TEST(a_gentle_step_has_no_subdomain),
                   TEST(contact_has_no_subdomain));
}
