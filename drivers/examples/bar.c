/* bar.c: makes a bar in code and lets it sag for half a second, by flesh's own integrator.
 * Sample output:
 *   at 0.50 s the tip is at z = -0.2854 m
 */
#include <flesh/flesh.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TRY(call) if (call) { fprintf(stderr, "%s\n", flesh_error_text()); return 1; }

int main(void)
{
  flesh_mesh *mesh; /* a bar of 4 m x 1 m x 1 m, clamped at x = 0 */
  TRY(flesh_mesh_box((int[]){16, 4, 4}, (double[]){4, 1, 1}, (double[]){0, 0, 0}, &mesh))
  int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh), clamped = 0;
  const double *rest = flesh_mesh_positions(mesh);
  double *density = malloc(tets * sizeof *density);
  int *wall = malloc(nodes * sizeof *wall);
  for (int e = 0; e < tets; e++) density[e] = 1000;
  for (int i = 0; i < nodes; i++) if (rest[3 * i] == 0) wall[clamped++] = i;

  flesh_material flesh; /* Young's modulus 1e5 Pa, Poisson's ratio 0.45 */
  TRY(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.45, &flesh))
  flesh_body body = {.mesh = mesh, .density = density, .materials = &flesh, .mass = FLESH_MASS_LUMPED};
  flesh_effect *inertia, *elasticity, *gravity;
  TRY(flesh_effect_inertia(&body, &inertia))
  TRY(flesh_effect_elasticity(&body, &elasticity))
  TRY(flesh_effect_gravity(&body, (double[]){0, 0, -9.81}, &gravity))
  flesh_system *system; /* owns the effects and has the constraints */
  TRY(flesh_system_create(mesh, &system))
  TRY(flesh_system_add_effect(system, &inertia))
  TRY(flesh_system_add_effect(system, &elasticity))
  TRY(flesh_system_add_effect(system, &gravity))
  TRY(flesh_system_add_pin(system, clamped, wall, FLESH_AXES_ALL, 0, 1e9))
  TRY(flesh_system_finalize(system))
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  flesh_integrator *integrator;
  TRY(flesh_integrator_create(system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator))
  flesh_state state = {.t = 0, .x = malloc(3 * nodes * sizeof(double)), .v = calloc(3 * nodes, sizeof(double))};
  memcpy(state.x, rest, 3 * nodes * sizeof(double));
  for (int step = 0; step < 30; step++) TRY(flesh_integrator_step(integrator, &state, 1. / 60, NULL))
  printf("at %.2f s the tip is at z = %.4f m\n", state.t, state.x[3 * nodes - 1]);
  flesh_integrator_destroy(&integrator);
  flesh_system_destroy(&system);
  flesh_mesh_destroy(&mesh);
  free(state.x), free(state.v), free(density), free(wall);
}
