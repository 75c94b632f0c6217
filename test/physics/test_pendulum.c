// TEST full seconds=300
/* test_pendulum.c: a spring pulls without a torque: a stiff cube suspended at the middle of a side swings as a physical
 * pendulum, and the angular momentum about the target is conserved. With every method, at a point and within a radius,
 * for four-node and ten-node tets. */
#include <stdlib.h>

#include "body.h"
#include "test.h"

static const double side = 0.1, gravity = 9.81;

/* Makes a cube of 1 kg on a spring at the middle of its side x = 0, whose target is there. */
static void hang(int order, double radius, double young, double stiffness, test_body *b)
{
  flesh_mesh *mesh = test_box(3, 3, 3, side, side, side), *raised;
  flesh_material material;
  flesh_effect *effect = NULL;
  const flesh_keyframe key = {.translation = {0, side / 2, side / 2}};
  if (order == 2) {
    CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
    flesh_mesh_destroy(&mesh);
    mesh = raised;
  }
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, young, 0.3, &material));
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_LUMPED, 1, b));
  CHECK_OK(flesh_effect_spring_within(&b->body, key.translation, radius, stiffness,
                                      &(flesh_motion){.count = 1, .keyframes = &key}, -INFINITY, INFINITY, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
}

static flesh_integrator *integrator_of(const test_body *b, flesh_method method, double newton, double tolerance)
{
  flesh_integrator *integrator = NULL;
  flesh_solver_options options = test_options(newton);
  flesh_adaptive_options adaptive;
  options.linear_tolerance = fmin(options.linear_tolerance, newton);
  flesh_adaptive_options_default(&adaptive);
  adaptive.tolerance = tolerance;
  CHECK_OK(flesh_integrator_create(b->system, method, &options, &integrator));
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
  return integrator;
}

/* Calls `run` with every method of motion. */
static void by_every_method(void (*run)(flesh_method method, int order, double radius))
{
  const double radii[] = {0, NAN, 0.03};
  for (int m = 0; flesh_method_name((flesh_method)m); m++)
    for (int order = 1; order <= 2 && m != FLESH_METHOD_STATIC; order++)
      for (int k = 0; k < 3; k++) run((flesh_method)m, order, radii[k]);
}

/* Returns the height of the centre of mass. */
static double height(const test_body *b)
{
  double *ones = malloc((size_t)b->n * sizeof *ones), *m = malloc((size_t)b->n * sizeof *m), sum = 0, mass = 0;
  for (int d = 0; d < b->n; d++) ones[d] = 1;
  test_body_mass_times(b, ones, m);
  for (int d = 2; d < b->n; d += 3) sum += m[d] * b->state.x[d], mass += m[d];
  free(ones);
  free(m);
  return sum / mass;
}

/* Returns the moment of inertia of the rest shape about the y axis through the target, from the nodes' masses: with
 * many nodes m s^2 (1/6 + 1/4). */
static double inertia(const test_body *b)
{
  const double *X = flesh_mesh_positions(b->mesh);
  double *m = malloc((size_t)b->n / 3 * sizeof *m), sum = 0;
  flesh_mesh_lumped_mass(b->mesh, b->density, m);
  for (int i = 0; i < b->n / 3; i++) sum += m[i] * (pow(X[3 * i], 2) + pow(X[3 * i + 2] - side / 2, 2));
  free(m);
  return sum;
}

/* w^2 = m g (s/2) / I; a quarter of the period, starting from the horizontal, is K(sin 45 degrees) / w, with K the
 * complete elliptic integral. */
static void swing(flesh_method method, int order, double radius)
{
  const double h = flesh_method_order(method) == 1 ? 1e-3 : 2e-3;
  double lowest = INFINITY, when = 0, last = 0, before = 0;
  test_body b;
  hang(order, radius, 1e7, 1e5, &b);
  CHECK_OK(test_body_gravity(&b, 0, 0, -gravity));
  CHECK_OK(flesh_system_finalize(b.system));
  const double mass = 1000 * side * side * side, quarter = 1.8540746773013719 / sqrt(mass * gravity * side / 2 / inertia(&b));
  flesh_integrator *integrator = integrator_of(&b, method, 1e-6, 1e-4);
  for (int k = 1; k * h < 1.25 * quarter; k++) {
    CHECK_OK(flesh_integrator_step(integrator, &b.state, h, NULL));
    const double z = height(&b) - side / 2;
    if (before < lowest) /* parabola through three heights */
      lowest = before, when = b.state.t - h + h / 2 * (last - z) / (last - 2 * before + z);
    last = before, before = z;
  }
  printf("# %s, order %d, radius %g: lowest by %.5f m at %.4f s, rigid by %.5f m at %.4f s\n", flesh_method_name(method),
         order, radius, lowest, when, -side / 2, quarter);
  CHECK_NEAR(lowest, -side / 2, 0.02 * side / 2);
  CHECK_NEAR(when, quarter, 0.02 * quarter);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

static void a_stiff_cube_is_a_pendulum(void) { by_every_method(swing); }

/* Computes the angular momentum about a position, L - position x p. */
static void momentum_about(const test_body *b, const double place[3], double L[3])
{
  double sums[6];
  test_momenta(b, sums);
  for (int c = 0; c < 3; c++)
    L[c] = sums[3 + c] - (place[(c + 1) % 3] * sums[(c + 2) % 3] - place[(c + 2) % 3] * sums[(c + 1) % 3]);
}

/* Returns the largest change of the angular momentum about the target while a soft cube spins and moves around it, as a
 * fraction of the initial value. */
static double drift(flesh_method method, int order, double radius, int steps, double tolerance)
{
  const double place[3] = {0, side / 2, side / 2};
  double first[3], now[3], worst = 0;
  test_body b;
  hang(order, radius, 2e5, 500, &b);
  CHECK_OK(flesh_system_finalize(b.system));
  for (int i = 0; i < b.n; i += 3) {
    const double r[3] = {b.state.x[i] - place[0], b.state.x[i + 1] - place[1], b.state.x[i + 2] - place[2]};
    const double v[3] = {0.2 - 4 * r[1], 0.3 + 4 * r[0], -0.4 + 3 * r[1]};
    memcpy(b.state.v + i, v, sizeof v);
    b.state.x[i] += 0.02;
  }
  flesh_integrator *integrator = integrator_of(&b, method, 1e-9, tolerance);
  momentum_about(&b, place, first);
  const double size = sqrt(first[0] * first[0] + first[1] * first[1] + first[2] * first[2]);
  for (int k = 0; k < steps; k++) {
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.2 / steps, NULL));
    momentum_about(&b, place, now);
    for (int c = 0; c < 3; c++) worst = fmax(worst, fabs(now[c] - first[c]) / size);
  }
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return worst;
}

/* The midpoint rule conserves it up to the residuals of the solves; others lose it by their errors in time, which fall
 * with the step. */
static void turn(flesh_method method, int order, double radius)
{
  const int exact = method == FLESH_METHOD_MIDPOINT, accuracy = flesh_method_order(method);
  const double coarse = drift(method, order, radius, 50, 1e-3), fine = drift(method, order, radius, 100, 1e-4);
  printf("# %s, order %d, radius %g: angular momentum about the target off by %.2g and %.2g\n",
         flesh_method_name(method), order, radius, coarse, fine);
  CHECK_BELOW(fine, exact ? 1e-6 : accuracy == 1 ? 0.1 : 0.01);
  if (!exact) CHECK_BELOW(fine, (accuracy == 2 ? 0.45 : 0.65) * coarse);
}

static void angular_momentum_about_the_target_is_kept(void) { by_every_method(turn); }

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(a_stiff_cube_is_a_pendulum), TEST(angular_momentum_about_the_target_is_kept));
}
