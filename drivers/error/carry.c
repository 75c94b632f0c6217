/* carry.c: turns selections by place into named sets of the mesh; finds the tets that boxes of regions and muscles
 * cut. */
#include "error/meshes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/text.h"
#include "cli/path.h"
#include "mesh/edges.h"
#include "mesh/inspect.h"
#include "mesh/mesh.h"
#include "scene/effect_list.h"
#include "scene/scene.h"

typedef struct carry {
  const flesh_scene *scene;
  flesh_overrides *overrides;
  flesh_mesh_sets sets;
  int quiet;
} carry;

/* Keeps the chosen corners and the nodes of edges between two of them, which refined meshes inherit. A box that ends
 * within tets also contains other nodes; with these, parts of faces would be loaded and held only on the first mesh. */
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

/* Makes a set of the nodes that a selection chooses by place or number; its regions need none, as tets keep their
 * region. */
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
  if (!selection->nodes.count) status = keep_whole_edges(c->scene->mesh, &count, nodes); /* a list means exactly its nodes */
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
  if (!isnan(selection->box[0])) flesh_overrides_add(c->overrides, flesh_path("%s.box", path), "null");
  if (!isnan(selection->sphere.radius)) flesh_overrides_add(c->overrides, flesh_path("%s.sphere", path), "null");
  if (selection->nodes.count) flesh_overrides_add(c->overrides, flesh_path("%s.nodes", path), "null");
  flesh_overrides_add(c->overrides, flesh_path("%s.set", path), name);
  return status;
}

/* Passes on the selections in a mapping with these keys, whose values are in `target`. The keys of a selection begin
 * with its box. */
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

enum { POINTS_OF_EDGE = 16, POINTS = 816 }; /* sample points of a tet */

typedef struct work {
  const flesh_scene *scene;
  int tets, count;       /* tets of the first body; number of its regions */
  uint8_t *meets;        /* [count*tets] whether a region would choose the tet but for its box */
  int *entries, *counts; /* [tets] region of each tet, -1: none; [count+1] number of a tet's points in no region and in each */
  int *sample;           /* [count+1] a tet of no region and of each; -1: there is no such tet */
} work;

/* Lists the sample points of a tet. */
static void list_points(const flesh_mesh *mesh, int t, double (*x)[3])
{
  const int n = POINTS_OF_EDGE, *corners = mesh->tet_nodes + 4 * (size_t)t;
  for (int i = 0; i < n; i++)
    for (int j = 0; i + j < n; j++)
      for (int k = 0; i + j + k < n; k++, x++) {
        const double L[4] = {(i + .25) / n, (j + .25) / n, (k + .25) / n, (n - 1 - i - j - k + .25) / n};
        memset(*x, 0, sizeof *x);
        for (int a = 0; a < 4; a++)
          for (int c = 0; c < 3; c++) (*x)[c] += L[a] * mesh->positions[3 * (size_t)corners[a] + (size_t)c];
      }
}

static int is_within(const double box[6], const double x[3])
{
  int is = 1;
  for (int c = 0; c < 3 && !isnan(box[0]); c++) is &= x[c] >= box[c] && x[c] <= box[3 + c];
  return is;
}

/* Returns the region at a place in a tet; -1: none. */
static int region_at(const work *w, int t, const double x[3])
{
  const flesh_scene_region *regions = w->scene->keys.body.regions.values;
  for (int e = 0; e < w->count; e++)
    if (w->meets[(size_t)e * (size_t)w->tets + (size_t)t] && is_within(regions[e].tets.box, x)) return e;
  return -1;
}

/* Finds which tets are cut, and by how much. */
static void find(const work *w, flesh_cut *cut)
{
  const flesh_mesh *mesh = w->scene->mesh;
  const flesh_body *body = &w->scene->body;
  double all = 0, x[POINTS][3];
  for (int t = w->tets; t-- > 0;) {
    flesh_mesh_centre(mesh, mesh->positions, t, x[0]);
    w->entries[t] = region_at(w, t, x[0]);
    w->sample[1 + w->entries[t]] = t;
  }
  for (int t = 0; t < w->tets; t++) {
    int most = 0, wrong = 0;
    list_points(mesh, t, x);
    memset(w->counts, 0, ((size_t)w->count + 1) * sizeof *w->counts);
    for (int k = 0; k < POINTS; k++) w->counts[1 + region_at(w, t, x[k])]++;
    cut->materials[t] = body->tet_material ? body->tet_material[t] : 0;
    for (int e = 0; e <= w->count; e++) {
      const int s = w->sample[e], is_denser = s >= 0 && body->density[s] != body->density[t];
      if (s < 0 || e == 1 + w->entries[t] || !w->counts[e] ||
          !(is_denser || (body->tet_material && body->tet_material[s] != body->tet_material[t])))
        continue;
      wrong += w->counts[e];
      cut->has_density |= is_denser;
      if (w->counts[e] > most && body->tet_material) cut->materials[t] = body->tet_material[s];
      if (w->counts[e] > most) most = w->counts[e];
    }
    all += mesh->volumes[t];
    cut->count += wrong > 0;
    cut->shares[t] = (double)wrong / POINTS;
    cut->share += mesh->volumes[t] * cut->shares[t];
  }
  cut->share /= all;
}

/* Marks the tets that the regions choose when their boxes are ignored. */
static int mark(work *w)
{
  const flesh_scene_region *regions = w->scene->keys.body.regions.values;
  int status = FLESH_OK;
  for (int e = 0; e < w->count && !status; e++) {
    flesh_tet_selection rest = regions[e].tets;
    flesh_chosen_fibres chosen;
    rest.box[0] = NAN;
    rest.body = w->scene->keys.body.name;
    status = flesh_tets_choose(&rest, &w->scene->body, &chosen);
    for (int k = 0; k < chosen.count && !status; k++) w->meets[(size_t)e * (size_t)w->tets + (size_t)chosen.tets[k]] = 1;
    flesh_fibres_free(&chosen);
    w->sample[e] = -1;
  }
  w->sample[w->count] = -1;
  return status;
}

int flesh_cut_find(const flesh_scene *scene, flesh_cut *cut)
{
  work w = {.scene = scene, .tets = scene->parts[0].tets, .count = scene->keys.body.regions.count};
  const size_t tets = (size_t)w.tets, count = (size_t)w.count, all = (size_t)scene->mesh->tets;
  flesh_arena *memory = &cut->memory;
  *cut = (flesh_cut){0};
  if (!count) return FLESH_OK;
  cut->shares = flesh_arena_take(memory, all * sizeof *cut->shares);
  cut->materials = flesh_arena_take(memory, all * sizeof *cut->materials);
  w.meets = flesh_arena_take(memory, count * tets);
  w.entries = flesh_arena_take(memory, (tets + 2 * (count + 1)) * sizeof *w.entries);
  int status = cut->shares && cut->materials && w.meets && w.entries ? FLESH_OK : flesh_no_memory();
  if (!status) {
    w.counts = w.entries + tets;
    w.sample = w.counts + count + 1;
    status = mark(&w);
  }
  if (!status) find(&w, cut);
  if (status || !cut->count) flesh_cut_clear(cut);
  return status;
}

void flesh_cut_clear(flesh_cut *cut)
{
  flesh_arena_free(&cut->memory);
  *cut = (flesh_cut){0};
}

/* Counts the tets of a selection that its box cuts. */
static int count_cut(const flesh_scene *scene, const flesh_tet_selection *selection, int *count)
{
  double x[POINTS][3];
  flesh_tet_selection rest = *selection;
  flesh_chosen_fibres chosen;
  rest.box[0] = NAN;
  const int status = flesh_tets_choose(&rest, &scene->body, &chosen);
  for (int k = 0; k < chosen.count && !status; k++) {
    int within = 0;
    list_points(scene->mesh, chosen.tets[k], x);
    for (int p = 0; p < POINTS; p++) within += is_within(selection->box, x[p]);
    *count += within > 0 && within < POINTS;
  }
  flesh_fibres_free(&chosen);
  return status;
}

int flesh_cut_say(const flesh_scene *scene, flesh_cut_words *words)
{
  const flesh_effect_entry *entries = scene->keys.effects.values;
  flesh_cut cut;
  int status = flesh_cut_find(scene, &cut);
  *words = (flesh_cut_words){.has_density = cut.has_density};
  if (cut.count)
    snprintf(words->regions, sizeof words->regions,
             "boxes of body.regions cut %d tets, which have the %s of the region that their middle is in: %.2g %% of the volume "
             "has that of the other side", cut.count, cut.has_density ? "density and material" : "material", 100 * cut.share);
  flesh_cut_clear(&cut);
  for (int k = 0; k < scene->keys.effects.count && !status; k++) {
    const flesh_key *keys = entries[k].path && entries[k].node ? entries[k].row->keys : NULL;
    int count = 0;
    if (!keys || !keys->name || strcmp(keys->name, "regions") || strcmp(keys[1].name, "box")) continue; /* chooses no tets */
    const char *parameters = entries[k].parameters;
    const flesh_tet_selection *selection = (const void *)(parameters + keys->offset);
    if (!isnan(selection->box[0])) status = count_cut(scene, selection, &count);
    if (count)
      flesh_text_add(words->muscles, sizeof words->muscles,
                     "%s%s.box cuts %d tets, whose middle decides whether they have fibres", *words->muscles ? "; " : "",
                     entries[k].path, count);
  }
  return status;
}
