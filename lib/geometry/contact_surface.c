/* contact_surface.c: triangles, edges and nodes of the surfaces of bodies that can touch each other. */
#include "geometry/contact_surface.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"
#include "math/area.h"
#include "math/mat3.h"
#include "math/nearest.h"
#include "mesh/pieces.h"

static int no_memory(int count)
{
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for a contact surface of %d triangles", count);
}

/* A side of a triangle: its nodes, ascending, and 3*triangle + corner. */
typedef struct side {
  int low, high, place;
} side;

static int list_nodes(flesh_contact_surface *s)
{
  s->node_place = flesh_malloc(((size_t)s->mesh_nodes + 1) * sizeof *s->node_place);
  if (!s->node_place) return no_memory(s->face_count);
  for (int i = 0; i < s->mesh_nodes; i++) s->node_place[i] = -1;
  for (int k = 0; k < 3 * s->face_count; k++) s->node_place[s->faces[k]] = 0;
  for (int i = 0; i < s->mesh_nodes; i++)
    if (s->node_place[i] == 0) s->node_place[i] = s->node_count++;
  s->nodes = flesh_malloc(((size_t)s->node_count + 1) * sizeof *s->nodes);
  s->node_faces = flesh_calloc((size_t)s->node_count + 1, sizeof *s->node_faces);
  s->node_edges = flesh_calloc((size_t)s->node_count + 1, sizeof *s->node_edges);
  s->node_edge_uses = flesh_calloc((size_t)s->node_count + 1, sizeof *s->node_edge_uses);
  s->node_area = flesh_calloc((size_t)s->node_count + 1, sizeof *s->node_area);
  if (!s->nodes || !s->node_faces || !s->node_edges || !s->node_edge_uses || !s->node_area)
    return no_memory(s->face_count);
  for (int i = 0; i < s->mesh_nodes; i++)
    if (s->node_place[i] >= 0) s->nodes[s->node_place[i]] = i;
  for (int k = 0; k < 3 * s->face_count; k++) s->node_faces[s->node_place[s->faces[k]]]++;
  return FLESH_OK;
}

static int list_edges(flesh_contact_surface *s)
{
  const int sides = 3 * s->face_count;
  side *sorted = flesh_malloc(((size_t)sides + 1) * sizeof *sorted);
  const size_t most = (size_t)sides + 1;
  s->edges = flesh_malloc(2 * most * sizeof *s->edges);
  s->edge_faces = flesh_malloc(2 * most * sizeof *s->edge_faces);
  s->edge_uses = flesh_calloc(most, sizeof *s->edge_uses);
  s->edge_area = flesh_calloc(most, sizeof *s->edge_area);
  s->face_edges = flesh_malloc(most * sizeof *s->face_edges);
  if (!sorted || !s->edges || !s->edge_faces || !s->edge_uses || !s->edge_area || !s->face_edges) {
    flesh_free(sorted);
    return no_memory(s->face_count);
  }
  for (int k = 0; k < sides; k++) {
    const int a = s->faces[k], b = s->faces[k % 3 == 2 ? k - 2 : k + 1];
    sorted[k] = (side){a < b ? a : b, a < b ? b : a, k};
  }
  flesh_sort(sorted, (size_t)sides, sizeof *sorted, flesh_compare_three_ints);
  for (int k = 0; k < sides; k++) {
    int e = s->edge_count - 1;
    if (k == 0 || sorted[k].low != sorted[k - 1].low || sorted[k].high != sorted[k - 1].high) {
      e = s->edge_count++;
      s->edges[2 * e] = sorted[k].low, s->edges[2 * e + 1] = sorted[k].high;
      s->edge_faces[2 * e] = s->edge_faces[2 * e + 1] = -1;
    }
    if (s->edge_uses[e] < 2) s->edge_faces[2 * e + s->edge_uses[e]] = sorted[k].place / 3;
    s->edge_uses[e]++;
    s->face_edges[sorted[k].place] = e;
  }
  for (int k = 0; k < 2 * s->edge_count; k++) {
    s->node_edges[s->node_place[s->edges[k]]]++;
    s->node_edge_uses[s->node_place[s->edges[k]]] += s->edge_uses[k / 2];
  }
  flesh_free(sorted);
  return FLESH_OK;
}

static void measure(const double *X, flesh_contact_surface *s)
{
  for (int f = 0; f < s->face_count; f++) {
    double n[3];
    flesh_area_vector_at(X, s->faces + 3 * (size_t)f, n);
    const double area = sqrt(flesh_vec3_dot(n, n)) / 2;
    s->area += area;
    for (int k = 0; k < 3; k++) {
      s->node_area[s->node_place[s->faces[3 * f + k]]] += area / 3;
      s->edge_area[s->face_edges[3 * f + k]] += area / 3;
    }
  }
  for (int e = 0; e < s->edge_count; e++)
    s->mean_edge += flesh_distance(X + 3 * (size_t)s->edges[2 * e], X + 3 * (size_t)s->edges[2 * e + 1]) / s->edge_count;
}

/* Unites the nodes of each cell [size*count] in `set`; nodes of no cell keep -1. */
static void join_cells(int size, int count, const int *cells, int *set)
{
  const size_t all = (size_t)size * (size_t)count;
  for (size_t k = 0; k < all; k++)
    if (cells[k] >= 0) set[cells[k]] = cells[k];
  for (size_t k = 0; k < all; k++)
    if (cells[k] >= 0) flesh_sets_join(set, cells[k - k % (size_t)size], cells[k]);
}

/* Replaces sets by body numbers, ascending by their least nodes. */
static void number_sets(int nodes, int *set)
{
  int bodies = 0;
  for (int i = 0; i < nodes; i++)
    if (set[i] >= 0) set[i] = flesh_set_of(set, i);
  /* The least node of a set comes first. It gets -2 - number, which the other nodes then look up. */
  for (int i = 0; i < nodes; i++)
    if (set[i] >= 0) set[i] = set[i] == i ? -2 - bodies++ : set[set[i]];
  for (int i = 0; i < nodes; i++) set[i] = -2 - set[i];
}

/* Copies body [mesh_nodes] to node_body and counts the bodies. FLESH_ERR_ARGUMENT for a negative number. */
static int keep_bodies(const int *body, flesh_contact_surface *s)
{
  s->node_body = flesh_malloc(((size_t)s->node_count + 1) * sizeof *s->node_body);
  if (!s->node_body) return no_memory(s->face_count);
  for (int k = 0; k < s->node_count; k++) {
    s->node_body[k] = body[s->nodes[k]];
    if (s->node_body[k] < 0)
      return flesh_fail(FLESH_ERR_ARGUMENT, "node %d is in body %d; bodies have the numbers 0, 1, ...", s->nodes[k],
                        s->node_body[k]);
    if (s->node_body[k] >= s->body_count) s->body_count = s->node_body[k] + 1;
  }
  return FLESH_OK;
}

/* Labels the pieces that triangles connect. */
static int find_pieces(flesh_contact_surface *s)
{
  int *set = flesh_malloc(((size_t)s->mesh_nodes + 1) * sizeof *set);
  s->node_piece = flesh_malloc(((size_t)s->node_count + 1) * sizeof *s->node_piece);
  if (set && s->node_piece) {
    join_cells(3, s->face_count, s->faces, set);
    for (int k = 0; k < s->node_count; k++) s->node_piece[k] = flesh_set_of(set, s->nodes[k]);
  }
  flesh_free(set);
  return s->node_piece && set ? FLESH_OK : no_memory(s->face_count);
}

/* Makes everything but the bodies. */
static int make(int nodes, const double *X, int count, const int *triangles, flesh_contact_surface *s)
{
  *s = (flesh_contact_surface){.mesh_nodes = nodes, .face_count = count};
  for (int k = 0; k < 3 * count; k++) {
    const int *corner = triangles + k / 3 * 3;
    if (triangles[k] < 0 || triangles[k] >= nodes || corner[k % 3] == corner[(k + 1) % 3])
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "triangle %d has the corners %d, %d, %d; they must be three of the nodes 0 to %d", k / 3,
                        corner[0], corner[1], corner[2], nodes - 1);
  }
  s->faces = flesh_malloc((3 * (size_t)count + 1) * sizeof *s->faces);
  if (!s->faces) return no_memory(count);
  memcpy(s->faces, triangles, 3 * (size_t)count * sizeof *s->faces);
  int status = list_nodes(s);
  if (!status) status = list_edges(s);
  if (!status) measure(X, s);
  return status ? status : find_pieces(s);
}

int flesh_contact_surface_of_triangles(int nodes, const double *X, int count, const int *triangles, const int *body,
                                       flesh_contact_surface *surface)
{
  int status = make(nodes, X, count, triangles, surface);
  int *set = flesh_malloc(((size_t)nodes + 1) * sizeof *set);
  if (!status && !set) status = no_memory(count);
  if (!status) {
    for (int i = 0; i < nodes; i++) set[i] = body ? body[i] : -1;
    if (!body) {
      join_cells(3, count, triangles, set);
      number_sets(nodes, set);
    }
    status = keep_bodies(set, surface);
  }
  flesh_free(set);
  if (status) flesh_contact_surface_clear(surface);
  return status;
}

/* Finds for each mesh node the least tet_body of its tets. */
static void bodies_of_tets(const flesh_mesh *mesh, const int *tet_body, int *body)
{
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++) {
    int n[10];
    const int size = flesh_mesh_tet_nodes(mesh, t, n);
    for (int a = 0; a < size; a++)
      if (tet_body[t] < body[n[a]]) body[n[a]] = tet_body[t];
  }
}

/* Labels the connected parts: piece [nodes] is the number of the part that tets connect. */
static void pieces_of_tets(const flesh_mesh *mesh, int *piece)
{
  const int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  for (int i = 0; i < nodes; i++) piece[i] = -1;
  join_cells(4, tets, flesh_mesh_tets(mesh), piece);
  for (int t = 0; t < tets; t++) { /* mid-edge nodes, after the corners have been united */
    int n[10];
    const int size = flesh_mesh_tet_nodes(mesh, t, n);
    for (int a = 4; a < size; a++) {
      if (piece[n[a]] < 0) piece[n[a]] = n[a];
      flesh_sets_join(piece, n[0], n[a]);
    }
  }
  number_sets(nodes, piece);
}

int flesh_contact_surface_of_mesh(const flesh_mesh *mesh, const int *tet_body, flesh_contact_surface *surface)
{
  int count;
  const size_t nodes = (size_t)flesh_mesh_node_count(mesh);
  const int *triangles = flesh_mesh_surface(mesh, &count);
  int *body = flesh_malloc((2 * nodes + 1) * sizeof *body), *piece = body + nodes;
  *surface = (flesh_contact_surface){0};
  if (!body) return no_memory(count);
  pieces_of_tets(mesh, piece);
  for (size_t i = 0; i < nodes; i++) body[i] = tet_body ? INT_MAX : piece[i];
  if (tet_body) bodies_of_tets(mesh, tet_body, body);
  const int status =
      flesh_contact_surface_of_triangles((int)nodes, flesh_mesh_positions(mesh), count, triangles, body, surface);
  for (int k = 0; k < surface->node_count && !status; k++) surface->node_piece[k] = piece[surface->nodes[k]];
  flesh_free(body);
  return status;
}

/* Returns an allocated copy, or NULL if there is no memory. */
static void *copy_of(size_t count, size_t size, const void *from)
{
  void *copy = flesh_malloc((count + 1) * size);
  if (copy && count) memcpy(copy, from, count * size);
  return copy;
}

int flesh_contact_surface_renumber(const flesh_contact_surface *whole, int nodes, const int *local,
                                   flesh_contact_surface *s)
{
  const size_t n = (size_t)whole->node_count, faces = 3 * (size_t)whole->face_count, edges = (size_t)whole->edge_count;
  const size_t one = sizeof(int), real = sizeof(double);
  int failed = 0;
  *s = *whole;
  s->mesh_nodes = nodes;
  failed |= !(s->nodes = copy_of(n, one, local));
  failed |= !(s->node_place = flesh_malloc(((size_t)nodes + 1) * one));
  failed |= !(s->faces = copy_of(faces, one, whole->faces));
  failed |= !(s->face_edges = copy_of(faces, one, whole->face_edges));
  failed |= !(s->edges = copy_of(2 * edges, one, whole->edges));
  failed |= !(s->edge_faces = copy_of(2 * edges, one, whole->edge_faces));
  failed |= !(s->edge_uses = copy_of(edges, one, whole->edge_uses));
  failed |= !(s->node_edge_uses = copy_of(n, one, whole->node_edge_uses));
  failed |= !(s->node_faces = copy_of(n, one, whole->node_faces));
  failed |= !(s->node_edges = copy_of(n, one, whole->node_edges));
  failed |= !(s->node_area = copy_of(n, real, whole->node_area));
  failed |= !(s->edge_area = copy_of(edges, real, whole->edge_area));
  failed |= !(s->node_body = copy_of(n, one, whole->node_body));
  failed |= !(s->node_piece = copy_of(n, one, whole->node_piece));
  if (failed) return no_memory(whole->face_count);
  for (int i = 0; i < nodes; i++) s->node_place[i] = -1;
  for (int k = 0; k < s->node_count; k++) s->node_place[local[k]] = k;
  for (size_t k = 0; k < faces; k++) s->faces[k] = local[whole->node_place[whole->faces[k]]];
  for (size_t k = 0; k < 2 * edges; k++) s->edges[k] = local[whole->node_place[whole->edges[k]]];
  return FLESH_OK;
}

int flesh_contact_surface_around(const flesh_contact_surface *s, int corners, int **start, int **list)
{
  const int *ends = corners == 3 ? s->faces : s->edges, count = corners * (corners == 3 ? s->face_count : s->edge_count);
  *start = calloc((size_t)s->node_count + 2, sizeof **start);
  *list = malloc(((size_t)count + 1) * sizeof **list);
  if (!*start || !*list) return flesh_fail(FLESH_ERR_MEMORY, "no memory for what is around %d nodes", s->node_count);
  for (int k = 0; k < count; k++) (*start)[s->node_place[ends[k]] + 2]++;
  for (int n = 0; n < s->node_count; n++) (*start)[n + 2] += (*start)[n + 1];
  for (int k = 0; k < count; k++) (*list)[(*start)[s->node_place[ends[k]] + 1]++] = k / corners;
  return FLESH_OK;
}

void flesh_contact_surface_clear(flesh_contact_surface *s)
{
  void *const owned[] = {s->nodes, s->node_place, s->faces, s->face_edges, s->edges, s->edge_faces, s->edge_uses,
                         s->node_edge_uses, s->node_faces, s->node_edges, s->node_area, s->edge_area, s->node_body, s->node_piece};
  for (size_t k = 0; k < sizeof owned / sizeof *owned; k++) flesh_free(owned[k]);
  *s = (flesh_contact_surface){0};
}

size_t flesh_contact_surface_memory(const flesh_contact_surface *s)
{
  const size_t ints = (size_t)s->mesh_nodes + 6 * (size_t)s->node_count + 6 * (size_t)s->face_count +
                      5 * (size_t)s->edge_count, doubles = (size_t)s->node_count + (size_t)s->edge_count;
  return sizeof *s + ints * sizeof(int) + doubles * sizeof(double);
}
