// TEST name=test_contact_motion_quick quick excerpt args: nothing_passes_with_fixed_steps
// TEST+ nothing_passes_with_methods_of_second_order nothing_passes_with_adaptive_steps
// TEST+ nothing_passes_without_the_guard what_moves_pushes a_handle_into_an_obstacle_says_so blocks_slip_at_mu
// TEST+ belts_carry_blocks_along friction_lasts_to_the_last_keyframe turning_floors_drag_and_carry
// TEST full seconds=120
/* test_contact_motion.c: bodies thrown at obstacles and moving obstacles: nothing passes through, with fixed and
 * adaptive steps; blocks on slopes stick and slip according to Coulomb's law. */
#include <stdlib.h>

#include "body.h"
#include "geometry/obstacle.h"
#include "test.h"

typedef struct scene {
  test_body b;
  flesh_integrator *integrator;
} scene;

/* A cube of 1 m in the air. */
static void make_cube(int cells, double young, scene *s)
{
  flesh_material material;
  s->integrator = NULL;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, young, 0.45, &material));
  CHECK_OK(test_body_create(test_box(cells, cells, cells, 1, 1, 1), material, 1000, FLESH_MASS_LUMPED, 1, &s->b));
}

/* Takes the obstacle. */
static void add_contact(scene *s, flesh_obstacle *obstacle, double thickness, double friction, double slip_speed)
{
  flesh_contact_options options;
  flesh_effect *effect = NULL;
  flesh_contact_options_default(&options);
  options.thickness = thickness;
  options.friction = friction;
  options.slip_speed = slip_speed;
  CHECK_OK(flesh_effect_obstacle_contact(&s->b.body, &options, &obstacle, &effect));
  CHECK_OK(flesh_system_add_effect(s->b.system, &effect));
}

static void start(scene *s, flesh_method method, double newton_tolerance)
{
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  options.newton_tolerance = newton_tolerance;
  CHECK_OK(flesh_integrator_create(s->b.system, method, &options, &s->integrator));
  flesh_adaptive_options adaptive;
  flesh_adaptive_options_default(&adaptive);
  adaptive.tolerance = 1e-2;
  CHECK_OK(flesh_integrator_set_adaptive(s->integrator, &adaptive));
}

static void finish(scene *s)
{
  flesh_integrator_destroy(&s->integrator);
  test_body_destroy(&s->b);
}

enum { PLANE, SPHERE, CAPSULE, BALL_OF_TRIANGLES, THIN_WALL, SHAPES };
static const char *const names[] = {"plane", "sphere", "capsule", "ball of triangles", "thin wall"};

/* An obstacle 0.3 m below the cube [0,1]^3. */
static flesh_obstacle *make_obstacle(int shape)
{
  flesh_obstacle *o = NULL;
  if (shape == PLANE) CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, -0.3}, (const double[]){0, 0, 1}, &o));
  if (shape == SPHERE) CHECK_OK(flesh_obstacle_sphere((const double[]){0.4, 0.55, -1.1}, 0.8, &o));
  if (shape == CAPSULE)
    CHECK_OK(flesh_obstacle_capsule((const double[]){-1, 0.4, -0.6}, (const double[]){2, 0.6, -0.6}, 0.3, &o));
  if (shape == THIN_WALL) {
    const double X[] = {-4, -5, -0.3, 5, -4, -0.3, 4, 6, -0.3, -5, 5, -0.3};
    CHECK_OK(flesh_obstacle_mesh(4, X, 2, (const int[]){0, 1, 2, 0, 2, 3}, &o));
  }
  if (shape == BALL_OF_TRIANGLES) {
    flesh_obstacle *ball = NULL;
    flesh_surface *surface;
    CHECK_OK(flesh_obstacle_sphere((const double[]){0.4, 0.55, -1.1}, 0.8, &ball));
    CHECK_OK(flesh_obstacle_surface(ball, 0, NULL, 0, &surface));
    CHECK_OK(flesh_obstacle_mesh(flesh_surface_vertex_count(surface), flesh_surface_positions(surface),
                                 flesh_surface_face_count(surface), flesh_surface_corners(surface), &o));
    flesh_surface_destroy(&surface);
    flesh_obstacle_destroy(&ball);
  }
  return o;
}

/* Whether a node is where it cannot have come, from geometry alone. */
static int is_through(int shape, const double *x, int nodes)
{
  for (int i = 0; i < nodes; i++) {
    const double *p = x + 3 * i;
    double d[3] = {p[0] - 0.4, p[1] - 0.55, p[2] + 1.1};
    if ((shape == PLANE || shape == THIN_WALL) && p[2] <= -0.3) return 1;
    double reach = shape == SPHERE ? 0.8 : 0.79; /* the triangles' ball is slightly smaller */
    if ((shape == SPHERE || shape == BALL_OF_TRIANGLES) && d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= reach * reach)
      return 1;
    if (shape == CAPSULE) {
      double s = fmin(fmax(((p[0] + 1) * 3 + (p[1] - 0.4) * 0.2) / 9.04, 0), 1);
      double e[3] = {p[0] + 1 - 3 * s, p[1] - 0.4 - 0.2 * s, p[2] + 0.6};
      if (e[0] * e[0] + e[1] * e[1] + e[2] * e[2] <= 0.09) return 1;
    }
  }
  return 0;
}

/* Returns how often the body contains a point: tets around it, minus those that are inverted. */
static int times_held(const flesh_mesh *mesh, const double *x, const double p[3])
{
  const int *tets = flesh_mesh_tets(mesh);
  int times = 0;
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++) {
    int sides = 0;
    for (int a = 0; a < 4; a++) { /* the volumes of the tets that p forms with the faces */
      double e[3][3];
      for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++) e[k][c] = x[3 * tets[4 * t + (a + k + 1) % 4] + c] - p[c];
      double volume = e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) -
                      e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
                      e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
      sides += (volume > 0 ? 1 : -1) * (a % 2 ? 1 : -1);
    }
    times += sides / 4;
  }
  return times;
}

/* Whether the body contains the middle of the obstacle: of a ball, or a point of a rod's axis. Soft faces as large as
 * an obstacle of triangles may contain it. */
static int is_swallowed(int shape, double young, const test_body *b)
{
  const double centre[3] = {0.4, 0.55, -1.1};
  if (shape == SPHERE || (shape == BALL_OF_TRIANGLES && young == 1e6))
    return times_held(b->mesh, b->state.x, centre) != 0;
  for (int k = 0; shape == CAPSULE && k <= 20; k++) {
    const double p[3] = {-1 + 0.15 * k, 0.4 + 0.01 * k, -0.6};
    if (times_held(b->mesh, b->state.x, p) != 0) return 1;
  }
  return 0;
}

/* Thrown at 50 m/s, a body is stopped by every shape, with steps that would carry it right through. */
static void check_throw(flesh_method method, double young, double h, double end)
{
  for (int shape = 0; shape < SHAPES; shape++) {
    scene s;
    make_cube(3, young, &s);
    add_contact(&s, make_obstacle(shape), NAN, shape % 2 ? 0.3 : 0, 1e-2);
    for (int i = 0; i < s.b.n / 3; i++) s.b.state.v[3 * i + 2] = -50;
    CHECK_OK(flesh_system_finalize(s.b.system));
    start(&s, method, 1e-4);
    flesh_solve_stats stats = {0};
    int steps = 0, status = FLESH_OK, through = 0;
    double lowest = 1;
    for (; s.b.state.t < end - 1e-9 && !status; steps++) {
      status = flesh_integrator_step(s.integrator, &s.b.state, h, &stats);
      through |= is_through(shape, s.b.state.x, s.b.n / 3) || is_swallowed(shape, young, &s.b);
      double middle = 0;
      for (int i = 0; i < s.b.n / 3; i++) middle += s.b.state.x[3 * i + 2] / (s.b.n / 3);
      lowest = fmin(lowest, middle);
    }
    printf("# %s, method %d, h = %g s: %d steps (%d taken), %d Newton, %d failed, mean height from %.3g to %.3g m\n",
           names[shape], (int)method, h, steps, stats.steps, stats.newton, stats.convergence_failures, lowest,
           s.b.state.x[2]);
    CHECK_OK(status);
    CHECK(!through);
    CHECK(lowest < 0.4); /* it arrived; it may slide past a ball */
    if (shape == PLANE || shape == THIN_WALL || (shape == CAPSULE && young == 1e6)) CHECK(lowest > -0.9);
    finish(&s);
  }
}

/* So soft that the rod indents it deeply. */
static void nothing_passes_through_soft_bodies(void) { check_throw(FLESH_METHOD_BACKWARD_EULER, 1e5, 1. / 30, 0.2); }

static void nothing_passes_with_fixed_steps(void)
{
  check_throw(FLESH_METHOD_BACKWARD_EULER, 1e6, 1. / 30, 0.3);
  check_throw(FLESH_METHOD_BACKWARD_EULER, 1e6, 1. / 60, 0.1);
}

static void nothing_passes_with_methods_of_second_order(void)
{
  check_throw(FLESH_METHOD_BDF2, 1e6, 1. / 60, 0.1);
  check_throw(FLESH_METHOD_MIDPOINT, 1e6, 1. / 960, 0.02);
}

static void nothing_passes_with_adaptive_steps(void)
{
  check_throw(FLESH_METHOD_IDA, 1e6, 1. / 30, 1. / 30);
}

/* Without the guard as well: KINSOL's own line search and plain Newton steps may fail, but never pass. */
static void nothing_passes_without_the_guard(void)
{
  const flesh_line_search kinds[] = {FLESH_LINE_SEARCH_NONE, FLESH_LINE_SEARCH_RESIDUAL};
  for (int k = 0; k < 2; k++) {
    scene s;
    make_cube(2, 1e5, &s);
    add_contact(&s, make_obstacle(THIN_WALL), NAN, 0, 1e-3);
    CHECK_OK(flesh_system_finalize(s.b.system));
    for (int i = 0; i < s.b.n / 3; i++) s.b.state.v[3 * i + 2] = -50;
    flesh_solver_options options;
    flesh_solver_options_default(&options);
    options.line_search = kinds[k];
    CHECK_OK(flesh_integrator_create(s.b.system, FLESH_METHOD_BACKWARD_EULER, &options, &s.integrator));
    int status = FLESH_OK;
    for (int step = 0; step < 3 && !status; step++) {
      status = flesh_integrator_step(s.integrator, &s.b.state, 1. / 30, NULL);
      CHECK(!is_through(THIN_WALL, s.b.state.x, s.b.n / 3));
    }
    printf("# line_search %d: %s\n", (int)kinds[k], status ? flesh_error_text() : "came through");
    finish(&s);
  }
}

/* An obstacle that moves at 6 m/s into a body carries it along: a ball, and a wall of two triangles. */
static void what_moves_pushes(void)
{
  static const flesh_keyframe keys[] = {{.t = 0}, {.t = 0.5, .translation = {0, 0, 3}}};
  const flesh_method methods[] = {FLESH_METHOD_BACKWARD_EULER, FLESH_METHOD_BDF2, FLESH_METHOD_IDA,
                                  FLESH_METHOD_STATIC};
  for (int k = 0; k < 8; k++) {
    scene s;
    int shape = k % 2 ? THIN_WALL : PLANE;
    const flesh_method method = methods[k / 2];
    make_cube(2, 1e5, &s);
    flesh_obstacle *obstacle = make_obstacle(shape);
    CHECK_OK(flesh_obstacle_move(obstacle, &(flesh_motion){2, keys, {0, 0, 0}, 0}));
    add_contact(&s, obstacle, NAN, 0.3, 1e-2);
    if (method == FLESH_METHOD_STATIC) { /* held up at the middle of its top */
      CHECK_OK(flesh_system_add_pin(s.b.system, 1, (const int[]){22}, FLESH_AXES_ALL, -INFINITY, INFINITY));
      CHECK_OK(flesh_system_add_pin(s.b.system, 1, (const int[]){25}, FLESH_AXIS_X, -INFINITY, INFINITY));
    }
    CHECK_OK(flesh_system_finalize(s.b.system));
    start(&s, method, 1e-6);
    int status = FLESH_OK, through = 0;
    const double h = 1. / 30, end = method == FLESH_METHOD_STATIC ? 0.15 : method == FLESH_METHOD_IDA ? 0.1 : 0.5;
    for (; s.b.state.t < end - 1e-9 && !status;) {
      status = flesh_integrator_step(s.integrator, &s.b.state, h, NULL);
      for (int i = 0; i < s.b.n / 3; i++)
        through |= s.b.state.x[3 * i + 2] <= -0.3 + 6 * fmin(s.b.state.t, 0.5);
    }
    CHECK_OK(status);
    CHECK(!through);
    printf("# method %d, %s: lowest corner at %.3g m at t = %.3g s\n", (int)method, names[shape], s.b.state.x[2],
           s.b.state.t);
    finish(&s);
  }
}

/* A prescribed motion into an obstacle ends the run with a message, soon. */
static void a_handle_into_an_obstacle_says_so(void)
{
  static const flesh_keyframe keys[] = {{.t = 0}, {.t = 1, .translation = {0, 0, -1}}};
  for (int method = 0; method < 2; method++) {
    scene s;
    make_cube(2, 1e5, &s);
    add_contact(&s, make_obstacle(PLANE), NAN, 0, 1e-3);
    CHECK_OK(test_body_hold(&s.b, 2, 0, FLESH_AXES_ALL, &(flesh_motion){2, keys, {0, 0, 0}, 0}, -INFINITY, INFINITY));
    CHECK_OK(flesh_system_finalize(s.b.system));
    start(&s, method ? FLESH_METHOD_IDA : FLESH_METHOD_BACKWARD_EULER, 1e-4);
    const flesh_run_options run = {.h = 1. / 30, .end = 1};
    CHECK(flesh_run(s.b.system, s.integrator, &run, &s.b.state, NULL) < 0);
    printf("# %s\n", flesh_error_text());
    CHECK_TEXT(flesh_error_text(), "9 nodes are in the plane");
    CHECK(s.b.state.t > 0.2 && s.b.state.t < 0.34);
    finish(&s);
  }
}

/* Gravity inclined by `angle` on a block on a plane with friction; returns what it reaches along the slope. */
static void slide(double angle, double friction, flesh_method method, double h, double end, double *way, double *speed)
{
  scene s;
  make_cube(2, 1e7, &s);
  flesh_obstacle *plane = NULL;
  CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, -0.0197}, (const double[]){0, 0, 1}, &plane));
  add_contact(&s, plane, 0.02, friction, 1e-3);
  CHECK_OK(test_body_gravity(&s.b, 9.81 * sin(angle), 0, -9.81 * cos(angle)));
  CHECK_OK(flesh_system_finalize(s.b.system));
  start(&s, FLESH_METHOD_BACKWARD_EULER, 1e-6);
  int status = FLESH_OK;
  for (int step = 0; step < 120 && !status; step++) /* settles */
    status = flesh_integrator_step(s.integrator, &s.b.state, 1. / 60, NULL);
  s.b.state.t = 0;
  flesh_integrator_destroy(&s.integrator);
  start(&s, method, 1e-6);
  double first = 0, x0 = 0;
  *way = *speed = 0;
  while (s.b.state.t < end - 1e-9 && !status) {
    status = flesh_integrator_step(s.integrator, &s.b.state, h, NULL);
    double x = 0, v = 0;
    for (int i = 0; i < s.b.n / 3; i++) x += s.b.state.x[3 * i] / (s.b.n / 3), v += s.b.state.v[3 * i] / (s.b.n / 3);
    if (s.b.state.t > end / 2 && first == 0) first = s.b.state.t, x0 = x, *speed = -v;
    if (s.b.state.t >= end - 1e-9) *way = x - x0, *speed = (v + *speed) / (s.b.state.t - first);
  }
  CHECK_OK(status);
  finish(&s);
}

/* A block sticks while tan(angle) < mu, and beyond that slips with g (sin - mu cos): the limit is mu to 1 %. */
static void blocks_slip_at_mu(void)
{
  const double g = 9.81, mu = 0.5;
  const flesh_method methods[] = {FLESH_METHOD_BACKWARD_EULER, FLESH_METHOD_BDF2, FLESH_METHOD_IDA};
  for (int k = 0; k < 3; k++) {
    const double h = 1. / 60, end = k == 2 ? 0.2 : 1;
    double way, acceleration;
    slide(atan(0.99 * mu), mu, methods[k], h, end, &way, &acceleration);
    printf("# method %d, tan = 0.99 mu: creeps by %.3g m in %g s\n", (int)methods[k], way, end / 2);
    CHECK(way < 1e-3 * end / 2);
    const double steep = atan(1.01 * mu), expected = g * (sin(steep) - mu * cos(steep));
    slide(steep, mu, methods[k], h, end, &way, &acceleration);
    printf("# method %d, tan = 1.01 mu: %.5g m/s^2, expected %.5g; %.3g m\n", (int)methods[k], acceleration, expected,
           way);
    CHECK_NEAR(acceleration, expected, 0.01 * g * mu);
    CHECK(way > 1e-3 * end / 2);
    const double far = atan(2 * mu), fast = g * (sin(far) - mu * cos(far));
    slide(far, mu, methods[k], h, end, &way, &acceleration);
    CHECK_NEAR(acceleration, fast, 0.01 * fast);
    printf("# method %d, tan = 2 mu: %.5g m/s^2, expected %.5g\n", (int)methods[k], acceleration, fast);
  }
}

/* A belt that starts at 2 m/s accelerates a resting block with mu g until both are equally fast: friction depends on
 * the relative speed. */
static void belts_carry_blocks_along(void)
{
  static const flesh_keyframe keys[] = {{.t = 2}, {.t = 4, .translation = {4, 0, 0}}};
  const double g = 9.81, mu = 0.5, h = 1. / 120;
  const flesh_method methods[] = {FLESH_METHOD_BACKWARD_EULER, FLESH_METHOD_BDF2, FLESH_METHOD_NEWMARK};
  for (int k = 0; k < 3; k++) {
    scene s;
    flesh_obstacle *belt = NULL;
    make_cube(2, 1e7, &s);
    CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, -0.0197}, (const double[]){0, 0, 1}, &belt));
    CHECK_OK(flesh_obstacle_move(belt, &(flesh_motion){2, keys, {0, 0, 0}, 0}));
    add_contact(&s, belt, 0.02, mu, 1e-3);
    CHECK_OK(test_body_gravity(&s.b, 0, 0, -g));
    CHECK_OK(flesh_system_finalize(s.b.system));
    start(&s, methods[k], 1e-6);
    int status = FLESH_OK;
    double slipping = NAN, carried = NAN;
    while (s.b.state.t < 2.8 - 1e-9 && !status) {
      status = flesh_integrator_step(s.integrator, &s.b.state, h, NULL);
      double v = 0;
      for (int i = 0; i < s.b.n / 3; i++) v += s.b.state.v[3 * i] / (s.b.n / 3);
      if (fabs(s.b.state.t - 2.2) < h / 2) slipping = v;
      carried = v;
    }
    CHECK_OK(status);
    printf("# method %d: %.4g m/s after 0.2 s, expected %.4g; then %.4g, the belt's 2\n", (int)methods[k], slipping,
           0.2 * mu * g, carried);
    CHECK_NEAR(slipping, 0.2 * mu * g, 0.03 * 0.2 * mu * g);
    CHECK_NEAR(carried, 2, methods[k] == FLESH_METHOD_NEWMARK ? 0.04 : 0.02); /* whose block keeps rocking */
    finish(&s);
  }
}

/* A belt moves at 1 m/s until t = 1 s and stops. At t = 1 s it counts as still moving, both for a block that it has
 * carried along and for the equilibrium of a hanging cube whose lower face a plane drags: its forces follow Coulomb's
 * law, also while the plane slows down to rest. */
static void friction_lasts_to_the_last_keyframe(void)
{
  static const flesh_keyframe keys[] = {{.t = 0}, {.t = 1, .translation = {1, 0, 0}}},
                              presses[] = {{.t = 0}, {.t = 1, .translation = {1, 0, 0.03}}};
  const double g = 9.81, mu = 0.5;
  const flesh_method methods[] = {FLESH_METHOD_BACKWARD_EULER, FLESH_METHOD_BDF2, FLESH_METHOD_NEWMARK, FLESH_METHOD_STATIC,
                                  FLESH_METHOD_STATIC};
  for (int k = 0; k < 5; k++) {
    scene s;
    flesh_obstacle *belt = NULL;
    const int hangs = methods[k] == FLESH_METHOD_STATIC;
    make_cube(2, 1e7, &s);
    CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, -0.0197}, (const double[]){0, 0, 1}, &belt));
    CHECK_OK(flesh_obstacle_move(belt, &(flesh_motion){2, hangs ? presses : keys, {0, 0, 0}, k == 4}));
    add_contact(&s, belt, 0.02, mu, 1e-3);
    if (hangs) CHECK_OK(test_body_hold(&s.b, 2, 1, FLESH_AXES_ALL, NULL, -INFINITY, INFINITY));
    else CHECK_OK(test_body_gravity(&s.b, 0, 0, -g));
    CHECK_OK(flesh_system_finalize(s.b.system));
    start(&s, methods[k], 1e-8);
    double v = 0, sums[6], *a = calloc(2 * (size_t)s.b.n, sizeof *a), *r = a + s.b.n;
    const int steps = hangs ? 2 : 128; /* of exact lengths */
    for (int step = 0; step < steps; step++) CHECK_OK(flesh_integrator_step(s.integrator, &s.b.state, 1. / steps, NULL));
    if (hangs) {
      const flesh_effect *elasticity = flesh_system_effect(s.b.system, 1);
      const flesh_point point = flesh_point_at(1, s.b.state.x, a, a);
      CHECK_OK(elasticity->operations->residual(elasticity, &point, r));
      for (int i = 0; i < s.b.n; i += 3)
        if (flesh_mesh_positions(s.b.mesh)[i + 2] > 0.99) r[i] = r[i + 1] = r[i + 2] = 0;
      test_sums(&s.b, r, sums);
      printf("# statics: drags by %.5g N, presses by %.5g N\n", sums[0], sums[2]);
      CHECK(sums[2] > 1e4);
      CHECK_NEAR(sums[0], mu * sums[2], 1e-5 * mu * sums[2]);
    } else {
      for (int i = 0; i < s.b.n; i += 3) v += 3 * s.b.state.v[i] / s.b.n;
      printf("# method %d: %.5g m/s at %.3g s\n", (int)methods[k], v, s.b.state.t);
      CHECK_NEAR(v, 1, 0.01);
    }
    free(a);
    finish(&s);
  }
}

/* A floor that turns by 1.6 rad in a step drags a hanging cube along its own velocity at the cube, according to
 * Coulomb's law, and carries a sticking block around its axis: steps of backward Euler move it neither inwards nor
 * outwards. */
static void turning_floors_drag_and_carry(void)
{
  static const flesh_keyframe lift[] = {{.t = 0}, {.t = 1, .translation = {0, 0, 0.03}, .rotation = {0, 0, 96}}},
                              turn[] = {{.t = 0}, {.t = 1, .rotation = {0, 0, 1}}};
  const double centre[3] = {0.5, -3, 0}, mu = 0.5;
  for (int hangs = 0; hangs < 2; hangs++) {
    scene s;
    flesh_obstacle *floor = NULL;
    make_cube(2, 1e7, &s);
    CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, -0.0197}, (const double[]){0, 0, 1}, &floor));
    CHECK_OK(flesh_obstacle_move(floor, &(flesh_motion){2, hangs ? lift : turn, {centre[0], centre[1], 0}, 0}));
    add_contact(&s, floor, 0.02, mu, 1e-3);
    if (hangs) CHECK_OK(test_body_hold(&s.b, 2, 1, FLESH_AXES_ALL, NULL, -INFINITY, INFINITY));
    else CHECK_OK(test_body_gravity(&s.b, 0, 0, -9.81));
    CHECK_OK(flesh_system_finalize(s.b.system));
    start(&s, FLESH_METHOD_BACKWARD_EULER, 1e-6);
    for (int i = 0; i < s.b.n && !hangs; i += 3)
      s.b.state.v[i] = centre[1] - s.b.state.x[i + 1], s.b.state.v[i + 1] = s.b.state.x[i] - centre[0];
    for (int step = 0; step < 60; step++) CHECK_OK(flesh_integrator_step(s.integrator, &s.b.state, 1. / 60, NULL));
    double sums[6], *a = calloc(2 * (size_t)s.b.n, sizeof *a), *r = a + s.b.n, middle[2] = {0};
    const flesh_effect *elasticity = flesh_system_effect(s.b.system, 1);
    const flesh_point point = flesh_point_at(1, s.b.state.x, a, a);
    CHECK_OK(elasticity->operations->residual(elasticity, &point, r));
    for (int i = 0; i < s.b.n; i += 3) {
      for (int c = 0; c < 2; c++) middle[c] += 3 * (s.b.state.x[i + c] - centre[c]) / s.b.n;
      if (flesh_mesh_positions(s.b.mesh)[i + 2] > 0.99) r[i] = r[i + 1] = r[i + 2] = 0;
    }
    test_sums(&s.b, r, sums);
    if (hangs) {
      CHECK_NEAR(sums[0], -mu * sums[2], 0.05 * mu * sums[2]);
      CHECK_NEAR(sums[1], 0, 0.05 * mu * sums[2]);
    } else CHECK_NEAR(hypot(middle[0], middle[1]), 3.5, 0.01);
    free(a);
    finish(&s);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(nothing_passes_through_soft_bodies), TEST(nothing_passes_with_fixed_steps),
                   TEST(nothing_passes_with_methods_of_second_order),
                   TEST(nothing_passes_with_adaptive_steps), TEST(nothing_passes_without_the_guard),
                   TEST(what_moves_pushes), TEST(a_handle_into_an_obstacle_says_so), TEST(blocks_slip_at_mu),
                   TEST(belts_carry_blocks_along), TEST(friction_lasts_to_the_last_keyframe),
                   TEST(turning_floors_drag_and_carry));
}
