// TEST quick seconds=60
/* test_every_effect.c: every effect that a scene can name, with sample parameters, runs under KINSOL and under IDA;
 * without elasticity a body moves as free nodes. */
#include <stdlib.h>

#include "body.h"
#include "effect_sample.h"
#include "methods.h"
#include "test.h"

static flesh_material soft(void)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 2e5, 0.4, &material));
  return material;
}

/* Computes 0.1 s of the unit cube with inertia, elasticity, gravity and the row; returns the corner's path. */
static void run(const flesh_effect_row *row, flesh_method method, double x[3])
{
  test_body b;
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  flesh_solver_options_default(&options);
  CHECK_OK(test_body_create(test_box(2, 2, 2, 1, 1, 1), soft(), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_gravity(&b, 1, 0, -9.81));
  if (!row->once && strcmp(row->name, "gravity")) test_add_sample(row, &b);
  CHECK_OK(flesh_system_finalize(b.system));
  for (int d = 0; d < b.n; d++) /* it falls, and shears */
    b.state.v[d] = d % 3 == 2 ? -1 : 0.5 + 2 * flesh_mesh_positions(b.mesh)[3 * (d / 3) + 2];
  CHECK_OK(flesh_integrator_create(b.system, method, &options, &integrator));
  for (int k = 0; k < 10; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, NULL));
  CHECK_NEAR(b.state.t, 0.1, 1e-12);
  memcpy(x, b.state.x + b.n - 3, 3 * sizeof *x);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

static void every_effect_runs_under_every_kind_of_method(void)
{
  enum { METHODS_LIMIT = 64 };
  flesh_method methods[METHODS_LIMIT] = {FLESH_METHOD_IDA};
  int rows, count = 1;
  const flesh_effect_row *const *row = flesh_effect_registry(&rows);
  double bare[3];
  for_every_method(method, TEST_FIXED_STEPS) methods[count++] = method;
  run(row[0], FLESH_METHOD_IDA, bare);
  for (int k = 0; k < rows; k++) {
    double x[METHODS_LIMIT][3], worst[METHODS_LIMIT] = {0}, matters = 0;
    for (int m = 0; m < count; m++) {
      run(row[k], methods[m], x[m]);
      for (int c = 0; c < 3; c++) worst[m] = fmax(worst[m], fabs(x[m][c] - x[0][c]));
    }
    for (int c = 0; c < 3; c++) matters = fmax(matters, fabs(x[0][c] - bare[c]));
    printf("# %-10s matters by %.2g m; from adaptive:", row[k]->name, matters);
    for (int m = 1; m < count; m++) printf(" %s %.2g m", flesh_method_name(methods[m]), worst[m]);
    putchar('\n');
    for (int m = 1; m < count; m++)
      CHECK_BELOW(worst[m], flesh_method_order(methods[m]) == 1 ? 0.05 + 0.5 * matters : 0.02 + 0.15 * matters);
  }
}

/* Computes the clamped cube's equilibrium. */
static void every_effect_runs_in_statics(void)
{
  int rows;
  const flesh_effect_row *const *row = flesh_effect_registry(&rows);
  for (int k = 0; k < rows; k++) {
    test_body b;
    flesh_solver_options options;
    flesh_integrator *integrator = NULL;
    flesh_solver_options_default(&options);
    CHECK_OK(test_body_create(test_box(2, 2, 2, 1, 1, 1), soft(), 1000, FLESH_MASS_LUMPED, 0, &b));
    CHECK_OK(test_body_clamp(&b, 1e-9));
    CHECK_OK(test_body_gravity(&b, 1, 0, -9.81));
    if (!row[k]->once && strcmp(row[k]->name, "gravity")) test_add_sample(row[k], &b);
    CHECK_OK(flesh_system_finalize(b.system));
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.5, NULL));
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* Without elasticity nodes are free masses: their parabola is exact for methods of order 2. */
static void free_flight_is_a_parabola(void)
{
  const flesh_method methods[] = {FLESH_METHOD_MIDPOINT, FLESH_METHOD_NEWMARK, FLESH_METHOD_IDA};
  for (int m = 0; m < 3; m++)
    for (int mass = 0; mass < 2; mass++) {
      test_body b;
      flesh_solver_options options;
      flesh_integrator *integrator = NULL;
      flesh_effect *effect = NULL;
      flesh_solver_options_default(&options);
      options.newton_tolerance = 1e-10;
      options.linear_tolerance = 1e-10;
      CHECK_OK(test_body_create(test_box(2, 1, 1, 2, 1, 1), soft(), 1000, (flesh_mass)mass, 0, &b));
      flesh_system_destroy(&b.system); /* without the elasticity */
      CHECK_OK(flesh_system_create(b.mesh, &b.system));
      b.body.materials = NULL;
      CHECK_OK(flesh_effect_inertia(&b.body, &effect));
      CHECK_OK(flesh_system_add_effect(b.system, &effect));
      CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
      CHECK_OK(flesh_system_finalize(b.system));
      for (int d = 0; d < b.n; d++) b.state.v[d] = d % 3 == 2 ? 5 : d % 3 == 0 ? 3 + d : 0;
      double *v = malloc((size_t)b.n * sizeof *v), worst = 0;
      memcpy(v, b.state.v, (size_t)b.n * sizeof *v);
      CHECK_OK(flesh_integrator_create(b.system, methods[m], &options, &integrator));
      for (int k = 0; k < 20; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.05, NULL));
      for (int d = 0; d < b.n; d++)
        worst = fmax(worst, fabs(b.state.x[d] - flesh_mesh_positions(b.mesh)[d] - v[d] + (d % 3 == 2) * 9.81 / 2));
      printf("# %s: off by %.2g m after 1 s\n", flesh_method_name(methods[m]), worst);
      CHECK_BELOW(worst, methods[m] == FLESH_METHOD_IDA ? 1e-3 : 1e-7);
      free(v);
      flesh_integrator_destroy(&integrator);
      test_body_destroy(&b);
    }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(every_effect_runs_under_every_kind_of_method), TEST(every_effect_runs_in_statics),
                   TEST(free_flight_is_a_parabola));
}
