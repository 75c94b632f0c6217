/* triangulate.c: cuts polygons into triangles, ear by ear (Meisters 1975), in the plane of their area vector. */
#include <math.h>

#include "surface/surface.h"

/* Chooses the two axes in which the polygon is counter-clockwise, seen along its largest area component. */
static void find_plane(int count, const int *corners, const double *positions, int axes[2])
{
  double area[3] = {0, 0, 0};
  const double *o = positions + 3 * (size_t)corners[0];
  for (int k = 1; k + 1 < count; k++) {
    const double *p = positions + 3 * (size_t)corners[k];
    const double *q = positions + 3 * (size_t)corners[k + 1];
    for (int d = 0; d < 3; d++) {
      int i = (d + 1) % 3, j = (d + 2) % 3;
      area[d] += (p[i] - o[i]) * (q[j] - o[j]) - (p[j] - o[j]) * (q[i] - o[i]);
    }
  }
  int largest = 0;
  for (int d = 1; d < 3; d++)
    if (fabs(area[d]) > fabs(area[largest])) largest = d;
  int turned = area[largest] < 0;
  axes[turned] = (largest + 1) % 3;
  axes[!turned] = (largest + 2) % 3;
}

typedef struct polygon {
  const int *corners, *axes;
  const double *positions;
  int *next, *previous; /* [count] linked rings of corner indices */
  int *hollow;          /* [hollows] corners that are not convex: only these can lie in an ear */
  int hollows;
} polygon;

/* Returns twice the signed area of the triangle of three corners. */
static double turn(const polygon *g, int a, int b, int c)
{
  const double *p = g->positions + 3 * (size_t)g->corners[a];
  const double *q = g->positions + 3 * (size_t)g->corners[b];
  const double *r = g->positions + 3 * (size_t)g->corners[c];
  int i = g->axes[0], j = g->axes[1];
  return (q[i] - p[i]) * (r[j] - p[j]) - (q[j] - p[j]) * (r[i] - p[i]);
}

static int is_ear(const polygon *g, int b)
{
  int a = g->previous[b], c = g->next[b];
  if (!(turn(g, a, b, c) > 0)) return 0;
  for (int h = 0; h < g->hollows; h++) {
    int p = g->hollow[h];
    int vertex = g->corners[p];
    if (g->next[p] < 0 || vertex == g->corners[a] || vertex == g->corners[b] ||
        vertex == g->corners[c])
      continue;
    if (turn(g, a, b, p) >= 0 && turn(g, b, c, p) >= 0 && turn(g, c, a, p) >= 0) return 0;
  }
  return 1;
}

void flesh_surface_cut(int count, const int *corners, const double *positions, int *room,
                       int *triangles)
{
  int axes[2], left = count, at = 1, tried = 0;
  find_plane(count, corners, positions, axes);
  polygon g = {corners, axes, positions, room, room + count, room + 2 * count, 0};
  for (int k = 0; k < count; k++) {
    g.next[k] = (k + 1) % count;
    g.previous[k] = (k + count - 1) % count;
  }
  for (int k = 0; k < count; k++)
    if (!(turn(&g, g.previous[k], k, g.next[k]) > 0)) g.hollow[g.hollows++] = k;
  while (left > 2) {
    /* If no ear is left, the polygon crosses itself or is flat, and any corner will do. */
    if (left > 3 && tried < left && g.hollows && !is_ear(&g, at)) {
      at = g.next[at];
      tried++;
      continue;
    }
    int a = g.previous[at], c = g.next[at];
    triangles[0] = a, triangles[1] = at, triangles[2] = c;
    triangles += 3;
    g.next[a] = c;
    g.previous[c] = a;
    g.next[at] = -1; /* gone */
    at = c;
    left--;
    tried = 0;
  }
}
