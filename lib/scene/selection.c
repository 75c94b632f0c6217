/* selection.c: finds the nodes and surface triangles that an effect acts on. */
#include "scene/selection.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/rising.h"
#include "base/text.h"
#include "mesh/pieces.h"
#include "mesh/mesh.h"
#include "mesh/split_part.h"

const flesh_key flesh_sphere_keys[] = {
    {.name = "centre", .type = FLESH_KEY_VECTOR, .offset = 0, .unit = "m", .doc = "centre of the sphere"},
    {.name = "radius", .type = FLESH_KEY_NUMBER, .offset = 3 * sizeof(double),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "m", .doc = "radius of the sphere"},
    {0}};

static int has_box(const flesh_selection *selection) { return !isnan(selection->box[0]); }
static int has_sphere(const flesh_selection *selection) { return !isnan(selection->sphere.radius); }

/* Returns whether more than a body is given. */
static int has_criteria(const flesh_selection *selection)
{
  return has_box(selection) || has_sphere(selection) || selection->nodes.count || selection->regions.count ||
         selection->set;
}

int flesh_selection_is_given(const flesh_selection *selection) { return has_criteria(selection) || selection->body; }

int flesh_selection_set(const char *name, const flesh_mesh *mesh, const flesh_mesh_set **set)
{
  const int found = name ? flesh_mesh_sets_find(&mesh->sets, name, strlen(name)) : -1;
  *set = found < 0 ? NULL : &mesh->sets.sets[found];
  if (!name || *set) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "set is '%s'; %s", name, flesh_mesh_sets_text(&mesh->sets));
}

int flesh_selection_body(const char *name, const flesh_body *body, const flesh_body_part **part)
{
  *part = NULL;
  for (int k = 0; name && k < body->part_count; k++)
    if (!strcmp(body->parts[k].name, name)) *part = &body->parts[k];
  if (!name || *part) return FLESH_OK;
  char names[480] = "";
  for (int k = 0; k < body->part_count; k++)
    flesh_text_add(names, sizeof names, "%s%.40s", k ? ", " : "", body->parts[k].name);
  return flesh_fail(FLESH_ERR_ARGUMENT, "body is '%s'; the scene has no body of that name, but %s", name,
                    *names ? names : "one without a name");
}

/* The body and the set that a selection names, or NULL. */
typedef struct named {
  const flesh_body_part *part;
  const flesh_mesh_set *set;
} named;

/* Checks a selection; *found: the body and set that it names. FLESH_ERR_ARGUMENT for the first fault. */
static int check(const flesh_selection *selection, const flesh_body *body, named *found)
{
  const flesh_mesh *mesh = body->mesh;
  const double *box = selection->box;
  int nodes = mesh->split ? mesh->split->whole_nodes : flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  if (!flesh_selection_is_given(selection))
    return flesh_fail(FLESH_ERR_ARGUMENT, "nothing is chosen; give " FLESH_SELECTION_NAMES);
  int status = flesh_selection_body(selection->body, body, &found->part);
  if (!status) status = flesh_selection_set(selection->set, mesh, &found->set);
  if (status) return status;
  for (int c = 0; has_box(selection) && c < 3; c++)
    if (box[c] > box[3 + c])
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "box has low %c = %g above high %c = %g; it must be [[low], [high]]",
                        'x' + c, box[c], 'x' + c, box[3 + c]);
  for (int k = 0; k < selection->nodes.count; k++)
    if (selection->nodes.values[k] < 0 || selection->nodes.values[k] >= nodes)
      return flesh_fail(FLESH_ERR_ARGUMENT, "nodes[%d] is %d; the mesh has the nodes 0 to %d", k,
                        selection->nodes.values[k], nodes - 1);
  for (int k = 0; k < selection->regions.count; k++) {
    int tet = 0;
    while (tet < tets && flesh_mesh_regions(mesh)[tet] != selection->regions.values[k]) tet++;
    if (tet == tets && !flesh_split_has_region(mesh->split, selection->regions.values[k]))
      return flesh_fail(FLESH_ERR_ARGUMENT, "regions[%d] is %d; no tet of the mesh has that tag", k,
                        selection->regions.values[k]);
  }
  return FLESH_OK;
}

int flesh_selection_contains(const flesh_selection *selection, const double p[3])
{
  const double *box = selection->box, *centre = selection->sphere.centre, radius = selection->sphere.radius;
  const double d[3] = {p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]};
  return (p[0] >= box[0] && p[1] >= box[1] && p[2] >= box[2] && p[0] <= box[3] && p[1] <= box[4] && p[2] <= box[5]) ||
         d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= radius * radius;
}

/* Marks the nodes in the box, the sphere, the list and the set, and nodes between two nodes of the list. */
static void mark(const flesh_selection *selection, const flesh_mesh_set *set, const flesh_mesh *mesh, uint8_t *chosen)
{
  for (int k = 0; k < selection->nodes.count; k++) {
    const int node = selection->nodes.values[k];
    const int own = mesh->split ? flesh_split_part_find(mesh->split, mesh->nodes, node) : node;
    if (own >= 0) chosen[own] = 1;
  }
  for (size_t i = 0; mesh->ends && selection->nodes.count && i < (size_t)mesh->nodes; i++)
    chosen[i] |= chosen[mesh->ends[2 * i]] & chosen[mesh->ends[2 * i + 1]];
  for (int k = 0; set && k < set->nodes.count; k++) chosen[set->nodes.values[k]] = 1;
  for (int i = 0; i < mesh->nodes; i++)
    if (flesh_selection_contains(selection, mesh->positions + 3 * (size_t)i)) chosen[i] = 1;
}

/* Returns whether the tet is in a chosen region or in the set. */
static int is_named(const flesh_selection *selection, const flesh_mesh_set *set, const flesh_mesh *mesh, int tet)
{
  for (int k = 0; k < selection->regions.count; k++)
    if (selection->regions.values[k] == mesh->regions[tet]) return 1;
  return set && flesh_rising_find(set->tets.values, 0, set->tets.count, tet) >= 0;
}

/* Fails as nothing was found, and frees the empty list. */
static int nothing_found(const flesh_selection *selection, const flesh_mesh *mesh, const char *what, int **list)
{
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  free(*list);
  *list = NULL;
  if (!has_box(selection) && !has_sphere(selection))
    return flesh_fail(FLESH_ERR_ARGUMENT, "no %s of the mesh lies in the given nodes, regions, set or body", what);
  for (size_t i = 0; i < 3 * (size_t)mesh->nodes; i++) {
    low[i % 3] = fmin(low[i % 3], mesh->positions[i]);
    high[i % 3] = fmax(high[i % 3], mesh->positions[i]);
  }
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "no %s of the mesh lies in the given %s; the mesh reaches from [%g, %g, %g] to [%g, %g, %g]", what,
                    !has_sphere(selection) ? "box" : has_box(selection) ? "box or sphere" : "sphere", low[0], low[1],
                    low[2], high[0], high[1], high[2]);
}

/* Returns whether the number found suffices; in a part of a split mesh it may be 0 (share.c asks all ranks). */
static int is_enough(const flesh_mesh *mesh, int found)
{
  if (mesh->split) mesh->split->found = found;
  return found || mesh->split;
}

static int is_of(const flesh_body_part *part, int tet)
{
  return !part || (tet >= part->first_tet && tet - part->first_tet < part->tets);
}

int flesh_selection_nodes(const flesh_selection *selection, const flesh_body *body, int *count,
                          int **nodes)
{
  const flesh_mesh *mesh = body->mesh;
  named by;
  int total = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh), found = 0;
  int status = check(selection, body, &by);
  if (status) return status;
  const flesh_body_part *part = by.part;
  /* Bits of a node: 1, chosen by place or number; 2, in the body. */
  uint8_t *chosen = calloc((size_t)total, 1);
  if (!chosen) return flesh_fail(FLESH_ERR_MEMORY, "no memory to choose among %d nodes", total);
  mark(selection, by.set, mesh, chosen);
  const int whole = part && !has_criteria(selection);
  for (int e = 0; (part || by.set || selection->regions.count) && e < tets; e++) {
    const int own = is_of(part, e), is_chosen = whole || is_named(selection, by.set, mesh, e);
    int tet[10], size = flesh_mesh_tet_nodes(mesh, e, tet);
    for (int a = 0; own && a < size; a++) chosen[tet[a]] |= is_chosen ? 3 : 2;
  }
  for (int i = 0; i < total; i++) found += chosen[i] = part ? chosen[i] == 3 : chosen[i] & 1;
  *nodes = malloc(((size_t)found + 1) * sizeof **nodes);
  *count = 0;
  for (int i = 0; *nodes && i < total; i++)
    if (chosen[i]) (*nodes)[(*count)++] = i;
  free(chosen);
  if (!*nodes) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d chosen nodes", found);
  return is_enough(mesh, found) ? FLESH_OK : nothing_found(selection, mesh, "node", nodes);
}

int flesh_selection_triangles(const flesh_selection *selection, const flesh_body *body, int *count,
                              int **triangles)
{
  const flesh_mesh *mesh = body->mesh;
  named by;
  int total, found = 0, of_whole = 0, status = check(selection, body, &by);
  const int *surface = flesh_mesh_surface(mesh, &total), *tet = flesh_mesh_surface_tets(mesh);
  if (status) return status;
  uint8_t *chosen = calloc((size_t)flesh_mesh_node_count(mesh), 1);
  *triangles = malloc((3 * (size_t)total + 1) * sizeof **triangles);
  if (!chosen || !*triangles) {
    free(chosen);
    free(*triangles);
    *triangles = NULL;
    return flesh_fail(FLESH_ERR_MEMORY, "no memory to choose among %d triangles", total);
  }
  mark(selection, by.set, mesh, chosen);
  const int whole = by.part && !has_criteria(selection);
  for (int k = 0; k < total; k++) {
    const int *n = surface + 3 * (size_t)k;
    if (!is_of(by.part, tet[k])) continue;
    if (!whole && !(chosen[n[0]] && chosen[n[1]] && chosen[n[2]]) && !is_named(selection, by.set, mesh, tet[k])) continue;
    for (int a = 0; a < 3; a++) (*triangles)[3 * found + a] = n[a];
    found++;
    /* A part of a split mesh has faces at its rim that are inside the whole. */
    of_whole += !mesh->split || mesh->split->owners[tet[k]] == mesh->split->part;
  }
  free(chosen);
  *count = found;
  return is_enough(mesh, of_whole) ? FLESH_OK : nothing_found(selection, mesh, "surface triangle", triangles);
}
