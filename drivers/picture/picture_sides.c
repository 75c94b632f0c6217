/* picture_sides.c: which side of a mesh obstacle is its front: the one that the body is on. */
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "base/sort.h"
#include "math/mat3.h"
#include "picture/picture_body.h"

/* An edge of a triangle, from its node `from` to its node `to`. */
typedef struct edge {
  int low, high; /* the same two nodes, in order */
  int triangle, from;
} edge;

typedef struct sheet {
  int triangles, *corners;
  int *neighbours;      /* [3*triangles], across side k; -1: none, or more than one */
  signed char *alike;   /* [3*triangles] 1: both are wound the same way round */
  int *component;       /* [triangles], -1: not yet */
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

/* Goes over what hangs together with triangle t, as component `number`. */
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

/* The solid angle under which p sees the triangle, over 4 pi; positive where it looks at its back (van Oosterom &
 * Strackee 1983). Summed over a closed surface that is wound outwards it is 1 within and 0 without. */
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

/* Six times the volume between the triangle and the origin `o`. */
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

/* Up to `room` of the body's nodes, all over it; returns their number. No node is within an obstacle, while the middle
 * of a ring may be. */
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

/* Components are judged by what the body's nodes see of them; those of which they see as much of either side, as of a
 * closed surface from without, by the volume in them. */
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
  int *room = malloc(count * (5 * sizeof *room + 4)), components = 0; /* and chars behind the ints */
  if (!room) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a picture");
  signed char *alike = (signed char *)(room + 5 * count);
  sheet s = {triangles, corners, room, alike, room + 3 * count, alike + 3 * count, room + 4 * count};
  int failed = link_sides(&s);
  for (int t = 0; t < triangles && !failed; t++) s.component[t] = -1;
  for (int t = 0; t < triangles && !failed; t++)
    if (s.component[t] < 0) spread(&s, t, components++);
  if (!failed) failed = turn_components(&s, components, positions, panel);
  free(room);
  return failed ? flesh_fail(FLESH_ERR_MEMORY, "out of memory for a picture") : FLESH_OK;
}
