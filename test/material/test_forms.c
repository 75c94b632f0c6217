// TEST quick seconds=60
/* test_forms.c: a form that this file adds, and every built-in one, through the derivatives of an effect, the
 * projection of the Hessian and a static solve. A form is a psi: nothing else is known of the one added here. */
#include <math.h>
#include <stdlib.h>

#include "body.h"
#include "material/form.h"
#include "math/mat3.h"
#include "test.h"

/* psi = E's + b/4 (I_C-3)^2: stiffer the more it is stretched, as Yeoh's (1993). */
typedef struct own_constants {
  double mu, lambda, b;
} own_constants;

static int own_psi(double I_C, double J, const flesh_material *material, flesh_psi *psi)
{
  const own_constants *c = material->user;
  double stretch = I_C - 3, dilation = J - 1, offset = dilation - c->mu / c->lambda;
  psi->value = c->mu / 2 * stretch + c->lambda / 2 * offset * offset + c->b / 4 * stretch * stretch;
  psi->I = c->mu / 2 + c->b / 2 * stretch;
  psi->J = c->lambda * dilation - c->mu;
  psi->II = c->b / 2;
  psi->IJ = 0;
  psi->JJ = c->lambda;
  return FLESH_OK;
}

static const own_constants like_e = {3e4, 2e5, 0}, stiffer = {3e4, 2e5, 3e4};

/* Returns the rows of the registry, then the one of this file. */
static const char *material_of(int row, flesh_material *material)
{
  if (row == FLESH_ENERGY_COUNT) {
    CHECK_OK(flesh_material_from_psi(own_psi, &stiffer, material));
    return "this file's";
  }
  flesh_energy energy = (flesh_energy)row;
  CHECK_OK(flesh_material_from_young(energy, flesh_form_default_constants(energy), 1e5, 0.4, material));
  return flesh_energy_name(energy);
}

static void derivatives_are_right(void)
{
  for (int row = 0; row <= FLESH_ENERGY_COUNT; row++) {
    flesh_material material;
    test_body b;
    flesh_derivative_report report;
    const char *name = material_of(row, &material);
    CHECK_OK(test_body_create(test_box(3, 2, 2, 2, 1, 1), material, 1000, FLESH_MASS_LUMPED, 0, &b));
    CHECK_OK(flesh_system_finalize(b.system));
    unsigned long long random = 5;
    for (int d = 0; d < b.n; d++) b.state.x[d] += 0.1 * (test_uniform(&random) - 0.5);
    CHECK_OK(flesh_effect_check_derivatives(flesh_system_effect(b.system, 0), b.mesh, 0, b.state.x, 7, &report));
    int passes = flesh_derivative_report_passes(&report, 1e-8);
    if (!passes) printf("# %s\n", name);
    CHECK(passes);
    test_body_destroy(&b);
  }
}

/* Returns the Rayleigh quotient of the projected Hessian along v; *size: the largest |H v|. */
static double curvature(const double H[81], const double v[9], double *size)
{
  double sum = 0;
  for (int p = 0; p < 9; p++) {
    double row = 0;
    for (int q = 0; q < 9; q++) row += H[9 * p + q] * v[q];
    sum += v[p] * row;
    *size = fmax(*size, fabs(row));
  }
  return sum;
}

/* The projected Hessian is semi-definite where the true one is not; the difference has no negative curvature either. */
static void projection_takes_negative_curvature(void)
{
  const double flat[9] = {1.1, 0.2, 0, 0, 0.9, 0.1, 0.05, 0, 0.2};
  for (int row = 0; row <= FLESH_ENERGY_COUNT; row++) {
    flesh_material material;
    const char *name = material_of(row, &material);
    double H[81], projected[81], least = 0, least_added = 0, most_negative = 0, size = 0, values[9], vectors[81];
    CHECK_OK(flesh_material_hessian(&material, flat, H));
    CHECK_OK(flesh_material_hessian_projected(&material, flat, projected));
    CHECK_OK(flesh_material_eigen(&material, flat, values, vectors));
    for (int k = 0; k < 9; k++) {
      const double *v = &vectors[9 * k];
      double now = curvature(projected, v, &size), before = curvature(H, v, &size);
      least = fmin(least, now);
      least_added = fmin(least_added, now - before);
      most_negative = fmin(most_negative, before);
    }
    int good = least >= -1e-10 * size && least_added >= -1e-10 * size;
    if (!good) printf("# %s: %g, %g of %g\n", name, least, least_added, size);
    CHECK(good);
    if (row == FLESH_ENERGY_COUNT || row == FLESH_ENERGY_E) CHECK(most_negative < -1e-3 * size); /* the projection had to act */
  }
}

/* Returns the sag of the end of a clamped bar under its weight. */
static double sag(const flesh_material *material, double gravity)
{
  test_body b;
  flesh_solver_options options = test_options(1e-12);
  flesh_integrator *integrator = NULL;
  CHECK_OK(test_body_create(test_box(6, 2, 2, 3, 1, 1), *material, 1000, FLESH_MASS_LUMPED, 0, &b));
  CHECK_OK(test_body_gravity(&b, 0, 0, -gravity));
  CHECK_OK(test_body_clamp(&b, 0));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 1, NULL));
  double down = 0;
  for (int d = 2; d < b.n; d += 3) down = fmin(down, b.state.x[d] - flesh_mesh_positions(b.mesh)[d]);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return -down;
}

/* All forms with the same small-strain constants sag equally under a small load. */
static void small_loads_see_the_small_strain_constants(void)
{
  double first = 0;
  for (int row = 0; row < FLESH_ENERGY_COUNT; row++) {
    if (!flesh_form_takes((flesh_energy)row, FLESH_CONSTANTS_MATCHED)) continue;
    flesh_material material;
    const char *name = material_of(row, &material);
    double now = sag(&material, 1e-4);
    if (first == 0) first = now;
    if (!(fabs(now / first - 1) < 1e-3)) printf("# %s: %g, %g\n", name, now, first);
    CHECK(now > 0);
    CHECK_NEAR(now / first, 1, 1e-3);
  }
  double mu, lambda;
  flesh_material own, built_in;
  CHECK_OK(flesh_material_from_psi(own_psi, &stiffer, &own));
  CHECK_OK(flesh_material_small_strain(&own, &mu, &lambda, NULL));
  CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, mu, lambda, &built_in));
  CHECK_NEAR(sag(&own, 1e-4) / sag(&built_in, 1e-4), 1, 1e-3);
}

/* Without b it is E, and sags like E; with b it is stiffer. */
static void an_added_form_is_solved_as_a_built_in(void)
{
  flesh_material own, stiff, built_in;
  CHECK_OK(flesh_material_from_psi(own_psi, &like_e, &own));
  CHECK_OK(flesh_material_from_psi(own_psi, &stiffer, &stiff));
  CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_E, FLESH_CONSTANTS_RAW, like_e.mu, like_e.lambda, &built_in));
  double expected = sag(&built_in, 5);
  CHECK(expected > 0.5);
  CHECK_NEAR(sag(&own, 5) / expected, 1, 1e-9);
  CHECK(sag(&stiff, 5) < 0.99 * expected);
}

/* An exponential that overflows is reported, and makes a step be retried with a shorter length. */
static void fungs_overflow_is_told(void)
{
  const double growth[] = {15, 100};
  for (int k = 0; k < 2; k++) {
    flesh_material material;
    test_body b;
    double V, size;
    material_of(FLESH_ENERGY_FUNG, &material);
    CHECK_OK(test_body_create(test_box(2, 1, 1, 2, 1, 1), material, 1000, FLESH_MASS_LUMPED, 0, &b));
    CHECK_OK(flesh_system_finalize(b.system));
    for (int d = 0; d < b.n; d++) b.state.x[d] *= growth[k];
    double *r = malloc((size_t)b.n * sizeof *r);
    const flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
    const flesh_shift shift = {.x = 1};
    const int expected = k ? FLESH_NONFINITE : FLESH_OK;
    CHECK(flesh_system_residual(b.system, &point, r) == expected);
    CHECK(flesh_system_potential(b.system, &point, &shift, &V, &size) == expected);
    free(r);
    test_body_destroy(&b);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(derivatives_are_right), TEST(projection_takes_negative_curvature),
                   TEST(small_loads_see_the_small_strain_constants), TEST(an_added_form_is_solved_as_a_built_in),
                   TEST(fungs_overflow_is_told));
}
