/* bodies.c: the bodies beside the first: moves their meshes into place and joins them into one mesh. */
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "geometry/motion.h"
#include "mesh/mesh.h"
#include "scene/keys.h"
#include "scene/scene.h"

/* Return the key `bodies`, its list, and the node to which an error about the key at `offset` of entry k refers. */
static const flesh_key *list_key(void)
{
  return flesh_key_at(flesh_scene_table, offsetof(flesh_scene_keys, bodies));
}

static const flesh_node *place_of(const flesh_scene *scene, int k, size_t offset)
{
  const flesh_node *list = flesh_scene_place(scene->root, flesh_scene_table, list_key()->offset);
  return flesh_scene_place(flesh_node_item(list, k), list_key()->children, offset);
}

/* A mesh being joined from several. */
typedef struct join {
  double *X;
  int *tets, *edges, *regions; /* edges: [6*tet_count], -1 for tets of four nodes */
  int *ends; /* [2*nodes] */
  int nodes, tet_count;
  flesh_mesh_sets sets; /* sets of the same name in several bodies become one */
} join;

static int append(join *j, const flesh_mesh *mesh, const flesh_scene_other *other)
{
  int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  double *X = realloc(j->X, 3 * ((size_t)j->nodes + (size_t)nodes) * sizeof *X);
  if (X) j->X = X;
  int *numbers = realloc(j->tets, 4 * ((size_t)j->tet_count + (size_t)tets) * sizeof *numbers);
  if (numbers) j->tets = numbers;
  int *regions = realloc(j->regions, ((size_t)j->tet_count + (size_t)tets) * sizeof *regions);
  if (regions) j->regions = regions;
  int *edges = realloc(j->edges, 6 * ((size_t)j->tet_count + (size_t)tets) * sizeof *edges);
  if (edges) j->edges = edges;
  int *ends = realloc(j->ends, 2 * ((size_t)j->nodes + (size_t)nodes) * sizeof *ends);
  if (ends) j->ends = ends;
  if (!X || !numbers || !regions || !edges || !ends) return 1;
  if (flesh_mesh_sets_append(&j->sets, &mesh->sets,
                             &(flesh_mesh_sets_map){.first_node = j->nodes, .first_tet = j->tet_count}))
    return 1;
  for (size_t k = 0; k < 6 * (size_t)tets; k++) {
    const int own = flesh_mesh_order(mesh) == 2 ? flesh_mesh_tet_edges(mesh)[k] : -1;
    edges[6 * (size_t)j->tet_count + k] = own < 0 ? -1 : own + j->nodes;
  }
  for (size_t k = 0; k < 2 * (size_t)nodes; k++)
    ends[2 * (size_t)j->nodes + k] = j->nodes + (mesh->ends ? mesh->ends[k] : (int)(k / 2));
  flesh_keyframe place = {0};
  for (int c = 0; other && c < 3; c++) {
    place.translation[c] = other->translation[c];
    place.rotation[c] = other->rotation[c];
  }
  const flesh_motion motion = {1, &place, {0}, 0};
  for (int i = 0; i < nodes; i++)
    flesh_motion_apply(&motion, 0, flesh_mesh_positions(mesh) + 3 * (size_t)i,
                       X + 3 * ((size_t)j->nodes + (size_t)i));
  for (size_t k = 0; k < 4 * (size_t)tets; k++)
    numbers[4 * (size_t)j->tet_count + k] = flesh_mesh_tets(mesh)[k] + j->nodes;
  memcpy(regions + j->tet_count, flesh_mesh_regions(mesh), (size_t)tets * sizeof *regions);
  j->nodes += nodes;
  j->tet_count += tets;
  return 0;
}

static flesh_element element_of(const flesh_scene *scene, const flesh_scene_other *other)
{
  return (flesh_element)(other->element >= 0 ? other->element : scene->keys.body.element);
}

flesh_element flesh_scene_element(const flesh_scene *scene, int body)
{
  const flesh_scene_other *others = scene->keys.bodies.values;
  const flesh_body_part *part = &scene->parts[body];
  const flesh_element given = body ? element_of(scene, others + body - 1) : (flesh_element)scene->keys.body.element;
  int ten = 0;
  if (given != FLESH_ELEMENT_AUTO) return given;
  for (int t = part->first_tet; t < part->first_tet + part->tets; t++) ten += flesh_mesh_is_quadratic(scene->mesh, t);
  return !ten ? FLESH_ELEMENT_TET4 : ten == part->tets ? FLESH_ELEMENT_TET10_MEAN : FLESH_ELEMENT_AUTO;
}

static int append_other(flesh_scene *scene, int k, join *j)
{
  flesh_scene_other *other = (flesh_scene_other *)scene->keys.bodies.values + k;
  const flesh_node *place = place_of(scene, k, offsetof(flesh_scene_other, mesh));
  flesh_mesh *mesh = NULL;
  char body[40];
  for (int p = 0; p <= k; p++)
    if (!strcmp(scene->parts[p].name, other->name))
      return flesh_node_fail(place_of(scene, k, offsetof(flesh_scene_other, name)),
                             "%s[%d].name is '%s'; another body has that name already", list_key()->name, k,
                             other->name);
  int status = flesh_mesh_read(other->mesh, &mesh);
  snprintf(body, sizeof body, "%s[%d]", list_key()->name, k);
  if (!status) status = flesh_scene_make_absolute(scene, &other->mesh);
  if (status) status = flesh_fail_within(status, "%s.mesh: ", body);
  else status = flesh_scene_fit_mesh(scene, body, element_of(scene, other), &other->curved, &mesh);
  if (status) {
    flesh_mesh_destroy(&mesh);
    return flesh_node_fail_within(status, place, "%s", "");
  }
  scene->parts[k + 1] = (flesh_body_part){other->name, j->tet_count, flesh_mesh_tet_count(mesh)};
  status = append(j, mesh, other) ? flesh_no_memory_for(scene->path) : FLESH_OK;
  scene->part_nodes[k + 2] = j->nodes;
  flesh_mesh_destroy(&mesh);
  return status;
}

int flesh_scene_join_bodies(flesh_scene *scene)
{
  const int count = scene->keys.bodies.count;
  join j = {0};
  flesh_mesh *joined = NULL;
  scene->parts = flesh_arena_take(&scene->arena, ((size_t)count + 1) * sizeof *scene->parts);
  scene->part_nodes = flesh_arena_take(&scene->arena, ((size_t)count + 2) * sizeof *scene->part_nodes);
  if (!scene->parts || !scene->part_nodes) return flesh_no_memory_for(scene->path);
  scene->part_count = count + 1;
  scene->parts[0] = (flesh_body_part){scene->keys.body.name, 0, flesh_mesh_tet_count(scene->mesh)};
  if (!count) return FLESH_OK;
  int status = append(&j, scene->mesh, NULL) ? flesh_no_memory_for(scene->path) : FLESH_OK;
  scene->part_nodes[0] = 0;
  scene->part_nodes[1] = j.nodes;
  for (int k = 0; !status && k < count; k++) status = append_other(scene, k, &j);
  if (!status) {
    status = flesh_mesh_build(&(flesh_mesh_lists){.nodes = j.nodes, .tets = j.tet_count, .positions = j.X,
                                                  .tet_nodes = j.tets, .edge_nodes = j.edges, .regions = j.regions,
                                                  .ends = j.ends, .sets = &j.sets},
                              NULL, &joined);
    if (status)
      flesh_node_fail_within(status, flesh_scene_place(scene->root, flesh_scene_table, list_key()->offset),
                             "%s: the mesh of all bodies in their places: ", list_key()->name);
  }
  free(j.X);
  free(j.tets);
  free(j.edges);
  free(j.ends);
  free(j.regions);
  flesh_mesh_sets_clear(&j.sets);
  if (status) return status;
  flesh_mesh_destroy(&scene->mesh);
  scene->mesh = joined;
  return FLESH_OK;
}

int flesh_scene_assign_bodies(flesh_scene *scene, int base, double *density, int *tet_material)
{
  flesh_scene_other *others = scene->keys.bodies.values;
  const flesh_element body_element = (flesh_element)scene->keys.body.element;
  for (int k = 0; k < scene->keys.bodies.count; k++) {
    int material = base;
    if (others[k].material.energy >= 0) {
      material = scene->material_count++;
      char *path = flesh_arena_print(&scene->arena, "%s[%d].material", list_key()->name, k);
      if (!path) return flesh_no_memory_for(scene->path);
      int status = flesh_scene_make_material(place_of(scene, k, offsetof(flesh_scene_other, material)), path,
                                             &others[k].material, flesh_scene_element(scene, k + 1),
                                             &scene->materials[material]);
      if (status) return status;
    }
    if (material == base && base >= 0 && element_of(scene, &others[k]) != body_element) {
      material = scene->material_count++;
      scene->materials[material] = scene->materials[base];
    }
    if (material >= 0 && material != base) scene->material_elements[material] = flesh_scene_element(scene, k + 1);
    if (material < 0 && scene->material_count)
      return flesh_node_fail(place_of(scene, k, offsetof(flesh_scene_other, material)),
                             "%s[%d].material is missing; every body must have a material, or none of them", list_key()->name, k);
    const flesh_body_part *part = &scene->parts[k + 1];
    for (int t = part->first_tet; t < part->first_tet + part->tets; t++) {
      density[t] = isnan(others[k].density) ? scene->keys.body.density : others[k].density;
      tet_material[t] = material;
    }
  }
  return FLESH_OK;
}

void flesh_scene_start_bodies(const flesh_scene *scene, double *v)
{
  const flesh_scene_other *others = scene->keys.bodies.values;
  for (int k = 0; k < scene->keys.bodies.count; k++)
    for (int i = scene->part_nodes[k + 1]; !isnan(others[k].velocity[0]) && i < scene->part_nodes[k + 2]; i++)
      for (int c = 0; c < 3; c++) v[3 * i + c] = others[k].velocity[c];
}
