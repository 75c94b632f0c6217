// TEST quick
/* test_added.c: the additions work: the force of a wind, the constants of a Yeoh form, and the damping of fast
 * oscillations requested from the method of Wood, Bossak & Zienkiewicz. */
#include <stdlib.h>

#include "body.h"
#include "effect/wind.h"
#include "test.h"

static flesh_material yeoh(double c2)
{
  flesh_material material = {0};
  flesh_material_given given;
  flesh_material_given_default(&given);
  given.young = 1e5, given.poisson = 0.4, given.c2 = c2;
  CHECK_OK(flesh_material_from_given(FLESH_ENERGY_YEOH, FLESH_CONSTANTS_MATCHED, &given, &material));
  return material;
}

/* A cube with sides of 1 m^2: 1.2/2 kg/m^3 (20 m/s)^2 on the windward side and, as suction, on the leeward side. */
static void wind_presses_by_the_square_of_its_speed(void)
{
  test_body b;
  flesh_effect *effect = NULL;
  int count;
  CHECK_OK(test_body_create(test_box(2, 2, 2, 1, 1, 1), yeoh(NAN), 1000, FLESH_MASS_LUMPED, 0, &b));
  const int *triangles = flesh_mesh_surface(b.mesh, &count);
  CHECK_OK(flesh_effect_wind(&b.body, count, triangles, (double[]){20, 0, 0}, 1.2, 1, NULL, &effect));
  for (int k = 0; k < 2; k++) {
    double *r = calloc((size_t)b.n, sizeof *r), sum[3] = {0}, speed = k ? 5 : 0;
    for (int i = 0; i < b.n / 3; i++) b.state.v[3 * i] = speed;
    flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
    CHECK_OK(effect->operations->residual(effect, &point, r));
    for (int d = 0; d < b.n; d++) sum[d % 3] += r[d];
    CHECK_NEAR(sum[0], -2 * 0.6 * (20 - speed) * (20 - speed), 1e-9);
    CHECK_NEAR(sum[1], 0, 1e-9);
    CHECK_NEAR(sum[2], 0, 1e-9);
    free(r);
  }
  flesh_effect_destroy(&effect);
  test_body_destroy(&b);
}

static void constants_beyond_mu_and_lambda_are_matched(void)
{
  const double given[] = {NAN, 0, 3e3};
  for (int k = 0; k < 3; k++) {
    flesh_material material = yeoh(given[k]);
    double mu, lambda, stress, mu_l = 1e5 / 2.8, lambda_l = 1e5 * 0.4 / (1.4 * 0.2);
    CHECK_NEAR(material.c2, k ? given[k] : mu_l / 10, 1e-9);
    CHECK_OK(flesh_material_small_strain(&material, &mu, &lambda, &stress));
    CHECK_NEAR(mu, mu_l, 1e-9 * mu_l);
    CHECK_NEAR(lambda, lambda_l, 1e-9 * lambda_l);
    CHECK_NEAR(stress, 0, 1e-9 * mu_l);
  }
  flesh_material material;
  flesh_material_given wrong;
  flesh_material_given_default(&wrong);
  wrong.young = 1e5, wrong.poisson = 0.4, wrong.c2 = -1;
  CHECK(flesh_material_from_given(FLESH_ENERGY_YEOH, FLESH_CONSTANTS_MATCHED, &wrong, &material) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "c2 is -1; it must be finite and >= 0");
  wrong.c2 = 1;
  CHECK(flesh_material_from_given(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, &wrong, &material) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "c2 is given with energy S; it is a constant of Yeoh");
}

static void rho_inf_is_checked(void)
{
  flesh_method_options options;
  flesh_method_options_default(&options);
  CHECK(options.rho_inf == 0.8);
  CHECK_OK(flesh_method_options_check(&options));
  options.rho_inf = 1.1;
  CHECK(flesh_method_options_check(&options) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "rho_inf is 1.1; it must be in [0, 1]");
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(wind_presses_by_the_square_of_its_speed),
                   TEST(constants_beyond_mu_and_lambda_are_matched), TEST(rho_inf_is_checked));
}
