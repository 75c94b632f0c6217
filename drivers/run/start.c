/* start.c: what a scene is integrated from, and by. */
#include "run/start.h"

#include <stdlib.h>

#include "base/error.h"
#include "system/system.h"

int flesh_state_make(int nodes, int multipliers, int internal, flesh_state *state)
{
  const size_t n = 3 * (size_t)nodes;
  *state = (flesh_state){.x = calloc(2 * n + (size_t)multipliers + (size_t)internal + 1, sizeof *state->x)};
  if (!state->x) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a state");
  state->v = state->x + n;
  state->multipliers = multipliers ? state->v + n : NULL;
  state->multiplier_count = multipliers;
  state->internal = internal ? state->v + n + multipliers : NULL;
  state->internal_count = internal;
  return FLESH_OK;
}

int flesh_start_make(const flesh_scene *scene, flesh_state *state)
{
  const flesh_system *system = flesh_scene_system(scene);
  const int status = flesh_state_make(flesh_mesh_node_count(flesh_scene_mesh(scene)), flesh_system_multiplier_count(system),
                                      flesh_system_internal_count(system), state);
  if (!status) flesh_scene_start(scene, state);
  return status;
}

int flesh_start_integrator(const flesh_scene *scene, const flesh_system *system, const flesh_solver_options *solver,
                           flesh_integrator **integrator)
{
  const flesh_scene_time *time = flesh_scene_times(scene);
  int status = flesh_integrator_create(system, time->method, solver, integrator);
  if (!status) status = flesh_integrator_set_adaptive(*integrator, &time->adaptive);
  if (!status) status = flesh_integrator_set_method_options(*integrator, &time->options);
  if (!status) status = flesh_integrator_set_max_energy_gain(*integrator, time->max_energy_gain);
  return status;
}
