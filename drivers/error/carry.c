/* carry.c: selections by place become named sets of the mesh. */
#include "error/carry.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/text.h"
#include "mesh/edges.h"
#include "mesh/mesh.h"
#include "scene/effect_list.h"
#include "scene/scene.h"

typedef struct carry {
  const flesh_scene *scene;
  flesh_overrides *overrides;
  flesh_mesh_sets sets;
  int quiet;
} carry;

/* PATH.key=value. */
static int override(carry *c, const char *path, const char *key, const char *value)
{
  char *name = flesh_text_new("%s.%s", path, key);
  if (!name) return flesh_no_memory();
  flesh_overrides_add(c->overrides, name, value);
  free(name);
  return FLESH_OK;
}

/* Leaves the chosen corners, and the nodes of edges between two of them, which refined meshes carry on. A box that ends
 * within tets has others, at which parts of faces would be loaded and held on the first mesh alone. */
static int keep_whole_edges(const flesh_mesh *mesh, int *count, int *nodes)
{
  uint8_t *chosen = calloc((size_t)mesh->nodes + 1, 1);
  if (!chosen) return flesh_no_memory();
  for (int k = 0; k < *count; k++) chosen[nodes[k]] = 1;
  for (int t = 0; t < mesh->tets; t++)
    for (int e = 0; e < 6 && flesh_mesh_is_quadratic(mesh, t); e++) {
      const int *corners = mesh->tet_nodes + 4 * (size_t)t, *ends = flesh_edge_corners[e];
      if (!chosen[corners[ends[0]]] || !chosen[corners[ends[1]]]) chosen[mesh->edge_nodes[6 * (size_t)t + (size_t)e]] = 0;
    }
  const int all = *count;
  *count = 0;
  for (int k = 0; k < all; k++)
    if (chosen[nodes[k]]) nodes[(*count)++] = nodes[k];
  free(chosen);
  return FLESH_OK;
}

/* Makes a set of the nodes that a selection takes by place or number; of its regions the tets stay what they are. */
static int carry_selection(void *data, const flesh_selection *selection, const char *path)
{
  carry *c = data;
  flesh_selection by_place = *selection;
  char name[48];
  int set, count, *nodes;
  if (isnan(selection->box[0]) && isnan(selection->sphere.radius) && !selection->nodes.count) return FLESH_OK;
  if (selection->set)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s has a set beside box, sphere or nodes; --to carries one or the other", path);
  by_place.regions.count = 0;
  int status = flesh_selection_nodes(&by_place, &c->scene->body, &count, &nodes);
  if (status) return flesh_fail_within(status, "%s: ", path);
  const int given = count;
  if (!selection->nodes.count) status = keep_whole_edges(c->scene->mesh, &count, nodes); /* a list means its nodes */
  if (!status && !count)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s has nodes within edges of the mesh and no corner of a tet; --to carries whole "
                                            "edges and faces", path);
  if (!status && count < given && !c->quiet)
    fprintf(stderr, "flesh: warning: %s ends within tets: --to takes whole edges and faces, and leaves out %d of its %d nodes\n",
            path, given - count, given);
  snprintf(name, sizeof name, "selection_%d", c->sets.count);
  if (!status) status = flesh_mesh_sets_take(&c->sets, name, strlen(name), &set);
  for (int k = 0; k < count && !status; k++) status = flesh_members_add(&c->sets.sets[set].nodes, nodes[k]);
  free(nodes);
  if (!status && !isnan(selection->box[0])) status = override(c, path, "box", "null");
  if (!status && !isnan(selection->sphere.radius)) status = override(c, path, "sphere", "null");
  if (!status && selection->nodes.count) status = override(c, path, "nodes", "null");
  return status ? status : override(c, path, "set", name);
}

/* Sees the selections of a mapping with these keys, whose values are in `target`. A selection's keys begin with its box. */
static int see_keys(const flesh_key *keys, const void *target, const char *path, flesh_error_see *see, void *data)
{
  int status = FLESH_OK;
  for (; keys && keys->name && !status; keys++) {
    const char *value = (const char *)target + keys->offset;
    if (keys->type == FLESH_KEY_BOX && !strcmp(keys->name, "box") && keys[1].name && !strcmp(keys[1].name, "sphere"))
      status = see(data, (const flesh_selection *)(const void *)value, path);
    else if (keys->type == FLESH_KEY_OBJECT && strcmp(keys->name, "sphere")) {
      char *below = flesh_text_new("%s.%s", path, keys->name);
      status = below ? see_keys(keys->children, value, below, see, data) : flesh_no_memory();
      free(below);
    }
  }
  return status;
}

int flesh_error_selections(const flesh_scene *scene, flesh_error_see *see, void *data)
{
  const flesh_effect_entry *entries = scene->keys.effects.values;
  int status = FLESH_OK;
  for (int k = 0; k < scene->keys.effects.count && !status; k++) {
    if (!entries[k].path || !entries[k].node) continue;
    status = see_keys(entries[k].row->keys, entries[k].parameters, entries[k].path, see, data);
  }
  return status;
}

static int carry_probes(carry *c)
{
  const flesh_scene_probe *probes = c->scene->keys.output.probes.values;
  int status = FLESH_OK;
  for (int k = 0; k < c->scene->keys.output.probes.count && !status; k++) {
    char path[48];
    snprintf(path, sizeof path, "output.probes[%d]", k);
    status = carry_selection(c, &probes[k].selection, path);
  }
  return status;
}

int flesh_error_carry(const flesh_scene *scene, int quiet, flesh_overrides *overrides, flesh_mesh **mesh)
{
  const flesh_mesh *given = scene->mesh;
  carry c = {.scene = scene, .overrides = overrides, .quiet = quiet};
  *mesh = NULL;
  int status = flesh_mesh_sets_append(&c.sets, &given->sets, &(flesh_mesh_sets_map){0});
  if (!status) status = flesh_error_selections(scene, carry_selection, &c);
  if (!status) status = carry_probes(&c);
  flesh_mesh_sets_settle(&c.sets);
  if (!status)
    status = flesh_mesh_build(&(flesh_mesh_lists){.nodes = given->nodes, .tets = given->tets, .positions = given->positions,
                                                  .tet_nodes = given->tet_nodes, .edge_nodes = given->edge_nodes,
                                                  .regions = given->regions, .sets = &c.sets}, NULL, mesh);
  flesh_mesh_sets_clear(&c.sets);
  return status;
}
