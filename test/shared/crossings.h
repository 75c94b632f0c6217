/* crossings.h: counts intersections of surfaces without rounding errors and independently of contact's search for
 * pairs: exact predicates for all edges and faces whose boxes overlap, found by a sweep along x. */
#ifndef FLESH_TEST_CROSSINGS_H
#define FLESH_TEST_CROSSINGS_H

#include <math.h>
#include <stdlib.h>

#include "geometry/contact_surface.h"
#include "geometry/orient.h"

typedef struct crossings_box {
  double low[3], high[3];
  int item; /* face number; edges are numbered from -1 downwards */
} crossings_box;

static inline int crossings_order(const void *a, const void *b)
{
  const double d = ((const crossings_box *)a)->low[0] - ((const crossings_box *)b)->low[0];
  return d < 0 ? -1 : d > 0;
}

static inline void crossings_bound(int count, const int *nodes, const double *x, crossings_box *box)
{
  for (int c = 0; c < 3; c++) {
    box->low[c] = INFINITY;
    box->high[c] = -INFINITY;
    for (int k = 0; k < count; k++) {
      box->low[c] = fmin(box->low[c], x[3 * nodes[k] + c]);
      box->high[c] = fmax(box->high[c], x[3 * nodes[k] + c]);
    }
  }
}

/* Whether the edge and the face, without a common node, have a point in common. */
static inline int crossings_meet(const flesh_contact_surface *surface, const double *x, int edge, int face)
{
  const int *e = surface->edges + 2 * edge, *f = surface->faces + 3 * face;
  for (int a = 0; a < 2; a++)
    for (int b = 0; b < 3; b++)
      if (e[a] == f[b]) return 0;
  return flesh_segment_meets_triangle(x + 3 * e[0], x + 3 * e[1], x + 3 * f[0], x + 3 * f[1], x + 3 * f[2]);
}

/* Counts the intersecting pairs of an edge and a face at x [3*nodes], of all bodies of the surface. */
static inline int crossings_count(const flesh_contact_surface *surface, const double *x)
{
  const int faces = surface->face_count, count = faces + surface->edge_count;
  crossings_box *boxes = malloc(((size_t)count + 1) * sizeof *boxes);
  int found = 0;
  for (int k = 0; k < count; k++) {
    const int is_face = k < faces;
    boxes[k].item = is_face ? k : -1 - (k - faces);
    crossings_bound(is_face ? 3 : 2, is_face ? surface->faces + 3 * k : surface->edges + 2 * (k - faces), x, &boxes[k]);
  }
  qsort(boxes, (size_t)count, sizeof *boxes, crossings_order);
  for (int a = 0; a < count; a++)
    for (int b = a + 1; b < count && boxes[b].low[0] <= boxes[a].high[0]; b++) {
      const crossings_box *p = &boxes[a], *q = &boxes[b];
      if ((p->item < 0) == (q->item < 0)) continue;
      if (p->low[1] > q->high[1] || q->low[1] > p->high[1] || p->low[2] > q->high[2] || q->low[2] > p->high[2]) continue;
      const int edge = -1 - (p->item < 0 ? p->item : q->item), face = p->item < 0 ? q->item : p->item;
      found += crossings_meet(surface, x, edge, face);
    }
  free(boxes);
  return found;
}

#endif
