/* picture_curved.c: divides faces of six nodes into sixteen triangles each. */
#include "picture/picture_body.h"

#include <string.h>

#include "base/error.h"
#include "mesh/mesh.h"

enum { PARTS = 4, POINTS = 15, TRIANGLES = PARTS * PARTS };

/* Returns the vertex a quarter of the way from corner `near` to `far`; every middle node belongs to one edge. */
static int quarter(const flesh_mesh *mesh, int near, int middle, int far)
{
  return flesh_mesh_node_count(mesh) + 2 * middle + (near > far);
}

/* Returns the vertex at (i, j, k)/4 of a face. */
static int vertex_at(const flesh_mesh *mesh, int f, const int n[6], const int at[3])
{
  int twos = 0, zero = -1;
  for (int d = 0; d < 3; d++) {
    if (at[d] == PARTS) return n[d];
    twos += at[d] == 2;
    if (at[d] == 0) zero = d;
  }
  if (zero < 0) return 3 * flesh_mesh_node_count(mesh) + 3 * f + (at[0] == 2 ? 0 : at[1] == 2 ? 1 : 2);
  const int from = (zero + 1) % 3, to = (zero + 2) % 3, middle = n[3 + from];
  if (twos) return middle;
  return at[from] > at[to] ? quarter(mesh, n[from], middle, n[to]) : quarter(mesh, n[to], middle, n[from]);
}

/* Returns the number of faces. */
static int count_faces(const flesh_mesh *mesh)
{
  int faces = 0;
  for (int k = 0; k < mesh->triangles; k += flesh_mesh_face_parts(mesh, mesh->surface_tets[k])) faces++;
  return faces;
}

/* Appends the triangle of three lattice points of a face of tet `tet`; its side is an edge of the mesh if both ends of
 * it are on one. */
static void add_triangle(const flesh_mesh *mesh, int tet, int f, const int n[6], int points[3][3],
                         flesh_curved_surface *s)
{
  const int t = s->triangles++;
  s->tets[t] = tet;
  s->hidden[t] = 0;
  for (int k = 0; k < 3; k++) {
    const int *p = points[(k + 1) % 3], *q = points[(k + 2) % 3];
    s->corners[3 * (size_t)t + (size_t)k] = vertex_at(mesh, f, n, points[k]);
    if (!((!p[0] && !q[0]) || (!p[1] && !q[1]) || (!p[2] && !q[2]))) s->hidden[t] |= (uint8_t)(1 << k);
  }
}

/* Makes the vertices of a face that are not nodes; in quarters, L (2 L - 1) and 4 L L' are multiples of 1/8. */
static void add_vertices(const flesh_mesh *mesh, int f, const int n[6], flesh_curved_surface *s)
{
  for (int j = 0; j <= PARTS; j++)
    for (int k = 0; j + k <= PARTS; k++) {
      const int at[3] = {PARTS - j - k, j, k}, number = vertex_at(mesh, f, n, at);
      flesh_curved_vertex *v = &s->rows[number];
      if (number < flesh_mesh_node_count(mesh)) continue;
      memcpy(v->nodes, n, sizeof v->nodes);
      for (int d = 0; d < 3; d++) v->eighths[d] = at[d] * (at[d] - 2), v->eighths[3 + d] = 2 * at[d] * at[(d + 1) % 3];
    }
}

/* Adds face f, whose first triangle in the mesh is `first`, in small triangles. */
static void add_face(const flesh_mesh *mesh, int first, int f, flesh_curved_surface *s)
{
  const int tet = mesh->surface_tets[first], *own = mesh->surface + 3 * (size_t)first;
  if (flesh_mesh_face_parts(mesh, tet) == 1) {
    const int t = s->triangles++;
    s->tets[t] = tet;
    s->hidden[t] = 0;
    memcpy(s->corners + 3 * (size_t)t, own, 3 * sizeof *s->corners);
    return;
  }
  /* Its corners a, b, c and the middles of ab, bc, ca, from its four triangles, which follow each other. */
  const int n[6] = {own[0], own[4], own[8], own[1], own[5], own[2]};
  add_vertices(mesh, f, n, s);
  for (int j = 0; j < PARTS; j++)
    for (int k = 0; j + k < PARTS; k++) {
      const int i = PARTS - j - k;
      int up[3][3] = {{i, j, k}, {i - 1, j + 1, k}, {i - 1, j, k + 1}};
      int down[3][3] = {{i - 1, j + 1, k}, {i - 2, j + 1, k + 1}, {i - 1, j, k + 1}};
      add_triangle(mesh, tet, f, n, up, s);
      if (i > 1) add_triangle(mesh, tet, f, n, down, s);
    }
}

int flesh_curved_surface_make(const flesh_mesh *mesh, flesh_arena *arena, flesh_curved_surface *s)
{
  const int faces = count_faces(mesh), nodes = flesh_mesh_node_count(mesh), vertices = 3 * nodes + 3 * faces;
  const size_t triangles = TRIANGLES * (size_t)faces;
  const size_t rows = ((size_t)vertices + 1) * sizeof *s->rows;
  *s = (flesh_curved_surface){.vertices = vertices, .rows = flesh_arena_take(arena, rows + triangles * (4 * sizeof(int) + 1))};
  if (!s->rows) return flesh_picture_no_memory();
  s->corners = (int *)(s->rows + vertices + 1);
  s->tets = s->corners + 3 * triangles;
  s->hidden = (uint8_t *)(s->tets + triangles);
  for (int v = 0; v < nodes; v++) s->rows[v] = (flesh_curved_vertex){{v}, {8}};
  for (int f = 0, first = 0; f < faces; f++) {
    add_face(mesh, first, f, s);
    first += flesh_mesh_face_parts(mesh, mesh->surface_tets[first]);
  }
  return FLESH_OK;
}

void flesh_curved_surface_apply(const flesh_curved_surface *s, int components, const double *nodal, double *values)
{
  const size_t m = (size_t)components;
  for (size_t v = 0; v < (size_t)s->vertices; v++)
    for (size_t c = 0; c < m; c++) {
      const flesh_curved_vertex *row = &s->rows[v];
      double sum = 0;
      for (int a = 0; a < 6; a++)
        if (row->eighths[a]) sum += row->eighths[a] / 8. * nodal[m * (size_t)row->nodes[a] + c];
      values[m * v + c] = sum;
    }
}
