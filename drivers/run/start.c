/* start.c: makes the state and the integrator with which a scene's run starts. */
#include "run/start.h"

#include <stdlib.h>

#include "base/error.h"
#include "effect/effect.h"
#include "scene/effect_list.h"
#include "scene/scene.h"
#include "system/feasible_step.h"
#include "system/parts.h"
#include "time/integrator.h"

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

int flesh_start_check(const flesh_scene *scene)
{
  const flesh_scene_time *time = flesh_scene_times(scene);
  const flesh_node *place = flesh_scene_place(scene->root, flesh_scene_table, offsetof(flesh_scene_keys, time));
  const double t = scene->start.t;
  const int single = flesh_run_is_single(scene->system, time->method);
  const int status = flesh_run_check_times(single, time->step, time->end, 0, t, t);
  return status ? flesh_node_fail_within(status, place, "time.end: ") : FLESH_OK;
}

int flesh_start_place(const flesh_scene *scene, const flesh_state *state, int status)
{
  const flesh_effect_entry *entry = scene->keys.effects.values, *end = entry + scene->keys.effects.count;
  for (; status == FLESH_ERR_ARGUMENT && entry < end; entry++) {
    if (!entry->effect) continue;
    const flesh_effect *effect = flesh_system_effect(scene->system, entry->effect - 1);
    const double *internal = flesh_internal_of(scene->system, entry->effect - 1, state->internal);
    const flesh_effect_barrier *barrier = flesh_effect_as_barrier(effect);
    if (barrier->check && barrier->check(effect, internal, state->t, state->x) == status)
      return flesh_node_fail_within(status, entry->node, "%s: ", entry->path);
  }
  return status;
}

int flesh_start_skin(const flesh_scene *scene, flesh_surface **surface, flesh_skin **skin)
{
  const flesh_node *place = flesh_scene_place(scene->root, flesh_scene_table, offsetof(flesh_scene_keys, output));
  const flesh_scene_output *output = flesh_scene_outputs(scene);
  if (!output->skin.surface || output->frame_interval < 1) return FLESH_OK;
  int status = flesh_surface_read(output->skin.surface, surface);
  if (!status) status = flesh_skin_bind(flesh_scene_mesh(scene), *surface, skin);
  return status ? flesh_node_fail_within(status, place, "output.skin.surface: ") : FLESH_OK;
}

int flesh_start_try(const flesh_scene *scene)
{
  const flesh_system *system = flesh_scene_system(scene);
  flesh_integrator *integrator = NULL;
  flesh_state state = {0};
  int status = flesh_start_check(scene);
  if (!status) status = flesh_start_make(scene, &state);
  if (!status) status = flesh_start_integrator(scene, system, flesh_scene_solver(scene), &integrator);
  if (!status) status = flesh_start_place(scene, &state, flesh_system_check_with(system, state.internal, state.t, state.x));
  if (!status) status = flesh_integrator_begin(integrator, &state);
  flesh_integrator_destroy(&integrator);
  free(state.x);
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
