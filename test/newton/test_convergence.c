// TEST quick seconds=60
/* test_convergence.c: where a solve ends, its residual is small compared with the forces that balance there, whatever
 * an obstacle, a prescribed motion or a spring has done to its first iterate. */
#include "press.h"
#include "sundials/kinsol.h"

static const double tau = 1e-6; /* the default */

/* A ball that starts within the barrier, hardly above a node, makes the first residual arbitrarily large: its final
 * force is the same at every tolerance. */
static void contact_forces_depend_little_on_the_tolerance(void)
{
  for (double gap = 5e-5; gap > 1e-10; gap /= 300) {
    double usual[DEPTHS], exact[DEPTHS];
    press(8, tau, gap, 0.02, usual);
    press(8, 1e-11, gap, 0.02, exact);
    for (int k = 0; k < DEPTHS; k++) CHECK_NEAR(usual[k] / exact[k], 1, 1e-3);
  }
}

static double unit(double s, int c) { return (c == 2 ? 0.1 : 0.3) * s; }

/* A block placed within the barrier is borne with its weight, however soft or stiff it is. */
static void resting_blocks_weigh_what_they_weigh(void)
{
  const double weight = 0.3 * 0.3 * 0.1 * 1000 * 9.81;
  const double moduli[] = {1e5, 1e9};
  for (int stiff = 0; stiff < 2; stiff++)
    for (double gap = 1e-3; gap > 1e-10; gap /= 100) {
      test_body b;
      flesh_material material;
      flesh_solve_stats stats = {0};
      flesh_obstacle *floor = NULL;
      CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, moduli[stiff], 0.3, &material));
      CHECK_OK(test_body_create(make_mesh(5, 5, 3, unit), material, 1000, FLESH_MASS_LUMPED, 0, &b));
      CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
      CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, -gap}, (const double[]){0, 0, 1}, &floor));
      add_contact(&b, floor, NAN);
      CHECK_OK(flesh_system_finalize(b.system));
      solve_statics(&b, tau, 1, &stats);
      printf("# %g Pa, %g m above: %.9g N by %d Newton iterations\n", moduli[stiff], gap, contact_force(&b),
             stats.newton);
      /* The residuals of the nodes may add up. */
      CHECK_NEAR(contact_force(&b), weight, sqrt(b.n / 3.) * stats.residual_last + 1e-9);
      CHECK_NEAR(contact_force(&b) / weight, 1, 1e-4);
      test_body_destroy(&b);
    }
}

/* max_newton keeps counting when a smaller residual is required. */
static void iterations_are_limited_in_all(void)
{
  test_body b;
  flesh_solve_stats stats = {0};
  flesh_obstacle *floor = NULL;
  flesh_integrator *integrator = NULL;
  flesh_solver_options options = test_options(tau);
  options.max_newton = 10;
  options.max_cutbacks = 0;
  options.accept_unconverged = 1;
  CHECK_OK(test_body_create(make_mesh(5, 5, 3, unit), test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 0,
                            &b));
  CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
  CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, -1e-9}, (const double[]){0, 0, 1}, &floor));
  add_contact(&b, floor, NAN);
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 1, &stats));
  printf("# residual %g N of %g N, wanted %g N, after %d Newton iterations\n", stats.residual_last,
         largest_force(&b, NULL), stats.residual_target, stats.newton);
  CHECK(stats.newton == 10 && stats.unconverged == 1 && stats.residual_last > stats.residual_target);
  CHECK_BELOW(stats.residual_target, 1e-3 * tau * stats.residual_first); /* it took more than one pass */
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* Prescribed motions and springs that have moved far at once: their initial effect on the adjacent elements must not
 * set the tolerance. */
static void far_jumps_end_in_balance(void)
{
  for (int spring = 0; spring < 2; spring++)
    for (double stiffness = 1e4; stiffness < 1e11; stiffness *= spring ? 100 : 1e9) {
      test_body b;
      flesh_solve_stats stats = {0};
      const flesh_keyframe key = {.translation = {1, 0.2, 0}, .rotation = {0.7, 0, 0}};
      const flesh_motion motion = {.count = 1, .keyframes = &key, .centre = {2, 0.5, 0.5}};
      CHECK_OK(test_body_create(test_box(12, 5, 5, 2, 1, 1), test_material(FLESH_ENERGY_S, 0.45), 1000,
                                FLESH_MASS_LUMPED, 0, &b));
      CHECK_OK(test_body_clamp(&b, 1e-9));
      if (spring) {
        flesh_effect *effect = NULL;
        CHECK_OK(flesh_effect_spring(&b.body, (const double[]){2, 0.5, 0.5}, stiffness, &motion, -INFINITY, INFINITY,
                                   &effect));
        CHECK_OK(flesh_system_add_effect(b.system, &effect));
      } else {
        CHECK_OK(test_body_hold(&b, 0, 2, FLESH_AXES_ALL, &motion, -INFINITY, INFINITY));
      }
      CHECK_OK(flesh_system_finalize(b.system));
      solve_statics(&b, tau, 1, &stats);
      printf("# %s%.0e: residual %.2g N of %.2g N by %d Newton iterations\n", spring ? "spring of N/m " : "handle ",
             stiffness, stats.residual_last, largest_force(&b, NULL), stats.newton);
      CHECK(stats.at_rounding == 0);
      test_body_destroy(&b);
    }
}

/* A floor that rises under a block, by steps that end within the barrier or push it up at once. */
static void moving_contact_ends_in_balance(void)
{
  const double h = 1. / 120;
  double worst = 0;
  test_body b;
  flesh_obstacle *floor = NULL;
  flesh_integrator *integrator = NULL;
  const flesh_solver_options options = test_options(tau);
  const flesh_keyframe keys[] = {{.t = 0}, {.t = 0.1, .translation = {0, 0, 0.05}}, {.t = 0.2}};
  const flesh_motion motion = {.count = 3, .keyframes = keys};
  CHECK_OK(test_body_create(make_mesh(5, 5, 3, unit), test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 1,
                            &b));
  CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
  CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, -2e-3}, (const double[]){0, 0, 1}, &floor));
  CHECK_OK(flesh_obstacle_move(floor, &motion));
  add_contact(&b, floor, NAN);
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  double *a = malloc((size_t)b.n * sizeof *a);
  for (int step = 0; step < 36; step++) {
    flesh_solve_stats stats = {0};
    memcpy(a, b.state.v, (size_t)b.n * sizeof *a);
    CHECK_OK(flesh_integrator_step(integrator, &b.state, h, &stats));
    for (int d = 0; d < b.n; d++) a[d] = (b.state.v[d] - a[d]) / h;
    CHECK(stats.solves == 1);
    const double share = stats.residual_last / largest_force(&b, a);
    if (!stats.at_rounding) worst = fmax(worst, share);
  }
  printf("# largest residual: %.2g of the forces in balance\n", worst);
  CHECK_BELOW(worst, 1.000001 * tau);
  free(a);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* A clamped bar that is kicked and then left to swing: the forces with which the first iterate has to stop or continue
 * the motion say nothing of the forces at the step's end, including inertia. Damped and undamped, with every method of
 * fixed steps. */
static void motion_without_contact_ends_in_balance(void)
{
  const flesh_method methods[] = {FLESH_METHOD_BACKWARD_EULER, FLESH_METHOD_BDF2, FLESH_METHOD_NEWMARK};
  for (int m = 0; m < 3; m++)
    for (double h = 1. / 60; h > 1e-5; h /= 20) {
      test_body b;
      flesh_integrator *integrator = NULL;
      const flesh_solver_options options = test_options(tau);
      double worst = 0;
      CHECK_OK(test_body_create(test_box(12, 3, 3, 4, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000,
                                FLESH_MASS_LUMPED, 1, &b));
      CHECK_OK(test_body_clamp(&b, 1e-9));
      CHECK_OK(test_body_gravity(&b, 0, 0, -1e-3));
      CHECK_OK(flesh_system_finalize(b.system));
      CHECK_OK(flesh_integrator_create(b.system, methods[m], &options, &integrator));
      for (int d = 0; d < b.n; d++)
        b.state.v[d] = (d % 3 == 1) * (flesh_mesh_positions(b.mesh)[d / 3 * 3] > 1e-9) * 5;
      double *a = calloc((size_t)b.n, sizeof *a);
      for (int step = 0; step < 12; step++) {
        flesh_solve_stats stats = {0};
        double *v = malloc((size_t)b.n * sizeof *v);
        memcpy(v, b.state.v, (size_t)b.n * sizeof *v);
        CHECK_OK(flesh_integrator_step(integrator, &b.state, h, &stats));
        /* Backward Euler's own acceleration; with the others what is left out is small compared with the elements'
         * forces. */
        for (int d = 0; d < b.n; d++) a[d] = (b.state.v[d] - v[d]) / h;
        if (!stats.at_rounding) worst = fmax(worst, stats.residual_last / largest_force(&b, a));
        free(v);
      }
      printf("# %s, h = %.2g s: largest residual %.2g of the forces in balance\n", flesh_method_name(methods[m]), h,
             worst);
      CHECK_BELOW(worst, (methods[m] == FLESH_METHOD_BACKWARD_EULER ? 1.000001 : 1.5) * tau);
      free(a);
      flesh_integrator_destroy(&integrator);
      test_body_destroy(&b);
    }
}

/* A first guess that ends hardly above the floor, where round-off would hide its residual of 1e20 N and more, is no
 * solution: the fallen block is stopped well before. */
static void guesses_that_nearly_touch_are_not_taken(void)
{
  const double fall = 0.004, h = 1e-3, bottom = nextafter(-0.05, 0);
  test_body b;
  flesh_solve_stats stats = {0};
  flesh_obstacle *floor = NULL;
  flesh_nonlinear *nonlinear = NULL;
  const flesh_solver_options options = test_options(tau);
  CHECK_OK(test_body_create(make_mesh(5, 5, 3, unit), test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, -0.05}, (const double[]){0, 0, 1}, &floor));
  add_contact(&b, floor, NAN);
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_nonlinear_create(b.system, &options, &nonlinear));
  double *x0 = calloc(4 * (size_t)b.n, sizeof *x0), *v0 = x0 + b.n, *a0 = v0 + b.n, *guess = a0 + b.n, lowest = INFINITY;
  for (int d = 0; d < b.n; d++) {
    const double end = b.state.x[d] + (d % 3 == 2 ? bottom : 0);
    x0[d] = end + (d % 3 == 2 ? fall : 0);
    guess[d] = end - x0[d];
    v0[d] = 0;
    a0[d] = -guess[d] / (h * h);
  }
  const flesh_stage stage = {.t = h, .load = 1, .prescribed_fraction = 1, .shift = {.x = 1, .v = 1 / h, .a = 1 / (h * h)},
                             .x0 = x0, .v0 = v0, .a0 = a0};
  nonlinear->newton->goal = (flesh_newton_goal){.target = 1e-3, .of_first = 1, .of_load = INFINITY, .node_mass = 1e-3};
  CHECK_OK(flesh_nonlinear_solve(nonlinear, &stage, (const double *[]){guess, NULL}, 0, &stats));
  for (int d = 2; d < b.n; d += 3) lowest = fmin(lowest, x0[d] + nonlinear->u[d] + 0.05);
  printf("# from a residual of %.3g N the block stops %g m above the floor\n", stats.residual_first, lowest);
  CHECK(lowest > 1e-4 && stats.at_rounding == 0);
  CHECK_BELOW(stats.residual_first, 1e7);
  free(x0);
  flesh_nonlinear_destroy(&nonlinear);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(contact_forces_depend_little_on_the_tolerance),
                   TEST(resting_blocks_weigh_what_they_weigh), TEST(iterations_are_limited_in_all),
                   TEST(far_jumps_end_in_balance),
                   TEST(moving_contact_ends_in_balance), TEST(motion_without_contact_ends_in_balance),
                   TEST(guesses_that_nearly_touch_are_not_taken));
}
