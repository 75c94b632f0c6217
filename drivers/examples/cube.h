/* cube.h: a cube of 0.2 m that is thrown on a sheet 5 cm beneath it, for examples with contact. */
#ifndef FLESH_EXAMPLES_CUBE_H
#define FLESH_EXAMPLES_CUBE_H

#include "bar.h"

typedef struct cube {
  flesh_mesh *mesh;
  double *density;
  flesh_material material;
  flesh_body body;
  flesh_system *system;
  flesh_state state; /* above the sheet, at 5 m/s */
} cube;

static inline void cube_begin(cube *c)
{
  const double corners[] = {-2, -2, -0.05, 3, -2, -0.05, 3, 3, -0.05, -2, 3, -0.05}; /* m, of the sheet */
  flesh_effect *inertia, *elasticity, *contact;
  flesh_obstacle *sheet;
  flesh_contact_options options;
  TRY(flesh_mesh_box((int[]){2, 2, 2}, (double[]){0.2, 0.2, 0.2}, (double[]){0, 0, 0}, &c->mesh));
  const int nodes = flesh_mesh_node_count(c->mesh), tets = flesh_mesh_tet_count(c->mesh);
  c->density = malloc((size_t)tets * sizeof(double));
  for (int e = 0; e < tets; e++) c->density[e] = 1000; /* kg/m^3 */
  TRY(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.45, &c->material));
  c->body = (flesh_body){.mesh = c->mesh, .density = c->density, .materials = &c->material, .mass = FLESH_MASS_LUMPED};
  TRY(flesh_obstacle_mesh(4, corners, 2, (int[]){0, 1, 2, 0, 2, 3}, &sheet));
  flesh_contact_options_default(&options);
  options.thickness = 1e-3; /* m */
  TRY(flesh_effect_inertia(&c->body, &inertia));
  TRY(flesh_effect_elasticity(&c->body, &elasticity));
  TRY(flesh_effect_obstacle_contact(&c->body, &options, &sheet, &contact));
  TRY(flesh_system_create(c->mesh, &c->system));
  TRY(flesh_system_add_effect(c->system, &inertia));
  TRY(flesh_system_add_effect(c->system, &elasticity));
  TRY(flesh_system_add_effect(c->system, &contact));
  TRY(flesh_system_finalize(c->system));
  c->state = (flesh_state){.x = malloc(3 * (size_t)nodes * sizeof(double)), .v = calloc(3 * (size_t)nodes, sizeof(double))};
  memcpy(c->state.x, flesh_mesh_positions(c->mesh), 3 * (size_t)nodes * sizeof(double));
  for (int i = 0; i < nodes; i++) c->state.v[3 * i + 2] = -5; /* m/s */
}

/* How far the lowest node is above the sheet, m. */
static inline double cube_lowest(const cube *c, const double *x)
{
  double lowest = INFINITY;
  for (int i = 0; i < flesh_mesh_node_count(c->mesh); i++) lowest = fmin(lowest, x[3 * i + 2] + 0.05);
  return lowest;
}

static inline void cube_destroy(cube *c)
{
  flesh_system_destroy(&c->system);
  flesh_mesh_destroy(&c->mesh);
  free(c->density);
  free(c->state.x);
  free(c->state.v);
}

#endif
