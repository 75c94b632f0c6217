// TEST full seconds=70
/* test_fast_sheets.c: steps of thin bodies that collide much faster than waves travel in them succeed, and the bodies
 * go neither through nor around each other. */
#include "crossings.h"
#include "flesh/integrator.h"
#include "welded.h"

/* Makes two sheets of 1 x 1 m with this thickness and number of cells along a side, with a wave speed of 20 m/s; the
 * lower side of the upper one starts at 0.25 m. Limits the number of Newton iterations. */
static void hit(double speed, double thickness, int side, int most)
{
  const int cells[3] = {side, side, 1};
  const double size[3] = {1, 1, thickness};
  const flesh_solver_options options = test_options(1e-6);
  flesh_contact_options contact_options;
  flesh_contact_surface surface;
  flesh_effect *contact = NULL;
  flesh_integrator *integrator = NULL;
  flesh_solve_stats stats = {0};
  test_body b;
  flesh_mesh *mesh = joined(box(cells, size, (double[]){0, 0, 0}), box(cells, size, (double[]){0.03, 0.02, 0.25}));
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.45), 1000, FLESH_MASS_LUMPED, 1, &b));
  flesh_contact_options_default(&contact_options);
  CHECK_OK(flesh_effect_surface_contact(&b.body, &contact_options, 0, NULL, &contact));
  CHECK_OK(flesh_system_add_effect(b.system, &contact));
  CHECK_OK(flesh_system_finalize(b.system));
  for (int d = b.n / 2 + 2; d < b.n; d += 3) b.state.v[d] = -speed;
  CHECK_OK(flesh_contact_surface_of_mesh(b.mesh, NULL, &surface));
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 50, &stats));
  double momenta[6], lower = 0;
  test_momenta(&b, momenta);
  for (int d = 2; d < b.n / 2; d += 3) lower += b.state.v[d] / (b.n / 6);
  printf("# %g m/s, %g m: %d Newton iterations, %d cutbacks, momentum %.6g N s, the lower one at %.6g m/s\n", speed, thickness,
         stats.newton, stats.convergence_failures, momenta[2], lower);
  CHECK(crossings_count(&surface, b.state.x) == 0);
  CHECK_NEAR(momenta[2] / (1000 * thickness * speed), -1, 1e-6); /* momentum of the upper one, which both then share */
  CHECK(lower < -0.01 * speed); /* not where a solve has led them around each other */
  CHECK(stats.newton > 10 && stats.newton <= most);
  flesh_contact_surface_clear(&surface);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* A solve that contact stalls, or that leads around the other body, is given up for a shorter step. */
static void thin_sheets_hit_each_other(void)
{
  for (int k = 0; k < 2; k++) hit(198 + 4 * k, 0.05, 6, 1000);
  hit(200, 0.05, 10, 2000);
}
static void thick_sheets_hit_each_other(void) { hit(200, 0.1, 6, 1000); }

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(thin_sheets_hit_each_other), TEST(thick_sheets_hit_each_other));
}
