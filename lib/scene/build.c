/* build.c: makes the arrays of the body and the system of its effects from a scene's keys. */
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

const flesh_node *flesh_scene_place(const flesh_node *above, const flesh_key *keys, size_t offset)
{
  const flesh_key *key = flesh_key_at(keys, offset);
  const flesh_node *node = key ? flesh_node_find(above, key->name) : NULL;
  return node && !node->removed ? node : above;
}

/* Writes the tags of the mesh, such as "1, 2, 7", cut if there are many. */
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

/* Fails with FLESH_ERR_ARGUMENT for the first tag of entry `e` that no tet of the first body has. */
static int check_tags(const flesh_scene *scene, const flesh_node *entry, int e)
{
  const flesh_integers *tags = &((const flesh_scene_region *)scene->keys.body.regions.values)[e].tets.regions;
  const int *of_mesh = flesh_mesh_regions(scene->mesh), own = scene->parts[0].tets;
  for (int i = 0; i < tags->count; i++) {
    int tet = 0;
    while (tet < own && of_mesh[tet] != tags->values[i]) tet++;
    if (tet < own || flesh_split_has_region(scene->mesh->split, tags->values[i])) continue;
    char existing[200];
    list_mesh_tags(scene->mesh, existing, sizeof existing);
    return flesh_node_fail(flesh_node_item(flesh_node_find(entry, "tags"), i),
                           "body.regions[%d].tags[%d] is %d; it must be a region tag of the mesh: %s", e, i, tags->values[i],
                           existing);
  }
  return FLESH_OK;
}

/* Makes the body's material, then those of the regions; of_region[e] is the index for region e, `base` that of the
 * body, or -1. */
static int make_materials(flesh_scene *scene, const flesh_node *body_node,
                          const flesh_node *regions, int *base, int *of_region)
{
  flesh_objects *objects = &scene->keys.body.regions;
  scene->materials =
      flesh_arena_take(&scene->arena, ((size_t)objects->count + (size_t)scene->keys.bodies.count + 1) *
                                          sizeof *scene->materials);
  scene->material_elements =
      flesh_arena_take(&scene->arena, ((size_t)objects->count + (size_t)scene->keys.bodies.count + 1) *
                                          sizeof *scene->material_elements);
  if (!scene->materials || !scene->material_elements) return flesh_no_memory_for(scene->path);
  *base = -1;
  int status = FLESH_OK;
  if (scene->keys.body.material.energy >= 0) {
    *base = scene->material_count++;
    status = flesh_scene_make_material(flesh_node_find(body_node, "material"), "body.material", &scene->keys.body.material,
                                       flesh_scene_element(scene, 0), &scene->materials[0]);
  }
  flesh_scene_region *entries = objects->values;
  for (int e = 0; !status && e < objects->count; e++) {
    of_region[e] = *base;
    if (entries[e].material.energy < 0) continue;
    of_region[e] = scene->material_count++;
    const char *path = flesh_arena_print(&scene->arena, "body.regions[%d].material", e);
    if (!path) return flesh_no_memory_for(scene->path);
    status = flesh_scene_make_material(flesh_node_find(flesh_node_item(regions, e), "material"), path, &entries[e].material,
                                       flesh_scene_element(scene, 0), &scene->materials[of_region[e]]);
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

/* Gives the first body's tets the materials of the file body.material_map. */
static int map_materials(flesh_scene *scene, const flesh_node *body_node, int base, const int *of_region, int *tet_material)
{
  const flesh_scene_region *entries = scene->keys.body.regions.values;
  if (!scene->keys.body.material_map) return FLESH_OK;
  const flesh_key *body = flesh_key_at(flesh_scene_table, offsetof(flesh_scene_keys, body));
  const flesh_scene_material **of = flesh_arena_take(&scene->arena, ((size_t)scene->material_count + 1) * sizeof *of);
  if (!of) return flesh_no_memory_for(scene->path);
  for (int m = 0; m < scene->material_count; m++) of[m] = NULL;
  for (int e = 0; e < scene->keys.body.regions.count; e++)
    if (of_region[e] >= 0) of[of_region[e]] = &entries[e].material;
  if (base >= 0) of[base] = &scene->keys.body.material;
  const flesh_node *place = flesh_scene_place(body_node, body->children,
                                              offsetof(flesh_scene_keys, body.material_map) - body->offset);
  const int status = flesh_scene_map_materials(scene, of, tet_material);
  return status ? flesh_node_fail_within(status, place, "body.material_map: ") : FLESH_OK;
}

/* Chooses the tets of entry `e`; entry_of[t] is the entry of tet t, or -1. */
static int choose_region(const flesh_scene *scene, const flesh_node *regions, int e, int *entry_of)
{
  const flesh_node *node = flesh_node_item(regions, e);
  flesh_tet_selection tets = ((const flesh_scene_region *)scene->keys.body.regions.values)[e].tets;
  if (!tets.regions.count && !tets.set && isnan(tets.box[0]))
    return flesh_node_fail(node, "body.regions[%d] chooses no tets; it must give tags, set or box", e);
  int status = check_tags(scene, node, e);
  if (status) return status;
  const flesh_body body = {.mesh = scene->mesh, .part_count = scene->part_count, .parts = scene->parts};
  flesh_chosen_fibres chosen;
  tets.body = scene->keys.body.name; /* regions apply to the mesh of the first body */
  status = flesh_tets_choose(&tets, &body, &chosen);
  if (status) status = flesh_node_fail_within(status, node, "body.regions[%d]: ", e);
  for (int k = 0; !status && k < chosen.count; k++) {
    int *entry = &entry_of[chosen.tets[k]];
    if (*entry >= 0)
      status = flesh_node_fail(node, "body.regions[%d] chooses tet %d, which body.regions[%d] has; regions must not overlap",
                               e, chosen.tets[k], *entry);
    *entry = e;
  }
  flesh_fibres_free(&chosen);
  return status;
}

/* Gives the tets of the first body its density and material, or those of their regions. */
static int assign_own(const flesh_scene *scene, const flesh_node *regions, int base, const int *of_region, double *density,
                      int *tet_material)
{
  const flesh_objects *list = &scene->keys.body.regions;
  const flesh_scene_region *entries = list->values;
  const int own = scene->parts[0].tets;
  int status = FLESH_OK;
  for (int t = 0; t < own; t++) tet_material[t] = -1;
  for (int e = 0; !status && e < list->count; e++) status = choose_region(scene, regions, e, tet_material);
  for (int t = 0; !status && t < own; t++) {
    const int e = tet_material[t];
    density[t] = e >= 0 && !isnan(entries[e].density) ? entries[e].density : scene->keys.body.density;
    tet_material[t] = e >= 0 ? of_region[e] : base;
    if (tet_material[t] < 0 && needs_material(scene))
      return flesh_node_fail(flesh_scene_place(scene->root, flesh_scene_table, offsetof(flesh_scene_keys, body)),
                             "the tets with region tag %d have no material; it must be given for the "
                             "whole body or for every region",
                             flesh_mesh_regions(scene->mesh)[t]);
  }
  return status;
}

/* Gives every tet its density and material. */
static int assign_tets(flesh_scene *scene, const flesh_node *body_node, const flesh_node *regions,
                       int base, const int *of_region)
{
  const size_t tets = (size_t)flesh_mesh_tet_count(scene->mesh);
  double *density = flesh_arena_take(&scene->arena, tets * sizeof *density);
  int *tet_material = flesh_arena_take(&scene->arena, tets * sizeof *tet_material);
  if (!density || !tet_material) return flesh_no_memory_for(scene->path);
  int status = assign_own(scene, regions, base, of_region, density, tet_material);
  if (status || (status = flesh_scene_assign_bodies(scene, base, density, tet_material)) ||
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
  if (!of_region) return flesh_no_memory_for(scene->path);
  int status = make_materials(scene, body_node, regions, &base, of_region);
  return status ? status : assign_tets(scene, body_node, regions, base, of_region);
}

/* Appends elasticity if the body has a material and the list does not name it; fails if the list names it and there is
 * no material. */
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
  if (!longer || !parameters) return flesh_no_memory_for(scene->path);
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

/* Returns whether the scene asks for an equilibrium; then the exact load of gravity is used, not the lumped one of free
 * fall. */
static int is_static(const flesh_scene *scene)
{
  return scene->keys.time.method == FLESH_METHOD_STATIC || !flesh_scene_has_inertia(scene);
}

/* Returns whether there are incompressible tets. Their pressures are part of the start, which is of the whole body. */
static int has_pressures(const flesh_scene *scene)
{
  int some = 0;
  for (int k = 0; k < scene->material_count; k++) some |= scene->materials[k].incompressible;
  return some;
}

/* Adds the effect or constraint of the entry to the system. Ranks other than the first (if no tets are incompressible),
 * and all ranks of a split mesh, skip effects that sum over tets, as their own systems make these (share.c); nobody
 * observes this system there. entry->found: number of nodes or triangles that a selection found in this part of a split
 * mesh. */
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
  /* Each rank steps a system of its own; only the first observes this one, of the whole. Internal variables are kept in
   * this one on all ranks. */
  if (scene->mesh->split || (scene->rank > 0 && !has_internals(scene->system))) return FLESH_OK;
  status = flesh_system_finalize(scene->system);
  return status ? flesh_fail_within(status, "%s: ", scene->path) : FLESH_OK;
}
