/* build.c: from a scene's keys to the body's arrays and the system of its effects. */
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/stop.h"
#include "base/text.h"
#include "effect/effect.h"
#include "mesh/mesh.h"
#include "mesh/split_part.h"
#include "scene/effect_rows.h"
#include "scene/effect_list.h"
#include "scene/keys.h"
#include "scene/scene.h"
#include "system/internal.h"
#include "system/parts.h"

static int no_memory(const flesh_scene *scene)
{
  return flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory", scene->path);
}

const flesh_node *flesh_scene_place(const flesh_node *above, const flesh_key *keys, size_t offset)
{
  const flesh_key *key = flesh_key_at(keys, offset);
  const flesh_node *node = key ? flesh_node_find(above, key->name) : NULL;
  return node && !node->removed ? node : above;
}

/* A region tag and the entry of body.regions that is for it. */
typedef struct tagged {
  int tag, entry, item, used;
} tagged;

static int compare_tags(const void *a, const void *b)
{
  int left = ((const tagged *)a)->tag, right = ((const tagged *)b)->tag;
  return (left > right) - (left < right);
}

/* "1, 2, 7": the tags that the mesh has, cut when many. */
static void list_mesh_tags(const flesh_mesh *mesh, char *text, size_t size)
{
  enum { LISTED = 12 };
  const int *regions = flesh_mesh_regions(mesh);
  int tets = flesh_mesh_tet_count(mesh), smallest_left = 0;
  text[0] = 0;
  for (int n = 0; n <= LISTED; n++) {
    int found = 0, next = 0;
    for (int t = 0; t < tets; t++)
      if ((!n || regions[t] > smallest_left) && (!found || regions[t] < next))
        found = 1, next = regions[t];
    if (!found) return;
    flesh_text_add(text, size, n == LISTED ? ", ..." : n ? ", %d" : "%d", next);
    smallest_left = next;
  }
}

/* Fails at item `item` of the tags of entry `entry`. */
static int bad_tag(const flesh_node *regions, const tagged *tag, const char *sentence)
{
  const flesh_key *body = flesh_key_at(flesh_scene_table, offsetof(flesh_scene_keys, body));
  const flesh_key *list =
      flesh_key_at(body->children, offsetof(flesh_scene_keys, body.regions) - body->offset);
  const flesh_key *tags = flesh_key_at(list->children, offsetof(flesh_scene_region, tags));
  const flesh_node *node = flesh_node_item(regions, tag->entry);
  node = flesh_node_item(flesh_scene_place(node, list->children, tags->offset), tag->item);
  return flesh_node_fail(node, "%s.%s[%d].%s[%d] is %d; %s", body->name, list->name, tag->entry,
                         tags->name, tag->item, tag->tag, sentence);
}

/* All tags of all entries, ascending; refuses a tag that stands twice. */
static int collect_tags(flesh_scene *scene, const flesh_node *regions, int *count, tagged **tags)
{
  const flesh_objects *list = &scene->keys.body.regions;
  const flesh_scene_region *entries = list->values;
  size_t total = 0;
  for (int e = 0; e < list->count; e++) total += (size_t)entries[e].tags.count;
  *tags = flesh_arena_take(&scene->arena, total * sizeof **tags);
  if (!*tags) return no_memory(scene);
  *count = 0;
  for (int e = 0; e < list->count; e++)
    for (int i = 0; i < entries[e].tags.count; i++)
      (*tags)[(*count)++] = (tagged){.tag = entries[e].tags.values[i], .entry = e, .item = i};
  qsort(*tags, (size_t)*count, sizeof **tags, compare_tags);
  for (int i = 1; i < *count; i++)
    if ((*tags)[i].tag == (*tags)[i - 1].tag)
      return bad_tag(regions, &(*tags)[i], "a tag must stand only once in all regions");
  return FLESH_OK;
}

/* Makes the body's material first and then those of the regions; of_region[e] is the index for
 * region e, `base` that of the body or -1. */
static int make_materials(flesh_scene *scene, const flesh_node *body_node,
                          const flesh_node *regions, int *base, int *of_region)
{
  const flesh_key *body = flesh_key_at(flesh_scene_table, offsetof(flesh_scene_keys, body));
  const flesh_key *list =
      flesh_key_at(body->children, offsetof(flesh_scene_keys, body.regions) - body->offset);
  const flesh_key *key =
      flesh_key_at(body->children, offsetof(flesh_scene_keys, body.material) - body->offset);
  const flesh_key *region_key =
      flesh_key_at(list->children, offsetof(flesh_scene_region, material));
  flesh_objects *objects = &scene->keys.body.regions;
  scene->materials =
      flesh_arena_take(&scene->arena, ((size_t)objects->count + (size_t)scene->keys.bodies.count + 1) *
                                          sizeof *scene->materials);
  scene->material_elements =
      flesh_arena_take(&scene->arena, ((size_t)objects->count + (size_t)scene->keys.bodies.count + 1) *
                                          sizeof *scene->material_elements);
  if (!scene->materials || !scene->material_elements) return no_memory(scene);
  *base = -1;
  int status = FLESH_OK;
  if (scene->keys.body.material.energy >= 0) {
    *base = scene->material_count++;
    char *path = flesh_key_path(&scene->arena, body->name, key->name);
    if (!path) return no_memory(scene);
    status = flesh_scene_make_material(flesh_scene_place(body_node, body->children, key->offset), path,
                                       &scene->keys.body.material, flesh_scene_element(scene, 0), &scene->materials[0]);
  }
  flesh_scene_region *entries = objects->values;
  for (int e = 0; !status && e < objects->count; e++) {
    of_region[e] = *base;
    if (entries[e].material.energy < 0) continue;
    of_region[e] = scene->material_count++;
    char *path = flesh_arena_print(&scene->arena, "%s.%s[%d].%s", body->name, list->name, e,
                                   region_key->name);
    if (!path) return no_memory(scene);
    const flesh_node *node =
        flesh_scene_place(flesh_node_item(regions, e), list->children, region_key->offset);
    status = flesh_scene_make_material(node, path, &entries[e].material, flesh_scene_element(scene, 0),
                                       &scene->materials[of_region[e]]);
  }
  return status;
}

static int needs_material(const flesh_scene *scene)
{
  const flesh_scene_other *others = scene->keys.bodies.values;
  int needed = scene->material_count > 0;
  for (int k = 0; k < scene->keys.bodies.count; k++) needed |= others[k].material.energy >= 0;
  return needed;
}

/* Gives the first body's tets the materials that body.material_map says. */
static int map_materials(flesh_scene *scene, const flesh_node *body_node, int base, const int *of_region, int *tet_material)
{
  const flesh_scene_region *entries = scene->keys.body.regions.values;
  if (!scene->keys.body.material_map) return FLESH_OK;
  const flesh_key *body = flesh_key_at(flesh_scene_table, offsetof(flesh_scene_keys, body));
  const flesh_scene_material **of = flesh_arena_take(&scene->arena, ((size_t)scene->material_count + 1) * sizeof *of);
  if (!of) return no_memory(scene);
  for (int m = 0; m < scene->material_count; m++) of[m] = NULL;
  for (int e = 0; e < scene->keys.body.regions.count; e++)
    if (of_region[e] >= 0) of[of_region[e]] = &entries[e].material;
  if (base >= 0) of[base] = &scene->keys.body.material;
  const flesh_node *place = flesh_scene_place(body_node, body->children,
                                              offsetof(flesh_scene_keys, body.material_map) - body->offset);
  const int status = flesh_scene_map_materials(scene, of, tet_material);
  return status ? flesh_node_fail_within(status, place, "body.material_map: ") : FLESH_OK;
}

/* Gives every tet its density and material. */
static int assign_tets(flesh_scene *scene, const flesh_node *body_node, const flesh_node *regions,
                       int base, const int *of_region)
{
  int tets = flesh_mesh_tet_count(scene->mesh), count = 0;
  const int *mesh_tags = flesh_mesh_regions(scene->mesh);
  const flesh_scene_region *entries = scene->keys.body.regions.values;
  tagged *tags = NULL;
  int status = collect_tags(scene, regions, &count, &tags);
  if (status) return status;
  double *density = flesh_arena_take(&scene->arena, (size_t)tets * sizeof *density);
  int *tet_material = flesh_arena_take(&scene->arena, (size_t)tets * sizeof *tet_material);
  if (!density || !tet_material) return no_memory(scene);
  const int own = scene->parts[0].tets; /* the regions are those of the body's own mesh */
  for (int t = 0; t < own; t++) {
    tagged wanted = {.tag = mesh_tags[t]};
    tagged *found =
        count ? bsearch(&wanted, tags, (size_t)count, sizeof *tags, compare_tags) : NULL;
    density[t] = scene->keys.body.density;
    tet_material[t] = base;
    if (found) {
      found->used = 1;
      if (!isnan(entries[found->entry].density)) density[t] = entries[found->entry].density;
      tet_material[t] = of_region[found->entry];
    }
    if (tet_material[t] < 0 && needs_material(scene))
      return flesh_node_fail(
          body_node,
          "the tets with region tag %d have no material; it must be given for the "
          "whole body or for every region",
          mesh_tags[t]);
  }
  for (int i = 0; i < count; i++)
    if (!tags[i].used && !flesh_split_has_region(scene->mesh->split, tags[i].tag)) {
      char existing[200], sentence[260];
      list_mesh_tags(scene->mesh, existing, sizeof existing);
      snprintf(sentence, sizeof sentence, "it must be a region tag of the mesh: %s", existing);
      return bad_tag(regions, &tags[i], sentence);
    }
  if ((status = flesh_scene_assign_bodies(scene, base, density, tet_material)) ||
      (status = map_materials(scene, body_node, base, of_region, tet_material)))
    return status;
  scene->body = (flesh_body){.mesh = scene->mesh,
                             .density = density,
                             .materials = scene->material_count ? scene->materials : NULL,
                             .tet_material = scene->material_count > 1 ? tet_material : NULL,
                             .mass = (flesh_mass)scene->keys.body.mass,
                             .element = (flesh_element)scene->keys.body.element,
                             .material_elements = scene->part_count > 1 ? scene->material_elements : NULL,
                             .part_count = scene->part_count,
                             .parts = scene->parts};
  return FLESH_OK;
}

int flesh_scene_make_body(flesh_scene *scene)
{
  const flesh_key *body = flesh_key_at(flesh_scene_table, offsetof(flesh_scene_keys, body));
  const flesh_node *body_node = flesh_scene_place(scene->root, flesh_scene_table, body->offset);
  const flesh_node *regions = flesh_scene_place(
      body_node, body->children, offsetof(flesh_scene_keys, body.regions) - body->offset);
  int base = -1, *of_region = flesh_arena_take(
                     &scene->arena, (size_t)scene->keys.body.regions.count * sizeof *of_region);
  if (!of_region) return no_memory(scene);
  int status = make_materials(scene, body_node, regions, &base, of_region);
  return status ? status : assign_tets(scene, body_node, regions, base, of_region);
}

/* Appends elasticity when the body has a material and the list does not name it; refuses it without
 * one. */
static int complete_effects(flesh_scene *scene)
{
  const flesh_effect_row *elasticity = flesh_effect_row_named("elasticity");
  flesh_objects *list = &scene->keys.effects;
  flesh_effect_entry *entries = list->values;
  int listed = 0;
  for (int i = 0; i < list->count; i++) {
    if (entries[i].row != elasticity) continue;
    listed = 1;
    if (!scene->body.materials)
      return flesh_node_fail_at_key(entries[i].node, "%s needs body.material, which is missing",
                                    entries[i].path);
    const flesh_elasticity_parameters *parameters = entries[i].parameters;
    scene->body.instructions = (flesh_instructions)parameters->instructions;
  }
  if (listed || !scene->body.materials) return FLESH_OK;
  flesh_effect_entry *longer =
      flesh_arena_take(&scene->arena, ((size_t)list->count + 1) * sizeof *longer);
  void *parameters = flesh_arena_take(&scene->arena, elasticity->parameters_size);
  if (!longer || !parameters) return no_memory(scene);
  if (list->count) memcpy(longer, entries, (size_t)list->count * sizeof *longer);
  longer[list->count++] = (flesh_effect_entry){.row = elasticity, .parameters = parameters, .path = elasticity->name};
  list->values = longer;
  flesh_key_reader reader = {.arena = &scene->arena};
  return flesh_keys_read(&reader, elasticity->keys, NULL, scene->root, elasticity->name,
                         parameters);
}

int flesh_scene_has_inertia(const flesh_scene *scene)
{
  const flesh_effect_row *inertia = flesh_effect_row_named("inertia");
  const flesh_effect_entry *entries = scene->keys.effects.values;
  for (int i = 0; i < scene->keys.effects.count; i++)
    if (entries[i].row == inertia) return 1;
  return 0;
}

/* Whether the scene asks for an equilibrium, where gravity's exact load is wanted and no free fall. */
static int is_static(const flesh_scene *scene)
{
  return scene->keys.time.method == FLESH_METHOD_STATIC || !flesh_scene_has_inertia(scene);
}

/* Incompressible tets have pressures, which a start has of the whole. */
static int has_pressures(const flesh_scene *scene)
{
  int some = 0;
  for (int k = 0; k < scene->material_count; k++) some |= scene->materials[k].incompressible;
  return some;
}

/* Adds what the entry says to the system. Where that is not observed, on all ranks but the first, and of a part of a split
 * mesh, sums over tets are made with the rank's own system alone (share.c). `found`: what a selection found here. */
static int add_entry(flesh_scene *scene, flesh_effect_entry *entry)
{
  flesh_split_part *split = scene->mesh->split;
  const int constraints = scene->system->constraint_count, effects = flesh_system_effect_count(scene->system);
  entry->found = -1;
  const int by_parts = split || (scene->rank > 0 && !has_pressures(scene));
  if (by_parts && entry->row->on_parts == FLESH_PARTS_TETS) return FLESH_OK;
  if (split) split->found = -1;
  const int status = entry->row->add(entry->parameters, &scene->body, scene->system);
  if (status)
    return flesh_node_fail_within(status, entry->node ? entry->node : scene->root, "%s: ", entry->path);
  if (split) entry->found = split->found;
  if (scene->system->constraint_count > constraints) entry->constraint = constraints + 1;
  if (flesh_system_effect_count(scene->system) > effects) entry->effect = effects + 1;
  return FLESH_OK;
}

static int has_internals(const flesh_system *system)
{
  int count = 0;
  for (int k = 0; k < flesh_system_effect_count(system); k++)
    count += flesh_effect_internal_count(flesh_system_effect(system, k));
  return count > 0;
}

int flesh_scene_make_system(flesh_scene *scene)
{
  int status = complete_effects(scene);
  if (status) return status;
  if (flesh_mesh_order(scene->mesh) == 2 && is_static(scene)) scene->body.mass = FLESH_MASS_CONSISTENT;
  const flesh_node *list =
      flesh_scene_place(scene->root, flesh_scene_table, offsetof(flesh_scene_keys, effects));
  if (!scene->keys.effects.count)
    return flesh_node_fail(
        list, "the scene has neither effects nor a material; nothing acts on the body");
  if ((status = flesh_system_create(scene->mesh, &scene->system)))
    return flesh_fail_within(status, "%s: ", scene->path);
  flesh_effect_entry *entries = scene->keys.effects.values;
  for (int i = 0; i < scene->keys.effects.count; i++)
    if ((status = flesh_stop_ask_before((size_t)flesh_mesh_tet_count(scene->mesh))) ||
        (status = add_entry(scene, &entries[i])))
      return status;
  if (!scene->mesh->split && (status = flesh_system_settle_internals(scene->system)))
    return flesh_fail_within(status, "%s: ", scene->path);
  /* A rank steps a system of its own; the first alone observes this one, which is the whole's. Internal variables are all
   * ranks'. */
  if (scene->mesh->split || (scene->rank > 0 && !has_internals(scene->system))) return FLESH_OK;
  status = flesh_system_finalize(scene->system);
  return status ? flesh_fail_within(status, "%s: ", scene->path) : FLESH_OK;
}
