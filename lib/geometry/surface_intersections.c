/* surface_intersections.c: finds edges that meet faces, by exact predicates if their boxes meet. */
#include "geometry/surface_intersections.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "geometry/near_finder.h"
#include "geometry/orient.h"
#include "math/mat3.h"

enum { EDGE_FACE = 0, POINT_FACE = 0, EDGE_EDGE = 1 };

typedef struct search {
  const flesh_near_finder *finder;
  const double *x;
} search;

/* Whether bonds hold the edge together with a side of the face, or one of its ends with the face. */
static int is_held(const flesh_near_finder *self, int e, int f)
{
  const flesh_contact_surface *s = self->surface;
  for (int k = 0; k < 2; k++)
    if (flesh_near_finder_holds(self, POINT_FACE, s->node_place[s->edges[2 * (size_t)e + (size_t)k]], f)) return 1;
  for (int k = 0; k < 3; k++) {
    const int side = s->face_edges[3 * (size_t)f + (size_t)k];
    if (flesh_near_finder_holds(self, EDGE_EDGE, e < side ? e : side, e < side ? side : e)) return 1;
  }
  return 0;
}

static void try_edge(const search *s, flesh_near_part *part, int e, int f)
{
  const flesh_near_finder *self = s->finder;
  const int *end = self->surface->edges + 2 * (size_t)e, *corner = self->surface->faces + 3 * (size_t)f;
  for (int k = 0; k < 3; k++)
    if (corner[k] == end[0] || corner[k] == end[1]) return;
  if (!flesh_near_may_meet(self, self->edge_body[e], self->face_body[f]) ||
      !flesh_near_boxes_meet(&self->edge_boxes[e], &self->face_boxes[f]))
    return;
  if (self->bonds && is_held(self, e, f)) return;
  const double *p[5] = {s->x + 3 * (size_t)end[0], s->x + 3 * (size_t)end[1]};
  for (int k = 0; k < 3; k++) p[2 + k] = s->x + 3 * (size_t)corner[k];
  if (flesh_segment_meets_triangle(p[0], p[1], p[2], p[3], p[4])) flesh_near_part_add(part, EDGE_FACE, e, f);
}

static void visit_faces(void *data, flesh_near_part *part, int f, int g)
{
  const search *s = data;
  const int *edges = s->finder->surface->face_edges;
  for (int k = 0; k < 3; k++) {
    if (s->finder->kept[f] >> (3 + k) & 1) try_edge(s, part, edges[3 * (size_t)f + (size_t)k], g);
    if (s->finder->kept[g] >> (3 + k) & 1) try_edge(s, part, edges[3 * (size_t)g + (size_t)k], f);
  }
}

/* Returns the parameter t, in p + t (q - p), of the middle of the edge's part within the sides of the triangle with
 * normal n; *reach is half of that part. */
static double clip(const double *p, const double *q, const double *const x[3], const double n[3], double *reach)
{
  double low = 0, high = 1;
  for (int k = 0; k < 3; k++) {
    double side[3], inward[3], to_p[3], to_q[3];
    for (int c = 0; c < 3; c++)
      side[c] = x[(k + 1) % 3][c] - x[k][c], to_p[c] = p[c] - x[k][c], to_q[c] = q[c] - x[k][c];
    flesh_vec3_cross(n, side, inward);
    const double from = flesh_vec3_dot(inward, to_p), to = flesh_vec3_dot(inward, to_q);
    if (from < 0 && to > from) low = fmax(low, fmin(from / (from - to), 1));
    if (to < 0 && from > to) high = fmin(high, fmax(from / (from - to), 0));
  }
  *reach = fmax(high - low, 0) / 2;
  return (low + high) / 2;
}

/* Computes where the edge pq crosses the triangle's plane; if it lies in the plane, the middle of its part within the
 * triangle. */
static void find_place(const double *p, const double *q, const double *const x[3], double place[3])
{
  const double rounding = 1e-9; /* fraction of the edge; a crossing further outside the triangle is an artefact of rounding */
  double e[3], f[3], n[3], to_p[3], to_q[3], reach;
  for (int c = 0; c < 3; c++) {
    e[c] = x[1][c] - x[0][c], f[c] = x[2][c] - x[0][c];
    to_p[c] = p[c] - x[0][c], to_q[c] = q[c] - x[0][c];
  }
  flesh_vec3_cross(e, f, n);
  const double above = fabs(flesh_vec3_dot(n, to_p)), below = fabs(flesh_vec3_dot(n, to_q));
  const double middle = clip(p, q, x, n, &reach);
  double t = above / (above + below);
  if (!(fabs(t - middle) <= reach + rounding)) t = middle;
  for (int c = 0; c < 3; c++) place[c] = p[c] + t * (q[c] - p[c]);
}

static void describe(const flesh_near_finder *self, const double *x, const int pair[2], flesh_surface_intersection *to)
{
  const flesh_contact_surface *s = self->surface;
  const int e = pair[0], f = pair[1], *end = s->edges + 2 * (size_t)e, *corner = s->faces + 3 * (size_t)f;
  *to = (flesh_surface_intersection){.edge = e, .face = f, .edge_body = self->edge_body[e],
                                     .face_body = self->face_body[f]};
  memcpy(to->edge_faces, s->edge_faces + 2 * (size_t)e, sizeof to->edge_faces);
  const double *const at[3] = {x + 3 * (size_t)corner[0], x + 3 * (size_t)corner[1], x + 3 * (size_t)corner[2]};
  find_place(x + 3 * (size_t)end[0], x + 3 * (size_t)end[1], at, to->place);
}

int flesh_surface_intersections_find(flesh_near_finder *finder, const double *x, flesh_threads *threads,
                                     flesh_surface_intersections *found)
{
  found->count = 0;
  int status = flesh_near_finder_fit(finder, x, NULL, 0, threads);
  if (status) return status;
  search s = {finder, x};
  flesh_near_finder_walk(finder, threads, NULL, visit_faces, &s);
  const int count = flesh_near_finder_count(finder, EDGE_FACE);
  if (count < 0 || !flesh_grow_to(&found->pairs, 2 * sizeof *found->pairs, count, &found->room) ||
      !flesh_grow_to(&found->items, sizeof *found->items, count, &found->item_room))
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for intersections of %d faces", finder->surface->face_count);
  if (count > 0) flesh_near_finder_gather(finder, EDGE_FACE, finder->surface->edge_count, found->pairs);
  for (int k = 0; k < count; k++) describe(finder, x, found->pairs + 2 * (size_t)k, &found->items[k]);
  found->count = count;
  return FLESH_OK;
}

void flesh_surface_intersections_clear(flesh_surface_intersections *found)
{
  flesh_free(found->pairs);
  flesh_free(found->items);
  *found = (flesh_surface_intersections){0};
}
