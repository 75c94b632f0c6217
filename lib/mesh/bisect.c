/* bisect.c: local refinement by bisection: halves tets until no tet has a node in the middle of one of its edges. */
#include <limits.h>
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/stop.h"
#include "mesh/edges.h"
#include "mesh/mesh.h"
#include "mesh/parents.h"
#include "mesh/tag_map.h"

/* A tet of the refined mesh. */
typedef struct leaf {
  int nodes[4], parent;
  uint8_t halvings; /* halvings still to do */
  flesh_tet_marks marks;
  double place[4][4]; /* barycentric coordinates of the corners in the parent */
} leaf;

typedef struct work {
  const flesh_mesh *mesh;
  leaf *leaves;
  int tets, room;
  flesh_tag_map own; /* node on each edge of the mesh, at order 2 */
  flesh_tag_map cut; /* middle node of each edge that has been cut */
  /* Nodes so far, [node_room]. */
  double *positions, *place;
  int *node_tet, nodes, node_room;
  int *corners, *edge_nodes; /* of the leaves, ordered by parent; edge_nodes is NULL at order 1 */
} work;

static int no_memory(const work *w)
{
  return flesh_fail(FLESH_ERR_MEMORY, "out of memory to refine a mesh of %d tets", w->mesh->tets);
}

static int64_t key_of(int a, int b) { return a < b ? ((int64_t)a << 32) | b : ((int64_t)b << 32) | a; }

static int grow_nodes(work *w, int room)
{
  double *positions = flesh_realloc(w->positions, 3 * (size_t)room * sizeof *positions);
  if (positions) w->positions = positions;
  double *place = flesh_realloc(w->place, 4 * (size_t)room * sizeof *place);
  if (place) w->place = place;
  int *node_tet = flesh_realloc(w->node_tet, (size_t)room * sizeof *node_tet);
  if (node_tet) w->node_tet = node_tet;
  if (!positions || !place || !node_tet) return no_memory(w);
  w->node_room = room;
  return FLESH_OK;
}

/* Adds the node in the middle of two corners of a leaf. On straight edges it is the mean of the ends to the last bit,
 * so that nodes on planes of the axes stay on them. */
static int add_node(work *w, const leaf *l, int i, int j, int *node)
{
  const flesh_mesh *mesh = w->mesh;
  int status = FLESH_OK;
  if (w->nodes >= INT_MAX / 3)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the refined mesh has more than the %d nodes that are supported", INT_MAX / 3);
  if (w->nodes == w->node_room) status = grow_nodes(w, w->nodes > INT_MAX / 6 ? INT_MAX / 3 : 2 * w->nodes);
  if (status) return status;
  const int n = *node = w->nodes++;
  double *place = w->place + 4 * (size_t)n, *at = w->positions + 3 * (size_t)n;
  for (int c = 0; c < 4; c++) place[c] = (l->place[i][c] + l->place[j][c]) / 2;
  w->node_tet[n] = l->parent;
  if (mesh->curved[l->parent]) flesh_mesh_interpolate(mesh, l->parent, place, 3, mesh->positions, at);
  for (int d = 0; d < 3 && !mesh->curved[l->parent]; d++)
    at[d] = w->positions[3 * (size_t)l->nodes[i] + d] / 2 + w->positions[3 * (size_t)l->nodes[j] + d] / 2;
  return FLESH_OK;
}

/* Halves a leaf; the second half is appended to the leaves. */
static int halve(work *w, int k)
{
  const int most = flesh_mesh_most_tets(w->mesh->edge_nodes ? 2 : 1);
  if (w->tets >= most)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the refined mesh has more than the %d tets that are supported", most);
  if (!flesh_grow(&w->leaves, sizeof *w->leaves, w->tets, &w->room)) return no_memory(w);
  leaf *l = &w->leaves[k], *other = &w->leaves[w->tets];
  const int i = flesh_edge_corners[l->marks.edge][0], j = flesh_edge_corners[l->marks.edge][1];
  const int64_t key = key_of(l->nodes[i], l->nodes[j]);
  int middle, status = FLESH_OK;
  if (!flesh_tag_map_find(&w->cut, key, &middle)) {
    if (!flesh_tag_map_find(&w->own, key, &middle)) status = add_node(w, l, i, j, &middle);
    if (!status) status = flesh_tag_map_set(&w->cut, key, middle);
    if (status) return status;
  }
  double place[4];
  for (int c = 0; c < 4; c++) place[c] = (l->place[i][c] + l->place[j][c]) / 2;
  l->halvings -= l->halvings > 0;
  *other = *l;
  w->tets++;
  l->nodes[j] = other->nodes[i] = middle;
  memcpy(l->place[j], place, sizeof place);
  memcpy(other->place[i], place, sizeof place);
  l->marks = flesh_tet_marks_half(&other->marks, j);
  other->marks = flesh_tet_marks_half(&other->marks, i);
  return FLESH_OK;
}

/* Returns whether another tet has cut an edge of the leaf. */
static int is_cut(const work *w, const leaf *l)
{
  int middle, found = 0;
  for (int e = 0; e < 6 && !found; e++)
    found = flesh_tag_map_find(&w->cut, key_of(l->nodes[flesh_edge_corners[e][0]], l->nodes[flesh_edge_corners[e][1]]),
                               &middle);
  return found;
}

static int halve_all(work *w)
{
  int status = FLESH_OK;
  for (int again = 1; again && !status;) {
    again = 0;
    for (int k = 0; k < w->tets && !status; k++) {
      status = flesh_stop_ask_at((size_t)k);
      while (!status && (w->leaves[k].halvings || is_cut(w, &w->leaves[k]))) again = 1, status = halve(w, k);
    }
  }
  return status;
}

/* Fails with FLESH_ERR_ARGUMENT if the requested halvings alone, without those that make faces fit, give too many
 * tets. */
static int check_count(const flesh_mesh *mesh, const uint8_t *halvings)
{
  const int most = flesh_mesh_most_tets(mesh->edge_nodes ? 2 : 1);
  double least = 0;
  for (int t = 0; t < mesh->tets; t++) least += ldexp(1, halvings[t]);
  if (least <= most) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "the refined mesh has %.3g tets at least; %d are supported", least, most);
}

/* Makes the tets of the mesh the first leaves, and gives its nodes their places in the tets. */
static int begin(work *w, const uint8_t *halvings)
{
  const flesh_mesh *mesh = w->mesh;
  const size_t tets = (size_t)mesh->tets;
  w->tets = w->room = mesh->tets;
  w->nodes = mesh->nodes;
  w->leaves = flesh_malloc(tets * sizeof *w->leaves);
  flesh_tet_marks *marks = flesh_malloc(tets * sizeof *marks);
  int status = w->leaves && marks ? grow_nodes(w, mesh->nodes) : no_memory(w);
  if (status) goto done;
  if (mesh->marks) memcpy(marks, mesh->marks, tets * sizeof *marks);
  else flesh_tet_marks_begin(mesh->positions, mesh->tets, mesh->tet_nodes, marks);
  memcpy(w->positions, mesh->positions, 3 * (size_t)mesh->nodes * sizeof *w->positions);
  memset(w->place, 0, 4 * (size_t)mesh->nodes * sizeof *w->place);
  for (int n = 0; n < mesh->nodes; n++) w->node_tet[n] = -1;
  for (int t = 0; t < mesh->tets && !status; t++) {
    leaf *l = &w->leaves[t];
    *l = (leaf){.parent = t, .halvings = halvings[t], .marks = marks[t]};
    memcpy(l->nodes, mesh->tet_nodes + 4 * (size_t)t, sizeof l->nodes);
    for (int a = 0; a < 4; a++) {
      double *place = w->place + 4 * (size_t)l->nodes[a];
      l->place[a][a] = 1;
      memset(place, 0, 4 * sizeof *place);
      place[a] = 1;
      w->node_tet[l->nodes[a]] = t;
    }
    for (int e = 0; e < 6 && flesh_mesh_is_quadratic(mesh, t) && !status; e++) {
      const int *ends = flesh_edge_corners[e], node = mesh->edge_nodes[6 * (size_t)t + (size_t)e];
      double *place = w->place + 4 * (size_t)node;
      memset(place, 0, 4 * sizeof *place);
      place[ends[0]] = place[ends[1]] = 0.5;
      w->node_tet[node] = t;
      if (flesh_tag_map_set(&w->own, key_of(l->nodes[ends[0]], l->nodes[ends[1]]), node) < 0) status = FLESH_ERR_MEMORY;
    }
  }
done:
  flesh_free(marks);
  return status;
}

/* Makes a node for each edge of the leaves, at order 2; `order` lists the leaves by parent. */
static int put_on_edges(work *w, const int *order)
{
  flesh_mesh_edges edges;
  int status = FLESH_OK;
  w->edge_nodes = flesh_malloc(6 * (size_t)w->tets * sizeof *w->edge_nodes);
  if (!w->edge_nodes || !flesh_mesh_edges_find(w->nodes, w->tets, w->corners, &edges)) return no_memory(w);
  int *on = flesh_malloc((size_t)edges.count * sizeof *on);
  if (!on) status = no_memory(w);
  for (int e = 0; e < edges.count && !status; e++) on[e] = -1;
  for (int k = 0; k < w->tets && !status; k++) {
    const leaf *l = &w->leaves[order[k]];
    const int quadratic = flesh_mesh_is_quadratic(w->mesh, l->parent);
    for (int e = 0; e < 6 && !status; e++) {
      const int i = flesh_edge_corners[e][0], j = flesh_edge_corners[e][1];
      int *node = &on[edges.tet_edges[6 * (size_t)k + (size_t)e]];
      if (quadratic && *node < 0 && !flesh_tag_map_find(&w->own, key_of(l->nodes[i], l->nodes[j]), node))
        status = add_node(w, l, i, j, node);
      w->edge_nodes[6 * (size_t)k + (size_t)e] = *node;
    }
  }
  flesh_free(on);
  flesh_mesh_edges_clear(&edges);
  return status;
}

/* Fills the parents and sets of the refined mesh. first [tets+1]: the first child of each tet of the coarser mesh. */
static int hand_over(work *w, const int *order, const int *first, flesh_mesh *refined, flesh_mesh_parents *parents)
{
  const size_t tets = (size_t)w->tets;
  parents->nodes = w->nodes;
  parents->tets = w->tets;
  parents->tet = flesh_malloc(tets * sizeof *parents->tet);
  refined->marks = flesh_malloc(tets * sizeof *refined->marks);
  if (!parents->tet || !refined->marks) return no_memory(w);
  parents->node_tet = w->node_tet, w->node_tet = NULL;
  parents->place = w->place, w->place = NULL;
  for (size_t k = 0; k < tets; k++) {
    refined->marks[k] = w->leaves[order[k]].marks;
    parents->tet[k] = w->leaves[order[k]].parent;
  }
  flesh_mesh_sets *sets = &refined->sets;
  const int status = flesh_mesh_sets_append(sets, &w->mesh->sets, &(flesh_mesh_sets_map){.first_children = first});
  return status ? status : flesh_mesh_parents_carry(w->mesh, parents, sets);
}

/* Makes the refined mesh from the leaves. */
static int finish(work *w, flesh_mesh **refined, flesh_mesh_parents *parents)
{
  const flesh_mesh *mesh = w->mesh;
  const size_t tets = (size_t)w->tets;
  int *order = flesh_malloc(tets * sizeof *order), *regions = flesh_malloc(tets * sizeof *regions);
  int *first = flesh_calloc((size_t)mesh->tets + 2, sizeof *first), status = FLESH_OK;
  w->corners = flesh_malloc(4 * tets * sizeof *w->corners);
  if (!order || !regions || !first || !w->corners) status = no_memory(w);
  if (status) goto done;
  for (size_t k = 0; k < tets; k++) first[w->leaves[k].parent + 2]++;
  for (int t = 0; t < mesh->tets; t++) first[t + 2] += first[t + 1];
  for (int k = 0; k < w->tets; k++) order[first[w->leaves[k].parent + 1]++] = k;
  for (size_t k = 0; k < tets; k++) {
    memcpy(w->corners + 4 * k, w->leaves[order[k]].nodes, 4 * sizeof *w->corners);
    regions[k] = mesh->regions[w->leaves[order[k]].parent];
  }
  if (mesh->edge_nodes) status = put_on_edges(w, order);
  if (!status)
    status = flesh_mesh_build(&(flesh_mesh_lists){.nodes = w->nodes, .tets = w->tets, .positions = w->positions,
                                                  .tet_nodes = w->corners, .edge_nodes = w->edge_nodes,
                                                  .regions = regions}, NULL, refined);
  if (!status && (*refined)->flipped)
    status = flesh_fail(FLESH_ERR_FILE, "%d halves of tets are inverted, as edges bend too much", (*refined)->flipped);
  if (!status) status = hand_over(w, order, first, *refined, parents);
done:
  flesh_free(order);
  flesh_free(regions);
  flesh_free(first);
  return status;
}

int flesh_mesh_refine_marked(const flesh_mesh *mesh, const uint8_t *halvings, flesh_mesh **refined,
                             flesh_mesh_parents *parents)
{
  flesh_mesh_parents own = {0};
  FLESH_NEED({refined, "refined"});
  *refined = NULL;
  if (parents) *parents = own;
  FLESH_NEED({mesh, "mesh"}, {halvings, "halvings"});
  work w = {.mesh = mesh};
  int status = check_count(mesh, halvings);
  if (!status) status = begin(&w, halvings);
  if (!status) status = halve_all(&w);
  if (!status) status = finish(&w, refined, &own);
  if (status) flesh_mesh_destroy(refined);
  if (status || !parents) flesh_mesh_parents_clear(&own);
  else *parents = own;
  flesh_tag_map_clear(&w.own);
  flesh_tag_map_clear(&w.cut);
  flesh_free(w.leaves);
  flesh_free(w.positions);
  flesh_free(w.place);
  flesh_free(w.node_tet);
  flesh_free(w.corners);
  flesh_free(w.edge_nodes);
  return status;
}
