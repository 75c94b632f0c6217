// TEST quick seconds=60
/* test_kept_matrices.c: matrices are reused for further iterations and steps as long as residuals agree with their
 * predictions. */
#include <stdlib.h>

#include "body.h"
#include "test.h"

/* A bar from x = 0 to 2, clamped at x = 0, under gravity. */
static void make_bar(double poisson, test_body *b)
{
  const flesh_material material = test_material(FLESH_ENERGY_S, poisson);
  CHECK_OK(test_body_create(test_box(6, 3, 3, 2, 1, 1), material, 1000, FLESH_MASS_LUMPED, 1, b));
  CHECK_OK(test_body_gravity(b, 0, 0, -9.81));
  CHECK_OK(test_body_clamp(b, 1e-9));
  CHECK_OK(flesh_system_finalize(b->system));
}

/* Makes a bar and takes some steps; returns what their solves took. */
static flesh_solve_stats swing(double poisson, flesh_method method, double tolerance, int steps, double h, test_body *b)
{
  flesh_solver_options options = test_options(tolerance);
  flesh_integrator *integrator = NULL;
  flesh_solve_stats stats = {0};
  make_bar(poisson, b);
  CHECK_OK(flesh_integrator_create(b->system, method, &options, &integrator));
  for (int step = 0; step < steps; step++) {
    CHECK_OK(flesh_integrator_step(integrator, &b->state, h, &stats));
    CHECK(stats.residual_last <= stats.residual_target);
  }
  printf("# to %g: %d Newton iterations, %d matrices in %d steps\n", tolerance, stats.newton, stats.assemblies, steps);
  flesh_integrator_destroy(&integrator);
  return stats;
}

/* A matrix is reused for a second iteration if its prediction held, and loosely solved steps after it. */
static void iterations_keep_matrices_that_predict(void)
{
  enum { STEPS = 30 };
  /* The most Newton iterations and matrices in a step. */
  static const double tolerances[] = {1e-11, 1e-8, 1e-6, 1e-4}, newton[] = {2.5, 2.3, 2.2, 1.7},
                      matrices[] = {1.6, 1.4, 1.4, 0.8};
  double *exact = NULL;
  for (int k = 0; k < 4; k++) {
    test_body b;
    const flesh_solve_stats stats = swing(0.49, FLESH_METHOD_BACKWARD_EULER, tolerances[k], STEPS, 1. / 60, &b);
    CHECK(stats.projections == 0);
    CHECK_BELOW(stats.newton, newton[k] * STEPS);
    CHECK_BELOW(stats.assemblies, matrices[k] * STEPS);
    if (!exact) {
      exact = malloc((size_t)b.n * sizeof *exact);
      memcpy(exact, b.state.x, (size_t)b.n * sizeof *exact);
    }
    CHECK_BELOW(test_distance(b.n, b.state.x, exact), 1e2 * tolerances[k]); /* of 2 m */
    test_body_destroy(&b);
  }
  free(exact);
}

/* If large steps barely need a second matrix, another iteration with the first replaces it. */
static void iterations_take_the_place_of_matrices(void)
{
  enum { STEPS = 30 };
  test_body b;
  const flesh_solve_stats stats = swing(0.3, FLESH_METHOD_BDF2, 1e-8, STEPS, 1. / 30, &b);
  CHECK_BELOW(stats.assemblies, 1.6 * STEPS); /* otherwise two in a step */
  CHECK_BELOW(stats.newton + stats.assemblies, 4.1 * STEPS); /* no more additional iterations than matrices saved */
  test_body_destroy(&b);
}

/* Small steps reuse a matrix of earlier steps, with any solver, and notice when it is no longer good enough. */
static void steps_keep_matrices_that_predict(void)
{
  enum { STEPS = 120, BLOW = 60 };
  double *exact = NULL;
  for (int k = 0; k < 4; k++) {
    test_body b;
    flesh_solver_options options = test_options(k == 0 ? 1e-11 : 1e-8);
    if (k == 3) options.linear_solver = FLESH_LINEAR_KLU;
    flesh_integrator *integrator = NULL;
    flesh_solve_stats stats = {0};
    int before = 0, newton = 0;
    make_bar(0.45, &b);
    const flesh_method method = k == 2 ? FLESH_METHOD_BDF2 : FLESH_METHOD_BACKWARD_EULER;
    CHECK_OK(flesh_integrator_create(b.system, method, &options, &integrator));
    for (int step = 0; step < STEPS; step++) {
      if (step == BLOW) {
        before = stats.assemblies;
        for (int d = 2; d < b.n; d += 3) b.state.v[d] += 3; /* m/s */
      }
      CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 1920, &stats));
      CHECK(stats.residual_last <= stats.residual_target);
      if (step == BLOW) CHECK(stats.assemblies > before);
      newton = stats.newton;
    }
    printf("# to %g: %d Newton iterations and %d matrices in %d steps, %d of these before the blow\n",
           options.newton_tolerance, newton, stats.assemblies, STEPS, before);
    CHECK(stats.assemblies < STEPS / 2 && stats.projections == 0);
    if (k == 0) {
      exact = malloc((size_t)b.n * sizeof *exact);
      memcpy(exact, b.state.x, (size_t)b.n * sizeof *exact);
    } else if (k != 2) {
      CHECK_BELOW(test_distance(b.n, b.state.x, exact), 1e-6); /* of 2 m */
      printf("# off by %.2g\n", test_distance(b.n, b.state.x, exact));
    }
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
  free(exact);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(iterations_keep_matrices_that_predict),
                   TEST(iterations_take_the_place_of_matrices), TEST(steps_keep_matrices_that_predict));
}
