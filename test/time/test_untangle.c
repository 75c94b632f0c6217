// TEST full seconds=120
/* test_untangle.c: tangles are detected by winding numbers and untangled, and bodies at rest leave them; held ones are
 * left alone. */
#include <stdlib.h>

#include "body.h"
#include "mesh/mesh.h"
#include "time/recovery/recovery.h"
#include "time/recovery/winding.h"
#include "test.h"

static flesh_mesh *bar(void)
{
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_box((int[]){12, 4, 4}, (double[]){1, 1. / 3, 1. / 3}, (double[]){0, 0, 0}, &mesh));
  return mesh;
}

/* Makes a fan of `count` tets around the z axis, each taking `angle` of it: a closed ring at angle = 2 pi / count. */
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

/* Wound twice around its axis, every tet of a ring of seven keeps a positive volume. */
static void double_winding_is_found(void)
{
  enum { COUNT = 7 };
  flesh_mesh *mesh = fan(COUNT);
  flesh_winding *winding = NULL;
  const uint8_t *tangled;
  double x[3 * (COUNT + 2)];
  int inverted;
  CHECK_OK(flesh_winding_create(mesh, NULL, &winding));
  CHECK(flesh_winding_find(winding, flesh_mesh_positions(mesh), &tangled) == 0);
  CHECK(!flesh_mesh_may_be_tangled(mesh, flesh_mesh_positions(mesh)));
  fan_positions(COUNT, 4 * M_PI / COUNT, x);
  flesh_mesh_jacobians(mesh, x, NULL, NULL, &inverted);
  CHECK(inverted == 0);
  CHECK(flesh_mesh_may_be_tangled(mesh, x));
  CHECK(flesh_winding_find(winding, x, &tangled) == COUNT);
  flesh_winding_destroy(&winding);
  flesh_mesh_destroy(&mesh);
}

/* A tet as strained as in a tangle counts as one after an inversion, and at the start, when nothing is known of it. */
static void tangles_are_remembered(void)
{
  enum { COUNT = 7, PLACES = 6 };
  flesh_mesh *mesh = fan(COUNT);
  flesh_recovery recovery = {.mesh = mesh, .tangled = 1};
  double wound[3 * (COUNT + 2)], inverted[3 * (COUNT + 2)];
  const double *rest = flesh_mesh_positions(mesh);
  fan_positions(COUNT, 4 * M_PI / COUNT, wound);
  memcpy(inverted, rest, sizeof inverted);
  const double *places[PLACES] = {wound, rest, wound, inverted, wound, rest};
  const int tangled[PLACES] = {1, 0, 0, 1, 1, 0};
  inverted[2 * 3] *= -1; /* a node of the ring on the other side of the axis */
  inverted[2 * 3 + 1] *= -1;
  for (int k = 0; k < PLACES; k++) CHECK(flesh_recovery_is_tangled(&recovery, places[k]) == tangled[k]);
  flesh_mesh_destroy(&mesh);
}

/* The quick test never misses a tangle: whenever it finds none, nor does the winding number. */
static void the_quick_test_is_safe(void)
{
  flesh_mesh *mesh = bar();
  flesh_winding *winding = NULL;
  CHECK_OK(flesh_winding_create(mesh, NULL, &winding));
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

/* A few tets of many, as in a crease, are none: the corner of a block passes through its tets, six of 4374 at most. */
static void creases_are_no_tangles(void)
{
  flesh_mesh *mesh = test_box(9, 9, 9, 1, 1, 1);
  flesh_recovery recovery = {.mesh = mesh, .tangled = 1};
  const size_t bytes = sizeof(double) * 3 * (size_t)flesh_mesh_node_count(mesh);
  double *x = malloc(bytes);
  int inverted;
  memcpy(x, flesh_mesh_positions(mesh), bytes);
  CHECK(!flesh_recovery_is_tangled(&recovery, x));
  for (int c = 0; c < 3; c++) x[c] = 0.4; /* from 0 */
  flesh_mesh_jacobians(mesh, x, NULL, NULL, &inverted);
  CHECK(inverted > 0 && inverted <= 6);
  CHECK(!flesh_recovery_is_tangled(&recovery, x));
  free(x);
  flesh_mesh_destroy(&mesh);
}

/* At order 2 mid-edge nodes can be tangled too, and tets inverted without an inverted flat piece. */
static void tangles_of_ten_nodes_are_found(void)
{
  flesh_mesh *linear = bar(), *mesh;
  flesh_winding *winding = NULL;
  const uint8_t *tangled;
  CHECK_OK(flesh_mesh_raise_order(linear, &mesh));
  flesh_mesh_destroy(&linear);
  CHECK_OK(flesh_winding_create(mesh, NULL, &winding));
  const double *X = flesh_mesh_positions(mesh);
  int n = 3 * flesh_mesh_node_count(mesh), pieces = 8 * flesh_mesh_tet_count(mesh), inverted, hidden = 0;
  double *x = malloc(sizeof(double) * (size_t)n);
  CHECK(!flesh_mesh_may_be_tangled(mesh, X) && flesh_winding_find(winding, X, &tangled) == 0);
  CHECK(!flesh_mesh_is_flat(mesh, X));
  unsigned long long random = 5;
  for (int trial = 0; trial < 100; trial++) {
    for (int d = 0; d < n; d++) x[d] = X[d] + 0.0016 * trial * (test_uniform(&random) - 0.5);
    double J = flesh_mesh_jacobian_bounds(mesh, x, NULL, NULL, &inverted);
    int may = flesh_mesh_may_be_tangled(mesh, x), count = flesh_winding_find(winding, x, &tangled);
    CHECK(may || !count);
    CHECK(J > 0 || (may && count >= 8 * inverted && count <= pieces));
    hidden += inverted > 0 && count == 8 * inverted;
  }
  CHECK(hidden > 0);
  /* A tangle around a mid-edge node. */
  memcpy(x, X, sizeof(double) * (size_t)n);
  int at = flesh_mesh_tet_edges(mesh)[6 * (flesh_mesh_tet_count(mesh) / 2) + 3];
  for (int i = 0; i < n; i += 3)
    if (hypot(hypot(X[i] - X[3 * at], X[i + 1] - X[3 * at + 1]), X[i + 2] - X[3 * at + 2]) < 0.09)
      for (int c = 0; c < 3; c++) x[i + c] += 0.3 * (test_uniform(&random) - 0.5);
  CHECK(flesh_mesh_jacobian_bounds(mesh, x, NULL, NULL, NULL) < 0);
  CHECK(flesh_winding_find(winding, x, &tangled) > 0);
  /* A body in a point has collapsed; one on a line is flat. */
  for (int d = 0; d < n; d++) x[d] = d % 3 ? 0 : X[d];
  CHECK(flesh_mesh_is_flat(mesh, x) && flesh_mesh_may_be_tangled(mesh, x));
  CHECK(flesh_winding_find(winding, x, &tangled) == pieces);
  free(x);
  flesh_winding_destroy(&winding);
  flesh_mesh_destroy(&mesh);
}

/* Thin ten-node tets that bend have flat pieces that are inverted, though J is positive everywhere. */
static void bent_plates_are_no_tangles(void)
{
  flesh_mesh *linear = test_box(4, 4, 1, 1, 1, 0.01), *mesh;
  flesh_winding *winding = NULL;
  const uint8_t *tangled;
  CHECK_OK(flesh_mesh_raise_order(linear, &mesh));
  flesh_mesh_destroy(&linear);
  CHECK_OK(flesh_winding_create(mesh, NULL, &winding));
  const double *X = flesh_mesh_positions(mesh), radius = 0.5, s = sqrt(0.5);
  const int n = 3 * flesh_mesh_node_count(mesh);
  double *x = malloc(sizeof(double) * (size_t)n);
  for (int i = 0; i < n; i += 3) { /* about the diagonal x = y */
    const double across = s * (X[i] - X[i + 1]), along = s * (X[i] + X[i + 1]), r = radius + X[i + 2];
    const double bent = r * sin(across / radius);
    x[i] = s * (along + bent), x[i + 1] = s * (along - bent), x[i + 2] = r * cos(across / radius);
  }
  CHECK(flesh_mesh_jacobian_bounds(mesh, x, NULL, NULL, NULL) > 0.9);
  CHECK(!flesh_mesh_may_be_tangled(mesh, x));
  CHECK(flesh_winding_find(winding, x, &tangled) == 0);
  free(x);
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
  CHECK_OK(flesh_system_finalize(b.system));
  unsigned long long random = 12345;
  for (int i = 0; i < b.n / 3; i++) {
    double *p = b.state.x + 3 * i;
    if (p[0] < 1e-9) continue;
    if (start == 0) p[0] = -p[0]; /* mirrored */
    for (int c = 0; start == 1 && c < 3; c++) p[c] = test_uniform(&random) / (c ? 3 : 1); /* scrambled */
  }
  flesh_solver_options_default(&options);
  if (!untangle) options.techniques &= ~(unsigned)FLESH_TECHNIQUE_UNTANGLE;
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  for (int k = 0; k < 300; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, &stats));
  /* Longer steps damp the rest of the swing. */
  for (int k = 0; k < 120; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.5, &stats));
  const uint8_t *tangled;
  CHECK_OK(flesh_winding_create(b.mesh, NULL, &winding));
  ending end = {flesh_winding_find(winding, b.state.x, &tangled), stats.untanglings,
                flesh_mesh_distance_from_rest(b.mesh, b.state.x)};
  printf("# start %d, poisson %g, untangle %d: %d tangled tets, %.3g of the length from rest, %d untanglings\n",
         start, poisson, untangle, end.tangled, end.distance, end.untanglings);
  flesh_winding_destroy(&winding);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return end;
}

/* Most recover by themselves. Which tangles occur depends on rounding; a body recovers from all. */
static void bodies_near_rest_leave_their_tangles(void)
{
  for (int start = 0; start < 2; start++)
    for (int k = 0; k < 3; k++) {
      ending back = settle(start, 0.488 + 0.001 * k, 1, 0);
      CHECK(back.tangled == 0);
      CHECK_BELOW(back.distance, 1e-3);
    }
}

/* Takes a step of the static method from the bar's state. */
static int find_equilibrium(test_body *b, const flesh_solver_options *options)
{
  flesh_integrator *integrator = NULL;
  flesh_solve_stats stats = {0};
  CHECK_OK(flesh_integrator_create(b->system, FLESH_METHOD_STATIC, options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b->state, 0, &stats));
  flesh_integrator_destroy(&integrator);
  return stats.untanglings;
}

/* Makes a bar at rest in a mirrored, tangled state, with untangling switched off, and its untangled equilibrium: wanted
 * [n], which the caller frees. */
static void make_tangled(int hangs, flesh_solver_options *options, test_body *b, double **wanted)
{
  flesh_material material;
  flesh_integrator *integrator = NULL;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.49, &material));
  CHECK_OK(test_body_create(bar(), material, 1000, FLESH_MASS_LUMPED, 1, b));
  CHECK_OK(test_body_clamp(b, 1e-9));
  if (hangs) CHECK_OK(test_body_gravity(b, 0, 0, -0.5));
  CHECK_OK(flesh_system_finalize(b->system));
  const double *X = flesh_mesh_positions(b->mesh);
  *wanted = malloc(sizeof(double) * (size_t)b->n);
  flesh_solver_options_default(options);
  options->newton_tolerance = 1e-10;
  options->max_newton = 1000;
  CHECK(find_equilibrium(b, options) == 0);
  memcpy(*wanted, b->state.x, sizeof(double) * (size_t)b->n);
  for (int d = 0; d < b->n; d++) b->state.x[d] = d % 3 ? X[d] : -X[d]; /* mirrored */
  options->techniques &= ~(unsigned)FLESH_TECHNIQUE_UNTANGLE;
  CHECK_OK(flesh_integrator_create(b->system, FLESH_METHOD_BACKWARD_EULER, options, &integrator));
  for (int k = 0; k < 120; k++) CHECK_OK(flesh_integrator_step(integrator, &b->state, 1. / 60, NULL));
  flesh_integrator_destroy(&integrator);
}

/* An equilibrium that is a tangle is untangled and solved again, for the true material: under its weight the bar then
 * hangs like one that was never tangled. */
static void equilibria_are_untangled(void)
{
  for (int hangs = 0; hangs < 2; hangs++) {
    test_body b;
    flesh_solver_options options;
    double *wanted = NULL;
    make_tangled(hangs, &options, &b, &wanted);
    for (int untangle = 0; untangle < 2; untangle++) {
      options.techniques = untangle ? FLESH_TECHNIQUES_ALL : FLESH_TECHNIQUES_ALL & ~FLESH_TECHNIQUE_UNTANGLE;
      const int untanglings = find_equilibrium(&b, &options);
      const double distance = test_distance(b.n, b.state.x, wanted) / sqrt(b.n / 3.);
      printf("# statics, hangs %d, untangle %d: %.3g m from where it should be, %d untanglings\n", hangs, untangle,
             distance, untanglings);
      CHECK((untanglings > 0) == untangle);
      if (untangle) CHECK_BELOW(distance, 1e-7);
      else CHECK(distance > 0.05);
    }
    free(wanted);
    test_body_destroy(&b);
  }
}

/* In motion too: from rest in a tangle, with steps so short that each has one minimum, softer materials in a step do
 * not help; only untangling does. */
static void what_rests_in_a_tangle_is_untangled(void)
{
  test_body b;
  flesh_solver_options options;
  double *wanted = NULL;
  make_tangled(0, &options, &b, &wanted);
  CHECK(find_equilibrium(&b, &options) == 0);
  for (int untangle = 0; untangle < 2; untangle++) {
    flesh_integrator *integrator = NULL;
    flesh_solve_stats stats = {0};
    options.techniques = untangle ? FLESH_TECHNIQUES_ALL : FLESH_TECHNIQUES_ALL & ~FLESH_TECHNIQUE_UNTANGLE;
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
    for (int k = 0; k < 12; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1e-4, &stats));
    const double distance = test_distance(b.n, b.state.x, wanted) / sqrt(b.n / 3.);
    printf("# at rest, untangle %d: %.3g m from where it should be, %d untanglings\n", untangle, distance,
           stats.untanglings);
    CHECK(stats.untanglings == untangle);
    if (untangle) CHECK_BELOW(distance, 1e-3);
    else CHECK(distance > 0.05);
    flesh_integrator_destroy(&integrator);
  }
  free(wanted);
  test_body_destroy(&b);
}

/* A bar compressed to half its length folds, and a few tets of the folds are inverted: the equilibrium without
 * inversion is found, otherwise unchanged, at less than the cost of the first solve. */
static void tangles_of_equilibria_are_left_locally(void)
{
  flesh_solve_stats stats[2] = {{0}};
  double *ends[2];
  int n = 0, inverted[2];
  for (int untangle = 0; untangle < 2; untangle++) {
    test_body b;
    flesh_solver_options options;
    flesh_integrator *integrator = NULL;
    const flesh_keyframe key = {.translation = {-2, 0, 0}};
    CHECK_OK(test_body_create(test_box(16, 4, 4, 4, 1, 1), test_material(FLESH_ENERGY_S, 0.49), 1000, FLESH_MASS_LUMPED, 0,
                              &b));
    CHECK_OK(test_body_clamp(&b, 1e-9));
    CHECK_OK(test_body_hold(&b, 0, 4, FLESH_AXES_ALL, &(flesh_motion){.count = 1, .keyframes = &key}, -INFINITY, INFINITY));
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_solver_options_default(&options);
    if (!untangle) options.techniques &= ~(unsigned)FLESH_TECHNIQUE_UNTANGLE;
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, &stats[untangle]));
    flesh_mesh_jacobians(b.mesh, b.state.x, NULL, NULL, &inverted[untangle]);
    printf("# pressed, untangle %d: %d tets inverted, %d Newton iterations\n", untangle, inverted[untangle],
           stats[untangle].newton);
    flesh_integrator_destroy(&integrator);
    n = b.n;
    ends[untangle] = b.state.x, b.state.x = NULL;
    test_body_destroy(&b);
  }
  printf("# rms distance between the two ends %.3g m\n", test_distance(n, ends[0], ends[1]) / sqrt(n / 3.));
  CHECK(inverted[0] > 0 && stats[0].untanglings == 0);
  CHECK(inverted[1] == 0 && stats[1].untanglings == 1);
  CHECK(stats[1].newton < 2 * stats[0].newton);
  CHECK_BELOW(test_distance(n, ends[0], ends[1]) / sqrt(n / 3.), 0.04); /* of 4 m; softened everywhere it folds anew */
  free(ends[0]), free(ends[1]);
}

/* Shrunk below a tenth in the mean; exact lines and points are distinguished from bodies with extent. */
static void collapse_is_found(void)
{
  flesh_mesh *mesh = bar();
  flesh_winding *winding = NULL;
  const uint8_t *tangled;
  int n = 3 * flesh_mesh_node_count(mesh);
  const double *X = flesh_mesh_positions(mesh);
  double *x = malloc(sizeof(double) * (size_t)n);
  CHECK_OK(flesh_winding_create(mesh, NULL, &winding));
  for (int k = 0; k < 3; k++) {
    const double scales[] = {0.11, 0.09, 1e-12};
    for (int d = 0; d < n; d++) x[d] = scales[k] * X[d];
    int all = k ? flesh_mesh_tet_count(mesh) : 0;
    CHECK(flesh_winding_find(winding, x, &tangled) == all);
    CHECK(flesh_mesh_may_be_tangled(mesh, x) == (k > 0));
    CHECK(!flesh_mesh_is_flat(mesh, x));
  }
  /* Remaining dimensions, and noise in the others. */
  const struct { int dimensions; double noise; int flat; } shapes[] = {
      {0, 0, 1}, {1, 0, 1}, {2, 0, 0}, {1, 1e-6, 0}, {0, 1e-12, 0}};
  for (int k = 0; k < 5; k++) {
    for (int d = 0; d < n; d++) x[d] = d % 3 < shapes[k].dimensions ? X[d] : 0.25;
    test_jitter(n, shapes[k].noise, 1, x);
    CHECK(flesh_mesh_is_flat(mesh, x) == shapes[k].flat);
  }
  free(x);
  flesh_winding_destroy(&winding);
  flesh_mesh_destroy(&mesh);
}

/* Makes a body and a copy beside it; [node < nodes of the body] are the body's. */
static flesh_mesh *two_of(const flesh_mesh *one, double apart)
{
  const int nodes = flesh_mesh_node_count(one), tets = flesh_mesh_tet_count(one);
  double *X = malloc(sizeof(double) * 6 * (size_t)nodes);
  int *both = malloc(sizeof(int) * 8 * (size_t)tets);
  flesh_mesh *mesh = NULL;
  for (int d = 0; d < 3 * nodes; d++) {
    X[d] = flesh_mesh_positions(one)[d];
    X[3 * nodes + d] = X[d] + (d % 3 == 0 ? apart : 0);
  }
  for (int k = 0; k < 4 * tets; k++) {
    both[k] = flesh_mesh_tets(one)[k];
    both[4 * tets + k] = both[k] + nodes;
  }
  CHECK_OK(flesh_mesh_create(2 * nodes, X, 2 * tets, both, NULL, &mesh));
  free(X), free(both);
  return mesh;
}

/* Two bodies that have moved apart, one of them upside down, collapse to a point each or have a tangle inside: both
 * recover their shape at their present position, not side by side as at rest. */
static void bodies_come_back_where_they_are(void)
{
  for (int knot = 0; knot < 2; knot++) {
    test_body b;
    flesh_material material;
    flesh_solver_options options;
    flesh_integrator *integrator = NULL;
    flesh_solve_stats stats = {0};
    flesh_mesh *one = test_box(4, 4, 4, 1, 1, 1), *both = two_of(one, 1.5);
    const int nodes = flesh_mesh_node_count(one);
    const double *X = flesh_mesh_positions(both);
    CHECK_OK(knot ? flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.49, &material)
                  : flesh_material_from_young(FLESH_ENERGY_E, FLESH_CONSTANTS_MATCHED, 1e5, 0.3, &material));
    CHECK_OK(test_body_create(both, material, 1000, FLESH_MASS_LUMPED, 1, &b));
    CHECK_OK(flesh_system_finalize(b.system));
    unsigned long long random = 5;
    double middle[2][3] = {{0.5, 0.5, 0.5}, {12, -0.5, -0.5}};
    for (int i = 0; i < 2 * nodes; i++) {
      const int second = i >= nodes;
      double *p = b.state.x + 3 * i;
      p[0] += second ? 10 : 0;
      for (int c = 1; c < 3 && second; c++) p[c] = -p[c];
      for (int c = 0; c < 3; c++) {
        if (!knot) p[c] = middle[second][c] + 0.01 * (p[c] - middle[second][c]);
        else if (fabs(X[3 * i + 1] - 0.5) < 0.3 && fabs(X[3 * i + 2] - 0.5) < 0.3) p[c] += test_uniform(&random) - 0.5;
      }
    }
    flesh_solver_options_default(&options);
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
    for (int k = 0; k < 80; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.1, &stats));
    printf("# two bodies, %s: %d untanglings\n", knot ? "a knot in each" : "a point each", stats.untanglings);
    CHECK(stats.untanglings > 0 || knot);
    double worst = 0;
    for (int body = 0; body < 2; body++) {
      double centre[3] = {0};
      for (int i = 0; i < nodes; i++)
        for (int c = 0; c < 3; c++) centre[c] += b.state.x[3 * (body * nodes + i) + c] / nodes;
      for (int c = 0; c < 3; c++) CHECK_NEAR(centre[c], middle[body][c], knot ? 0.1 : 1e-6);
      for (int i = 1; i < nodes; i++) {
        const int p = 3 * (body * nodes + i), q = 3 * body * nodes;
        double now[3], rest[3];
        for (int c = 0; c < 3; c++) now[c] = b.state.x[p + c] - b.state.x[q + c], rest[c] = X[p + c] - X[q + c];
        worst = fmax(worst, fabs(test_norm(3, now) - test_norm(3, rest)));
      }
    }
    CHECK_BELOW(worst, 1e-4);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
    flesh_mesh_destroy(&one);
  }
}

/* Runs a free block whose rest shape is scaled along the axes until it is at rest. */
static ending collapse(flesh_energy energy, flesh_constants constants, const double scale[3],
                       int untangle)
{
  test_body b;
  flesh_material material;
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  flesh_solve_stats stats = {0};
  CHECK_OK(flesh_material_from_young(energy, constants, 1e5, 0.3, &material));
  CHECK_OK(test_body_create(test_box(4, 2, 2, 2, 1, 1), material, 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(flesh_system_finalize(b.system));
  for (int d = 0; d < b.n; d++) b.state.x[d] *= scale[d % 3];
  flesh_solver_options_default(&options);
  if (!untangle) options.techniques &= ~(unsigned)FLESH_TECHNIQUE_UNTANGLE;
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  for (int k = 0; k < 60; k++)
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.2, &stats));
  ending end = {0, stats.untanglings, flesh_mesh_distance_from_rest(b.mesh, b.state.x)};
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return end;
}

/* F = 0 is a local minimum of E's energy at nu = 0.3: a body that collapses to it leaves it through softer materials, a
 * body that starts in it stays, and so does a line, which has nowhere else to go. D at this nu has no other rest
 * state. */
static void collapsed_bodies_come_back(void)
{
  const double small[] = {0.01, 0.01, 0.01}, point[] = {0, 0, 0}, line[] = {1, 0, 0},
               rest[] = {1, 1, 1};
  for (int untangle = 0; untangle < 2; untangle++) {
    ending back = collapse(FLESH_ENERGY_E, FLESH_CONSTANTS_MATCHED, small, untangle);
    CHECK(back.untanglings == 0);
    CHECK_BELOW(back.distance, 1e-6);
  }
  const double *flat[] = {point, line};
  for (int k = 0; k < 2; k++) {
    ending stays = collapse(FLESH_ENERGY_E, FLESH_CONSTANTS_MATCHED, flat[k], 1);
    CHECK(stays.untanglings == 0 && stays.distance > 0.5);
  }
  ending deflated = collapse(FLESH_ENERGY_D, FLESH_CONSTANTS_RAW, rest, 1);
  CHECK(deflated.untanglings == 0 && deflated.distance > 0.5);
}

/* An inverted tet of E may collapse to a point, in which its energy is no more than at rest for nu = 0, and where no
 * material has a force: softer materials are used before it gets there. */
static void a_point_without_forces_is_not_reached(void)
{
  for (int untangle = 0; untangle < 2; untangle++) {
    test_body b;
    flesh_material material;
    flesh_solver_options options;
    flesh_integrator *integrator = NULL;
    flesh_solve_stats stats = {0};
    flesh_mesh *mesh = NULL;
    const double X[12] = {0, 0, 0, 1, 1, 0, 1, 0, 1, 0, 1, 1},
                 start[12] = {0.86, 0.67, 0.49, 0.08, 0.79, 0.04, 0.75, 0.07, 0.79, 0.80, 0.65, 0.27};
    CHECK_OK(flesh_mesh_create(4, X, 1, (int[]){0, 1, 3, 2}, NULL, &mesh));
    CHECK_OK(flesh_material_from_young(FLESH_ENERGY_E, FLESH_CONSTANTS_MATCHED, 1e5, 0, &material));
    CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_LUMPED, 1, &b));
    CHECK_OK(flesh_system_finalize(b.system));
    memcpy(b.state.x, start, sizeof start);
    flesh_solver_options_default(&options);
    if (!untangle) options.techniques &= ~(unsigned)FLESH_TECHNIQUE_UNTANGLE;
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
    for (int k = 0; k < 120; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.2, &stats));
    const double distance = flesh_mesh_distance_from_rest(b.mesh, b.state.x);
    printf("# one tet, untangle %d: %d untanglings, %.3g from rest\n", untangle, stats.untanglings, distance);
    CHECK(stats.untanglings == 0);
    CHECK_BELOW(distance, 1e-6);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* A spring that holds a corner pulled through the body keeps tets inverted; when released, it recovers. */
static void held_tangles_stay(void)
{
  test_body b;
  flesh_material material;
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  flesh_effect *effect = NULL;
  flesh_solve_stats stats = {0};
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.45, &material));
  CHECK_OK(test_body_create(test_box(1, 1, 1, 1, 1, 1), material, 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  const flesh_keyframe key = {.translation = {-0.5, -0.5, -0.5}};
  const flesh_motion target = {.count = 1, .keyframes = &key};
  CHECK_OK(flesh_effect_spring(&b.body, (double[]){1, 1, 1}, 1e9, &target, 0, 12.1, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_solver_options_default(&options);
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  int inverted;
  for (int k = 0; k < 60; k++)
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.2, &stats));
  flesh_mesh_jacobians(b.mesh, b.state.x, NULL, NULL, &inverted);
  printf("# held: %d tets inverted, %d untanglings\n", inverted, stats.untanglings);
  CHECK(inverted > 0 && stats.untanglings == 0);
  for (int k = 0; k < 100; k++)
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.2, &stats));
  CHECK_BELOW(flesh_mesh_distance_from_rest(b.mesh, b.state.x), 1e-6);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(double_winding_is_found), TEST(tangles_are_remembered), TEST(creases_are_no_tangles),
                   TEST(the_quick_test_is_safe),
                   TEST(tangles_of_ten_nodes_are_found), TEST(bent_plates_are_no_tangles), TEST(collapse_is_found),
                   TEST(bodies_come_back_where_they_are), TEST(collapsed_bodies_come_back),
                   TEST(a_point_without_forces_is_not_reached),
                   TEST(held_tangles_stay), TEST(bodies_near_rest_leave_their_tangles),
                   TEST(equilibria_are_untangled), TEST(what_rests_in_a_tangle_is_untangled),
                   TEST(tangles_of_equilibria_are_left_locally));
}
