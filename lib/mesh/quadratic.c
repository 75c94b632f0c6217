/* quadratic.c: makes meshes of ten-node tets, from arrays and from four-node tets, and checks them. */
#include "mesh/mesh.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/stop.h"
#include "mesh/bernstein.h"
#include "mesh/edges.h"

static void swap(int *a, int *b)
{
  int kept = *a;
  *a = *b, *b = kept;
}

void flesh_mesh_flip_edge_nodes(int edge_nodes[6])
{
  swap(&edge_nodes[1], &edge_nodes[4]); /* 12 and 13 */
  swap(&edge_nodes[2], &edge_nodes[3]); /* 02 and 03 */
}

/* Checks the node of edge k of tet t: an edge has one node and a node one edge. edge_node [edges]: BARE if a four-node
 * tet has the edge, -1 nothing known yet; node_edge [nodes]: 0 nothing known yet, -1 a corner, else 1 + its edge. */
enum { BARE = -2 };

static int check_edge_node(const flesh_mesh *mesh, const flesh_mesh_origin *origin, int t, int k,
                           const flesh_mesh_edges *edges, int *edge_node, int *node_edge)
{
  const int n = mesh->edge_nodes[6 * (size_t)t + k], e = edges->tet_edges[6 * (size_t)t + k];
  const long long label = flesh_mesh_tet_label(origin, t);
  const long long low = flesh_mesh_node_label(origin, edges->ends[2 * (size_t)e]);
  const long long high = flesh_mesh_node_label(origin, edges->ends[2 * (size_t)e + 1]);
  const long long node = flesh_mesh_node_label(origin, n);
  if (node_edge[n] < 0)
    return flesh_mesh_fail_at(origin, t,
                              "tet %lld has node %lld on the edge of nodes %lld and %lld, but it is "
                              "the corner of a tet; it must be one or the other",
                              label, node, low, high);
  if (edge_node[e] == BARE)
    return flesh_mesh_fail_at(origin, t,
                              "tet %lld has node %lld on the edge of nodes %lld and %lld, but a tet of four nodes has "
                              "that edge too; tets of four nodes and of ten must not share an edge",
                              label, node, low, high);
  if (edge_node[e] >= 0 && edge_node[e] != n)
    return flesh_mesh_fail_at(origin, t,
                              "tet %lld has node %lld on the edge of nodes %lld and %lld, but an "
                              "earlier tet has node %lld there; all tets of an edge must share its "
                              "node",
                              label, node, low, high, flesh_mesh_node_label(origin, edge_node[e]));
  if (node_edge[n] && node_edge[n] != e + 1) {
    const int *other = edges->ends + 2 * (size_t)(node_edge[n] - 1);
    return flesh_mesh_fail_at(origin, t,
                              "tet %lld has node %lld on the edge of nodes %lld and %lld, but it is "
                              "on the edge of nodes %lld and %lld already; each edge must have its "
                              "own node",
                              label, node, low, high, flesh_mesh_node_label(origin, other[0]),
                              flesh_mesh_node_label(origin, other[1]));
  }
  edge_node[e] = n;
  node_edge[n] = e + 1;
  return FLESH_OK;
}

int flesh_mesh_check_edge_nodes(const flesh_mesh *mesh, const flesh_mesh_origin *origin)
{
  int status = FLESH_OK;
  for (int t = 0; t < mesh->tets; t++)
    for (int k = 0; k < 6; k++) {
      int n = mesh->edge_nodes[6 * (size_t)t + k];
      if (flesh_mesh_is_quadratic(mesh, t) ? n < 0 || n >= mesh->nodes : n != -1)
        return flesh_mesh_fail_at(origin, t, "tet %lld uses node %d; the nodes are 0 to %d",
                                  flesh_mesh_tet_label(origin, t), n, mesh->nodes - 1);
    }
  flesh_mesh_edges edges;
  if (!flesh_mesh_edges_find(mesh->nodes, mesh->tets, mesh->tet_nodes, &edges))
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for the edges of %d tets", mesh->tets);
  int *edge_node = flesh_malloc((size_t)edges.count * sizeof *edge_node);
  int *node_edge = flesh_calloc((size_t)mesh->nodes, sizeof *node_edge);
  if (!edge_node || !node_edge)
    status = flesh_fail(FLESH_ERR_MEMORY, "out of memory for the edges of %d tets", mesh->tets);
  for (int e = 0; e < edges.count && !status; e++) edge_node[e] = -1;
  for (size_t k = 0; k < 4 * (size_t)mesh->tets && !status; k++) node_edge[mesh->tet_nodes[k]] = -1;
  for (int t = 0; t < mesh->tets && mesh->linear && !status; t++)
    for (int k = 0; k < 6 && !flesh_mesh_is_quadratic(mesh, t); k++)
      edge_node[edges.tet_edges[6 * (size_t)t + k]] = BARE;
  for (int t = 0; t < mesh->tets && !status; t++) {
    status = flesh_stop_ask_at((size_t)t);
    for (int k = 0; k < 6 && flesh_mesh_is_quadratic(mesh, t) && !status; k++)
      status = check_edge_node(mesh, origin, t, k, &edges, edge_node, node_edge);
  }
  flesh_free(edge_node);
  flesh_free(node_edge);
  flesh_mesh_edges_clear(&edges);
  return status;
}

int flesh_mesh_find_jacobians(flesh_mesh *mesh, const flesh_mesh_origin *origin)
{
  double one[FLESH_CUBIC];
  for (int t = 0; t < mesh->tets; t++) {
    const int *n = mesh->tet_nodes + 4 * (size_t)t;
    double *C = mesh->jacobians + FLESH_CUBIC * (size_t)t, volume;
    const int status = flesh_stop_ask_at((size_t)t);
    if (status) return status;
    for (int a = 0; a < FLESH_CUBIC; a++) C[a] = 6 * mesh->volumes[t];
    if (!flesh_mesh_is_quadratic(mesh, t)) continue;
    flesh_tet10_jacobian(mesh->positions, n, mesh->edge_nodes + 6 * (size_t)t, C);
    mesh->volumes[t] = volume = flesh_cubic_integral(C);
    for (int a = 0; a < FLESH_CUBIC; a++) one[a] = 6 * fabs(volume);
    flesh_least least = flesh_cubic_least(C, one, 0.5);
    if (!(least.low > 0))
      return flesh_mesh_fail_at(origin, t,
                                "tet %lld (corners %lld %lld %lld %lld) is turned inside out by the "
                                "nodes on its edges: its Jacobian falls to %.3g of its mean, and must "
                                "be positive in all of it; Gmsh's Mesh.HighOrderOptimize repairs it, or a mesh "
                                "of order 1 with body.element: tet10-mean",
                                flesh_mesh_tet_label(origin, t), flesh_mesh_node_label(origin, n[0]),
                                flesh_mesh_node_label(origin, n[1]), flesh_mesh_node_label(origin, n[2]),
                                flesh_mesh_node_label(origin, n[3]), fmin(least.high, 0));
  }
  return FLESH_OK;
}

void flesh_mesh_find_curved(flesh_mesh *mesh)
{
  for (int t = 0; t < mesh->tets; t++)
    for (int k = 0; k < 6 && flesh_mesh_is_quadratic(mesh, t); k++) {
      const int *corner = flesh_edge_corners[k], *n = mesh->tet_nodes + 4 * (size_t)t;
      const double *a = mesh->positions + 3 * (size_t)n[corner[0]];
      const double *b = mesh->positions + 3 * (size_t)n[corner[1]];
      const double *m = mesh->positions + 3 * (size_t)mesh->edge_nodes[6 * (size_t)t + k];
      double off = 0, length = 0, far = 0;
      for (int d = 0; d < 3; d++) {
        off = fmax(off, fabs(m[d] - (a[d] + b[d]) / 2));
        length = fmax(length, fabs(a[d] - b[d]));
        far = fmax(far, fmax(fabs(a[d]), fabs(b[d])));
      }
      mesh->curved[t] |= off > 1e-12 * length + 4 * DBL_EPSILON * far;
    }
}

int flesh_mesh_create_quadratic(int nodes, const double *positions, int tets, const int *tet_nodes,
                                const int *regions, flesh_mesh **mesh)
{
  FLESH_NEED({mesh, "mesh"});
  *mesh = NULL;
  FLESH_NEED({positions, "positions"}, {tet_nodes, "tet_nodes"});
  size_t count = tets > 0 ? (size_t)tets : 0;
  int *corners = flesh_malloc((10 * count + 1) * sizeof *corners), *on_edges = corners + 4 * count;
  if (!corners) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a mesh of %d tets", tets);
  for (size_t t = 0; t < count; t++) {
    memcpy(corners + 4 * t, tet_nodes + 10 * t, 4 * sizeof *corners);
    memcpy(on_edges + 6 * t, tet_nodes + 10 * t + 4, 6 * sizeof *corners);
  }
  int status = flesh_mesh_build(&(flesh_mesh_lists){.nodes = nodes, .tets = tets, .positions = positions,
                                                    .tet_nodes = corners, .edge_nodes = on_edges, .regions = regions},
                                NULL, mesh);
  flesh_free(corners);
  return status == FLESH_ERR_FILE ? FLESH_ERR_ARGUMENT : status; /* no file was read */
}

/* Puts the middles of the edges after the positions, and lists the edge nodes of the tets. */
static void put_nodes(const flesh_mesh *mesh, const flesh_mesh_edges *edges, double *x, int *on_edges)
{
  const size_t nodes = (size_t)mesh->nodes;
  memcpy(x, mesh->positions, 3 * nodes * sizeof *x);
  for (size_t e = 0; e < (size_t)edges->count; e++)
    for (int d = 0; d < 3; d++) {
      double a = x[3 * (size_t)edges->ends[2 * e] + d], b = x[3 * (size_t)edges->ends[2 * e + 1] + d];
      x[3 * (nodes + e) + d] = a / 2 + b / 2;
    }
  for (size_t k = 0; k < 6 * (size_t)mesh->tets; k++) on_edges[k] = mesh->nodes + edges->tet_edges[k];
}

int flesh_mesh_raise_order(const flesh_mesh *mesh, flesh_mesh **raised)
{
  FLESH_NEED({raised, "raised"});
  *raised = NULL;
  FLESH_NEED({mesh, "mesh"});
  if (mesh->edge_nodes)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the mesh has order 2 already; only order 1 can be raised");
  if (mesh->tets > flesh_mesh_most_tets(2))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the mesh has %d tets; at most %d are supported at order 2",
                      mesh->tets, flesh_mesh_most_tets(2));
  flesh_mesh_edges edges;
  if (!flesh_mesh_edges_find(mesh->nodes, mesh->tets, mesh->tet_nodes, &edges))
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for the edges of %d tets", mesh->tets);
  double *x = NULL;
  int *on_edges = NULL, *ends = NULL, status = FLESH_OK;
  if (edges.count > INT_MAX / 3 - mesh->nodes) {
    status = flesh_fail(FLESH_ERR_ARGUMENT,
                        "%d nodes and %d edges make more than the %d nodes that are supported",
                        mesh->nodes, edges.count, INT_MAX / 3);
    goto done;
  }
  x = flesh_malloc(3 * ((size_t)mesh->nodes + (size_t)edges.count) * sizeof *x);
  on_edges = flesh_malloc(6 * (size_t)mesh->tets * sizeof *on_edges);
  ends = flesh_mesh_add_ends(mesh, edges.count, edges.ends);
  if (!x || !on_edges || !ends) {
    status = flesh_fail(FLESH_ERR_MEMORY, "out of memory for %d nodes on edges", edges.count);
    goto done;
  }
  put_nodes(mesh, &edges, x, on_edges);
  status = flesh_mesh_build(&(flesh_mesh_lists){.nodes = mesh->nodes + edges.count, .tets = mesh->tets, .positions = x,
                                                .tet_nodes = mesh->tet_nodes, .edge_nodes = on_edges,
                                                .regions = mesh->regions, .ends = ends, .sets = &mesh->sets}, NULL, raised);
  if (status) goto done;
  (*raised)->flipped = mesh->flipped;
  status = flesh_mesh_sets_add_between(&(*raised)->sets, mesh->nodes, (*raised)->nodes, ends);
  if (status) flesh_mesh_destroy(raised);
done:
  flesh_free(x);
  flesh_free(on_edges);
  flesh_free(ends);
  flesh_mesh_edges_clear(&edges);
  return status;
}

int flesh_mesh_lower_order(const flesh_mesh *mesh, flesh_mesh **lowered)
{
  FLESH_NEED({lowered, "lowered"});
  *lowered = NULL;
  FLESH_NEED({mesh, "mesh"});
  if (!mesh->edge_nodes)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the mesh has order 1 already; only order 2 can be lowered");
  const size_t nodes = (size_t)mesh->nodes, tets = (size_t)mesh->tets;
  int *number = flesh_calloc(nodes, sizeof *number), *corners = flesh_malloc(4 * tets * sizeof *corners);
  double *x = flesh_malloc(3 * nodes * sizeof *x);
  int kept = 0, status;
  if (!number || !corners || !x) {
    status = flesh_fail(FLESH_ERR_MEMORY, "out of memory for a mesh of %d tets", mesh->tets);
    goto done;
  }
  for (size_t k = 0; k < 6 * tets; k++)
    if (mesh->edge_nodes[k] >= 0) number[mesh->edge_nodes[k]] = -1;
  for (size_t n = 0; n < nodes; n++) {
    if (number[n] < 0) continue;
    memcpy(x + 3 * (size_t)kept, mesh->positions + 3 * n, 3 * sizeof *x);
    number[n] = kept++;
  }
  for (size_t k = 0; k < 4 * tets; k++) corners[k] = number[mesh->tet_nodes[k]];
  status = flesh_mesh_create(kept, x, mesh->tets, corners, mesh->regions, lowered);
  if (status) goto done;
  (*lowered)->flipped = mesh->flipped;
  status = flesh_mesh_sets_append(&(*lowered)->sets, &mesh->sets, &(flesh_mesh_sets_map){.nodes = number});
  if (status) flesh_mesh_destroy(lowered);
done:
  flesh_free(number);
  flesh_free(corners);
  flesh_free(x);
  return status;
}
