// TEST full memory seconds=60
/* test_watchdog.c: stiff parts turn along arcs, which straight steps cannot follow: continuing beyond the point where
 * the potential would cut them, and returning from there, takes far fewer iterations and has the same result. */
#include "body.h"
#include "test.h"

typedef struct outcome {
  flesh_solve_stats stats;
  double tip[3];
} outcome;

/* Computes the equilibrium of a bar clamped at x = 0 that is 1e6 times stiffer from x = 1 on; the stiff part then hangs
 * down. */
static outcome hang(flesh_energy energy, double poisson, int watchdog)
{
  const flesh_constants constants = FLESH_CONSTANTS_MATCHED;
  flesh_material materials[2];
  outcome result = {0};
  test_body b;
  flesh_solver_options options = test_options(1e-8);
  flesh_integrator *integrator = NULL;
  flesh_effect *effect = NULL;
  if (!watchdog) options.techniques &= ~(unsigned)FLESH_TECHNIQUE_WATCHDOG;
  CHECK_OK(flesh_material_from_young(energy, constants, 1e5, poisson, &materials[0]));
  CHECK_OK(flesh_material_from_young(energy, constants, 1e11, poisson, &materials[1]));
  CHECK_OK(test_body_create(test_box(8, 2, 2, 2, 0.5, 0.5), materials[0], 1000, FLESH_MASS_LUMPED, 0, &b));
  flesh_system_destroy(&b.system);
  CHECK_OK(flesh_system_create(b.mesh, &b.system));
  const int tets = flesh_mesh_tet_count(b.mesh), *nodes = flesh_mesh_tets(b.mesh);
  int *which = calloc((size_t)tets, sizeof *which);
  for (int e = 0; e < tets; e++) {
    double x = 0;
    for (int a = 0; a < 4; a++) x += flesh_mesh_positions(b.mesh)[3 * nodes[4 * e + a]] / 4;
    which[e] = x > 1;
  }
  b.body.materials = materials;
  b.body.tet_material = which;
  CHECK_OK(flesh_effect_elasticity(&b.body, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(test_body_gravity(&b, 0, 0, -20));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, &result.stats));
  memcpy(result.tip, b.state.x + b.n - 3, sizeof result.tip);
  printf("# %s, nu = %g, %s: %d Newton, %d linear iterations, %d watchdog steps, %d backtracks; the tip is at %.4g %.4g m\n",
         flesh_energy_name(energy), poisson, watchdog ? "with" : "without", result.stats.newton, result.stats.linear,
         result.stats.watchdog_steps, result.stats.backtracks, result.tip[0], result.tip[2]);
  CHECK(result.stats.potential_rises == 0 && result.stats.unconverged == 0);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  free(which);
  return result;
}

static void stiff_parts_turn(void)
{
  const flesh_energy energies[] = {FLESH_ENERGY_S, FLESH_ENERGY_E};
  for (int e = 0; e < 2; e++)
    for (int k = 0; k < 2; k++) {
      const double poisson = k ? 0.49 : 0.4;
      const outcome with = hang(energies[e], poisson, 1), without = hang(energies[e], poisson, 0);
      CHECK(with.stats.watchdog_steps > 0 && without.stats.watchdog_steps == 0);
      CHECK(5 * with.stats.newton < without.stats.newton);
      /* Recovering from an increase of the residual is no convergence that linear tolerances should follow. */
      CHECK_BELOW((double)with.stats.linear / with.stats.newton, 55);
      CHECK_BELOW(test_distance(3, with.tip, without.tip), 1e-4);
    }
}

int main(int argc, char **argv) { return RUN_TESTS(argc, argv, TEST(stiff_parts_turn)); }
