// TEST full memory seconds=60
/* test_impacts.c: bodies that collide with obstacles under methods whose forces balance before the end of a step: the
 * ends are outside of the obstacle at bounded cost, momentum along a smooth plane is conserved, and the method
 * continues from the right acceleration; otherwise spurious energy ends the run at once, with cause, position and
 * time. */
#include <stdlib.h>

#include "body.h"
#include "test.h"

typedef struct scene {
  test_body b;
  flesh_integrator *integrator;
} scene;

/* A cube of jelly, 10 cm, 2 cm above the origin's level. Takes the obstacle. */
static void make(flesh_method method, flesh_obstacle *obstacle, double friction, const double v[3], double tolerance,
                 scene *s)
{
  flesh_material material;
  flesh_contact_options options;
  flesh_effect *effect = NULL;
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_box((int[]){5, 5, 5}, (double[]){0.1, 0.1, 0.1}, (double[]){0, 0, 0.02}, &mesh));
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 5000, 0.45, &material));
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_LUMPED, 1, &s->b));
  CHECK_OK(test_body_gravity(&s->b, 0, 0, -9.81));
  flesh_contact_options_default(&options);
  options.friction = friction;
  options.slip_speed = 0.01;
  CHECK_OK(flesh_effect_obstacle_contact(&s->b.body, &options, &obstacle, &effect));
  CHECK_OK(flesh_system_add_effect(s->b.system, &effect));
  CHECK_OK(flesh_system_finalize(s->b.system));
  for (int d = 0; d < s->b.n; d++) s->b.state.v[d] = v[d % 3];
  const flesh_solver_options solver = test_options(tolerance);
  CHECK_OK(flesh_integrator_create(s->b.system, method, &solver, &s->integrator));
}

static void clear(scene *s)
{
  flesh_integrator_destroy(&s->integrator);
  test_body_destroy(&s->b);
}

/* Five steps of 6 cm that go down 4 cm each. */
static flesh_obstacle *make_stairs(void)
{
  enum { STEPS = 5, LINES = 2 * STEPS };
  double X[2 * LINES * 3];
  int corners[2 * (LINES - 1) * 3], count = 0;
  for (int k = 0; k < LINES; k++)
    for (int side = 0; side < 2; side++) {
      double *p = X + 3 * (2 * k + side);
      p[0] = -0.1 + 0.06 * ((k + 1) / 2) + (k == LINES - 1 ? 1 : 0);
      p[1] = side ? 1 : -1;
      p[2] = -0.04 * (k / 2);
    }
  for (int k = 0; k + 1 < LINES; k++) {
    const int quad[] = {2 * k, 2 * k + 2, 2 * k + 1, 2 * k + 1, 2 * k + 2, 2 * k + 3};
    for (int c = 0; c < 6; c++) corners[count++] = quad[c];
  }
  flesh_obstacle *o = NULL;
  CHECK_OK(flesh_obstacle_mesh(2 * LINES, X, count / 3, corners, &o));
  return o;
}

/* Thrown down the stairs with steps in which a node moves far through the barrier: each method ends with hardly more
 * energy than at the start, in a few iterations per step. The trapezoidal rule, whose steps are cut where energy rises,
 * gains some. */
static void stairs_are_taken(void)
{
  const flesh_method methods[] = {FLESH_METHOD_MIDPOINT, FLESH_METHOD_HHT, FLESH_METHOD_GENERALIZED_ALPHA,
                                  FLESH_METHOD_NEWMARK, FLESH_METHOD_BDF2};
  for (int m = 0; m < TEST_FEWER(5, 2); m++) {
    scene s;
    flesh_solve_stats stats = {0};
    make(methods[m], make_stairs(), 0.4, (double[]){0.4, 0, 0}, 1e-6, &s);
    int status = FLESH_OK, steps = 0, undefined = 0;
    for (; steps < 60 && !status; steps++) {
      status = flesh_integrator_step(s.integrator, &s.b.state, 1. / 120, &stats);
      undefined += flesh_system_check(s.b.system, s.b.state.t, s.b.state.x) != FLESH_OK;
    }
    const flesh_energy_balance *balance = flesh_integrator_energy_balance(s.integrator);
    printf("# %s: %s after %d steps, %d by backward Euler, %d halved, %d for their energy, %d Newton, gain %.3g\n",
           flesh_method_name(methods[m]), flesh_status_name(status), steps, stats.impact_steps,
           stats.convergence_failures, stats.rejected, stats.newton, balance->gain);
    const int feeds = methods[m] == FLESH_METHOD_NEWMARK;
    CHECK(!status && !undefined);
    CHECK(stats.newton < (feeds ? 50 : 30) * steps && stats.convergence_failures <= 3);
    CHECK(feeds ? stats.rejected > 0 : stats.rejected <= 8);
    CHECK_BELOW(balance->gain, 0.011);
    const int within = methods[m] != FLESH_METHOD_NEWMARK && methods[m] != FLESH_METHOD_BDF2;
    CHECK(within ? stats.impact_steps > 0 : stats.impact_steps == 0);
    clear(&s);
  }
}

/* On a smooth slope momentum along it changes by gravity only, with or without impacts; and no step ends beyond it. */
static void slopes_keep_momentum_along_them(void)
{
  const flesh_method methods[] = {FLESH_METHOD_MIDPOINT, FLESH_METHOD_HHT, FLESH_METHOD_BDF2};
  const double normal[3] = {0.6, 0, 0.8}, along[3] = {0.8, 0, -0.6}, h = 1. / 120;
  for (int m = 0; m < 3; m++) {
    scene s;
    flesh_solve_stats stats = {0};
    flesh_obstacle *o = NULL;
    CHECK_OK(flesh_obstacle_plane((double[]){0, 0, -0.1}, normal, &o));
    make(methods[m], o, 0, (double[]){0.3, 0.2, -1}, 1e-9, &s);
    double worst = 0, lowest = 1;
    for (int k = 1; k <= 60; k++) {
      CHECK_OK(flesh_integrator_step(s.integrator, &s.b.state, h, &stats));
      double p[2] = {0, 0}, *mass = malloc((size_t)s.b.n * sizeof *mass), *v = malloc((size_t)s.b.n * sizeof *v);
      for (int d = 0; d < s.b.n; d++) v[d] = 1;
      test_body_mass_times(&s.b, v, mass);
      for (int d = 0; d < s.b.n; d++) {
        p[0] += mass[d] * along[d % 3] * s.b.state.v[d];
        if (d % 3 == 1) p[1] += mass[d] * s.b.state.v[d];
      }
      for (int i = 0; i < s.b.n; i += 3) {
        const double *x = s.b.state.x + i;
        lowest = fmin(lowest, normal[0] * x[0] + normal[1] * x[1] + normal[2] * (x[2] + 0.1));
      }
      /* 1 kg */
      worst = fmax(worst, fmax(fabs(p[0] - (0.3 * 0.8 + 0.6 + 0.6 * 9.81 * h * k)), fabs(p[1] - 0.2)));
      free(mass);
      free(v);
    }
    printf("# %s: momentum off by %.2g of %.3g kg m/s, %d impacts, lowest node %.3g m above the slope\n",
           flesh_method_name(methods[m]), worst, 0.84 + 0.6 * 9.81 / 2, stats.impact_steps, lowest);
    CHECK_BELOW(worst, 1e-6);
    CHECK(lowest > 0 && (methods[m] == FLESH_METHOD_BDF2 || stats.impact_steps > 0));
    clear(&s);
  }
}

/* HHT continues from the acceleration with which the step of backward Euler balances: (v_1 - v_0)/h. The next step's
 * x_2 - x_1 and v_2 - v_1 are two equations for the same a_2. */
static void hht_goes_on_from_the_acceleration_of_an_impact(void)
{
  const double h = 1. / 120, alpha = -0.1, beta = (1 - alpha) * (1 - alpha) / 4, gamma = 0.5 - alpha;
  scene s;
  flesh_obstacle *o = NULL;
  CHECK_OK(flesh_obstacle_plane((double[]){0, 0, 0.0}, (double[]){0, 0, 1}, &o));
  make(FLESH_METHOD_HHT, o, 0, (double[]){0, 0, -2}, 1e-9, &s);
  CHECK_OK(flesh_integrator_set_max_energy_gain(s.integrator, INFINITY)); /* no steps shorter than h */
  const size_t bytes = (size_t)s.b.n * sizeof(double);
  double *x = malloc(bytes), *v = malloc(bytes), *a = malloc(bytes), worst = 0, largest = 0;
  int impacts = 0, followed = 0;
  for (int k = 0; k < 60; k++) {
    flesh_solve_stats stats = {0};
    memcpy(x, s.b.state.x, bytes);
    memcpy(v, s.b.state.v, bytes);
    CHECK_OK(flesh_integrator_step(s.integrator, &s.b.state, h, &stats));
    for (int d = 0; d < s.b.n && impacts; d++) { /* the previous step was one */
      const double a2 = ((s.b.state.v[d] - v[d]) / h - (1 - gamma) * a[d]) / gamma;
      const double x2 = x[d] + h * v[d] + h * h * ((0.5 - beta) * a[d] + beta * a2);
      if (stats.impact_steps || stats.steps != 1) continue;
      worst = fmax(worst, fabs(s.b.state.x[d] - x2));
      largest = fmax(largest, h * h * fabs(a[d]));
      followed++;
    }
    impacts = stats.impact_steps == 1 && stats.steps == 1;
    for (int d = 0; d < s.b.n; d++) a[d] = (s.b.state.v[d] - v[d]) / h;
  }
  printf("# %d impacts followed, off by %.2g m where h^2 a is up to %.2g m\n", followed / s.b.n, worst, largest);
  CHECK(followed > 0 && largest > 1e-3);
  CHECK_BELOW(worst, 1e-12);
  free(x);
  free(v);
  free(a);
  clear(&s);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(stairs_are_taken), TEST(slopes_keep_momentum_along_them),
                   TEST(hht_goes_on_from_the_acceleration_of_an_impact));
}
