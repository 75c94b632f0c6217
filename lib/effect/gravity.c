/* gravity.c: a uniform acceleration g: r = -M g with the lumped or the consistent mass M, so that a free fall causes no
 * deformation. */
#include "base/error.h"
#include "base/memory.h"
#include "effect/dead_load.h"
#include "element/body.h"

static const flesh_effect_operations gravity_operations = {
    .name = "gravity",
    .role = FLESH_ROLE_LOAD,
    .traits = FLESH_IS_PASSIVE | FLESH_IS_SUM_OVER_TETS,
    .residual = flesh_dead_load_residual,
    .potential = flesh_dead_load_potential,
    .energy = flesh_dead_load_energy,
    .destroy = flesh_dead_load_destroy,
    .figures = &flesh_dead_load_figures,
};

/* Computes M g in `force` [3*nodes], with `work` of the same size. On linear tets both masses give the same. */
static void weigh(const flesh_body *body, const double acceleration[3], double *work, double *force)
{
  const int dofs = 3 * flesh_mesh_node_count(body->mesh);
  if (body->mass == FLESH_MASS_CONSISTENT && flesh_mesh_order(body->mesh) == 2) {
    for (int d = 0; d < dofs; d++) work[d] = acceleration[d % 3];
    flesh_mesh_consistent_mass_times(body->mesh, body->density, work, force);
    return;
  }
  flesh_mesh_lumped_mass(body->mesh, body->density, work);
  for (int d = 0; d < dofs; d++) force[d] = work[d / 3] * acceleration[d % 3];
}

int flesh_effect_gravity(const flesh_body *body, const double acceleration[3], flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"}, {acceleration, "acceleration"});
  flesh_dead_load *load;
  const int nodes = flesh_mesh_node_count(body->mesh);
  int status = flesh_body_check_density(body);
  if (!status) status = flesh_dead_load_create("acceleration", "m/s^2", acceleration, nodes, NULL, &load);
  if (status) return status;
  double *work = flesh_malloc(3 * (size_t)nodes * sizeof *work);
  if (!work) {
    flesh_dead_load_destroy(load);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the weights of %d nodes", nodes);
  }
  weigh(body, acceleration, work, load->force);
  flesh_free(work);
  return flesh_effect_create(&gravity_operations, body->mesh, load, effect);
}

const double *flesh_effect_acceleration(const flesh_effect *effect)
{
  return effect->operations == &gravity_operations ? ((const flesh_dead_load *)effect->data)->vector : NULL;
}
