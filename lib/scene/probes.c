/* probes.c: chooses and checks the probes of output.probes, and checks the fields of frames. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "mesh/mesh.h"
#include "output/fields.h"
#include "scene/keys.h"
#include "scene/probe_effects.h"
#include "scene/scene.h"

/* Fills in the probe's nodes or point from the keys. */
static int choose(flesh_scene *scene, const flesh_scene_probe *keys, flesh_probe *probe)
{
  const flesh_selection *s = &keys->selection;
  const int selects = flesh_selection_is_given(s);
  *probe = (flesh_probe){.name = keys->name, .quantities = keys->quantities, .tet = -1};
  memcpy(probe->point, keys->point, sizeof probe->point);
  memcpy(probe->about, keys->about, sizeof probe->about);
  if (keys->effect)
    return selects || !isnan(keys->point[0])
               ? flesh_fail(FLESH_ERR_ARGUMENT,
                            "effect is given beside point, " FLESH_SELECTION_NAMES "; give one of them")
               : flesh_scene_probe_effect(scene, keys->effect, probe);
  if (!isnan(keys->point[0]))
    return selects ? flesh_fail(FLESH_ERR_ARGUMENT,
                                "point is given beside " FLESH_SELECTION_NAMES "; give one of them")
                   : FLESH_OK;
  if (!selects)
    return flesh_fail(FLESH_ERR_ARGUMENT, "nothing is chosen; give point, effect, " FLESH_SELECTION_NAMES);
  int count, *nodes, status = flesh_selection_nodes(s, &scene->body, &count, &nodes);
  if (status) return status;
  int *kept = flesh_arena_take(&scene->arena, (size_t)count * sizeof *kept);
  if (kept) memcpy(kept, nodes, (size_t)count * sizeof *kept);
  free(nodes);
  probe->node_count = count;
  probe->nodes = kept;
  return kept ? FLESH_OK : flesh_no_memory();
}

static int check_name(const flesh_scene *scene, int k)
{
  for (int j = 0; j < k; j++)
    if (!strcmp(scene->probes[j].name, scene->probes[k].name))
      return flesh_fail(FLESH_ERR_ARGUMENT, "%s is %s, as that of probes[%d]; names must differ",
                        k < scene->keys.output.probes.count ? "name" : "its name", scene->probes[k].name, j);
  return FLESH_OK;
}

int flesh_scene_probe_fail(const flesh_scene *scene, int k, int status)
{
  const flesh_key *output = flesh_key_at(flesh_scene_table, offsetof(flesh_scene_keys, output));
  const flesh_key *list = flesh_key_at(output->children, offsetof(flesh_output_keys, probes));
  const flesh_node *place = flesh_scene_place(scene->root, flesh_scene_table, output->offset);
  if (k < scene->keys.output.probes.count) {
    place = flesh_node_item(flesh_scene_place(place, output->children, list->offset), k);
    return flesh_node_fail_within(status, place, "%s.%s[%d]: ", output->name, list->name, k);
  }
  place = flesh_scene_place(place, output->children, offsetof(flesh_output_keys, reactions));
  const char *name = scene->probes[k].name ? scene->probes[k].name : "a pin";
  return flesh_node_fail_within(status, place, "%s.reactions: the probe %s: ", output->name, name);
}

/* Prepares the k-th probe. If ranks share the body, its parts are prepared later (share_probes.c); the first rank
 * prepares a copy for the whole mesh, so that errors read as on a single rank. */
static int prepare(const flesh_scene *scene, int k)
{
  flesh_probe alone = scene->probes[k], *probe = scene->ranks > 1 ? &alone : &scene->probes[k];
  int status = FLESH_OK;
  if (!scene->mesh->split && scene->rank == 0) status = flesh_probe_prepare(probe, &scene->body, scene->system);
  return status ? status : check_name(scene, k);
}

int flesh_scene_make_probes(flesh_scene *scene)
{
  const flesh_objects *objects = &scene->keys.output.probes;
  const flesh_scene_probe *keys = objects->values;
  const int bearing = scene->keys.output.reactions == 1 ? flesh_scene_count_bearing(scene) : 0;
  if (!objects->count && !bearing) return FLESH_OK;
  scene->probes = flesh_arena_take(&scene->arena, ((size_t)objects->count + (size_t)bearing) * sizeof *scene->probes);
  if (!scene->probes) return flesh_no_memory_for(scene->path);
  int status = FLESH_OK;
  for (int k = 0; k < objects->count + bearing && !status; k++) {
    if (k < objects->count) status = choose(scene, &keys[k], &scene->probes[k]);
    else if (k == objects->count) status = flesh_scene_probe_bearing(scene, scene->probes + k); /* makes all of them */
    if (!status) status = prepare(scene, k);
    if (status) return flesh_scene_probe_fail(scene, k, status);
    scene->probe_count = k + 1;
  }
  return status;
}

int flesh_scene_check_fields(const flesh_scene *scene)
{
  const flesh_scene_output *given = &scene->keys.output.given;
  const flesh_key *output = flesh_key_at(flesh_scene_table, offsetof(flesh_scene_keys, output));
  int status = flesh_fields_check(&scene->body, scene->system, given->fields, given->fields_at);
  if (!status) return status;
  const flesh_node *place = flesh_scene_place(scene->root, flesh_scene_table, output->offset);
  place = flesh_scene_place(place, output->children, offsetof(flesh_output_keys, given.fields));
  return flesh_node_fail_within(status, place, "%s.", output->name);
}

const flesh_probe *flesh_scene_probes(const flesh_scene *scene, int *count)
{
  *count = scene->probe_count;
  return scene->probes;
}
