/* picture_curved.c: divides faces of six nodes into sixteen triangles each. */
#include "picture/picture_body.h"

#include <string.h>

#include "base/error.h"
#include "mesh/mesh.h"

enum { PARTS = 4 };

/* Returns the vertex at (i, j, k)/4 of a face; new vertices inside the face become known by inside [3]. */
static int vertex_at(flesh_curved_surface *s, const int n[6], const int at[3], int inside[3])
{
  int *place = &inside[at[0] == 2 ? 0 : at[1] == 2 ? 1 : 2];
  for (int d = 0; d < 3; d++) {
    const int from = (d + 1) % 3, to = (d + 2) % 3, middle = n[3 + from];
    if (at[d] == PARTS) return n[d];
    if (at[d]) continue;
    if (at[from] == at[to]) return middle;
    /* A quarter of the way between two corners; every middle node belongs to one edge. */
    place = &s->places[2 * middle + (at[from] > at[to] ? n[from] > n[to] : n[to] > n[from])];
  }
  if (!*place) *place = s->vertices++;
  int *six = s->six + 6 * (*place - s->nodes), *eighths = s->eighths + 6 * (*place - s->nodes);
  memcpy(six, n, 6 * sizeof *six);
  /* In quarters, L (2 L - 1) and 4 L L' are multiples of 1/8. */
  for (int d = 0; d < 3; d++) eighths[d] = at[d] * (at[d] - 2), eighths[3 + d] = 2 * at[d] * at[(d + 1) % 3];
  return *place;
}

/* Appends the triangle of three lattice points of a face of tet `tet`; its side is an edge of the mesh if both ends of
 * it are on one. */
static void add_triangle(flesh_curved_surface *s, int tet, const int n[6], int points[3][3], int inside[3])
{
  const int t = s->triangles++;
  s->tets[t] = tet;
  for (int k = 0; k < 3; k++) {
    const int *p = points[(k + 1) % 3], *q = points[(k + 2) % 3];
    s->corners[3 * (size_t)t + (size_t)k] = vertex_at(s, n, points[k], inside);
    if (!((!p[0] && !q[0]) || (!p[1] && !q[1]) || (!p[2] && !q[2]))) s->hidden[t] |= (uint8_t)(1 << k);
  }
}

/* Adds the face whose first triangle in the mesh is `first`, in small triangles. */
static void add_face(const flesh_mesh *mesh, int first, flesh_curved_surface *s)
{
  const int tet = mesh->surface_tets[first], *own = mesh->surface + 3 * (size_t)first;
  if (flesh_mesh_face_parts(mesh, tet) == 1) {
    const int t = s->triangles++;
    s->tets[t] = tet;
    memcpy(s->corners + 3 * (size_t)t, own, 3 * sizeof *s->corners);
    return;
  }
  /* Its corners a, b, c and the middles of ab, bc, ca, from its four triangles, which follow each other. */
  const int n[6] = {own[0], own[4], own[8], own[1], own[5], own[2]};
  int inside[3] = {0};
  for (int j = 0; j < PARTS; j++)
    for (int k = 0; j + k < PARTS; k++) {
      const int i = PARTS - j - k;
      int up[3][3] = {{i, j, k}, {i - 1, j + 1, k}, {i - 1, j, k + 1}};
      int down[3][3] = {{i - 1, j + 1, k}, {i - 2, j + 1, k + 1}, {i - 1, j, k + 1}};
      add_triangle(s, tet, n, up, inside);
      if (i > 1) add_triangle(s, tet, n, down, inside);
    }
}

int flesh_curved_surface_make(const flesh_mesh *mesh, flesh_arena *arena, flesh_curved_surface *s)
{
  /* Each of the mesh's triangles becomes at most four, with at most three vertices that are not nodes. */
  const size_t nodes = (size_t)flesh_mesh_node_count(mesh), most = (size_t)mesh->triangles;
  *s = (flesh_curved_surface){.nodes = (int)nodes, .vertices = (int)nodes,
                              .places = flesh_arena_take(arena, (2 * nodes + 52 * most) * sizeof(int) + 4 * most)};
  if (!s->places) return flesh_picture_no_memory();
  s->six = s->places + 2 * nodes;
  s->eighths = s->six + 18 * most;
  s->corners = s->eighths + 18 * most;
  s->tets = s->corners + 12 * most;
  s->hidden = (uint8_t *)(s->tets + 4 * most);
  for (int k = 0; k < mesh->triangles; k += flesh_mesh_face_parts(mesh, mesh->surface_tets[k])) add_face(mesh, k, s);
  return FLESH_OK;
}

void flesh_curved_surface_apply(const flesh_curved_surface *s, int components, const double *nodal, double *values)
{
  const size_t m = (size_t)components, nodes = (size_t)s->nodes;
  memcpy(values, nodal, m * nodes * sizeof *values);
  for (size_t v = nodes; v < (size_t)s->vertices; v++)
    for (size_t c = 0; c < m; c++) {
      const int *six = s->six + 6 * (v - nodes), *eighths = s->eighths + 6 * (v - nodes);
      double sum = 0;
      for (int a = 0; a < 6; a++)
        if (eighths[a]) sum += eighths[a] / 8. * nodal[m * (size_t)six[a] + c];
      values[m * v + c] = sum;
    }
}
