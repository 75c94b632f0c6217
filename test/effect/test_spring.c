// TEST quick
/* test_spring.c: where a spring pulls, how keyframed motions move, and what the constructors of effects refuse. */
#include <stdlib.h>

#include "body.h"
#include "geometry/motion.h"
#include "test.h"

/* Makes a body of the unit cube; the system is empty. */
static void make_cube(int cells, int order, test_body *b)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.4, &material));
  flesh_mesh *mesh = test_box(cells, cells, cells, 1, 1, 1), *raised;
  if (order == 2) {
    CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
    flesh_mesh_destroy(&mesh);
    mesh = raised;
  }
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_LUMPED, 0, b));
  flesh_system_destroy(&b->system);
  CHECK_OK(flesh_system_create(b->mesh, &b->system));
}

/* The spring's force on a body that moves rigidly by d is k (p + d - target), wherever the point was given. */
static void check_spring_of(int order, const double given[3], const double found[3])
{
  test_body b;
  make_cube(2, order, &b);
  flesh_effect *effect = NULL;
  flesh_keyframe keys[] = {{.t = 1, .translation = {2, 0, 0}}, {.t = 3, .translation = {4, 2, 0}}};
  flesh_motion target = {.count = 2, .keyframes = keys};
  CHECK_OK(flesh_effect_spring(&b.body, given, 50, &target, 0.5, 2.5, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_system_finalize(b.system));
  double *r = calloc((size_t)b.n, sizeof *r);
  for (int d = 0; d < b.n; d++) b.state.x[d] += (double[]){0.1, -0.2, 0.3}[d % 3];
  const double times[] = {0.49, 0.5, 1.5, 2, 2.5};
  const double targets[][3] = {{0}, {2, 0, 0}, {2.5, 0.5, 0}, {3, 1, 0}, {0}};
  for (int k = 0; k < 5; k++) {
    int active = k > 0 && k < 4;
    double sum[3] = {0}, torque = 0, energy, expected = 0, pull[3];
    flesh_point point = flesh_point_at(times[k], b.state.x, b.state.v, b.state.v);
    CHECK_OK(flesh_system_residual(b.system, &point, r));
    CHECK_OK(flesh_system_energies(b.system, &point, &energy));
    for (int d = 0; d < b.n; d++) sum[d % 3] += r[d];
    for (int i = 0; i < b.n / 3; i++)
      torque += b.state.x[3 * i] * r[3 * i + 1] - b.state.x[3 * i + 1] * r[3 * i];
    for (int c = 0; c < 3; c++) {
      double extension = found[c] + (double[]){0.1, -0.2, 0.3}[c] - targets[k][c];
      pull[c] = active ? 50 * extension : 0;
      expected += active ? 25 * extension * extension : 0;
      CHECK_NEAR(sum[c], pull[c], 1e-11);
    }
    /* Equal to one force at the point, so the weights are those of the point itself. */
    CHECK_NEAR(torque, (found[0] + 0.1) * pull[1] - (found[1] - 0.2) * pull[0], 1e-11);
    CHECK_NEAR(energy, expected, 1e-10);
  }
  CHECK(flesh_system_next_event(b.system, 0) == 0.5);
  CHECK(flesh_system_next_event(b.system, 0.5) == 1);
  CHECK(flesh_system_next_event(b.system, 1) == 2.5);
  CHECK(flesh_system_next_event(b.system, 2.5) == 3);
  CHECK(flesh_system_next_event(b.system, 3) == INFINITY);
  free(r);
  test_body_destroy(&b);
}

static void check_drag(const double given[3], const double found[3])
{
  for (int order = 1; order <= 2; order++) check_spring_of(order, given, found);
}

/* In ten-node tets the point follows a quadratic motion, which their corners alone do not determine. */
static void the_point_follows_curved_edges(void)
{
  test_body b;
  make_cube(2, 2, &b);
  flesh_effect *effect = NULL;
  const double p[3] = {0.37, 0.8, 0.21}, *X = flesh_mesh_positions(b.mesh);
  flesh_keyframe key = {.translation = {3, 1, 2}};
  flesh_motion target = {.count = 1, .keyframes = &key};
  CHECK_OK(flesh_effect_spring(&b.body, p, 50, &target, 0, 10, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_system_finalize(b.system));
  double *r = calloc((size_t)b.n, sizeof *r), sum[3] = {0};
  for (int i = 0; i < b.n; i += 3) {
    b.state.x[i] = X[i] + 0.3 * X[i + 1] * X[i + 1];
    b.state.x[i + 1] = X[i + 1] - 0.2 * X[i] * X[i + 2];
    b.state.x[i + 2] = X[i + 2] + 0.1 * X[i] * X[i];
  }
  flesh_point point = flesh_point_at(1, b.state.x, b.state.v, b.state.v);
  CHECK_OK(flesh_system_residual(b.system, &point, r));
  for (int d = 0; d < b.n; d++) sum[d % 3] += r[d];
  CHECK_NEAR(sum[0], 50 * (p[0] + 0.3 * p[1] * p[1] - 3), 1e-12);
  CHECK_NEAR(sum[1], 50 * (p[1] - 0.2 * p[0] * p[2] - 1), 1e-12);
  CHECK_NEAR(sum[2], 50 * (p[2] + 0.1 * p[0] * p[0] - 2), 1e-12);
  free(r);
  test_body_destroy(&b);
}

static void spring_pulls_at_its_point(void)
{
  check_drag((double[]){0.9, 0.8, 0.3}, (double[]){0.9, 0.8, 0.3});   /* inside */
  check_drag((double[]){1, 1, 1}, (double[]){1, 1, 1});               /* a corner */
  check_drag((double[]){0.3, 0.6, 5}, (double[]){0.3, 0.6, 1});       /* outside: the nearest point of the surface */
  check_drag((double[]){-3, 0.4, 0.7}, (double[]){0, 0.4, 0.7});
  check_drag((double[]){9, 9, 9}, (double[]){1, 1, 1});
  check_drag((double[]){0.25, 2, -1}, (double[]){0.25, 1, 0});        /* an edge */
}

static void motions(void)
{
  flesh_keyframe keys[] = {{.t = 1, .translation = {1, 0, 0}},
                           {.t = 2, .translation = {3, 1, 0}, .rotation = {0, 0, M_PI / 2}}};
  flesh_motion given = {.count = 2, .keyframes = keys, .centre = {1, 1, 0}}, motion;
  double t[3], y[3];
  CHECK_OK(flesh_motion_copy(&given, &motion));
  flesh_motion_at(&motion, 0, t);
  CHECK(t[0] == 1);
  flesh_motion_at(&motion, 1.25, t);
  CHECK_NEAR(t[0], 1.5, 1e-15);
  flesh_motion_apply(&motion, 1.25, (double[]){2, 1, 0}, y);
  CHECK_NEAR(y[1] - 1.25, sin(M_PI / 8), 1e-15);
  flesh_motion_at(&motion, 9, t);
  CHECK(t[0] == 3 && t[1] == 1);
  flesh_motion_apply(&motion, 2, (double[]){3, 1, 7}, y); /* a quarter turn about (1,1) takes (2,0) to (0,2) */
  CHECK_NEAR(y[0], 1 + 3, 1e-15);
  CHECK_NEAR(y[1], 1 + 2 + 1, 1e-15);
  CHECK_NEAR(y[2], 7, 1e-15);
  /* Compares a rotation vector in general position with the matrix exponential. */
  keys[0].rotation[0] = 0.4, keys[0].rotation[1] = -1.1, keys[0].rotation[2] = 0.9;
  flesh_motion_clear(&motion);
  CHECK_OK(flesh_motion_copy(&given, &motion));
  flesh_motion_apply(&motion, 0.5, (double[]){2, -1, 3}, y);
  double series[3] = {1, -2, 3}, term[3] = {1, -2, 3};
  for (int k = 1; k < 40; k++) {
    const double *o = keys[0].rotation;
    double next[3] = {o[1] * term[2] - o[2] * term[1], o[2] * term[0] - o[0] * term[2],
                      o[0] * term[1] - o[1] * term[0]};
    for (int c = 0; c < 3; c++) series[c] += term[c] = next[c] / k;
  }
  for (int c = 0; c < 3; c++)
    CHECK_NEAR(y[c], given.centre[c] + keys[0].translation[c] + series[c], 1e-14);
  flesh_motion_clear(&motion);
  /* Smooth motion: at rest at its keyframes, half-way at half time. */
  given.smooth = 1;
  CHECK_OK(flesh_motion_copy(&given, &motion));
  flesh_motion_at(&motion, 1.5, t);
  CHECK_NEAR(t[0], 2, 1e-15);
  flesh_motion_at(&motion, 1 + 1e-4, t);
  CHECK_BELOW(t[0] - 1, 1e-7);
  CHECK(t[0] > 1);
  flesh_motion_clear(&motion);
}

/* Computes the rows of the rotation at t. */
static void rotation_at(const flesh_motion *motion, double t, double R[9])
{
  double origin[3], y[3];
  flesh_motion_apply(motion, t, (double[]){0, 0, 0}, origin);
  for (int k = 0; k < 3; k++) {
    double e[3] = {0, 0, 0};
    e[k] = 1;
    flesh_motion_apply(motion, t, e, y);
    for (int c = 0; c < 3; c++) R[3 * c + k] = y[c] - origin[c];
  }
}

/* Computes the angular velocity R' R^T at t from the analytic rates. */
static void spin_at(const flesh_motion *motion, double t, double spin[3])
{
  double R[9], W[9] = {0}, v0[3], v[3], a[3];
  rotation_at(motion, t, R);
  flesh_motion_rates(motion, t, (double[]){0, 0, 0}, v0, a);
  for (int k = 0; k < 3; k++) {
    double e[3] = {0, 0, 0};
    e[k] = 1;
    flesh_motion_rates(motion, t, e, v, a);
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) W[3 * i + j] += (v[i] - v0[i]) * R[3 * j + k];
  }
  spin[0] = (W[7] - W[5]) / 2, spin[1] = (W[2] - W[6]) / 2, spin[2] = (W[3] - W[1]) / 2;
}

/* Between keyframes about any axes a body turns at a constant rate and is half-way at half time; at keyframes it has
 * their rotation; turns about one axis are counted. */
static void rotations_go_evenly(void)
{
  const double ends[][2][3] = {{{1, 0, 0}, {0, 1, 0}}, {{2, 0.5, -1}, {-1, 2, 1}}, {{0, 0, 0}, {0, 0, 9}},
                               {{0, 0, -3}, {0, 0, 7.5}}, {{3, 0, 0}, {0, 0, -3}}, {{0, 0, 3}, {0.001, 0, -3}},
                               {{2 * M_PI, 0, 0}, {0, 2 * M_PI, 0}}, {{1e-9, 0, 0}, {0, 1e-9, 0}}};
  for (size_t k = 0; k < sizeof ends / sizeof ends[0]; k++) {
    flesh_keyframe keys[] = {{.t = 1}, {.t = 3, .translation = {1, 2, 3}}};
    double R[2][9], at[9], spin[3], first[3], worst = 0, rates = 0, expected = 0, size = 0;
    for (int e = 0; e < 2; e++) {
      memcpy(keys[e].rotation, ends[k][e], sizeof keys[e].rotation);
      const flesh_motion alone = {.count = 1, .keyframes = &keys[e], .centre = {0.3, 0.2, 0.1}};
      rotation_at(&alone, 0, R[e]);
    }
    const flesh_motion motion = {.count = 2, .keyframes = keys, .centre = {0.3, 0.2, 0.1}};
    for (int e = 0; e < 2; e++) {
      rotation_at(&motion, e ? 3 - 1e-12 : 1, at);
      for (int c = 0; c < 9; c++) worst = fmax(worst, fabs(at[c] - R[e][c]));
    }
    spin_at(&motion, 1, first);
    for (int s = 0; s < 10; s++) {
      const double t = 1 + 0.2 * s + 0.05, h = 1e-4, X[3] = {1, -1, 2};
      double y[3], before[3], after[3], v[3], a[3];
      spin_at(&motion, t, spin);
      for (int c = 0; c < 3; c++) rates = fmax(rates, fabs(spin[c] - first[c]));
      flesh_motion_rates(&motion, t, X, v, a);
      flesh_motion_apply(&motion, t - h, X, before);
      flesh_motion_apply(&motion, t, X, y);
      flesh_motion_apply(&motion, t + h, X, after);
      for (int c = 0; c < 3; c++) {
        CHECK_NEAR(v[c], (after[c] - before[c]) / (2 * h), 2e-6);
        CHECK_NEAR(a[c], (after[c] - 2 * y[c] + before[c]) / (h * h), 1e-5);
      }
    }
    for (int c = 0; c < 3; c++) {
      expected += pow((ends[k][1][c] - ends[k][0][c]) / 2, 2);
      size += first[c] * first[c];
    }
    printf("# rotations %zu: ends off by %.1g, angular velocity %.4g 1/s, uneven by %.1g\n", k, worst, sqrt(size),
           rates);
    CHECK_BELOW(worst, 1e-10);
    CHECK_BELOW(rates, 1e-10);
    if (k == 2 || k == 3) CHECK_NEAR(sqrt(size), sqrt(expected), 1e-12);
    if (k == 5) CHECK_NEAR(sqrt(size), sqrt(expected), 1e-3);
  }
}

static void bad_arguments_are_sentences(void)
{
  test_body b;
  make_cube(1, 1, &b);
  flesh_effect *effect = NULL;
  flesh_keyframe keys[] = {{.t = 1}, {.t = 1}};
  flesh_motion target = {.count = 1, .keyframes = keys};
  const double point[3] = {0.5, 0.5, 0.5};
#define REFUSED(call, part)                       \
  do {                                            \
    flesh_effect_destroy(&effect);                \
    CHECK((call) == FLESH_ERR_ARGUMENT);          \
    CHECK_TEXT(flesh_error_text(), part);         \
    CHECK(effect == NULL);                        \
  } while (0)
  REFUSED(flesh_effect_spring(&b.body, point, 0, &target, 0, 1, &effect), "stiffness is 0 N/m");
  REFUSED(flesh_effect_spring_within(&b.body, point, -1, 5, &target, 0, 1, &effect), "radius is -1 m");
  REFUSED(flesh_effect_spring_within(&b.body, point, INFINITY, 5, &target, 0, 1, &effect), "radius is inf m");
  REFUSED(flesh_effect_spring_within(&b.body, point, 1e-300, 5, &target, 0, 1, &effect), "radius is 1e-300 m");
  REFUSED(flesh_effect_spring(&b.body, point, NAN, &target, 0, 1, &effect), "stiffness is nan N/m");
  REFUSED(flesh_effect_spring(&b.body, point, 1, &target, 1, 1, &effect), "until is 1 s");
  REFUSED(flesh_effect_spring(&b.body, point, 1, &target, NAN, 1, &effect), "until is 1 s");
  REFUSED(flesh_effect_spring(&b.body, (double[]){0, NAN, 0}, 1, &target, 0, 1, &effect), "finite");
  target.count = 2;
  REFUSED(flesh_effect_spring(&b.body, point, 1, &target, 0, 1, &effect), "times must ascend");
  target.count = 0;
  REFUSED(flesh_effect_spring(&b.body, point, 1, &target, 0, 1, &effect), "at least one keyframe");
  target.count = 1;
  keys[0].translation[1] = INFINITY;
  REFUSED(flesh_effect_spring(&b.body, point, 1, &target, 0, 1, &effect), "finite");
  keys[0].translation[1] = 0;
  keys[0].t = NAN;
  REFUSED(flesh_effect_spring(&b.body, point, 1, &target, 0, 1, &effect), "finite");
  REFUSED(flesh_effect_gravity(&b.body, (double[]){0, 0, NAN}, &effect), "finite");
  b.density[3] = 0;
  REFUSED(flesh_effect_inertia(&b.body, &effect), "density");
  b.density[3] = 1;
  b.body.materials = NULL;
  REFUSED(flesh_effect_elasticity(&b.body, &effect), "needs a body with a material");
  flesh_effect_destroy(&effect);
  flesh_effect_destroy(NULL);
  test_body_destroy(&b);
}

/* Springs stiffer than the block carry it forty lengths away in one equilibrium; a stretched first iterate does not
 * prevent that. */
static void springs_carry_a_free_block_far(void)
{
  test_body b;
  flesh_effect *effect = NULL;
  flesh_integrator *integrator = NULL;
  flesh_solve_stats stats = {0};
  const flesh_solver_options options = test_options(1e-6);
  const double corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}};
  make_cube(3, 1, &b);
  CHECK_OK(flesh_effect_elasticity(&b.body, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  for (int k = 0; k < 4; k++) {
    flesh_keyframe key = {.translation = {corners[k][0] + 40, corners[k][1], corners[k][2]}};
    const flesh_motion target = {.count = 1, .keyframes = &key};
    CHECK_OK(flesh_effect_spring(&b.body, corners[k], 1e9, &target, -INFINITY, INFINITY, &effect));
    CHECK_OK(flesh_system_add_effect(b.system, &effect));
  }
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, &stats));
  for (int d = 0; d < b.n; d++) CHECK_NEAR(b.state.x[d], flesh_mesh_positions(b.mesh)[d] + (d % 3 ? 0 : 40), 1e-6);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(spring_pulls_at_its_point), TEST(the_point_follows_curved_edges), TEST(motions), TEST(rotations_go_evenly),
                   TEST(bad_arguments_are_sentences), TEST(springs_carry_a_free_block_far));
}
