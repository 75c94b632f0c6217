/* picture_obstacle.c: makes triangles of the obstacles that a body touches, and finds the front of a mesh: the side
 * that the body is on. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/sort.h"
#include "effect/contact.h"
#include "math/mat3.h"
#include "picture/picture_body.h"
#include "surface/surface.h"

static const flesh_obstacle *find(const flesh_picture_panel *panel, int wanted, int *count)
{
  const flesh_obstacle *found = NULL;
  *count = 0;
  for (int e = 0; panel->system && e < flesh_system_effect_count(panel->system); e++) {
    const flesh_obstacle *obstacle =
        flesh_effect_obstacle(flesh_system_effect(panel->system, e));
    if (obstacle && (*count)++ == wanted) found = obstacle;
  }
  return found;
}

int flesh_picture_obstacle_count(const flesh_picture_panel *panel)
{
  int count;
  find(panel, -1, &count);
  return count;
}

static int allocate(flesh_arena *arena, flesh_picture_obstacle *o, int vertices, int triangles)
{
  *o = (flesh_picture_obstacle){vertices, triangles, flesh_arena_take(arena, 3 * (size_t)vertices * sizeof *o->x),
                                flesh_arena_take(arena, 3 * (size_t)triangles * sizeof *o->corners), 0};
  return o->x && o->corners ? FLESH_OK : flesh_picture_no_memory();
}

/* Makes a grid of a square, given by its corners in order, so that parts behind the eye can be left out triangle by
 * triangle. */
static int cut_plane(const double *ring, flesh_arena *arena, flesh_picture_obstacle *o)
{
  enum { CELLS = 40 };
  const int status = allocate(arena, o, (CELLS + 1) * (CELLS + 1), 2 * CELLS * CELLS);
  if (status) return status;
  double *x = o->x;
  int *c = o->corners;
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

/* Merges corners at the same place into one node, so that the light is smooth over seams. */
static int weld(flesh_arena *arena, flesh_picture_obstacle *o)
{
  int *first = flesh_arena_take(arena, sizeof *first * (size_t)o->vertices);
  const int status = first ? flesh_surface_first_vertices(o->vertices, o->x, first) : flesh_picture_no_memory();
  for (int c = 0; c < 3 * o->triangles && !status; c++) o->corners[c] = first[o->corners[c]];
  return status;
}

double flesh_picture_plane_extent(const flesh_view *view)
{
  return 2.4 * view->height * fmax(1, (double)view->width_px / view->height_px);
}

static int copy_surface(const flesh_surface *surface, flesh_arena *arena, flesh_picture_obstacle *o)
{
  const int status = allocate(arena, o, flesh_surface_vertex_count(surface), flesh_surface_face_count(surface));
  if (status) return status;
  memcpy(o->x, flesh_surface_positions(surface), 3 * (size_t)o->vertices * sizeof *o->x);
  memcpy(o->corners, flesh_surface_corners(surface), 3 * (size_t)o->triangles * sizeof *o->corners);
  return FLESH_OK;
}

int flesh_picture_obstacle_make(const flesh_picture_panel *panel, int k, const flesh_view *view, flesh_arena *arena,
                                flesh_picture_obstacle *o)
{
  int count;
  const flesh_obstacle *obstacle = find(panel, k, &count);
  double centre[3] = {0, 0, 0}, extent = view ? flesh_picture_plane_extent(view) : 1;
  for (int d = 0; view && d < 3; d++) centre[d] = view->target[d];
  flesh_surface *surface;
  *o = (flesh_picture_obstacle){0};
  int status = flesh_obstacle_surface(obstacle, panel->t, centre, extent, &surface);
  if (status) return status;
  const int is_plane = flesh_surface_vertex_count(surface) == 4 && flesh_surface_face_count(surface) == 2;
  if (!is_plane) {
    status = copy_surface(surface, arena, o);
    if (!status) status = weld(arena, o);
    if (!status && view) status = flesh_picture_face_body(panel, o->x, o->triangles, o->corners);
  } else if (view) {
    status = cut_plane(flesh_surface_positions(surface), arena, o);
  }
  flesh_surface_destroy(&surface);
  o->is_plane = is_plane;
  return status;
}

/* An edge of a triangle, from its node `from` to another. */
typedef struct edge {
  int low, high; /* the two nodes, in ascending order */
  int triangle, from;
} edge;

typedef struct sheet {
  int triangles, *corners;
  int *neighbours;      /* [3*triangles] triangle across side k; -1: none, or more than one */
  signed char *alike;   /* [3*triangles] 1: both triangles have the same orientation */
  int *component;       /* [triangles]; -1: not yet known */
  signed char *turn;    /* [triangles] */
  int *queue;
} sheet;

static int link_sides(sheet *s)
{
  const size_t count = 3 * (size_t)s->triangles;
  edge *edges = malloc((count + 1) * sizeof *edges);
  if (!edges) return -1;
  for (size_t c = 0; c < count; c++) {
    int from = s->corners[c], to = s->corners[c % 3 == 2 ? c - 2 : c + 1];
    edges[c] = (edge){from < to ? from : to, from < to ? to : from, (int)c, from};
    s->neighbours[c] = -1;
  }
  qsort(edges, count, sizeof *edges, flesh_compare_two_ints);
  for (size_t begin = 0, end; begin < count; begin = end) {
    for (end = begin + 1; end < count && !flesh_compare_two_ints(&edges[begin], &edges[end]);) end++;
    if (end - begin != 2) continue;
    const edge *a = &edges[begin], *b = a + 1;
    s->neighbours[a->triangle] = b->triangle / 3;
    s->neighbours[b->triangle] = a->triangle / 3;
    s->alike[a->triangle] = s->alike[b->triangle] = a->from != b->from;
  }
  free(edges);
  return 0;
}

/* Visits the connected component of triangle t, numbers it `number`, and finds which of its triangles to turn. */
static void spread(sheet *s, int t, int number)
{
  int head = 0, tail = 0;
  s->queue[tail++] = t;
  s->component[t] = number;
  s->turn[t] = 0;
  while (head < tail) {
    const int at = s->queue[head++];
    for (int k = 0; k < 3; k++) {
      const int other = s->neighbours[3 * at + k];
      if (other < 0 || s->component[other] >= 0) continue;
      s->component[other] = number;
      s->turn[other] = (signed char)(s->alike[3 * at + k] ? s->turn[at] : !s->turn[at]);
      s->queue[tail++] = other;
    }
  }
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
  double a[3][3], n[3];
  for (int k = 0; k < 3; k++)
    for (int d = 0; d < 3; d++) a[k][d] = x[3 * (size_t)corners[k] + (size_t)d] - o[d];
  flesh_vec3_cross(a[1], a[2], n);
  return flesh_vec3_dot(a[0], n);
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

/* Orients each component by what the body's nodes see of it; if they see as much of either side, as of a closed surface
 * from outside, by the sign of its volume. */
static int turn_components(const sheet *s, int components, const double *x, const flesh_picture_panel *panel)
{
  enum { SAMPLES = 16 };
  static const double SEEN = 1e-3;
  const double *points[SAMPLES];
  const int samples = sample_nodes(panel, SAMPLES, points);
  double(*sums)[2] = calloc((size_t)components + 1, sizeof *sums);
  if (!sums) return -1;
  for (int t = 0; t < s->triangles; t++) {
    int *corners = s->corners + 3 * (size_t)t;
    double *sum = sums[s->component[t]];
    if (s->turn[t]) swap(corners);
    for (int k = 0; k < samples; k++) sum[0] += solid_angle(x, corners, points[k]) / samples;
    sum[1] += volume(x, corners, x + 3 * (size_t)s->corners[0]);
  }
  for (int t = 0; t < s->triangles; t++) {
    const double *sum = sums[s->component[t]];
    if (fabs(sum[0]) > SEEN ? sum[0] > 0 : sum[1] < 0) swap(s->corners + 3 * (size_t)t);
  }
  free(sums);
  return 0;
}

int flesh_picture_face_body(const flesh_picture_panel *panel, const double *positions, int triangles, int *corners)
{
  const size_t count = (size_t)triangles + 1;
  int *room = malloc(count * (5 * sizeof *room + 4)), components = 0; /* the bytes are behind the ints */
  if (!room) return flesh_picture_no_memory();
  signed char *alike = (signed char *)(room + 5 * count);
  sheet s = {triangles, corners, room, alike, room + 3 * count, alike + 3 * count, room + 4 * count};
  int failed = link_sides(&s);
  for (int t = 0; t < triangles && !failed; t++) s.component[t] = -1;
  for (int t = 0; t < triangles && !failed; t++)
    if (s.component[t] < 0) spread(&s, t, components++);
  if (!failed) failed = turn_components(&s, components, positions, panel);
  free(room);
  return failed ? flesh_picture_no_memory() : FLESH_OK;
}
