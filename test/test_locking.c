/* test_locking.c: */
#include <stdlib.h>
#include <time.h>

#include "body.h"
#include "test.h"

int main(int argc, char **argv)
{
  (void)argc, (void)argv;
  static const double nus[] = {.3, .45, .49, .499, .4999};
  static const double limit[] = {-.7813, -.7649, -.7583, -.7567, -.7565};
  for (int e = 1; e >= 0; e--)
  for (int k = 0; k < 5; k++) {
    test_body b;
    flesh_mesh *mesh = NULL, *box = test_box(16, 4, 4, 4, 1, 1);
    CHECK_OK(flesh_mesh_raise_order(box, &mesh));
    CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, nus[k]), 1000, FLESH_MASS_CONSISTENT, 0, &b));
    flesh_system_destroy(&b.system);
    b.body.element = e ? FLESH_ELEMENT_TET10_MEAN : FLESH_ELEMENT_TET10;
    flesh_effect *effect = NULL;
    CHECK_OK(flesh_system_create(mesh, &b.system));
    CHECK_OK(flesh_effect_elasticity(&b.body, &effect));
    CHECK_OK(flesh_system_add_effect(b.system, &effect));
    CHECK_OK(test_body_gravity(&b, 0, 0, -0.2));
    CHECK_OK(test_body_clamp(&b, 1e-9));
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_integrator *integrator = NULL;
    flesh_solver_options options = test_options(1e-8);
    flesh_solve_stats stats = {0};
    clock_t t = clock();
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, &stats));
    for (int i = 0; i < b.n / 3; i++) {
      const double *X = flesh_mesh_positions(mesh) + 3 * i;
      if (X[0] == 4 && X[1] == .5 && X[2] == .5) {
        double tip = b.state.x[3 * i + 2] - X[2];
        printf("%s nu %g: tip %.6f, %+.2f %% of the limit; %d Newton %d linear %.2f s\n", flesh_element_name(b.body.element), nus[k], tip,
               100 * (tip / limit[k] - 1), stats.newton, stats.linear, (double)(clock() - t) / CLOCKS_PER_SEC);
      }
    }
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
  return 0;
}
