// TEST quick seconds=120
/* test_held_tangles.c: nodes that a load holds tangled through the surrounding elements are left alone, at every
 * step. */
#include <stdlib.h>

#include "body.h"
#include "test.h"

enum { STEPS = 40 };

/* Runs a bar of nearly incompressible ten-node tets that a spring pulls so that corners of tets turn inside out.
 * Allocates the positions after every step, x [STEPS][n]; returns n. */
static int pull(int untangle, double **x, int *inverted, flesh_solve_stats *stats)
{
  test_body b;
  flesh_material material;
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  flesh_effect *effect = NULL;
  flesh_mesh *linear = test_box(10, 2, 2, 0.075, 0.016, 0.016), *mesh = NULL;
  CHECK_OK(flesh_mesh_raise_order(linear, &mesh));
  flesh_mesh_destroy(&linear);
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_E, FLESH_CONSTANTS_MATCHED, 5e4, 0.49, &material));
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  const flesh_keyframe key = {.translation = {0.15, 0.058, 0.038}};
  const flesh_motion target = {.count = 1, .keyframes = &key};
  CHECK_OK(flesh_effect_spring_within(&b.body, (double[]){0.075, 0.008, 0.008}, 0.006, 500, &target, -INFINITY,
                                      INFINITY, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_solver_options_default(&options);
  if (!untangle) options.techniques &= ~(unsigned)FLESH_TECHNIQUE_UNTANGLE;
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  *x = malloc(sizeof(double) * STEPS * (size_t)b.n);
  for (int k = 0; k < STEPS; k++) {
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, stats));
    memcpy(*x + (size_t)k * (size_t)b.n, b.state.x, sizeof(double) * (size_t)b.n);
  }
  flesh_mesh_jacobian_bounds(b.mesh, b.state.x, NULL, NULL, inverted);
  printf("# untangle %d: %d tets inverted at the end, %d untanglings, %d steps, %d Newton\n", untangle, *inverted,
         stats->untanglings, stats->steps, stats->newton);
  flesh_integrator_destroy(&integrator);
  const int n = b.n;
  test_body_destroy(&b);
  return n;
}

/* The spring acts on few of the nodes of the inverted tets. The stress around holds them, and after softening they
 * return: the motion is that without softening, at every step. */
static void tangles_that_stress_holds_are_left_alone(void)
{
  double *with, *without, worst = 0;
  int inverted[2];
  flesh_solve_stats stats[2] = {{0}};
  const int n = pull(1, &with, &inverted[0], &stats[0]);
  pull(0, &without, &inverted[1], &stats[1]);
  for (int d = 0; d < STEPS * n; d++) worst = fmax(worst, fabs(with[d] - without[d]));
  printf("# largest distance between the two motions %.3g m\n", worst);
  CHECK_BELOW(worst, 1e-7);
  CHECK(inverted[0] > 0 && inverted[0] == inverted[1]);
  CHECK(stats[0].untanglings == 0 && stats[0].steps == STEPS);
  CHECK(stats[0].newton > stats[1].newton); /* it has been tried */
  free(with), free(without);
}

int main(int argc, char **argv) { return RUN_TESTS(argc, argv, TEST(tangles_that_stress_holds_are_left_alone)); }
