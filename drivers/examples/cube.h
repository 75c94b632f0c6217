/* cube.h: a cube of 0.2 m that is thrown at a sheet 5 cm below it, for examples with contact. */
#ifndef FLESH_EXAMPLES_CUBE_H
#define FLESH_EXAMPLES_CUBE_H

#include "bar.h"

/* Makes the cube above the sheet, with a velocity of 5 m/s downwards. To be freed by bar_destroy. */
static inline void cube_begin(bar *c)
{
  const double corners[] = {-2, -2, -0.05, 3, -2, -0.05, 3, 3, -0.05, -2, 3, -0.05}; /* m, of the sheet */
  flesh_material material;
  flesh_effect *contact;
  flesh_obstacle *sheet;
  flesh_contact_options options;
  TRY(flesh_mesh_box((int[]){2, 2, 2}, (double[]){0.2, 0.2, 0.2}, (double[]){0, 0, 0}, &c->mesh));
  TRY(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.45, &material));
  bar_make(c, FLESH_ELEMENT_TET4, material, 1);
  TRY(flesh_obstacle_mesh(4, corners, 2, (int[]){0, 1, 2, 0, 2, 3}, &sheet));
  flesh_contact_options_default(&options);
  options.thickness = 1e-3; /* m */
  TRY(flesh_effect_obstacle_contact(&c->body, &options, &sheet, &contact));
  TRY(flesh_system_add_effect(c->system, &contact));
  TRY(flesh_system_finalize(c->system));
  for (int i = 0; i < c->nodes; i++) c->state.v[3 * i + 2] = -5; /* m/s */
}

/* Returns how far the lowest node is above the sheet, m. */
static inline double cube_lowest(const bar *c, const double *x)
{
  double lowest = INFINITY;
  for (int i = 0; i < c->nodes; i++) lowest = fmin(lowest, x[3 * i + 2] + 0.05);
  return lowest;
}

#endif
