/* tets.c: what a constant of the material of each single tet changes in the residual. A tet's elastic forces depend on its
 * own constants alone, so that the residual of the body torn into its tets, which share no node, has them all at once. */
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "flesh/effects.h"
#include "flesh/sensitivity.h"
#include "mesh/mesh.h"
#include "mesh/torn.h"

static int no_memory(int tets) { return flesh_fail(FLESH_ERR_MEMORY, "no memory for the forces of %d tets", tets); }

/* r [3*nodes of torn]: the elastic forces of a body of that mesh at x [3*nodes of torn]. */
static int find_forces(const flesh_body *body, const flesh_mesh *torn, const flesh_state *state, const double *x, double *r)
{
  flesh_body apart = *body;
  flesh_system *system = NULL;
  flesh_effect *elasticity = NULL;
  apart.mesh = torn;
  apart.part_count = 0;
  flesh_point point = flesh_point_at(state->t, x, x, x); /* elasticity reads neither v nor a */
  point.multipliers = state->multipliers;
  int status = flesh_system_create(torn, &system);
  if (!status) status = flesh_effect_elasticity(&apart, &elasticity);
  if (!status) status = flesh_system_add_effect(system, &elasticity);
  if (!status) status = flesh_system_finalize(system);
  if (!status) status = flesh_system_residual(system, &point, r);
  flesh_system_destroy(&system);
  return status > 0 ? flesh_fail(FLESH_ERR_SOLVE, "the tets have no elastic forces where their constants are changed") : status;
}

int flesh_tet_forces(const flesh_tet_parameter *parameter, const flesh_state *state, double *forces)
{
  FLESH_NEED({parameter, "parameter"}, {state, "state"}, {forces, "forces"});
  FLESH_NEED({parameter->bodies[0], "parameter->bodies[0]"}, {parameter->bodies[1], "parameter->bodies[1]"},
             {parameter->difference, "parameter->difference"}, {state->x, "state->x"});
  const flesh_body *const *bodies = parameter->bodies;
  const flesh_mesh *mesh = bodies[0]->mesh;
  const int size = flesh_mesh_order(mesh) == 2 ? 10 : 4;
  flesh_mesh *torn = NULL;
  int *from = NULL;
  double *x = NULL, *r[2] = {NULL};
  if (flesh_mesh_tet_count(bodies[1]->mesh) != mesh->tets || flesh_mesh_node_count(bodies[1]->mesh) != mesh->nodes)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the bodies of a parameter by tets have different meshes; they must have the same");
  int status = flesh_mesh_tear(mesh, &torn, &from);
  const int nodes = status ? 0 : flesh_mesh_node_count(torn);
  if (!status && !(x = flesh_malloc(9 * (size_t)nodes * sizeof *x))) status = no_memory(mesh->tets);
  for (int i = 0; i < nodes && !status; i++) memcpy(x + 3 * (size_t)i, state->x + 3 * (size_t)from[i], 3 * sizeof *x);
  for (int k = 0; k < 2 && !status; k++) {
    r[k] = x + (size_t)(3 + 3 * k) * (size_t)nodes;
    status = find_forces(bodies[k], torn, state, x, r[k]);
  }
  if (!status) memset(forces, 0, 3 * (size_t)size * (size_t)mesh->tets * sizeof *forces);
  for (int t = 0, i = 0; t < mesh->tets && !status; t++) {
    const int count = flesh_mesh_is_quadratic(mesh, t) ? 30 : 12;
    for (int d = 0; d < count && parameter->difference[t] != 0; d++)
      forces[3 * (size_t)size * (size_t)t + (size_t)d] = (r[1][i + d] - r[0][i + d]) / parameter->difference[t];
    i += count;
  }
  flesh_mesh_destroy(&torn);
  flesh_free(from);
  flesh_free(x);
  return status;
}
