/* test_untangle.c: tangles are found by winding, put back, and calm bodies leave them; held ones are left alone. */
#include <stdlib.h>

#include "body.h"
#include "mesh/winding.h"
#include "test.h"

static flesh_mesh *bar(void)
{
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_box((int[]){12, 4, 4}, (double[]){1, 1. / 3, 1. / 3}, (double[]){0, 0, 0}, &mesh));
  return mesh;
}

/* A fan of `count` tets around the z axis, each taking `angle` of it: a closed ring at angle = 2 pi / count. */
static void fan_positions(int count, double angle, double *x)
{
  double axis[6] = {0, 0, 0, 0, 0, 1};
  memcpy(x, axis, sizeof axis);
  for (int k = 0; k < count; k++) {
    x[6 + 3 * k] = cos(angle * k);
    x[7 + 3 * k] = sin(angle * k);
    x[8 + 3 * k] = 0.5;
  }
}

static flesh_mesh *fan(int count)
{
  double *x = malloc(sizeof(double) * 3 * (size_t)(count + 2));
  int *tets = malloc(sizeof(int) * 4 * (size_t)count);
  flesh_mesh *mesh = NULL;
  fan_positions(count, 2 * M_PI / count, x);
  for (int k = 0; k < count; k++) {
    int tet[4] = {0, 2 + k, 2 + (k + 1) % count, 1};
    memcpy(tets + 4 * k, tet, sizeof tet);
  }
  CHECK_OK(flesh_mesh_create(count + 2, x, count, tets, NULL, &mesh));
  free(x);
  free(tets);
  return mesh;
}

/* Wound twice around its axis every tet of a ring of seven keeps a positive volume. */
static void double_winding_is_found(void)
{
  enum { COUNT = 7 };
  flesh_mesh *mesh = fan(COUNT);
  flesh_winding *winding = NULL;
  const uint8_t *tangled;
  double x[3 * (COUNT + 2)];
  int inverted;
  CHECK_OK(flesh_winding_create(mesh, &winding));
  CHECK(flesh_winding_find(winding, flesh_mesh_positions(mesh), &tangled) == 0);
  CHECK(!flesh_mesh_may_be_tangled(mesh, flesh_mesh_positions(mesh)));
  fan_positions(COUNT, 4 * M_PI / COUNT, x);
  flesh_mesh_jacobians(mesh, x, NULL, NULL, &inverted);
  CHECK(inverted == 0);
  CHECK(flesh_mesh_may_be_tangled(mesh, x));
  CHECK(flesh_winding_find(winding, x, &tangled) == COUNT);
  /* Nothing around it is left to say where it was, but its shape comes back. */
  uint8_t fixed[3 * (COUNT + 2)] = {0};
  CHECK(flesh_winding_embed(winding, 1, fixed, x) == COUNT + 2);
  CHECK_BELOW(flesh_mesh_distance_from_rest(mesh, x), 1e-12);
  flesh_winding_destroy(&winding);
  flesh_mesh_destroy(&mesh);
}

/* The quick test never misses a tangle: wherever it says no, the winding finds none. */
static void the_quick_test_is_safe(void)
{
  flesh_mesh *mesh = bar();
  flesh_winding *winding = NULL;
  CHECK_OK(flesh_winding_create(mesh, &winding));
  int n = 3 * flesh_mesh_node_count(mesh), said_no = 0, found = 0;
  double *x = malloc(sizeof(double) * (size_t)n);
  unsigned long long random = 7;
  for (int trial = 0; trial < 200; trial++) {
    double size = 0.002 * trial;
    const uint8_t *tangled;
    for (int d = 0; d < n; d++) x[d] = flesh_mesh_positions(mesh)[d] + size * (test_uniform(&random) - 0.5);
    int may = flesh_mesh_may_be_tangled(mesh, x), count = flesh_winding_find(winding, x, &tangled);
    CHECK(may || !count);
    said_no += !may;
    found += count > 0;
  }
  CHECK(said_no > 5 && found > 50);
  free(x);
  flesh_winding_destroy(&winding);
  flesh_mesh_destroy(&mesh);
}

/* A knot of scrambled nodes within a bent body is put back to where its surroundings say. */
static void a_knot_is_put_back(void)
{
  flesh_mesh *mesh = bar();
  flesh_winding *winding = NULL;
  CHECK_OK(flesh_winding_create(mesh, &winding));
  const double *X = flesh_mesh_positions(mesh);
  int nodes = flesh_mesh_node_count(mesh);
  double *x = malloc(sizeof(double) * 3 * (size_t)nodes), *bent = malloc(sizeof(double) * 3 * (size_t)nodes);
  uint8_t *fixed = calloc(3 * (size_t)nodes, 1);
  unsigned long long random = 3;
  for (int i = 0; i < nodes; i++) {
    double angle = X[3 * i], radius = 1 + X[3 * i + 1];
    bent[3 * i] = radius * sin(angle), bent[3 * i + 1] = radius * cos(angle), bent[3 * i + 2] = X[3 * i + 2];
  }
  memcpy(x, bent, sizeof(double) * 3 * (size_t)nodes);
  for (int i = 0; i < nodes; i++)
    if (fabs(X[3 * i] - 0.5) < 0.1 && fabs(X[3 * i + 1] - 1. / 6) < 0.1 && fabs(X[3 * i + 2] - 1. / 6) < 0.1)
      for (int c = 0; c < 3; c++) x[3 * i + c] += 0.4 * (test_uniform(&random) - 0.5);
  const uint8_t *tangled;
  CHECK(flesh_winding_find(winding, bent, &tangled) == 0);
  CHECK(flesh_winding_find(winding, x, &tangled) > 0);
  int moved = flesh_winding_embed(winding, 1, fixed, x);
  CHECK(moved > 0 && moved < nodes);
  CHECK(flesh_winding_find(winding, x, &tangled) == 0);
  double worst = 0;
  for (int d = 0; d < 3 * nodes; d++) {
    worst = fmax(worst, fabs(x[d] - bent[d]));
    if (!flesh_winding_moved(winding)[d / 3]) CHECK(x[d] == bent[d]);
  }
  CHECK_BELOW(worst, 1. / 12); /* an edge: the body is bent there */
  free(x), free(bent), free(fixed);
  flesh_winding_destroy(&winding);
  flesh_mesh_destroy(&mesh);
}

typedef struct ending {
  int tangled, untanglings;
  double distance;
} ending;

/* Runs a clamped bar of S from a start until it has come to rest. */
static ending settle(int start, double poisson, int untangle, double gravity)
{
  test_body b;
  flesh_material material;
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  flesh_winding *winding = NULL;
  flesh_solve_stats stats = {0};
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, poisson, &material));
  CHECK_OK(test_body_create(bar(), material, 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  if (gravity != 0) CHECK_OK(test_body_gravity(&b, 0, 0, gravity));
  CHECK_OK(flesh_system_finish(b.system));
  unsigned long long random = 12345;
  for (int i = 0; i < b.n / 3; i++) {
    double *p = b.state.x + 3 * i;
    if (p[0] < 1e-9) continue;
    if (start == 0) p[0] = -p[0]; /* mirrored */
    for (int c = 0; start == 1 && c < 3; c++) p[c] = test_uniform(&random) / (c ? 3 : 1); /* scrambled */
  }
  flesh_solver_options_default(&options);
  options.untangle = untangle;
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  for (int k = 0; k < 300; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, &stats));
  /* Longer steps damp the rest of the swing. */
  for (int k = 0; k < 40; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.5, &stats));
  const uint8_t *tangled;
  CHECK_OK(flesh_winding_create(b.mesh, &winding));
  ending end = {flesh_winding_find(winding, b.state.x, &tangled), stats.untanglings,
                flesh_mesh_distance_from_rest(b.mesh, b.state.x)};
  printf("# start %d, poisson %g, untangle %d: %d tangled tets, %.3g of the length from rest, %d untanglings\n",
         start, poisson, untangle, end.tangled, end.distance, end.untanglings);
  flesh_winding_destroy(&winding);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return end;
}

/* Without help these stay in a local minimum for ever; with it they come back to rest. */
static void calm_bodies_leave_their_tangles(void)
{
  for (int start = 0; start < 2; start++) {
    ending stuck = settle(start, 0.49, 0, 0), back = settle(start, 0.49, 1, 0);
    CHECK(stuck.tangled > 0 && stuck.untanglings == 0 && stuck.distance > 0.1);
    CHECK(back.tangled == 0 && back.untanglings > 0);
    CHECK_BELOW(back.distance, 1e-3);
  }
}

/* An equilibrium that is a tangle is put back and solved again. */
static void equilibria_are_untangled(void)
{
  test_body b;
  flesh_material material;
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.49, &material));
  CHECK_OK(test_body_create(bar(), material, 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finish(b.system));
  for (int i = 0; i < b.n / 3; i++) b.state.x[3 * i] *= -1; /* mirrored */
  flesh_solver_options_default(&options);
  options.untangle = 0;
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  for (int k = 0; k < 120; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, NULL));
  flesh_integrator_destroy(&integrator);
  options.newton_tolerance = 1e-10;
  options.max_newton = 1000;
  for (int untangle = 0; untangle < 2; untangle++) {
    flesh_solve_stats stats = {0};
    options.untangle = untangle;
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, &stats));
    double distance = flesh_mesh_distance_from_rest(b.mesh, b.state.x);
    printf("# statics, untangle %d: %.3g of the length from rest, %d untanglings\n", untangle, distance,
           stats.untanglings);
    CHECK((stats.untanglings > 0) == untangle);
    if (untangle) CHECK_BELOW(distance, 1e-7);
    else CHECK(distance > 0.1);
    flesh_integrator_destroy(&integrator);
  }
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(double_winding_is_found), TEST(the_quick_test_is_safe),
                   TEST(a_knot_is_put_back), TEST(calm_bodies_leave_their_tangles),
                   TEST(equilibria_are_untangled));
}
