/* far_bodies_cost.c: takes steps of two blocks 100 m apart, one of which approaches at 40 m/s and vibrates, with or
 * without contact, for test_far_bodies_cost.sh, which counts their instructions.
 *
 *   far_bodies_cost CELLS CONTACT STEPS
 *
 * Blocks of CELLS^3 cubes; CONTACT 0 or 1. */
#include <stdlib.h>

#include "flesh/contact.h"
#include "flesh/integrator.h"
#include "welded.h"

int main(int argc, char **argv)
{
  if (argc != 4) return 2;
  const int side = atoi(argv[1]), cells[3] = {side, side, side};
  const double size[3] = {0.3, 0.3, 0.3};
  flesh_solver_options options = test_options(1e-6);
  options.techniques &= ~(unsigned)FLESH_TECHNIQUE_UNTANGLE; /* only bodies without contact are untangled */
  flesh_integrator *integrator = NULL;
  test_body b;
  flesh_mesh *mesh = joined(box(cells, size, (double[]){0, 0, 0}), box(cells, size, (double[]){100.3, 0.05, 0.02}));
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 1, &b));
  if (atoi(argv[2])) {
    flesh_contact_options contact_options;
    flesh_effect *contact = NULL;
    flesh_contact_options_default(&contact_options);
    CHECK_OK(flesh_effect_surface_contact(&b.body, &contact_options, 0, NULL, &contact));
    CHECK_OK(flesh_system_add_effect(b.system, &contact));
  }
  CHECK_OK(flesh_system_finalize(b.system));
  for (int d = b.n / 2; d < b.n; d += 3) b.state.v[d] = -40, b.state.v[d + 2] = 0.2 * sin(d);
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  for (int s = 0; s < atoi(argv[3]); s++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 200, NULL));
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return 0;
}
