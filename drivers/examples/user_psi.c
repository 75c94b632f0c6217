/* user_psi.c: defines an elastic energy of the user's own, psi(I_C, J).
 *
 *   psi = mu/2 (I_C - 3) - mu (J - 1) + lambda/2 (J - 1)^2 + b/4 (I_C - 3)^2
 *
 * It is flesh's energy E, with the same constants, and a term that stiffens it with stretch. The user writes the value
 * and its derivatives; stress, Hessian, the Hessian's eigenvalues for projection and the small-strain constants follow.
 * The bar sags under its weight: with E, with b = 0, which is the same, and with b > 0.
 *
 * Sample output:
 *   E             : mu 17241 Pa, lambda 155172 Pa, stress at rest 0 Pa, tip at z = -2.2378 m
 *   psi, b = 0    : mu 17241 Pa, lambda 155172 Pa, stress at rest 0 Pa, tip at z = -2.2378 m
 *   psi, b = mu   : mu 17241 Pa, lambda 189654 Pa, stress at rest 0 Pa, tip at z = -1.9533 m
 */
#include "bar.h"

typedef struct constants {
  double mu, lambda, b;
} constants;

static int stiffening(double I_C, double J, const flesh_material *material, flesh_psi *psi)
{
  const constants *c = material->user;
  psi->value = c->mu / 2 * (I_C - 3) - c->mu * (J - 1) + c->lambda / 2 * (J - 1) * (J - 1) +
               c->b / 4 * (I_C - 3) * (I_C - 3);
  psi->I = c->mu / 2 + c->b / 2 * (I_C - 3);
  psi->J = -c->mu + c->lambda * (J - 1);
  psi->II = c->b / 2;
  psi->IJ = 0;
  psi->JJ = c->lambda;
  return FLESH_OK;
}

/* Small-strain constants and the bar's equilibrium by the integrator layer. */
static void sag(const char *name, const flesh_material *material)
{
  double mu, lambda, rest;
  TRY(flesh_material_small_strain(material, &mu, &lambda, &rest));
  bar b;
  flesh_solver_options options;
  flesh_integrator *integrator;
  bar_begin(&b, FLESH_ELEMENT_TET4, *material, 0);
  bar_gravity(&b, -9.81);
  bar_finish(&b);
  flesh_solver_options_default(&options);
  TRY(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  TRY(flesh_integrator_step(integrator, &b.state, 1, NULL));
  printf("%s: mu %.0f Pa, lambda %.0f Pa, stress at rest %.0f Pa, tip at z = %.4f m\n", name, mu, lambda, rest,
         b.state.x[3 * b.tip + 2]);
  flesh_integrator_destroy(&integrator);
  bar_destroy(&b);
}

int main(void)
{
  const constants plain = {17241, 172413, 0}, stiff = {17241, 172413, 17241};
  flesh_material material;

  /* 1. Flesh's E. */
  TRY(flesh_material_from_lame(FLESH_ENERGY_E, FLESH_CONSTANTS_RAW, plain.mu, plain.lambda, &material));
  sag("E             ", &material);

  /* 2. A material from the function; the constants are borrowed. */
  TRY(flesh_material_from_psi(stiffening, &plain, &material));
  sag("psi, b = 0    ", &material);
  TRY(flesh_material_from_psi(stiffening, &stiff, &material));
  sag("psi, b = mu   ", &material);
  return 0;
}
