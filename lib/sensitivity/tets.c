/* tets.c: change of the residual by a material constant of each single tet. A tet's forces depend on its own constants
 * alone, so that one residual of the body torn into its tets, which share no node, has the changes of all tets. */
#include "sensitivity/tets.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "flesh/effects.h"
#include "mesh/pieces.h"
#include "mesh/torn.h"

/* Makes a system of elasticity, and of those of `effects` that damp by the stiffness. */
static int make_system(const flesh_varied_tets *self, const flesh_body *body, const flesh_system *effects, flesh_system **system)
{
  const flesh_mesh *torn = self->torn_body.mesh;
  flesh_effect *effect = NULL;
  flesh_body own = *body;
  own.mesh = torn;
  own.part_count = 0;
  int status = flesh_system_create(torn, system);
  if (!status) status = flesh_effect_elasticity(&own, &effect);
  if (!status) status = flesh_system_add_effect(*system, &effect);
  for (int e = 0; effects && e < flesh_system_effect_count(effects) && !status; e++) {
    const flesh_effect *one = flesh_system_effect(effects, e);
    const flesh_effect_partials *partials = flesh_effect_private_of(one)->partials;
    if (one->operations->role != FLESH_ROLE_DAMPING || !partials || !partials->tear) continue;
    status = partials->tear(one, body, torn, &effect);
    if (!status) status = flesh_system_add_effect(*system, &effect);
  }
  flesh_effect_destroy(&effect);
  return status ? status : flesh_system_finalize(*system);
}

int flesh_varied_tets_open(const flesh_tet_parameter *parameter, const flesh_system *effects, flesh_varied_tets *self)
{
  *self = (flesh_varied_tets){.parameter = parameter};
  FLESH_NEED({parameter, "parameter"});
  FLESH_NEED({parameter->bodies[0], "parameter->bodies[0]"}, {parameter->bodies[1], "parameter->bodies[1]"},
             {parameter->difference, "parameter->difference"});
  const flesh_mesh *mesh = parameter->bodies[0]->mesh, *other = parameter->bodies[1]->mesh;
  if (flesh_mesh_tet_count(other) != mesh->tets || flesh_mesh_node_count(other) != mesh->nodes)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the bodies of a parameter by tets have different meshes; they must have the same");
  const flesh_mesh *moves = effects ? flesh_system_mesh(effects) : mesh;
  if (flesh_mesh_tet_count(moves) != mesh->tets || flesh_mesh_node_count(moves) != mesh->nodes)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the bodies of a parameter by tets have another mesh than the motion");
  for (int t = 0; t < mesh->tets; t++)
    if (!isfinite(parameter->difference[t]))
      return flesh_fail(FLESH_ERR_ARGUMENT, "difference[%d] is %g; it must be finite", t, parameter->difference[t]);
  int status = flesh_torn_body_open(mesh, &self->torn_body);
  for (int k = 0; k < 2 && !status; k++) {
    self->r[k] = self->torn_body.room + (size_t)(10 + k) * (size_t)self->torn_body.n;
    status = make_system(self, parameter->bodies[k], effects, &self->systems[k]);
  }
  return status;
}

void flesh_varied_tets_clear(flesh_varied_tets *self)
{
  for (int k = 0; k < 2; k++) flesh_system_destroy(&self->systems[k]);
  flesh_torn_body_clear(0, &self->torn_body);
}

int flesh_varied_tets_set(flesh_varied_tets *self, const flesh_point *point)
{
  const flesh_point torn = flesh_torn_body_point(&self->torn_body, point);
  int status = FLESH_OK;
  for (int k = 0; k < 2 && !status; k++) status = flesh_system_residual(self->systems[k], &torn, self->r[k]);
  return status > 0 ? flesh_fail(FLESH_ERR_SOLVE, "the tets have no forces where their constants are changed") : status;
}

void flesh_varied_tets_add(const flesh_varied_tets *self, const double *lambda, double *gradient)
{
  for (int t = 0, i = 0, nodes[10]; t < flesh_mesh_tet_count(self->torn_body.mesh); t++) {
    const int has = flesh_mesh_tet_nodes(self->torn_body.mesh, t, nodes);
    const double difference = self->parameter->difference[t];
    for (int d = 3 * i; d < 3 * (i + has) && difference != 0; d++)
      gradient[t] -= lambda[3 * self->torn_body.from[d / 3] + d % 3] * (self->r[1][d] - self->r[0][d]) / difference;
    i += has;
  }
}

int flesh_tet_forces(const flesh_tet_parameter *parameter, const flesh_state *state, double *forces)
{
  flesh_varied_tets varied;
  FLESH_NEED({parameter, "parameter"}, {state, "state"}, {forces, "forces"}, {state ? state->x : NULL, "state->x"});
  flesh_point point = flesh_point_at(state->t, state->x, state->x, state->x); /* elasticity reads neither v nor a */
  point.multipliers = state->multipliers;
  int status = flesh_varied_tets_open(parameter, NULL, &varied);
  const int own = status ? 0 : flesh_system_multiplier_count(varied.systems[0]);
  if (!status && state->multipliers && state->multiplier_count != own)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "the state has %d multipliers; the body has %d", state->multiplier_count, own);
  if (!status) status = flesh_varied_tets_set(&varied, &point);
  const flesh_mesh *torn = varied.torn_body.mesh;
  const size_t size = status ? 0 : flesh_mesh_order(torn) == 2 ? 30 : 12;
  if (!status) memset(forces, 0, size * (size_t)flesh_mesh_tet_count(torn) * sizeof *forces);
  for (int t = 0, i = 0, nodes[10]; !status && t < flesh_mesh_tet_count(torn); t++) {
    const int count = 3 * flesh_mesh_tet_nodes(torn, t, nodes);
    for (int d = 0; d < count && parameter->difference[t] != 0; d++)
      forces[size * (size_t)t + (size_t)d] = (varied.r[1][i + d] - varied.r[0][i + d]) / parameter->difference[t];
    i += count;
  }
  flesh_varied_tets_clear(&varied);
  return status;
}
