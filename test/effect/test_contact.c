// TEST quick seconds=60
/* test_contact.c: distances, barriers and swept tests of obstacles; derivatives of contact, its equilibria, and
 * refusals. */
#include <stdlib.h>

#include "body.h"
#include "effect/contact.h"
#include "effect/private.h"
#include "geometry/obstacle.h"
#include "math/mat3.h"
#include "test.h"

/* A vertical wall in the plane x = 0 of two triangles, 10 m wide and high. */
static void make_wall(flesh_obstacle **wall)
{
  const double corners[] = {0, -5, -5, 0, 5, -5, 0, 5, 5, 0, -5, 5};
  CHECK_OK(flesh_obstacle_mesh(4, corners, 2, (const int[]){0, 1, 2, 0, 2, 3}, wall));
}

/* The floor z = 0, divided into n x n irregular squares of two triangles, within |x|, |y| <= 1. */
static void make_floor(int n, double tilt, flesh_obstacle **floor)
{
  int nodes = (n + 1) * (n + 1), next = 0;
  double *X = malloc(3 * (size_t)nodes * sizeof *X);
  int *corners = malloc(6 * (size_t)n * n * sizeof *corners);
  for (int i = 0; i < nodes; i++) {
    double x = 2. * (i % (n + 1)) / n - 1, y = 2. * (i / (n + 1)) / n - 1;
    X[3 * i] = x + 0.05 * sin(3 * x) * y, X[3 * i + 1] = y + 0.04 * cos(2 * y) * x;
    X[3 * i + 2] = tilt * fabs(x);
  }
  for (int j = 0; j < n; j++)
    for (int i = 0; i < n; i++) {
      int a = j * (n + 1) + i, square[] = {a, a + 1, a + n + 2, a, a + n + 2, a + n + 1};
      for (int k = 0; k < 6; k++) corners[next++] = square[k];
    }
  CHECK_OK(flesh_obstacle_mesh(nodes, X, 2 * n * n, corners, floor));
  free(X);
  free(corners);
}

/* However a flat face is divided, its barrier is that of a plane, above triangles, edges and vertices alike. */
static void a_flat_mesh_is_a_plane(void)
{
  flesh_obstacle *plane, *mesh;
  flesh_barrier expected, found;
  CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, 0}, (const double[]){0, 0, 2}, &plane));
  for (int n = 2; n <= 8; n += 3) {
    make_floor(n, 0, &mesh);
    for (int k = 0; k < 500; k++) {
      double y[3] = {0, 0, 0.06};
      test_jitter(3, 0.05, 7919u * (unsigned)k + 3, y);
      y[0] *= 14, y[1] *= 14;
      flesh_obstacle_barrier(plane, y, 0.1, &expected);
      flesh_obstacle_barrier(mesh, y, 0.1, &found);
      CHECK_NEAR(found.value, expected.value, 1e-12 * (1 + expected.value));
      CHECK_NEAR(found.distance == INFINITY ? 1 : found.distance, expected.distance == INFINITY ? 1 : expected.distance,
                 1e-13);
      for (int c = 0; c < 3; c++)
        CHECK_NEAR(found.gradient[c], expected.gradient[c], 1e-10 * (1 - expected.gradient[2]));
      for (int c = 0; c < 9; c++) CHECK_NEAR(found.hessian[c], expected.hessian[c], 1e-9 * (1 + expected.hessian[8]));
    }
    flesh_obstacle_destroy(&mesh);
  }
  flesh_obstacle_destroy(&plane);
}

/* In a valley and over a ridge the gradient has no jump, and gradient and Hessian are correct derivatives. */
static void a_bent_mesh_is_smooth(void)
{
  for (int ridge = 0; ridge < 2; ridge++) {
    flesh_obstacle *mesh;
    const double s = 1e-5;
    double gradient_error = 0, hessian_error = 0;
    int points = 0, jumps = 0;
    make_floor(4, ridge ? -0.8 : 0.8, &mesh);
    for (int k = 0; k < 4000; k++) {
      double y[3] = {0, 0, ridge ? 0.05 : 0.15}, error = 0, size = 0;
      test_jitter(3, 0.06, 104729u * (unsigned)k + 1, y);
      y[1] *= 14;
      flesh_barrier at, moved[2];
      flesh_obstacle_barrier(mesh, y, 0.2, &at);
      if (at.distance < 0.04 || at.distance == INFINITY) continue;
      for (int c = 0; c < 3; c++) {
        for (int side = 0; side < 2; side++) {
          double z[3] = {y[0], y[1], y[2]};
          z[c] += side ? s : -s;
          flesh_obstacle_barrier(mesh, z, 0.2, &moved[side]);
        }
        gradient_error = fmax(gradient_error, fabs((moved[1].value - moved[0].value) / (2 * s) - at.gradient[c]));
        for (int e = 0; e < 3; e++) {
          double difference = (moved[1].gradient[e] - moved[0].gradient[e]) / (2 * s) - at.hessian[3 * c + e];
          error = fmax(error, fabs(difference));
          size = fmax(size, fabs(at.hessian[3 * c + e]));
        }
      }
      /* Curvature begins, and the Hessian jumps, where the nearest point moves onto an edge. */
      points++;
      if (error > 0.01 * size) jumps++;
      else hessian_error = fmax(hessian_error, error / size);
    }
    printf("# %s: gradient off by %.2g, hessian by %.2g; %d jumps at %d points\n", ridge ? "ridge" : "valley",
           gradient_error, hessian_error, jumps, points);
    CHECK_BELOW(gradient_error, 1e-3);
    CHECK(points > 1000 && jumps < points / 200);
    flesh_obstacle_destroy(&mesh);
  }
}

/* Paths end where a walk in small steps first finds itself inside, for shapes that have an inside. */
static void ways_end_at_the_surface(void)
{
  flesh_obstacle *obstacles[3];
  CHECK_OK(flesh_obstacle_plane((const double[]){0.1, 0, 0.2}, (const double[]){0.3, 0.2, 1}, &obstacles[0]));
  CHECK_OK(flesh_obstacle_sphere((const double[]){0.1, -0.2, 0}, 0.7, &obstacles[1]));
  CHECK_OK(flesh_obstacle_capsule((const double[]){-0.8, 0, 0}, (const double[]){0.7, 0.4, 0.2}, 0.3, &obstacles[2]));
  for (int o = 0; o < 3; o++) {
    int hits = 0;
    for (int k = 0; k < 400; k++) {
      double y[6] = {0}, point[3], met = 1;
      flesh_barrier barrier;
      test_jitter(6, 2, 31u * (unsigned)k + 17, y);
      flesh_obstacle_barrier(obstacles[o], y, 1e-3, &barrier);
      if (!(barrier.distance > 0)) continue;
      for (int s = 1; s <= 2000 && met == 1; s++) {
        for (int c = 0; c < 3; c++) point[c] = y[c] + s / 2000. * (y[3 + c] - y[c]);
        if (flesh_obstacle_depth(obstacles[o], point) > 0) met = s / 2000.;
      }
      double fraction = flesh_obstacle_max_feasible_step(obstacles[o], y, y + 3);
      hits += met < 1;
      if (met < 1) CHECK(fraction <= met && fraction >= met - 1. / 2000 - 1e-12);
      else if (fraction < 1) { /* a grazing contact between two points of the walk */
        for (int c = 0; c < 3; c++) point[c] = y[c] + (fraction + 1e-9) * (y[3 + c] - y[c]);
        CHECK_BELOW(flesh_obstacle_depth(obstacles[o], point), 2e-3);
      }
    }
    CHECK(hits > 30);
    flesh_obstacle_destroy(&obstacles[o]);
  }
}

/* No step leads through a closed surface, least of all through its edges and vertices. */
static void meshes_have_no_cracks(void)
{
  flesh_mesh *ball = test_box(3, 3, 3, 2, 2, 2);
  int triangles;
  const int *surface = flesh_mesh_surface(ball, &triangles);
  const double *X = flesh_mesh_positions(ball);
  flesh_obstacle *mesh;
  CHECK_OK(flesh_obstacle_mesh(flesh_mesh_node_count(ball), X, triangles, surface, &mesh));
  for (int t = 0; t < triangles; t++)
    for (int k = 0; k < 3; k++) {
      const double *a = X + 3 * surface[3 * t + k], *b = X + 3 * surface[3 * t + (k + 1) % 3];
      for (int part = 0; part <= 8; part++) {
        double inside[3] = {0.9, 1.1, 1.05}, through[3], outside[3];
        for (int c = 0; c < 3; c++) {
          through[c] = a[c] + part / 8. * (b[c] - a[c]);
          outside[c] = inside[c] + 3 * (through[c] - inside[c]);
        }
        double fraction = flesh_obstacle_max_feasible_step(mesh, inside, outside);
        CHECK_NEAR(fraction, 1. / 3, 1e-9);
        CHECK_NEAR(flesh_obstacle_max_feasible_step(mesh, outside, inside), 2. / 3, 1e-9);
        for (int c = 0; c < 3; c++) outside[c] = inside[c] + 0.999 * (through[c] - inside[c]);
        CHECK(flesh_obstacle_max_feasible_step(mesh, inside, outside) == 1);
      }
    }
  flesh_obstacle_destroy(&mesh);
  flesh_mesh_destroy(&ball);
}

static void add_contact(test_body *b, flesh_obstacle **obstacle, double stiffness, double thickness, double friction,
                        double slip_speed)
{
  flesh_contact_options options;
  flesh_effect *effect = NULL;
  flesh_contact_options_default(&options);
  options.stiffness = stiffness;
  options.thickness = thickness;
  options.friction = friction;
  options.slip_speed = slip_speed;
  CHECK_OK(flesh_effect_obstacle_contact(&b->body, &options, obstacle, &effect));
  CHECK(*obstacle == NULL);
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
}

static void make_cube(int cells, double young, double poisson, int inertia, test_body *b)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, young, poisson, &material));
  CHECK_OK(test_body_create(test_box(cells, cells, cells, 1, 1, 1), material, 1000, FLESH_MASS_LUMPED, inertia, b));
}

static const flesh_keyframe turn[] = {{.t = 0},
                                      {.t = 1, .translation = {0.02, 0.01, -0.03}, .rotation = {0.1, 0.2, -0.3}}};

/* Every shape, still and moving, with friction: residual and Jacobian are derivatives of potential and residual. */
static void derivatives_of_every_shape(void)
{
  for (int shape = 0; shape < 8; shape++) {
    test_body b;
    flesh_obstacle *obstacle = NULL;
    make_cube(2, 1e5, 0.4, 1, &b);
    switch (shape / 2) {
    case 0: CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, -0.4}, (const double[]){0.1, 0, 1}, &obstacle)); break;
    case 1: CHECK_OK(flesh_obstacle_sphere((const double[]){0.4, 0.5, -1.3}, 0.8, &obstacle)); break;
    case 2:
      CHECK_OK(flesh_obstacle_capsule((const double[]){0.2, 0.5, -1}, (const double[]){0.8, 0.4, -1}, 0.4, &obstacle));
      break;
    case 3: {
      const double corners[] = {-3, -3, -0.5, 3.1, -3, -0.4, 0.2, 3, -0.45, 0.3, 0.2, -3};
      CHECK_OK(flesh_obstacle_mesh(4, corners, 4, (const int[]){0, 1, 2, 0, 1, 3, 1, 2, 3, 2, 0, 3}, &obstacle));
    }
    }
    if (shape % 2) CHECK_OK(flesh_obstacle_move(obstacle, &(flesh_motion){2, turn, {0.1, 0.2, -1}, 0}));
    add_contact(&b, &obstacle, 1e5, 2, 0.7, shape % 3 ? 20 : 1e-6); /* creep and slip, away from the transition */
    test_jitter(b.n, 0.1, 5, b.state.x);
    flesh_derivative_report report;
    const flesh_effect *effect = flesh_system_effect(b.system, 2);
    CHECK(flesh_effect_obstacle(effect) && !flesh_effect_obstacle(flesh_system_effect(b.system, 0)));
    CHECK_OK(flesh_effect_check_derivatives(effect, b.mesh, 0.3, b.state.x, 3, &report));
    CHECK(flesh_derivative_report_passes(&report, 1e-7));
    printf("# shape %d: %.2g %.2g, %.2g %.2g, %.2g %.2g\n", shape, report.potential[0], report.potential[1],
           report.jacobian[0], report.jacobian[1], report.asymmetry, report.negative);
    test_body_destroy(&b);
  }
}

/* A body with nodes in many parts: a mesh with friction, and a ball that faces meet too; in one pass and in two. */
static void threads_give_the_same_bits(void)
{
  for (int shape = 0; shape < 2; shape++) {
    test_body b;
    flesh_obstacle *obstacle = NULL;
    make_cube(6, 1e5, 0.4, 0, &b);
    for (int d = 2; d < b.n; d += 3) b.state.x[d] += 0.05;
    test_jitter(b.n, 0.04, 5, b.state.x);
    test_jitter(b.n, 1, 6, b.state.v);
    if (shape == 0) make_floor(3, 0, &obstacle);
    else CHECK_OK(flesh_obstacle_sphere((const double[]){0.5, 0.5, -0.5}, 0.5, &obstacle));
    add_contact(&b, &obstacle, 1e5, 0.4, 0.3, 0.1);
    CHECK_OK(flesh_system_finalize(b.system));
    const flesh_effect *effect = flesh_system_effect(b.system, 1);
    const size_t bytes = (size_t)b.n * sizeof(double);
    double *r[2] = {malloc(bytes), malloc(bytes)}, *both = malloc(bytes), phi[2], size[2];
    flesh_block_matrix *K[2];
    for (int k = 0; k < 2; k++) CHECK_OK(flesh_system_matrix_create(b.system, &K[k]));
    for (int count = 1; count <= 3; count++) {
      const int k = count > 1;
      const flesh_shift shift = {.x = 1, .v = 60, .filter = FLESH_FILTER_CLAMP};
      flesh_threads *threads;
      CHECK_OK(flesh_threads_create(count, &threads));
      flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
      point.threads = threads;
      double phi_both = phi[k] = size[k] = 0, size_both = 0;
      memset(r[k], 0, bytes);
      memset(both, 0, bytes);
      CHECK_OK(effect->operations->residual(effect, &point, r[k]));
      CHECK_OK(effect->operations->potential(effect, &point, &shift, &phi[k], &size[k]));
      CHECK_OK(effect->operations->library->evaluate(effect, &point, &shift, both, &phi_both, &size_both));
      CHECK_OK(flesh_system_jacobian(b.system, &point, &shift, K[k]));
      CHECK(!memcmp(both, r[k], bytes) && phi_both == phi[k] && size_both == size[k]);
      flesh_threads_destroy(&threads);
    }
    CHECK(phi[0] == phi[1] && phi[0] > 0 && size[0] == size[1] && !memcmp(r[0], r[1], bytes));
    CHECK(!memcmp(K[0]->values, K[1]->values, (size_t)K[0]->row_start[K[0]->rows] * 9 * sizeof(double)));
    for (int k = 0; k < 2; k++) {
      flesh_block_matrix_destroy(&K[k]);
      free(r[k]);
    }
    free(both);
    test_body_destroy(&b);
  }
}

/* Computes the sum of the contact's forces on the body [3] at its state. */
static void contact_force(const test_body *b, const flesh_effect *effect, double force[3])
{
  double *r = calloc((size_t)b->n, sizeof *r), *zero = calloc((size_t)b->n, sizeof *zero);
  const flesh_point point = flesh_point_at(b->state.t, b->state.x, zero, zero);
  CHECK_OK(effect->operations->residual(effect, &point, r));
  force[0] = force[1] = force[2] = 0;
  for (int d = 0; d < b->n; d++) force[d % 3] -= r[d];
  free(r);
  free(zero);
}

/* Energy and force on a plane follow the formula of contact.h, written out: B = 1/s - 3 + 3s - s^2. */
static void the_barrier_is_the_documented_one(void)
{
  const double stiffness = 3e4, thickness = 0.2;
  for (double s = 0.1; s < 1.3; s += 0.2) {
    test_body b;
    flesh_obstacle *floor;
    double force[3], share = 0;
    int count;
    make_cube(3, 1e5, 0.3, 0, &b);
    CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, -s * thickness}, (const double[]){0, 0, 1}, &floor));
    add_contact(&b, &floor, stiffness, thickness, 0, 1e-3);
    CHECK_OK(flesh_system_finalize(b.system));
    const double *X = flesh_mesh_positions(b.mesh);
    const int *corners = flesh_mesh_surface(b.mesh, &count);
    for (int k = 0; k < count; k++) {
      double u[3], v[3], n[3];
      for (int c = 0; c < 3; c++) {
        u[c] = X[3 * corners[3 * k + 1] + c] - X[3 * corners[3 * k] + c];
        v[c] = X[3 * corners[3 * k + 2] + c] - X[3 * corners[3 * k] + c];
      }
      flesh_vec3_cross(u, v, n);
      for (int a = 0; a < 3; a++)
        if (X[3 * corners[3 * k + a] + 2] == 0) share += sqrt(flesh_vec3_dot(n, n)) / 6;
    }
    const flesh_effect *contact = flesh_system_effect(b.system, flesh_system_effect_count(b.system) - 1);
    const flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
    double energy = 0;
    CHECK_OK(contact->operations->energy(contact, &point, &energy));
    contact_force(&b, contact, force);
    const double V = s < 1 ? 1 / s - 3 + 3 * s - s * s : 0, slope = s < 1 ? -1 / (s * s) + 3 - 2 * s : 0;
    CHECK_NEAR(energy, share * stiffness * thickness * V, 1e-10 * share * stiffness);
    CHECK_NEAR(fabs(force[2]), -share * stiffness * slope, 1e-10 * share * stiffness / (s * s));
    test_body_destroy(&b);
  }
}

/* A body that rests on a plane, in a valley or on a ball presses with its weight; no node is inside. */
static void what_rests_presses_with_its_weight(void)
{
  for (int shape = 0; shape < 3; shape++) {
    test_body b;
    flesh_obstacle *obstacle = NULL;
    flesh_integrator *integrator = NULL;
    make_cube(3, 2e5, 0.45, 0, &b);
    CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
    if (shape == 0) CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, -0.02}, (const double[]){0, 0, 1}, &obstacle));
    if (shape == 1) CHECK_OK(flesh_obstacle_sphere((const double[]){0.5, 0.5, -3.02}, 3, &obstacle));
    if (shape == 2) { /* the upside-down valley: its two sides slope from x = 0.5 */
      const double corners[] = {-2, -2, 0.98, 0.5, -2, -0.02, 3, -2, 0.98, -2, 3, 0.98, 0.5, 3, -0.02, 3, 3, 0.98};
      CHECK_OK(flesh_obstacle_mesh(6, corners, 4, (const int[]){0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4}, &obstacle));
      for (int i = 0; i < b.n / 3; i++) b.state.x[3 * i + 2] += 0.2;
    }
    add_contact(&b, &obstacle, NAN, 0.03, 0, 1);
    /* Pins hold the free directions, so that the equilibrium is unique. */
    int nodes[64], count = 0;
    for (int i = 0; i < b.n / 3; i++)
      if (fabs(flesh_mesh_positions(b.mesh)[3 * i] - 1. / 3) < 1e-9 &&
          fabs(flesh_mesh_positions(b.mesh)[3 * i + 1] - 1. / 3) < 1e-9)
        nodes[count++] = i;
    CHECK_OK(flesh_system_add_pin(b.system, count, nodes, shape == 2 ? FLESH_AXIS_Y : FLESH_AXIS_X | FLESH_AXIS_Y,
                                  -INFINITY, INFINITY));
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_solver_options options;
    flesh_solver_options_default(&options);
    options.newton_tolerance = 1e-8;
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
    flesh_solve_stats stats = {0};
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 1, &stats));
    double force[3], values[3];
    const flesh_effect *effect = flesh_system_effect(b.system, 2);
    contact_force(&b, effect, force);
    CHECK_NEAR(force[2], 9810, 9810e-6);
    CHECK_OK(flesh_system_check(b.system, 0, b.state.x));
    const flesh_point point = flesh_point_at(0, b.state.x, NULL, NULL);
    effect->operations->figures->report(effect, &point, values);
    CHECK_NEAR(values[2], 9810, shape == 0 ? 9810e-6 : 300);
    CHECK(values[0] > 0 && values[0] < 0.03 && values[1] > 0);
    printf("# shape %d: force (%.3g, %.3g, %.9g) N, gap %.3g m, %g nodes, %d Newton steps\n", shape, force[0], force[1],
           force[2], values[0], values[1], stats.newton);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* The potential of friction is the integral of its force over the speed of slip: e (y - 1/3) F beyond the slip speed e,
 * y^2 (1 - y/3) e F below, with y in units of e (the smoothing of Li et al. 2020, "Incremental Potential Contact", but
 * for a constant). */
static void the_potential_of_friction_has_no_step(void)
{
  static const double speeds[] = {0.1, 0.5, 0.999999, 1, 1.000001, 2, 10};
  const double e = 1e-3;
  test_body b;
  flesh_obstacle *obstacle;
  make_cube(1, 1e5, 0.4, 0, &b);
  CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, -0.05}, (const double[]){0, 0, 1}, &obstacle));
  add_contact(&b, &obstacle, 1e5, 0.1, 0.5, e);
  CHECK_OK(flesh_system_finalize(b.system));
  const flesh_effect *effect = flesh_system_effect(b.system, 1);
  const flesh_shift shift = {.v = 1};
  double unit = 0;
  for (int k = 6; k >= 0; k--) {
    const double y = speeds[k];
    double phi = 0, magnitude = 0;
    for (int d = 0; d < b.n; d += 3) b.state.v[d] = y * e;
    const flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
    CHECK_OK(effect->operations->potential(effect, &point, &shift, &phi, &magnitude));
    const double expected = y < 1 ? y * y * (1 - y / 3) : y - 1. / 3;
    if (k == 6) unit = phi / expected;
    CHECK(unit > 0);
    CHECK_NEAR(phi / unit, expected, 1e-12 * expected);
  }
  test_body_destroy(&b);
}

/* The power of friction is never positive, and friction follows Coulomb's law while slipping. */
static void friction_only_dissipates(void)
{
  test_body with, without;
  flesh_obstacle *obstacle;
  make_cube(2, 1e5, 0.4, 0, &with);
  make_cube(2, 1e5, 0.4, 0, &without);
  CHECK_OK(flesh_obstacle_sphere((const double[]){0.4, 0.5, -2.1}, 2, &obstacle));
  CHECK_OK(flesh_obstacle_move(obstacle, &(flesh_motion){2, turn, {0, 0, 0}, 0}));
  add_contact(&with, &obstacle, 1e5, 0.3, 0.6, 1e-3);
  CHECK_OK(flesh_obstacle_sphere((const double[]){0.4, 0.5, -2.1}, 2, &obstacle));
  CHECK_OK(flesh_obstacle_move(obstacle, &(flesh_motion){2, turn, {0, 0, 0}, 0}));
  add_contact(&without, &obstacle, 1e5, 0.3, 0, 1);
  double *r = calloc((size_t)with.n, sizeof *r), *normal = calloc((size_t)with.n, sizeof *r);
  for (int k = 0; k < 30; k++) {
    test_jitter(with.n, 20, 91 + (unsigned)k, with.state.v);
    const flesh_point point = flesh_point_at(0.3, with.state.x, with.state.v, with.state.v);
    CHECK_OK(flesh_system_residual(with.system, &point, r));
    CHECK_OK(flesh_system_residual(without.system, &point, normal));
    int rubbing = 0;
    const flesh_effect *smooth = flesh_system_effect(without.system, 1);
    double *push = calloc((size_t)with.n, sizeof *push);
    CHECK_OK(smooth->operations->residual(smooth, &point, push));
    for (int i = 0; i < with.n / 3; i++) {
      double friction[3], v[3], w[3], power = 0, size = 0, pushed = 0;
      const double *x = with.state.x + 3 * i;
      flesh_frame frame;
      double y[3];
      flesh_obstacle_frame(flesh_effect_obstacle(smooth), 0.3, &frame);
      flesh_frame_enter(&frame, x, y);
      flesh_obstacle_velocity(flesh_effect_obstacle(smooth), 0.3, y, w);
      for (int c = 0; c < 3; c++) {
        friction[c] = r[3 * i + c] - normal[3 * i + c];
        v[c] = with.state.v[3 * i + c] - w[c];
        power -= friction[c] * v[c];
        size += friction[c] * friction[c];
        pushed += push[3 * i + c] * push[3 * i + c];
      }
      CHECK(power <= 0);
      CHECK_NEAR(sqrt(size), 0.6 * sqrt(pushed), 1e-9 * sqrt(pushed));
      CHECK(pushed > 0 ? power < 0 : size == 0);
      rubbing += pushed > 0;
    }
    CHECK(rubbing > 3);
    free(push);
  }
  free(r);
  free(normal);
  test_body_destroy(&with);
  test_body_destroy(&without);
}

static void bad_obstacles_are_refused(void)
{
  flesh_obstacle *o = NULL;
  const double zero[3] = {0, 0, 0}, up[3] = {0, 0, 1}, nan[3] = {NAN, 0, 0};
  CHECK(flesh_obstacle_plane(zero, zero, &o) == FLESH_ERR_ARGUMENT && !o);
  CHECK(flesh_obstacle_plane(nan, up, &o) == FLESH_ERR_ARGUMENT && !o);
  CHECK(flesh_obstacle_sphere(zero, 0, &o) == FLESH_ERR_ARGUMENT && !o);
  CHECK_TEXT(flesh_error_text(), "radius");
  CHECK(flesh_obstacle_sphere(zero, INFINITY, &o) == FLESH_ERR_ARGUMENT && !o);
  CHECK(flesh_obstacle_capsule(zero, nan, 1, &o) == FLESH_ERR_ARGUMENT && !o);
  const double flat[] = {0, 0, 0, 1, 0, 0, 2, 0, 0};
  CHECK(flesh_obstacle_mesh(3, flat, 1, (const int[]){0, 1, 2}, &o) == FLESH_ERR_ARGUMENT && !o);
  CHECK_TEXT(flesh_error_text(), "area");
  CHECK(flesh_obstacle_mesh(3, flat, 1, (const int[]){0, 1, 3}, &o) == FLESH_ERR_ARGUMENT && !o);
  CHECK(flesh_obstacle_mesh(0, flat, 0, NULL, &o) == FLESH_ERR_ARGUMENT && !o);
  test_body b;
  make_cube(1, 1e5, 0.4, 0, &b);
  flesh_effect *effect = NULL;
  flesh_contact_options options;
  for (int k = 0; k < 4; k++) {
    flesh_contact_options_default(&options);
    (k == 0   ? &options.stiffness
     : k == 1 ? &options.thickness
     : k == 2 ? &options.friction
              : &options.slip_speed)[0] = k == 2 ? -1 : 0;
    CHECK_OK(flesh_obstacle_sphere(zero, 1, &o));
    CHECK(flesh_effect_obstacle_contact(&b.body, &options, &o, &effect) == FLESH_ERR_ARGUMENT && !o && !effect);
    CHECK_TEXT(flesh_error_text(), ((const char *[]){"stiffness", "thickness", "friction", "slip_speed"})[k]);
  }
  test_body_destroy(&b);
}

/* A start with nodes inside an obstacle whose surface is at this height, or on it up to rounding, is refused with the
 * deepest node and its depth. */
static void start_inside(double height, const char *words, const char *depth)
{
  test_body b;
  flesh_obstacle *obstacle;
  flesh_integrator *integrator = NULL;
  flesh_solver_options options;
  make_cube(2, 1e5, 0.4, 1, &b);
  CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, height}, (const double[]){0, 0, 1}, &obstacle));
  add_contact(&b, &obstacle, NAN, NAN, 0, 1);
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_solver_options_default(&options);
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  const flesh_run_options run = {.h = 0.1, .end = 1};
  CHECK(flesh_run(b.system, integrator, &run, &b.state, NULL) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), words);
  CHECK_TEXT(flesh_error_text(), depth);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

static void a_start_inside_is_refused(void)
{
  start_inside(0.25, "9 nodes are in the plane", "0.25 m");
  start_inside(-1e-17, "9 nodes are in the plane", "0 m");
}

/* Counts triangles with negligible area or two corners at one position. */
static int count_flat(int triangles, const double *X, const int *corners)
{
  int flat = 0;
  for (int t = 0; t < triangles; t++) {
    double e[2][3], n[3], longest = 0;
    for (int k = 0; k < 2; k++)
      for (int c = 0; c < 3; c++) e[k][c] = X[3 * corners[3 * t + k + 1] + c] - X[3 * corners[3 * t] + c];
    flesh_vec3_cross(e[0], e[1], n);
    for (int k = 0; k < 2; k++) longest = fmax(longest, flesh_vec3_dot(e[k], e[k]));
    flat += !(sqrt(flesh_vec3_dot(n, n)) > 1e-6 * longest);
  }
  return flat;
}

/* Surfaces for pictures lie on the obstacle, look outward, have no triangle without area, and move with it. */
static void surfaces_for_pictures(void)
{
  flesh_obstacle *o[4];
  CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, 1}, (const double[]){0, 0.3, 1}, &o[0]));
  CHECK_OK(flesh_obstacle_sphere((const double[]){1, 2, 3}, 0.5, &o[1]));
  CHECK_OK(flesh_obstacle_capsule((const double[]){1, 2, 3}, (const double[]){2, 1, 3}, 0.5, &o[2]));
  make_wall(&o[3]);
  for (int k = 0; k < 4; k++) {
    CHECK_OK(flesh_obstacle_move(o[k], &(flesh_motion){2, turn, {0.1, 0, 0}, 0}));
    flesh_surface *surface;
    CHECK_OK(flesh_obstacle_surface(o[k], 0.7, (const double[]){0, 0, 0}, 3, &surface));
    const int nodes = flesh_surface_vertex_count(surface), triangles = flesh_surface_face_count(surface);
    const int *corners = flesh_surface_corners(surface);
    const double *X = flesh_surface_positions(surface);
    double volume = 0;
    flesh_frame frame;
    flesh_obstacle_frame(o[k], 0.7, &frame);
    for (int i = 0; i < nodes; i++) {
      double y[3];
      flesh_barrier barrier;
      flesh_frame_enter(&frame, X + 3 * i, y);
      flesh_obstacle_barrier(o[k], y, 0.1, &barrier);
      CHECK_NEAR(barrier.distance, 0, 1e-12);
    }
    for (int t = 0; t < triangles; t++) {
      const double *a = X + 3 * corners[3 * t], *b = X + 3 * corners[3 * t + 1], *c = X + 3 * corners[3 * t + 2];
      volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                 a[2] * (b[0] * c[1] - b[1] * c[0])) /
                6;
    }
    CHECK(k == 3 || count_flat(triangles, X, corners) == 0);
    const double pi = acos(-1), ball = 4 * pi / 3 / 8, rod = pi / 4 * sqrt(2);
    if (k == 1) CHECK_NEAR(volume, ball, 0.02 * ball);
    if (k == 2) CHECK_NEAR(volume, ball + rod, 0.02 * (ball + rod));
    flesh_surface_destroy(&surface);
    flesh_obstacle_destroy(&o[k]);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(a_flat_mesh_is_a_plane), TEST(a_bent_mesh_is_smooth), TEST(ways_end_at_the_surface),
                   TEST(meshes_have_no_cracks), TEST(derivatives_of_every_shape),
                   TEST_OF_THREADS(threads_give_the_same_bits), TEST(the_barrier_is_the_documented_one),
                   TEST(what_rests_presses_with_its_weight),
                   TEST(the_potential_of_friction_has_no_step),
                   TEST(friction_only_dissipates),
                   TEST(bad_obstacles_are_refused), TEST(a_start_inside_is_refused), TEST(surfaces_for_pictures));
}
