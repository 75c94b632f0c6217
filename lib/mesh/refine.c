/* refine.c: uniform refinement: cuts each tet into eight of an eighth of its volume, four at its corners and four that
 * fill the octahedron between them (red refinement; Bey, Computing 55, 1995). */
#include "mesh/refine.h"

#include <limits.h>
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/stop.h"
#include "mesh/edges.h"
#include "mesh/mesh.h"
#include "mesh/shape.h"

/* The eight children for each diagonal of the octahedron, between the middles of the edges 02-13, 03-12 or 01-23, as
 * indices into the ten nodes (VTK's order). The last four stand around the diagonal; all are wound as their parent. */
static const signed char cuts[3][8][4] = {
    {{0, 4, 6, 7}, {4, 1, 5, 8}, {6, 5, 2, 9}, {7, 8, 9, 3}, {6, 8, 4, 5}, {6, 8, 5, 9}, {6, 8, 9, 7}, {6, 8, 7, 4}},
    {{0, 4, 6, 7}, {4, 1, 5, 8}, {6, 5, 2, 9}, {7, 8, 9, 3}, {7, 5, 4, 6}, {7, 5, 6, 9}, {7, 5, 9, 8}, {7, 5, 8, 4}},
    {{0, 4, 6, 7}, {4, 1, 5, 8}, {6, 5, 2, 9}, {7, 8, 9, 3}, {4, 9, 5, 6}, {4, 9, 6, 7}, {4, 9, 7, 8}, {4, 9, 8, 5}}};

/* A refined mesh without positions. `own` below are the ten nodes of a tet; children have nodes on edges at order 2
 * only. */
typedef struct draft {
  int nodes;            /* nodes of the refined mesh */
  flesh_mesh_edges cut; /* order 1: the edges that get a node in the middle; order 2: those of the children */
  int *tets;            /* [32*tets] corners of the children, eight in a row for each tet */
} draft;

static void clear(draft *d)
{
  flesh_mesh_edges_clear(&d->cut);
  flesh_free(d->tets);
}

/* Gives the ten nodes of tet t; at order 1 those on edges are nodes of the refined mesh. */
static void own_nodes(const flesh_mesh *mesh, const flesh_mesh_edges *edges, int t, int own[10])
{
  memcpy(own, mesh->tet_nodes + 4 * (size_t)t, 4 * sizeof *own);
  for (size_t k = 0; k < 6; k++)
    own[4 + k] = mesh->edge_nodes ? mesh->edge_nodes[6 * (size_t)t + k]
                                  : mesh->nodes + edges->tet_edges[6 * (size_t)t + k];
}

/* Returns how stretched the four tets around a diagonal are: their largest sum of squared edges, which is a measure as
 * their volumes are equal for straight edges; infinite if one is not wound as its parent. at: the ten nodes. */
static double stretch(double at[10][3], const signed char tets[8][4])
{
  static const int corners[4] = {0, 1, 2, 3};
  double most = 0;
  for (int child = 4; child < 8; child++) {
    double x[12], sum = 0;
    for (int a = 0; a < 4; a++) memcpy(x + 3 * a, at[tets[child][a]], 3 * sizeof *x);
    for (int k = 0; k < 6; k++)
      for (int d = 0; d < 3; d++) {
        const double edge = x[3 * flesh_edge_corners[k][0] + d] - x[3 * flesh_edge_corners[k][1] + d];
        sum += edge * edge;
      }
    most = flesh_tet_volume(x, corners) > 0 ? fmax(most, sum) : INFINITY;
  }
  return most;
}

/* Returns the diagonal with the least stretched tets, the first of equal ones. It cuts Kuhn's tets into Kuhn's tets. */
static int best_cut(const flesh_mesh *mesh, int t)
{
  const int *n = mesh->tet_nodes + 4 * (size_t)t;
  double at[10][3], least = INFINITY;
  int best = 0;
  for (int a = 0; a < 4; a++) memcpy(at[a], mesh->positions + 3 * (size_t)n[a], sizeof at[a]);
  for (int k = 0; k < 6; k++) {
    const int *ends = flesh_edge_corners[k];
    if (mesh->edge_nodes)
      memcpy(at[4 + k], mesh->positions + 3 * (size_t)mesh->edge_nodes[6 * (size_t)t + (size_t)k], sizeof at[0]);
    else
      for (int d = 0; d < 3; d++) at[4 + k][d] = (at[ends[0]][d] + at[ends[1]][d]) / 2;
  }
  for (int c = 0; c < 3; c++) {
    const double most = stretch(at, cuts[c]);
    if (most < least * (1 - 1e-9)) least = most, best = c;
  }
  return best;
}

int flesh_mesh_check_refine(const flesh_mesh *mesh, int order, int times)
{
  const double tets = mesh->tets * pow(8, times), most = flesh_mesh_most_tets(order);
  const double bytes = tets * flesh_mesh_bytes_of_tet(order), memory = flesh_physical_memory();
  if (times > 0 && tets > most)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the mesh's %d tets become %.4g, and at most %.0f are supported", mesh->tets, tets,
                      most);
  if (times > 0 && bytes > memory)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the mesh's %d tets become %.4g, whose mesh alone takes %.3g GB; this machine has "
                      "%.3g GB of memory", mesh->tets, tets, bytes / 1e9, memory / 1e9);
  return FLESH_OK;
}

static int no_memory(const flesh_mesh *mesh)
{
  return flesh_fail(FLESH_ERR_MEMORY, "out of memory to refine a mesh of %d tets", mesh->tets);
}

static int make_draft(const flesh_mesh *mesh, draft *d)
{
  const int order = flesh_mesh_order(mesh), most = flesh_mesh_most_tets(order) / 8;
  *d = (draft){0};
  if (mesh->linear)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the mesh has tets of four nodes and of ten; they must be refined apart");
  if (mesh->tets > most)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the mesh has %d tets; at most %d can be cut into eight each", mesh->tets,
                      most);
  d->tets = flesh_malloc(32 * (size_t)mesh->tets * sizeof *d->tets);
  if (!d->tets) return no_memory(mesh);
  if (order == 1 && !flesh_mesh_edges_find(mesh->nodes, mesh->tets, mesh->tet_nodes, &d->cut)) return no_memory(mesh);
  for (int t = 0; t < mesh->tets; t++) {
    const int c = best_cut(mesh, t), status = flesh_stop_ask_at((size_t)t);
    int own[10];
    if (status) return status;
    own_nodes(mesh, &d->cut, t, own);
    for (int k = 0; k < 32; k++) d->tets[32 * (size_t)t + (size_t)k] = own[cuts[c][k / 4][k % 4]];
  }
  const int status = flesh_stop_ask_before((size_t)mesh->tets);
  if (status) return status;
  if (order == 2 && !flesh_mesh_edges_find(mesh->nodes, 8 * mesh->tets, d->tets, &d->cut)) return no_memory(mesh);
  if (d->cut.count > INT_MAX / 3 - mesh->nodes)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%d nodes and %d edges make more than the %d nodes that are supported",
                      mesh->nodes, d->cut.count, INT_MAX / 3);
  d->nodes = mesh->nodes + d->cut.count;
  return FLESH_OK;
}

/* Fills in the middles of the children's edges at order 2, by the shape functions of the parent. */
static void fill_quadratic(const flesh_mesh *mesh, const draft *d, double *field)
{
  for (int t = 0; t < mesh->tets; t++) {
    int own[10];
    own_nodes(mesh, NULL, t, own);
    for (int child = 0; child < 8; child++)
      for (int k = 0; k < 6; k++) {
        const size_t edge = 6 * (8 * (size_t)t + (size_t)child) + (size_t)k;
        const int *corners = d->tets + 4 * (8 * (size_t)t + (size_t)child);
        double L[4] = {0}, N[10];
        for (int end = 0; end < 2; end++)
          for (int a = 0; a < 10; a++) {
            if (own[a] != corners[flesh_edge_corners[k][end]]) continue;
            if (a < 4) L[a] += 0.5;
            else L[flesh_edge_corners[a - 4][0]] += 0.25, L[flesh_edge_corners[a - 4][1]] += 0.25;
          }
        flesh_tet10_shape(L, N);
        double *to = field + 3 * ((size_t)mesh->nodes + (size_t)d->cut.tet_edges[edge]);
        for (int c = 0; c < 3; c++) {
          to[c] = 0;
          for (int a = 0; a < 10; a++) to[c] += N[a] * field[3 * (size_t)own[a] + (size_t)c];
        }
      }
  }
}

static void fill(const flesh_mesh *mesh, const draft *d, double *field)
{
  if (mesh->edge_nodes) {
    fill_quadratic(mesh, d, field);
    return;
  }
  for (size_t e = 0; e < (size_t)d->cut.count; e++)
    for (size_t c = 0; c < 3; c++) {
      const double a = field[3 * (size_t)d->cut.ends[2 * e] + c], b = field[3 * (size_t)d->cut.ends[2 * e + 1] + c];
      field[3 * ((size_t)mesh->nodes + e) + c] = a / 2 + b / 2;
    }
}

int flesh_mesh_refine_field(const flesh_mesh *mesh, double *field)
{
  draft d;
  const int status = make_draft(mesh, &d);
  if (!status) fill(mesh, &d, field);
  clear(&d);
  return status;
}

/* Makes the mesh of the children from positions, and at order 2 nodes on their edges. */
static int finish(const flesh_mesh *mesh, const draft *d, flesh_mesh **refined)
{
  const size_t tets = 8 * (size_t)mesh->tets;
  double *x = flesh_malloc(3 * (size_t)d->nodes * sizeof *x);
  int *regions = flesh_malloc(tets * sizeof *regions), status = FLESH_OK;
  int *on_edges = mesh->edge_nodes ? flesh_malloc(6 * tets * sizeof *on_edges) : NULL;
  int *ends = flesh_mesh_add_ends(mesh, d->cut.count, d->cut.ends);
  if (!x || !regions || !ends || (mesh->edge_nodes && !on_edges)) {
    status = no_memory(mesh);
  } else {
    memcpy(x, mesh->positions, 3 * (size_t)mesh->nodes * sizeof *x);
    fill(mesh, d, x);
    for (size_t t = 0; t < tets; t++) regions[t] = mesh->regions[t / 8];
    for (size_t k = 0; on_edges && k < 6 * tets; k++) on_edges[k] = mesh->nodes + d->cut.tet_edges[k];
    status = flesh_mesh_build(&(flesh_mesh_lists){.nodes = d->nodes, .tets = (int)tets, .positions = x,
                                                  .tet_nodes = d->tets, .edge_nodes = on_edges, .regions = regions,
                                                  .ends = ends}, NULL, refined);
  }
  if (!status) {
    flesh_mesh_sets *sets = &(*refined)->sets;
    (*refined)->flipped = 0; /* the table of cuts winds the children */
    status = flesh_mesh_sets_append(sets, &mesh->sets, &(flesh_mesh_sets_map){.children = 8});
    if (!status) status = flesh_mesh_sets_add_between(sets, mesh->nodes, d->nodes, ends);
    if (status) flesh_mesh_destroy(refined);
  }
  flesh_free(x);
  flesh_free(regions);
  flesh_free(on_edges);
  flesh_free(ends);
  return status;
}

int flesh_mesh_refine(const flesh_mesh *mesh, flesh_mesh **refined)
{
  FLESH_NEED({refined, "refined"});
  *refined = NULL;
  FLESH_NEED({mesh, "mesh"});
  draft d;
  int status = make_draft(mesh, &d);
  if (!status) status = finish(mesh, &d, refined);
  clear(&d);
  return status;
}
