/* picture_obstacle.c: makes triangles of the obstacles that a body touches, and finds the front of a mesh: the side
 * that the body is on. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/sort.h"
#include "effect/contact.h"
#include "math/mat3.h"
#include "picture/picture_body.h"
#include "surface/surface.h"

/* Makes room for the arrays of a surface. */
static int allocate(flesh_arena *arena, int vertices, int triangles, flesh_render_surface *s, double **x, int **corners)
{
  s->vertices = vertices, s->triangles = triangles;
  s->x = *x = flesh_arena_take(arena, 3 * (size_t)vertices * sizeof **x);
  s->corners = *corners = flesh_arena_take(arena, 3 * (size_t)triangles * sizeof **corners);
  return *x && *corners ? FLESH_OK : flesh_picture_no_memory();
}

/* Makes a grid of a square, given by its corners in order, so that parts behind the eye can be left out triangle by
 * triangle. */
static int cut_plane(const double *ring, flesh_arena *arena, flesh_render_surface *s)
{
  enum { CELLS = 40 };
  double *x;
  int *c;
  const int status = allocate(arena, (CELLS + 1) * (CELLS + 1), 2 * CELLS * CELLS, s, &x, &c);
  if (status) return status;
  for (int j = 0; j <= CELLS; j++)
    for (int i = 0; i <= CELLS; i++)
      for (int d = 0; d < 3; d++)
        *x++ = ring[d] + i * (ring[3 + d] - ring[d]) / CELLS + j * (ring[6 + d] - ring[3 + d]) / CELLS;
  for (int j = 0; j < CELLS; j++)
    for (int i = 0; i < CELLS; i++) {
      int at = j * (CELLS + 1) + i, cell[6] = {at, at + 1, at + CELLS + 2, at, at + CELLS + 2, at + CELLS + 1};
      for (int k = 0; k < 6; k++) *c++ = cell[k];
    }
  return FLESH_OK;
}

/* Copies a surface. Corners at the same place become one node, so that the light is smooth over seams. Unless `panel` is
 * NULL, triangles are turned towards its body. */
static int copy_surface(const flesh_surface *surface, const flesh_picture_panel *panel, flesh_arena *arena,
                        flesh_render_surface *s)
{
  double *x;
  int *corners, *first = flesh_arena_take(arena, sizeof *first * (size_t)flesh_surface_vertex_count(surface));
  int status = allocate(arena, flesh_surface_vertex_count(surface), flesh_surface_face_count(surface), s, &x, &corners);
  if (!status && !first) status = flesh_picture_no_memory();
  if (status) return status;
  memcpy(x, flesh_surface_positions(surface), 3 * (size_t)s->vertices * sizeof *x);
  status = flesh_surface_first_vertices(s->vertices, x, first);
  for (int c = 0; c < 3 * s->triangles && !status; c++) corners[c] = first[flesh_surface_corners(surface)[c]];
  return status || !panel ? status : flesh_picture_turn_to_body(panel, x, s->triangles, corners);
}

static int make_obstacle(const flesh_picture_panel *panel, const flesh_obstacle *obstacle, const flesh_view *view,
                         flesh_arena *arena, flesh_render_surface *s)
{
  /* A plane's square extends beyond the picture. */
  const double extent = view ? 2.4 * view->height * fmax(1, (double)view->width_px / view->height_px) : 1;
  double centre[3] = {0, 0, 0};
  flesh_surface *surface;
  if (view) memcpy(centre, view->target, sizeof centre);
  int status = flesh_obstacle_surface(obstacle, panel->t, centre, extent, &surface);
  if (status) return status;
  s->glass = 1;
  s->ground = flesh_surface_vertex_count(surface) == 4 && flesh_surface_face_count(surface) == 2; /* a plane */
  if (s->ground && view) {
    s->fade = extent;
    status = cut_plane(flesh_surface_positions(surface), arena, s);
  }
  if (!s->ground) status = copy_surface(surface, view ? panel : NULL, arena, s);
  flesh_surface_destroy(&surface);
  return status;
}

int flesh_picture_obstacles(const flesh_picture_panel *panel, const flesh_view *view, flesh_picture_scene *scene)
{
  const int effects = panel->system ? flesh_system_effect_count(panel->system) : 0;
  int status = FLESH_OK;
  *scene = (flesh_picture_scene){.count = 1};
  scene->surfaces = flesh_arena_take(&scene->arena, ((size_t)effects + 1) * sizeof *scene->surfaces);
  if (!scene->surfaces) return flesh_picture_no_memory();
  for (int e = 0; e < effects && !status; e++) {
    const flesh_obstacle *obstacle = flesh_effect_obstacle(flesh_system_effect(panel->system, e));
    if (obstacle) status = make_obstacle(panel, obstacle, view, &scene->arena, &scene->surfaces[scene->count++]);
  }
  return status;
}

/* A side of a triangle, from its node `from` to another. */
typedef struct side {
  int low, high; /* the two nodes, in ascending order */
  int triangle, from;
} side;

/* Joins two triangles, whose orientations agree if `alike`, unless that contradicts earlier ones. Number 2t of the
 * disjoint sets is triangle t as it is, 2t+1 the same turned: a set has what is oriented alike. */
static void join(int *sets, int a, int b, int alike)
{
  if (flesh_set_of(sets, 2 * a) == flesh_set_of(sets, 2 * b + alike)) return;
  flesh_sets_join(sets, 2 * a, 2 * b + !alike);
  flesh_sets_join(sets, 2 * a + 1, 2 * b + alike);
}

/* Finds the connected components. Triangles hang together across a side that just two of them have. */
static int find_components(int triangles, const int *corners, int *sets)
{
  const size_t count = 3 * (size_t)triangles;
  side *sides = malloc((count + 1) * sizeof *sides);
  if (!sides) return -1;
  for (int k = 0; k < 2 * triangles; k++) sets[k] = k;
  for (size_t c = 0; c < count; c++) {
    int from = corners[c], to = corners[c % 3 == 2 ? c - 2 : c + 1];
    sides[c] = (side){from < to ? from : to, from < to ? to : from, (int)(c / 3), from};
  }
  qsort(sides, count, sizeof *sides, flesh_compare_two_ints);
  for (size_t begin = 0, end; begin < count; begin = end) {
    for (end = begin + 1; end < count && !flesh_compare_two_ints(&sides[begin], &sides[end]);) end++;
    const side *a = &sides[begin], *b = a + 1;
    if (end - begin == 2) join(sets, a->triangle, b->triangle, a->from != b->from);
  }
  free(sides);
  return 0;
}

/* Returns the solid angle of the triangle seen from p, over 4 pi; positive if p sees its back (van Oosterom & Strackee
 * 1983). The sum over a closed surface that is oriented outwards is 1 inside and 0 outside. */
static double solid_angle(const double *x, const int *corners, const double p[3])
{
  double a[3][3], length[3], n[3];
  for (int k = 0; k < 3; k++) {
    for (int d = 0; d < 3; d++) a[k][d] = x[3 * (size_t)corners[k] + (size_t)d] - p[d];
    length[k] = sqrt(flesh_vec3_dot(a[k], a[k]));
  }
  flesh_vec3_cross(a[1], a[2], n);
  const double above = flesh_vec3_dot(a[0], n);
  const double below = length[0] * length[1] * length[2] + flesh_vec3_dot(a[0], a[1]) * length[2] +
                       flesh_vec3_dot(a[1], a[2]) * length[0] + flesh_vec3_dot(a[2], a[0]) * length[1];
  return atan2(above, below) / (2 * acos(-1));
}

/* Returns six times the volume between the triangle and the point `o`. */
static double volume(const double *x, const int *corners, const double *o)
{
  double edges[9];
  for (int k = 0; k < 9; k++) edges[k] = x[3 * (size_t)corners[k / 3] + (size_t)(k % 3)] - o[k % 3];
  return flesh_mat3_determinant(edges);
}

static void swap(int *corners)
{
  const int kept = corners[1];
  corners[1] = corners[2];
  corners[2] = kept;
}

/* Chooses up to `room` of the body's nodes, spread over it; returns their number. Nodes are never inside an obstacle,
 * while the middle of a ring may be. */
static int sample_nodes(const flesh_picture_panel *panel, int room, const double **points)
{
  const int nodes = panel->x ? flesh_mesh_node_count(panel->body->mesh) : 0;
  int count = 0;
  for (int k = 0; k < room && nodes; k++) {
    const double *p = panel->x + 3 * (size_t)((int64_t)k * nodes / room);
    if (isfinite(p[0] + p[1] + p[2])) points[count++] = p;
  }
  return count;
}

/* Orients each component like its lowest triangle, and then by what the body's nodes see of it; if they see as much of
 * either side, as of a closed surface from outside, by the sign of its volume. */
static int turn_components(int *sets, const double *x, const flesh_picture_panel *panel, int triangles, int *corners)
{
  enum { SAMPLES = 16 };
  static const double SEEN = 1e-3;
  const double *points[SAMPLES];
  const int samples = sample_nodes(panel, SAMPLES, points);
  double(*sums)[2] = calloc((size_t)triangles + 1, sizeof *sums); /* of each component, at its lowest triangle */
  if (!sums) return -1;
  for (int t = 0; t < triangles; t++) {
    int *own = corners + 3 * (size_t)t;
    const int like = flesh_set_of(sets, 2 * t);
    double *sum = sums[like / 2];
    if (like % 2) swap(own);
    for (int k = 0; k < samples; k++) sum[0] += solid_angle(x, own, points[k]) / samples;
    sum[1] += volume(x, own, x + 3 * (size_t)corners[0]);
  }
  for (int t = 0; t < triangles; t++) {
    const double *sum = sums[flesh_set_of(sets, 2 * t) / 2];
    if (fabs(sum[0]) > SEEN ? sum[0] > 0 : sum[1] < 0) swap(corners + 3 * (size_t)t);
  }
  free(sums);
  return 0;
}

int flesh_picture_turn_to_body(const flesh_picture_panel *panel, const double *positions, int triangles, int *corners)
{
  int *sets = malloc((2 * (size_t)triangles + 1) * sizeof *sets);
  const int failed = !sets || find_components(triangles, corners, sets) ||
                     turn_components(sets, positions, panel, triangles, corners);
  free(sets);
  return failed ? flesh_picture_no_memory() : FLESH_OK;
}
