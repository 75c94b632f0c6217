/* share_probes.c: a rank's part of a scene's probes. */
#include <stdlib.h>

#include "base/error.h"
#include "scene/share.h"

void flesh_share_probes_clear(flesh_share_probes *self)
{
  for (int k = 0; k < self->count; k++) free((int *)self->probes[k].nodes);
  free(self->probes);
  *self = (flesh_share_probes){0};
}

/* Lists the probe's nodes that the part has. */
static int take_nodes(const flesh_probe *whole, const flesh_rank_part *part, flesh_probe *probe)
{
  int *nodes = malloc(((size_t)whole->node_count + 1) * sizeof *nodes), count = 0;
  if (!nodes) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a probe of %d nodes", whole->node_count);
  for (int k = 0; k < whole->node_count; k++)
    if ((nodes[count] = flesh_rank_part_find(part, whole->nodes[k])) >= 0) count++;
  probe->nodes = nodes;
  probe->node_count = count;
  return FLESH_OK;
}

/* Returns the number in the part's system of the effect with this number in the scene's system. */
static int find_effect(const flesh_scene *scene, const int *effects, int number)
{
  const flesh_effect_entry *entries = scene->keys.effects.values;
  for (int k = 0; k < scene->keys.effects.count; k++)
    if (number && entries[k].effect == number) return effects[k];
  return 0;
}

int flesh_share_probes_take(const flesh_scene *scene, const flesh_rank_part *part, const int *effects,
                            flesh_share_probes *self)
{
  int status = FLESH_OK;
  self->probes = calloc((size_t)scene->probe_count + 1, sizeof *self->probes);
  if (!self->probes) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d probes", scene->probe_count);
  for (int k = 0; k < scene->probe_count && !status; k++) {
    flesh_probe *probe = &self->probes[self->count++];
    *probe = scene->probes[k];
    probe->nodes = NULL;
    probe->contact = find_effect(scene, effects, probe->contact);
    status = take_nodes(&scene->probes[k], part, probe);
  }
  return status;
}

int flesh_share_probes_prepare(const flesh_scene *scene, const flesh_body *body, const flesh_system *system,
                               flesh_share_probes *self)
{
  for (int k = 0; k < self->count; k++) {
    const int status = flesh_probe_prepare(&self->probes[k], body, system);
    if (status) return flesh_scene_probe_fail(scene, k, status);
  }
  return FLESH_OK;
}
