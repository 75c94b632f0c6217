// TEST quick seconds=5
/* test_error_control.c: adaptive steps in cases in which the error is hard to see. */
#include "motion_reference.h"

/* A load that grows from 0 excites vibrations, which a long first step would skip without seeing an error. */
static void vibrations_that_growing_loads_excite_are_seen(void)
{
  enum { END_NODES = 4, RUNS = 8 };
  const flesh_curve_point points[] = {{0, 0}, {3, 1}};
  const flesh_amplitude amplitude = {2, points, 0, -INFINITY, INFINITY};
  int nodes[END_NODES], count = 0;
  test_body b;
  flesh_effect *effect = NULL;
  CHECK_OK(test_body_create(test_box(3, 1, 1, 3, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
  for (int i = 0; i < b.n / 3; i++)
    if (flesh_mesh_positions(b.mesh)[3 * i] > 2.9) nodes[count++] = i;
  CHECK_OK(flesh_effect_force(&b.body, count, nodes, (double[]){1500, 0, 0}, &amplitude, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_state exact = state_copy(b.n, &b.state);
  motion_reference_run(&b, 6, 1e-12, &exact);
  for (int k = 0; k < RUNS; k++) {
    const double tolerance = pow(10, -1 - k / 2.);
    flesh_state state = state_copy(b.n, &b.state);
    flesh_solve_stats stats = {0};
    flesh_integrator *integrator = motion_controlled(&b, FLESH_METHOD_RUNGE_KUTTA, 1e-11, tolerance);
    CHECK_OK(flesh_integrator_step(integrator, &state, 6, &stats));
    const double error = motion_distance(b.n, state.x, exact.x);
    printf("# tolerance %.2g: %d steps, %d rejected, %d Newton, error %.3g m = %.3g tolerances\n", tolerance, stats.steps,
           stats.rejected, stats.newton, error, error / (3 * tolerance));
    CHECK(error < 2 * (3 * tolerance));
    flesh_integrator_destroy(&integrator);
    state_free(&state);
  }
  state_free(&exact);
  test_body_destroy(&b);
}

/* Makes a rod that spins freely or, if `hinged`, about a line of pins, as a rigid body. */
static void make_spinning(double young, int hinged, test_body *b)
{
  const double c[] = {hinged ? 0 : 1.5, 0.5, hinged ? 0 : 0.5}, w[] = {hinged ? 0 : 1, hinged ? 1 : 0.6, hinged ? 0 : 3};
  int pins[3], count = 0;
  flesh_material material;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, young, 0.4, &material));
  CHECK_OK(test_body_create(test_box(6, 2, 2, 3, 1, 1), material, 1000, FLESH_MASS_LUMPED, 1, b));
  for (int i = 0; i < b->n / 3 && hinged; i++) {
    const double *X = flesh_mesh_positions(b->mesh) + 3 * i;
    if (X[0] == 0 && X[2] == 0) pins[count++] = i;
  }
  if (hinged) CHECK_OK(flesh_system_add_pin(b->system, count, pins, FLESH_AXES_ALL, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b->system));
  for (int d = 0; d < b->n; d++) {
    const double *X = b->state.x + d - d % 3;
    const int e = (d + 1) % 3, f = (d + 2) % 3;
    b->state.v[d] = w[e] * (X[f] - c[f]) - w[f] * (X[e] - c[e]);
  }
}

/* Moves the body for 2 s by steps that the tolerance chooses. Returns by how much its angular momentum has changed, if
 * `hinged` that about the line. */
static double spin(test_body *b, flesh_method method, double tolerance, int hinged)
{
  double before[6], after[6], change = 0, all = 0;
  flesh_solve_stats stats = {0};
  flesh_integrator *integrator = motion_controlled(b, method, 1e-11, tolerance);
  test_momenta(b, before);
  CHECK_OK(flesh_integrator_step(integrator, &b->state, 2, &stats));
  test_momenta(b, after);
  flesh_integrator_destroy(&integrator);
  for (int i = hinged ? 4 : 3; i < (hinged ? 5 : 6); i++) change += pow(after[i] - before[i], 2), all += pow(before[i], 2);
  printf("# %s, %s%.1e Pa at %g: %d steps, %d rejected, %d Newton, angular momentum off by %.2g tolerances\n",
         flesh_method_name(method), hinged ? "hinged, mu " : "mu ", b->material.mu, tolerance, stats.steps, stats.rejected,
         stats.newton, sqrt(change / all) / tolerance);
  return sqrt(change / all);
}

/* A body that spins far more slowly than it vibrates conserves its angular momentum as accurately as steps may err:
 * residuals, which hardly move it within a step, would turn it for as long as it moves, and so would accelerations that
 * swing, of Newmark's family. */
static void keep_spinning(flesh_method method, double young, int hinged)
{
  const int most = method == FLESH_METHOD_NEWMARK && young > 1e11 ? 4 : 2; /* rounding scatters it up to 3.3 */
  for (double tolerance = 1e-2; tolerance > 2e-4; tolerance /= sqrt(10)) {
    test_body b;
    make_spinning(young, hinged, &b);
    CHECK_BELOW(spin(&b, method, tolerance, hinged), most * tolerance);
    test_body_destroy(&b);
  }
}

static void stiff_bodies_that_spin_freely_keep_spinning(void)
{
  for (double young = 1e8; young < 2e12; young *= 100) {
    keep_spinning(FLESH_METHOD_NEWMARK, young, 0);
    keep_spinning(FLESH_METHOD_HHT, young, 0);
    keep_spinning(FLESH_METHOD_GENERALIZED_ALPHA, young, 0);
  }
}

/* Runge-Kutta methods keep the angular momentum of a free body to rounding. The errors that remain are those of vibrations,
 * up to four tolerances; stiff bodies err by less than half a tolerance, by esdirk325 by two. */
static void errors_of_bodies_that_spin_freely_follow_the_tolerance(void)
{
  for (double young = 1e6; young < 2e12; young *= 100) {
    test_body b, exact;
    make_spinning(young, 0, &exact);
    CHECK_BELOW(spin(&exact, FLESH_METHOD_RUNGE_KUTTA, 1e-7, 0), 1e-9);
    for (double tolerance = 1e-2; tolerance > 5e-6; tolerance /= 10) {
      make_spinning(young, 0, &b);
      CHECK_BELOW(spin(&b, FLESH_METHOD_RUNGE_KUTTA, tolerance, 0), 1e-9);
      const double error = motion_distance(b.n, b.state.x, exact.state.x) / 3;
      printf("# error %.2g tolerances\n", error / tolerance);
      CHECK_BELOW(error, (young < 1e9 ? 4 : 0.5) * tolerance);
      test_body_destroy(&b);
    }
    test_body_destroy(&exact);
  }
}

/* A force at a corner, which changes the momenta of a free body, and of that with an elastic motion. */
static void forces_turn_free_bodies(void)
{
  test_body b;
  flesh_effect *effect = NULL;
  CHECK_OK(test_body_create(test_box(3, 1, 1, 3, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(flesh_effect_force(&b.body, 1, (const int[]){0}, (double[]){200, 500, 1000}, NULL, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(test_body_gravity(&b, 0, 0, -2));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_state exact = state_copy(b.n, &b.state);
  motion_reference_run(&b, 2, 1e-12, &exact);
  spin(&b, FLESH_METHOD_RUNGE_KUTTA, 1e-3, 0);
  const double error = motion_distance(b.n, b.state.x, exact.x) / 3;
  printf("# error %.2g tolerances\n", error / 1e-3);
  CHECK_BELOW(error, 2e-3);
  state_free(&exact);
  test_body_destroy(&b);
}

static void stiff_bodies_that_turn_on_pins_keep_turning(void)
{
  for (double young = 1e8; young < 2e10; young *= 100) {
    keep_spinning(FLESH_METHOD_RUNGE_KUTTA, young, 1);
    keep_spinning(FLESH_METHOD_NEWMARK, young, 1);
    keep_spinning(FLESH_METHOD_HHT, young, 1);
  }
}

/* A longest step equal to the time between outputs, which is rounded, makes one step of each. */
static void longest_steps_reach_outputs(void)
{
  const double h = 1. / 60;
  test_body b;
  CHECK_OK(test_body_create(test_box(3, 1, 1, 3, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_gravity(&b, 0, 0, -2));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_solve_stats stats = {0};
  flesh_integrator *integrator = motion_integrator(&b, FLESH_METHOD_RUNGE_KUTTA, 1e-11);
  flesh_adaptive_options adaptive;
  flesh_adaptive_options_default(&adaptive);
  adaptive.control = 1;
  adaptive.tolerance = 0.1;
  adaptive.max_step = h;
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
  for (int k = 1; k <= 60; k++) {
    CHECK_OK(flesh_integrator_step(integrator, &b.state, k * h - b.state.t, &stats));
    b.state.t = k * h;
  }
  printf("# %d steps to 60 outputs\n", stats.steps);
  CHECK(stats.steps == 60);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(vibrations_that_growing_loads_excite_are_seen),
                   TEST_LONG(stiff_bodies_that_spin_freely_keep_spinning),
                   TEST_LONG(errors_of_bodies_that_spin_freely_follow_the_tolerance), TEST(forces_turn_free_bodies),
                   TEST_LONG(stiff_bodies_that_turn_on_pins_keep_turning), TEST(longest_steps_reach_outputs));
}
