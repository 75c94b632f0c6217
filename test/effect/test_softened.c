// TEST quick
/* test_softened.c: a softened system has softened materials, and as many levels as the body's stiffness requires. */
#include <stdlib.h>

#include "body.h"
#include "system/softened.h"
#include "test.h"
#include "time/recovery/continuation.h"

/* A softened material is S with the same shear modulus and the requested ratio, whatever the form and element. */
static void check_softened(int order, double poisson)
{
  const double mu = 1e5, ratio = 2 * poisson / (1 - 2 * poisson);
  test_body hard, soft, *bodies[] = {&hard, &soft};
  flesh_material b, s;
  CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_B, FLESH_CONSTANTS_MATCHED, mu, 1e8, &b));
  CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, mu, ratio * mu, &s));
  for (int k = 0; k < 2; k++) {
    flesh_mesh *mesh = test_box(12, 4, 4, 1, 1. / 3, 1. / 3), *raised = NULL;
    if (order == 2) {
      CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
      flesh_mesh_destroy(&mesh);
      mesh = raised;
    }
    CHECK_OK(test_body_create(mesh, k ? s : b, 1000, FLESH_MASS_LUMPED, 1, bodies[k]));
    CHECK_OK(flesh_system_finalize(bodies[k]->system));
  }
  const int n = hard.n;
  double *x = malloc(sizeof(double) * (size_t)n), *zero = calloc((size_t)n, sizeof(double)),
         *r = malloc(sizeof(double) * (size_t)n), *wanted = malloc(sizeof(double) * (size_t)n);
  memcpy(x, flesh_mesh_positions(hard.mesh), sizeof(double) * (size_t)n);
  test_jitter(n, 0.1, 3, x); /* some tets are inverted, where B has no value */
  flesh_point point = flesh_point_at(0, x, zero, zero);
  CHECK(flesh_system_residual(hard.system, &point, r) == FLESH_UNDEFINED);
  CHECK_OK(flesh_system_residual(soft.system, &point, wanted));
  flesh_system *softened = NULL;
  CHECK_OK(flesh_system_soften(hard.system, ratio, &softened));
  CHECK_OK(flesh_system_residual(softened, &point, r));
  CHECK_BELOW(test_distance(n, r, wanted), 1e-12 * test_norm(n, wanted));
  CHECK(flesh_system_effect(softened, 1) != flesh_system_effect(hard.system, 1)); /* elasticity */
  CHECK(flesh_system_effect(softened, 0) == flesh_system_effect(hard.system, 0));
  flesh_softened_destroy(&softened);
  CHECK(flesh_system_residual(hard.system, &point, r) == FLESH_UNDEFINED);
  free(x), free(zero), free(r), free(wanted);
  test_body_destroy(&hard);
  test_body_destroy(&soft);
}

static void softened_materials_are_s(void)
{
  for (int order = 1; order <= 2; order++)
    for (int k = 0; k < 3; k++) check_softened(order, (double[]){0, 0.49, 0.499}[k]);
}

/* Intermediate levels are those at least five times as soft as the stiffest material. */
static void stiffer_bodies_have_more_levels(void)
{
  const double ratios[] = {-0.5, 0.3, 0.49, 0.497, 0.4985, 0.4997, 0.4999};
  const int levels[] = {1, 1, 1, 1, 2, 2, 3};
  for (int k = 0; k < 7; k++) {
    flesh_mesh *mesh = test_box(1, 1, 1, 1, 1, 1);
    flesh_material materials[2];
    flesh_effect *effect = NULL;
    flesh_system *system = NULL;
    flesh_solver_options options;
    flesh_nonlinear *nonlinear = NULL;
    flesh_continuation continuation;
    CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e6, 0.2, &materials[0]));
    CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1, ratios[k], &materials[1]));
    const flesh_body body = {.mesh = mesh, .materials = materials, .tet_material = (int[]){0, 0, 0, 0, 0, 1}};
    CHECK_OK(flesh_effect_elasticity(&body, &effect));
    CHECK_OK(flesh_system_create(mesh, &system));
    CHECK_OK(flesh_system_add_effect(system, &effect));
    CHECK_OK(flesh_system_finalize(system));
    flesh_solver_options_default(&options);
    CHECK_OK(flesh_nonlinear_create(system, &options, &nonlinear));
    CHECK_OK(flesh_continuation_create(nonlinear, NULL, NULL, &continuation));
    CHECK(continuation.count == levels[k]);
    for (int l = 0; l < FLESH_SOFTENINGS; l++) CHECK(!continuation.softened[l] == (l >= levels[k]));
    flesh_continuation_clear(&continuation);
    flesh_nonlinear_destroy(&nonlinear);
    flesh_system_destroy(&system);
    flesh_mesh_destroy(&mesh);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(softened_materials_are_s), TEST(stiffer_bodies_have_more_levels));
}
