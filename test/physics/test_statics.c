// TEST quick seconds=60
/* test_statics.c: equilibria under large prescribed motions, heavy loads and springs: reached, in increments if
 * necessary, or refused with the state unchanged. */
#include <stdlib.h>

#include "body.h"
#include "test.h"

/* A bar from x = 0 to 2, clamped at x = 0, under gravity; not finished. */
static void make_bar(flesh_energy energy, double poisson, test_body *b)
{
  CHECK_OK(test_body_create(test_box(6, 3, 3, 2, 1, 1), test_material(energy, poisson), 1000, FLESH_MASS_LUMPED, 0, b));
  CHECK_OK(test_body_gravity(b, 0, 0, -9.81));
  CHECK_OK(test_body_clamp(b, 1e-9));
}

/* B cannot be pushed through its clamp: statics try increments, give up, and leave the state unchanged. */
static void impossible_statics_leave_the_state(void)
{
  const flesh_keyframe through = {.translation = {-3, 0, 0}};
  const flesh_motion motion = {.count = 1, .keyframes = &through};
  test_body b;
  flesh_solver_options options = test_options(1e-6);
  options.max_newton = 20; /* with more the bar finds a way around */
  options.max_cutbacks = 4;
  flesh_integrator *integrator = NULL;
  flesh_solve_stats stats = {0};
  make_bar(FLESH_ENERGY_B, 0.45, &b);
  CHECK_OK(test_body_hold(&b, 0, 2, FLESH_AXES_ALL, &motion, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b.system));
  test_jitter(b.n, 0.01, 1, b.state.x);
  test_jitter(b.n, 1, 1, b.state.v);
  double *x = malloc((size_t)b.n * sizeof *x), *v = malloc((size_t)b.n * sizeof *v);
  memcpy(x, b.state.x, (size_t)b.n * sizeof *x);
  memcpy(v, b.state.v, (size_t)b.n * sizeof *v);
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK(flesh_integrator_step(integrator, &b.state, 0.5, &stats) == FLESH_ERR_SOLVE);
  printf("# after %d solves, %d Newton iterations: %s\n", stats.solves, stats.newton, flesh_error_text());
  CHECK(stats.newton > 0); /* it got somewhere */
  CHECK(!memcmp(x, b.state.x, (size_t)b.n * sizeof *x) && !memcmp(v, b.state.v, (size_t)b.n * sizeof *v));
  CHECK(b.state.t == 0);
  free(x);
  free(v);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* Pulled to twice its length, turned over, and pushed to half at once: statics succeed. */
static void statics_reach_far_handles(void)
{
  const flesh_keyframe far[] = {{.translation = {2, 0, 0}}, {.rotation = {1.5, 0, 0}}, {.translation = {-1, 0, 0}},
                                {.translation = {1, 1.5, 0}, .rotation = {0, 0, 1.5}}};
  const flesh_energy energies[] = {FLESH_ENERGY_S, FLESH_ENERGY_E, FLESH_ENERGY_B, FLESH_ENERGY_NEO};
  for (int e = 0; e < 4; e++)
    for (int k = 0; k < 4; k++) {
      test_body b;
      flesh_solver_options options = test_options(1e-8);
      flesh_integrator *integrator = NULL;
      flesh_solve_stats stats = {0};
      flesh_motion motion = {.count = 1, .keyframes = &far[k], .centre = {2, 0.5, 0.5}};
      make_bar(energies[e], 0.45, &b);
      CHECK_OK(test_body_hold(&b, 0, 2, FLESH_AXES_ALL, &motion, -INFINITY, INFINITY));
      CHECK_OK(flesh_system_finalize(b.system));
      CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
      CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, &stats));
      int inverted;
      double *r = calloc((size_t)b.n, sizeof *r), free_forces = 0;
      uint8_t *fixed = calloc((size_t)b.n, 1);
      flesh_mesh_jacobians(b.mesh, b.state.x, NULL, NULL, &inverted);
      printf("# %s, handle %d: %d solves, %d Newton, %d linear, %d backtracks; %d inverted\n",
             flesh_energy_name(energies[e]), k, stats.solves, stats.newton, stats.linear, stats.backtracks, inverted);
      /* The result is an equilibrium under the whole load, with the prescribed motion complete. */
      flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
      CHECK_OK(flesh_system_residual(b.system, &point, r));
      flesh_system_fixed(b.system, 0, fixed);
      for (int d = 0; d < b.n; d++) free_forces += fixed[d] ? 0 : r[d] * r[d];
      CHECK_NEAR(sqrt(free_forces), stats.residual_last, 1e-6);
      CHECK_BELOW(sqrt(free_forces), 1.001 * stats.residual_target + 1e-7);
      double y[3];
      for (int i = 0; i < b.n / 3; i++)
        if (k == 0 && flesh_mesh_positions(b.mesh)[3 * i] == 2) {
          for (int c = 0; c < 3; c++) y[c] = flesh_mesh_positions(b.mesh)[3 * i + c] + far[k].translation[c];
          CHECK_BELOW(test_distance(3, y, b.state.x + 3 * i), 1e-14);
        }
      CHECK(b.state.t == 0 && test_norm(b.n, b.state.v) == 0);
      free(r);
      free(fixed);
      flesh_integrator_destroy(&integrator);
      test_body_destroy(&b);
    }
}

/* A solve that uses up its iterations is continued as often as halvings are allowed, or else the load is raised in
 * increments; a truncated linear solve still helps. All end like the unlimited solve. */
static void hindered_statics_arrive(void)
{
  double *free_solution = NULL;
  for (int hindrance = 0; hindrance < 4; hindrance++) {
    test_body b;
    flesh_solver_options options = test_options(1e-11);
    flesh_integrator *integrator = NULL;
    flesh_solve_stats stats = {0};
    make_bar(FLESH_ENERGY_S, 0.4, &b);
    CHECK_OK(flesh_system_finalize(b.system));
    if (hindrance == 1) options.max_newton = 8;
    if (hindrance == 2) options.max_linear = 12;
    if (hindrance == 3) options.max_newton = 9, options.max_cutbacks = 0; /* too few for the whole load */
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, &stats));
    printf("# %d solves, %d Newton, %d linear iterations\n", stats.solves, stats.newton, stats.linear);
    CHECK((stats.solves > 2) == (hindrance == 3));
    if (!hindrance) {
      CHECK(stats.newton > 8 && stats.linear > 12 * stats.newton); /* otherwise the limit has no effect */
      free_solution = malloc((size_t)b.n * sizeof *free_solution);
      memcpy(free_solution, b.state.x, (size_t)b.n * sizeof *free_solution);
    }
    CHECK_BELOW(test_distance(b.n, b.state.x, free_solution), 1e-9);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
  free(free_solution);
}

/* The spring's pull is balanced by the clamp; when released, the body returns. */
static void drags_pull_and_let_go(void)
{
  test_body b;
  flesh_solver_options options = test_options(1e-10);
  flesh_integrator *integrator = NULL;
  flesh_effect *effect = NULL;
  flesh_keyframe key = {.translation = {3, 1, 0.5}};
  flesh_motion target = {.count = 1, .keyframes = &key};
  CHECK_OK(test_body_create(test_box(4, 2, 2, 2, 1, 1), test_material(FLESH_ENERGY_S, 0.45), 1000, FLESH_MASS_LUMPED, 0,
                            &b));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_effect_spring(&b.body, (double[]){2, 0.5, 0.5}, 5e3, &target, 0, 1, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.5, NULL));
  const double *X = flesh_mesh_positions(b.mesh);
  double *r = calloc((size_t)b.n, sizeof *r), held[3] = {0};
  int node = -1;
  flesh_point point = flesh_point_at(0.5, b.state.x, b.state.v, b.state.v);
  CHECK_OK(flesh_system_residual(b.system, &point, r));
  for (int i = 0; i < b.n / 3; i++) {
    if (test_distance(3, X + 3 * i, (double[]){2, 0.5, 0.5}) < 1e-12) node = i;
    for (int c = 0; c < 3 && X[3 * i] == 0; c++) held[c] += r[3 * i + c];
  }
  CHECK(node >= 0 && b.state.x[3 * node] > 2.02 && b.state.x[3 * node + 1] > 0.55);
  for (int c = 0; c < 3; c++)
    CHECK_NEAR(held[c], 5e3 * (b.state.x[3 * node + c] - key.translation[c]), 1e-5);
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.5, NULL));
  CHECK_BELOW(test_distance(b.n, b.state.x, X), 1e-8);
  free(r);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* A block that starts deformed by z += shear x, x *= stretch, and returns to rest, to 1e-8; returns its Newton
 * iterations. */
static int comes_back(flesh_energy energy, int cells, double stretch, double shear,
                      flesh_eigenvalue_filter eigenvalue_filter)
{
  test_body b;
  flesh_solver_options options = test_options(1e-8);
  flesh_integrator *integrator = NULL;
  flesh_solve_stats stats = {0};
  options.eigenvalue_filter = eigenvalue_filter;
  CHECK_OK(test_body_create(test_box(2 * cells, cells, cells, 0.2, 0.1, 0.1), test_material(energy, 0.495), 1000,
                            FLESH_MASS_LUMPED, 0, &b));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  for (int d = 0; d < b.n; d += 3) b.state.x[d + 2] += shear * b.state.x[d], b.state.x[d] *= stretch;
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, &stats));
  printf("# %s, %d cells, stretched to %g, sheared by %g: %d Newton, %d linear iterations, %d backtracks\n",
         flesh_energy_name(energy), cells, stretch, shear, stats.newton, stats.linear, stats.backtracks);
  CHECK_BELOW(test_distance(b.n, b.state.x, flesh_mesh_positions(b.mesh)), 1e-5);
  CHECK(stats.potential_rises == 0 && stats.at_rounding == 0);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return stats.newton;
}

/* Steps that were cut too much are lengthened again, and the last one is solved accurately enough to be the last. */
static void far_starts_take_few_iterations(void)
{
  CHECK_BELOW(comes_back(FLESH_ENERGY_S, 8, 4, 0, FLESH_FILTER_AUTO), 15.5);
  CHECK_BELOW(comes_back(FLESH_ENERGY_E, 8, 4, 0, FLESH_FILTER_AUTO), 15.5);
  const int most = comes_back(FLESH_ENERGY_E, 16, 1, 2, FLESH_FILTER_AUTO);
  CHECK_BELOW(most, 5.5);
  for (flesh_eigenvalue_filter other = FLESH_FILTER_AUTO; other <= FLESH_FILTER_TRUST_REGION; other++)
    CHECK_BELOW(most, 1.2 * comes_back(FLESH_ENERGY_E, 16, 1, 2, other) + 1e-9);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(statics_reach_far_handles), TEST(hindered_statics_arrive),
                   TEST(impossible_statics_leave_the_state), TEST(drags_pull_and_let_go),
                   TEST(far_starts_take_few_iterations));
}
