/* time.c: the method, steps and end in force for a scene. */
#include <math.h>

#include "scene/keys.h"
#include "scene/scene.h"
#include "time/ida.h"
#include "time/method.h"

/* Sets whether and how errors choose the steps of the method; `by_name`: the scene named the method `adaptive`. */
static int settle_adaptive(const flesh_scene *scene, int by_name, const flesh_node *place, flesh_adaptive_options *taken)
{
  const flesh_method method = (flesh_method)scene->keys.time.method;
  const int said = scene->keys.time.controlled, known = flesh_method_controlled(method) != NULL;
  flesh_adaptive_options defaults;
  flesh_adaptive_options_default(&defaults);
  *taken = scene->keys.time.adaptive;
  taken->control = known && (said < 0 ? method == FLESH_METHOD_RUNGE_KUTTA && !isnan(taken->tolerance) : said);
  if (isnan(taken->tolerance)) taken->tolerance = defaults.tolerance;
  if (by_name ? said : said != 1 || known || flesh_method_order(method) == 0) return FLESH_OK;
  return flesh_node_fail(place, "time.adaptive is %s; with method %s, whose error %s, it must be %s, or choose another method",
                         by_name ? "false" : "true", by_name ? "adaptive" : flesh_method_name(method),
                         by_name ? "chooses steps" : "is not estimated", by_name ? "true" : "false");
}

/* Uses statics, as without inertia there is nothing to step; warns if the scene names another method. */
static int take_statics(flesh_scene *scene, const flesh_node *place)
{
  const flesh_node *method = flesh_node_find(place, "method");
  const int ignored = scene->keys.time.method != FLESH_METHOD_STATIC && method && !method->removed;
  const char *name = flesh_method_names[scene->keys.time.method];
  scene->keys.time.method = FLESH_METHOD_STATIC;
  if (!ignored) return FLESH_OK;
  return flesh_scene_warn(scene, flesh_arena_print(&scene->arena, "time.method is %s, but the scene has no inertia and is solved "
                                                   "for equilibrium; add the effect inertia, or make the method static", name));
}

int flesh_scene_settle_time(flesh_scene *scene)
{
  const flesh_key *time = flesh_key_at(flesh_scene_table, offsetof(flesh_scene_keys, time));
  const flesh_node *place = flesh_scene_place(scene->root, flesh_scene_table, time->offset);
  int status = flesh_scene_has_inertia(scene) ? FLESH_OK : take_statics(scene, place);
  if (status) return status;
  const int by_name = !flesh_method_find((flesh_method)scene->keys.time.method);
  if (by_name) scene->keys.time.method = FLESH_METHOD_RUNGE_KUTTA;
  if (by_name && scene->keys.time.controlled) scene->keys.time.controlled = 1;
  if (isnan(scene->keys.time.end) && scene->keys.time.method != FLESH_METHOD_STATIC) {
    char expected[FLESH_EXPECTATION_SIZE];
    return flesh_node_fail(place, "time.end is missing; it must be %s when the scene has inertia",
                           flesh_key_expectation(flesh_key_named(time->children, "end"), expected));
  }
  if (isnan(scene->keys.time.end)) scene->keys.time.end = 0;
  const flesh_method method = (flesh_method)scene->keys.time.method;
  const char *refused = flesh_system_multiplier_count(scene->system)
                            ? "which cannot judge the error of the pressures of incompressible tets (poisson 0.5); it "
                              "must be adaptive or a method of fixed steps, or poisson below 0.5"
                        : flesh_system_internal_count(scene->system)
                            ? "which goes on from a history of smooth steps; with a weld that breaks or a contact that "
                              "is adaptive it must be adaptive or a method of fixed steps"
                            : NULL;
  if (refused && method == FLESH_METHOD_IDA)
    return flesh_node_fail(place, "time.method is %s, %s", flesh_method_name(method), refused);
  flesh_adaptive_options taken;
  status = settle_adaptive(scene, by_name, place, &taken);
  if (status) return status;
  scene->keys.time.options.table = (flesh_table)scene->keys.time.table;
  scene->time = (flesh_scene_time){(flesh_method)scene->keys.time.method, scene->keys.time.step,
                                   scene->keys.time.end, scene->keys.time.max_energy_gain,
                                   scene->keys.time.options, taken};
  status = flesh_method_options_check(&scene->time.options);
  if (!status) status = flesh_adaptive_options_check(&taken);
  return status ? flesh_node_fail_within(status, place, "time.") : FLESH_OK;
}
