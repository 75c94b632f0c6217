/* probe_effects.c: probes of the forces of a pin, a prescribed motion, a contact, a weld or a joint of the scene. */
#include "scene/probe_effects.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "scene/effect_list.h"
#include "system/parts.h"

static int is_contact(const flesh_scene *scene, const flesh_effect_entry *entry)
{
  return entry->effect && flesh_system_effect(scene->system, entry->effect - 1)->operations->role == FLESH_ROLE_CONTACT;
}

static int bears(const flesh_scene *scene, const flesh_effect_entry *entry)
{
  return entry->constraint || is_contact(scene, entry) || (entry->effect && entry->row->bearers);
}

/* Returns how many effects of the same name are listed before the entry. */
static int index_of(const flesh_scene *scene, const flesh_effect_entry *entry)
{
  int index = 0;
  for (const flesh_effect_entry *e = scene->keys.effects.values; e < entry; e++) index += e->row == entry->row;
  return index;
}

/* Fails with a sentence such as "effect is 'pin[3]'; it must be pin, pin[1] or contact". */
static int refuse(const flesh_scene *scene, const char *word)
{
  const flesh_effect_entry *entries = scene->keys.effects.values;
  char list[400] = "";
  for (int k = 0; k < scene->keys.effects.count; k++) {
    const int index = index_of(scene, &entries[k]);
    const size_t length = strlen(list);
    if (!bears(scene, &entries[k])) continue;
    snprintf(list + length, sizeof list - length, index ? "%s%s[%d]" : "%s%s", length ? ", " : "", entries[k].row->name,
             index);
  }
  if (!*list)
    return flesh_fail(FLESH_ERR_ARGUMENT, "effect is '%s', but the scene has no pin, prescribed_motion, contact, weld or joint",
                      word);
  return flesh_fail(FLESH_ERR_ARGUMENT, "effect is '%s'; of this scene it must be one of %s", word, list);
}

/* Returns the effect that "pin" or "pin[1]" names, among those that have forces to probe; NULL: none. */
static const flesh_effect_entry *find(const flesh_scene *scene, const char *word)
{
  const flesh_effect_entry *entries = scene->keys.effects.values;
  const size_t length = strcspn(word, "[");
  char *end = NULL;
  const long index = word[length] ? strtol(word + length + 1, &end, 10) : 0;
  if (end && (end == word + length + 1 || strcmp(end, "]"))) return NULL;
  for (int k = 0; k < scene->keys.effects.count; k++)
    if (strlen(entries[k].row->name) == length && !strncmp(entries[k].row->name, word, length) &&
        index_of(scene, &entries[k]) == index)
      return bears(scene, &entries[k]) ? &entries[k] : NULL;
  return NULL;
}

/* Takes the nodes on the first side of a weld or joint. */
static int take_bearers(flesh_scene *scene, const flesh_effect_entry *entry, flesh_probe *probe)
{
  int count, *nodes = NULL, status = entry->row->bearers(entry->parameters, &scene->body, &count, &nodes);
  if (status) return status;
  int *kept = flesh_arena_take(&scene->arena, (size_t)count * sizeof *kept);
  if (kept) memcpy(kept, nodes, (size_t)count * sizeof *kept);
  free(nodes);
  if (!kept) return flesh_no_memory();
  probe->nodes = kept;
  probe->node_count = count;
  probe->holder = 0;
  probe->contact = entry->effect;
  return FLESH_OK;
}

/* Takes the effect's nodes, all for a contact, and its number in the system. */
static int take(flesh_scene *scene, const flesh_effect_entry *entry, flesh_probe *probe)
{
  if (entry->row->bearers) return take_bearers(scene, entry, probe);
  const flesh_constraint *held = entry->constraint ? &scene->system->constraints[entry->constraint - 1] : NULL;
  const int count = held ? held->count : flesh_mesh_node_count(scene->mesh);
  int *nodes = flesh_arena_take(&scene->arena, (size_t)count * sizeof *nodes);
  if (!nodes) return flesh_no_memory();
  for (int k = 0; k < count; k++) nodes[k] = held ? held->nodes[k] : k;
  probe->nodes = nodes;
  probe->node_count = count;
  probe->holder = entry->constraint;
  probe->contact = held ? 0 : entry->effect;
  return FLESH_OK;
}

int flesh_scene_probe_effect(flesh_scene *scene, const char *word, flesh_probe *probe)
{
  const flesh_effect_entry *entry = find(scene, word);
  if (!entry) return refuse(scene, word);
  const unsigned other = entry->constraint ? FLESH_PROBE_CONTACT_FORCE : FLESH_PROBE_REACTION;
  if (probe->quantities & other)
    return flesh_fail(FLESH_ERR_ARGUMENT, "quantities has %s, but %s has %s",
                      entry->constraint ? "contact_force" : "reaction", entry->row->name,
                      entry->constraint ? "reaction" : "contact_force");
  return take(scene, entry, probe);
}

int flesh_scene_count_bearing(const flesh_scene *scene)
{
  const flesh_effect_entry *entries = scene->keys.effects.values;
  int count = 0;
  for (int k = 0; k < scene->keys.effects.count; k++) count += bears(scene, &entries[k]);
  return count;
}

int flesh_scene_probe_bearing(flesh_scene *scene, flesh_probe *probes)
{
  const flesh_effect_entry *entries = scene->keys.effects.values;
  for (int k = 0, next = 0; k < scene->keys.effects.count; k++) {
    const flesh_effect_entry *entry = &entries[k];
    const size_t size = strlen(entry->row->name) + 16;
    char *name = flesh_arena_take(&scene->arena, size);
    if (!name) return flesh_no_memory();
    if (!bears(scene, entry)) continue;
    const int index = index_of(scene, entry);
    snprintf(name, size, index ? "%s_%d" : "%s", entry->row->name, index + 1);
    flesh_probe *probe = &probes[next++];
    *probe = (flesh_probe){.name = name,
                           .quantities = entry->constraint ? FLESH_PROBE_REACTION : FLESH_PROBE_CONTACT_FORCE,
                           .point = {NAN, NAN, NAN},
                           .about = {0, 0, 0}, /* the same point for all, so that their moments can be added */
                           .tet = -1};
    int status = take(scene, entry, probe);
    if (status) return status;
  }
  return FLESH_OK;
}
