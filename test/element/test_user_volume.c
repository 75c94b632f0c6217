// TEST quick seconds=60
/* test_user_volume.c: the volume part U(J) of a user-defined psi: tet10-mean averages it as the built-in terms;
 * refusals. */
#include <stdlib.h>

#include "body.h"
#include "test.h"

static const double mu = 2e4, lambda = 3e6; /* Pa */

/* Neo-Hookean with the volume part (log J)^2/2: the built-in form Neo. */
static int neo_psi(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  (void)m;
  if (!(J > 0)) return FLESH_UNDEFINED;
  const double log_J = log(J);
  *psi = (flesh_psi){.value = mu / 2 * (I_C - 3) - mu * log_J + lambda / 2 * log_J * log_J,
                     .I = mu / 2,
                     .J = (lambda * log_J - mu) / J,
                     .JJ = (lambda * (1 - log_J) + mu) / (J * J)};
  return FLESH_OK;
}

static int log_volume(double J, const flesh_material *m, flesh_volume_part *U)
{
  (void)m;
  if (!(J > 0)) return FLESH_UNDEFINED;
  *U = (flesh_volume_part){0.5 * log(J) * log(J), log(J) / J, (1 - log(J)) / (J * J)};
  return FLESH_OK;
}

/* mu/2 (J^(-2/3) I_C - 3) + lambda/4 (J^2 - 1 - 2 log J): Simo & Miehe 1992, as in deal.II's step-44. */
static int simo_psi(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  (void)m;
  if (!(J > 0)) return FLESH_UNDEFINED;
  const double h = mu / 2 * pow(J, -2. / 3);
  *psi = (flesh_psi){.value = h * I_C - 1.5 * mu + lambda / 4 * (J * J - 1 - 2 * log(J)),
                     .I = h,
                     .J = -2. / 3 * h * I_C / J + lambda / 2 * (J - 1 / J),
                     .IJ = -2. / 3 * h / J,
                     .JJ = 10. / 9 * h * I_C / (J * J) + lambda / 2 * (1 + 1 / (J * J))};
  return FLESH_OK;
}

static int simo_volume(double J, const flesh_material *m, flesh_volume_part *U)
{
  (void)m;
  if (!(J > 0)) return FLESH_UNDEFINED;
  *U = (flesh_volume_part){0.25 * (J * J - 1 - 2 * log(J)), 0.5 * (J - 1 / J), 0.5 * (1 + 1 / (J * J))};
  return FLESH_OK;
}

/* A volume part of modulus 2 with a slope at J = 1. */
static int scaled_volume(double J, const flesh_material *m, flesh_volume_part *U)
{
  (void)m;
  *U = (flesh_volume_part){(J - 1) * (J - 1), 2 * (J - 1), 2};
  return FLESH_OK;
}

static int sloping_volume(double J, const flesh_material *m, flesh_volume_part *U)
{
  (void)m;
  *U = (flesh_volume_part){J * J / 2, J, 1};
  return FLESH_OK;
}

static int no_volume(double J, const flesh_material *m, flesh_volume_part *U)
{
  (void)J, (void)m, (void)U;
  return FLESH_UNDEFINED;
}

static flesh_material users(flesh_psi_function psi, flesh_volume_function volume)
{
  flesh_material m;
  CHECK_OK(flesh_material_from_psi(psi, NULL, &m));
  m.lambda = lambda;
  m.volume = volume;
  return m;
}

/* Makes a block of ten-node tets with only the material's elasticity. */
static int block(flesh_material material, test_body *b)
{
  flesh_mesh *linear = test_box(3, 2, 2, 1.5, 1, 1), *mesh = NULL;
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_mesh_raise_order(linear, &mesh));
  flesh_mesh_destroy(&linear);
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_CONSISTENT, 0, b));
  flesh_system_destroy(&b->system);
  CHECK_OK(flesh_system_create(mesh, &b->system));
  b->material = material;
  b->body.element = FLESH_ELEMENT_TET10_MEAN;
  const int status = flesh_effect_elasticity(&b->body, &effect);
  if (status) return status;
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(flesh_system_finalize(b->system));
  test_jitter(b->n, 0.03, 7, b->state.x);
  return FLESH_OK;
}

/* Computes potential, forces and a Hessian of the block at x. */
static double evaluate(const test_body *b, const double *x, double *r, double *values, int project)
{
  double V = 0, size;
  const flesh_point point = flesh_point_at(0, x, b->state.v, b->state.v);
  const flesh_shift shift = {.x = 1, .filter = project ? FLESH_FILTER_CLAMP : FLESH_FILTER_NONE};
  flesh_block_matrix *K;
  CHECK_OK(flesh_system_potential(b->system, &point, &shift, &V, &size));
  CHECK_OK(flesh_system_residual(b->system, &point, r));
  if (!values) return V;
  CHECK_OK(flesh_system_matrix_create(b->system, &K));
  CHECK_OK(flesh_system_jacobian(b->system, &point, &shift, K));
  memcpy(values, K->values, 9 * (size_t)K->row_start[b->n / 3] * sizeof *values);
  flesh_block_matrix_destroy(&K);
  return V;
}

/* Neo is the same, whether built in or user-defined. */
static void a_users_part_is_taken_as_a_built_in_one(void)
{
  flesh_material neo;
  test_body own, built_in;
  CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_NEO, FLESH_CONSTANTS_RAW, mu, lambda, &neo));
  CHECK_OK(block(neo, &built_in));
  CHECK_OK(block(users(neo_psi, log_volume), &own));
  const size_t n = (size_t)own.n, most = n * n;
  double *r = calloc(2 * n, sizeof *r), *K = calloc(2 * most, sizeof *K);
  for (int project = 0; project < 2; project++) {
    const double V = evaluate(&own, own.state.x, r, K, project);
    CHECK_NEAR(V / evaluate(&built_in, built_in.state.x, r + n, K + most, project), 1, 1e-12);
    CHECK_BELOW(test_distance(own.n, r, r + n), 1e-11 * test_norm(own.n, r));
    CHECK_BELOW(test_distance((int)most, K, K + most), 1e-11 * test_norm((int)most, K));
  }
  free(r), free(K);
  test_body_destroy(&own);
  test_body_destroy(&built_in);
}

/* Checks that forces and Hessian are derivatives of the potential, by differences. */
static void forces_and_hessian_are_derivatives(void)
{
  const flesh_psi_function psi[2] = {simo_psi, neo_psi};
  const flesh_volume_function volume[2] = {simo_volume, log_volume};
  for (int k = 0; k < 2; k++) {
    test_body b;
    flesh_effect *effect = NULL;
    flesh_derivative_report report;
    CHECK_OK(block(users(psi[k], volume[k]), &b));
    CHECK_OK(flesh_effect_elasticity(&b.body, &effect));
    CHECK_OK(flesh_effect_check_derivatives(effect, b.mesh, 0, b.state.x, 3, &report));
    CHECK(flesh_derivative_report_passes(&report, 1e-7));
    flesh_effect_destroy(&effect);
    test_body_destroy(&b);
  }
}

static void refused(flesh_material material, const char *words)
{
  test_body b;
  CHECK(block(material, &b) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), words);
  test_body_destroy(&b);
}

/* A psi that does not contain the volume part that tets would average, and functions that are no U. */
static void other_volume_parts_are_refused(void)
{
  refused(users(simo_psi, NULL), "does not contain lambda (J-1)^2/2; set material.volume");
  refused(users(neo_psi, NULL), "set material.volume");
  refused(users(neo_psi, scaled_volume), "U'' = 2 at J = 1");
  refused(users(neo_psi, sloping_volume), "U' = 1");
  refused(users(neo_psi, no_volume), "no value at J = 1");
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(a_users_part_is_taken_as_a_built_in_one), TEST(forces_and_hessian_are_derivatives),
                   TEST(other_volume_parts_are_refused));
}
