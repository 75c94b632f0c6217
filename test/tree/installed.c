/* installed.c: an outside program for test_install.sh, valid as C and as C++: one static solve with the installed
 * headers and library, so that KINSOL, KLU and the rest are linked too. */
#include <flesh/flesh.h>
#include <flesh/ida.h>
#include <flesh/kinsol.h>
#include <stdio.h>
#include <string.h>

enum { NODES = 81, TETS = 192 };

int main(void)
{
  const int cells[3] = {8, 2, 2};
  const double size[3] = {4, 1, 1}, origin[3] = {0, 0, 0}, weight[3] = {0, 0, -0.5};
  double density[TETS], v[3 * NODES] = {0}, x[3 * NODES];
  int wall[NODES], held = 0, status;
  flesh_mesh *mesh = NULL;
  flesh_material material;
  flesh_effect *elasticity = NULL, *gravity = NULL;
  flesh_system *system = NULL;
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  flesh_state state;

  memset(&state, 0, sizeof state);
  state.x = x;
  state.v = v;
  status = flesh_mesh_box(cells, size, origin, &mesh);
  if (status || flesh_mesh_node_count(mesh) != NODES || flesh_mesh_tet_count(mesh) != TETS) return 1;
  memcpy(x, flesh_mesh_positions(mesh), sizeof x);
  for (int e = 0; e < TETS; e++) density[e] = 1000;
  for (int i = 0; i < NODES; i++)
    if (x[3 * i] == 0) wall[held++] = i;
  if (flesh_material_from_lame(FLESH_ENERGY_S, FLESH_CONSTANTS_RAW, 34000, 306000, &material)) return 1;
  flesh_body body;
  memset(&body, 0, sizeof body);
  body.mesh = mesh;
  body.density = density;
  body.materials = &material;
  body.mass = FLESH_MASS_LUMPED;
  flesh_solver_options_default(&options);
  options.linear_solver = FLESH_LINEAR_KLU;
  if (!status) status = flesh_effect_elasticity(&body, &elasticity);
  if (!status) status = flesh_effect_gravity(&body, weight, &gravity);
  if (!status) status = flesh_system_create(mesh, &system);
  if (!status) status = flesh_system_add_effect(system, &elasticity);
  if (!status) status = flesh_system_add_effect(system, &gravity);
  if (!status) status = flesh_system_add_pin(system, held, wall, FLESH_AXES_ALL, 0, 1e9);
  if (!status) status = flesh_system_finalize(system);
  if (!status) status = flesh_integrator_create(system, FLESH_METHOD_STATIC, &options, &integrator);
  if (!status) status = flesh_integrator_step(integrator, &state, 1, NULL);
  if (status) {
    fprintf(stderr, "%s\n", flesh_error_text());
    return 1;
  }
  printf("tip %.6f\n", x[3 * 44 + 2]); /* (4, 0.5, 0.5) at rest */
  flesh_integrator_destroy(&integrator);
  flesh_system_destroy(&system);
  flesh_mesh_destroy(&mesh);
  return 0;
}
