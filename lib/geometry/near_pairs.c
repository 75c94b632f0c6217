/* near_pairs.c: searches for near pairs. */
#include "geometry/near_pairs.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "geometry/continuous_collision.h"
#include "geometry/near_finder.h"

enum { POINT_FACE = 0, EDGE_EDGE = 1 };

static int no_memory(const flesh_contact_surface *s)
{
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for near pairs of %d faces", s->face_count);
}

/* Finds the bodies of edges and faces, and assigns each node and edge to a face: the first of its own body, else the
 * first. */
static int keep_primitives(flesh_near_finder *self)
{
  const flesh_contact_surface *s = self->surface;
  int *keeper = malloc(((size_t)s->node_count + (size_t)s->edge_count) * sizeof *keeper);
  if (!keeper) return no_memory(s);
  for (int k = 0; k < s->node_count + s->edge_count; k++) keeper[k] = -1;
  for (int k = 0; k < 2 * s->edge_count; k++) {
    const int body = s->node_body[s->node_place[s->edges[k]]];
    if (k % 2 == 0 || body > self->edge_body[k / 2]) self->edge_body[k / 2] = body;
  }
  for (int k = 0; k < 3 * s->face_count; k++) {
    const int body = s->node_body[s->node_place[s->faces[k]]];
    if (k % 3 == 0 || body > self->face_body[k / 3]) self->face_body[k / 3] = body;
  }
  for (int k = 0; k < 3 * s->face_count; k++) {
    const int node = s->node_place[s->faces[k]], edge = s->face_edges[k], body = self->face_body[k / 3];
    int *const of[2] = {&keeper[node], &keeper[s->node_count + edge]};
    const int bodies[2] = {s->node_body[node], self->edge_body[edge]};
    for (int j = 0; j < 2; j++)
      if (*of[j] < 0 || (body == bodies[j] && self->face_body[*of[j] / 3] != body)) *of[j] = k;
  }
  for (int i = 0; i < s->node_count; i++) self->kept[keeper[i] / 3] |= (unsigned char)(1 << keeper[i] % 3);
  for (int e = 0; e < s->edge_count; e++) {
    const int k = keeper[s->node_count + e];
    self->kept[k / 3] |= (unsigned char)(8 << k % 3);
  }
  free(keeper);
  return FLESH_OK;
}

typedef struct search {
  const flesh_near_finder *finder;
  const double *x0, *x1;
  double distance;
  int within_pieces; /* whether only pairs of one connected piece of a body are searched for */
} search;

/* Whether the nodes belong to one piece. */
static int are_connected(const flesh_contact_surface *s, int node, int other)
{
  return s->node_piece[s->node_place[node]] == s->node_piece[s->node_place[other]];
}

/* Whether the box around a node's path, enlarged by half of the distance, does not meet a face's box. */
static int point_is_outside(const search *s, int node, const flesh_near_box *box)
{
  const double *from = s->x0 + 3 * (size_t)node, *to = s->x1 ? s->x1 + 3 * (size_t)node : from;
  for (int c = 0; c < 3; c++) {
    const double low = from[c] < to[c] ? from[c] : to[c], high = from[c] < to[c] ? to[c] : from[c];
    const double far = s->finder->fit_inflation + 4 * DBL_EPSILON * (fabs(low) + fabs(high));
    if (low - far > box->high[c] || high + far < box->low[c]) return 1;
  }
  return 0;
}

static void try_point(const search *s, flesh_near_part *part, int node, int f)
{
  const flesh_near_finder *self = s->finder;
  const flesh_contact_surface *surface = self->surface;
  const int *corner = surface->faces + 3 * (size_t)f, place = surface->node_place[node];
  const int body = surface->node_body[place], other = self->face_body[f];
  if (node >= self->own) return;
  if (node == corner[0] || node == corner[1] || node == corner[2] || !flesh_near_may_meet(self, body, other)) return;
  if (s->within_pieces && (body != other || !are_connected(surface, node, corner[0]))) return;
  if (point_is_outside(s, node, &self->face_boxes[f])) return;
  if (body == other && flesh_near_finder_excludes(self, POINT_FACE, place, f)) return;
  if (self->bonds && flesh_near_finder_holds(self, POINT_FACE, place, f)) return;
  if (self->patches && flesh_near_finder_ignores(self, POINT_FACE, place, f)) return;
  const int nodes[4] = {node, corner[0], corner[1], corner[2]};
  if (!flesh_hulls_stay_apart(1, 3, nodes, s->x0, s->x1, s->distance)) flesh_near_part_add(part, POINT_FACE, place, f);
}

static void try_edges(const search *s, flesh_near_part *part, int first, int second)
{
  const flesh_near_finder *self = s->finder;
  const int a = first < second ? first : second, b = first < second ? second : first;
  const int *p = self->surface->edges + 2 * (size_t)a, *q = self->surface->edges + 2 * (size_t)b;
  const int body = self->edge_body[a], other = self->edge_body[b];
  if (p[0] >= self->own) return;
  if (p[0] == q[0] || p[0] == q[1] || p[1] == q[0] || p[1] == q[1] || !flesh_near_may_meet(self, body, other)) return;
  if (s->within_pieces && (body != other || !are_connected(self->surface, p[0], q[0]))) return;
  if (!flesh_near_boxes_meet(&self->edge_boxes[a], &self->edge_boxes[b])) return;
  if (body == other && flesh_near_finder_excludes(self, EDGE_EDGE, a, b)) return;
  if (self->bonds && flesh_near_finder_holds(self, EDGE_EDGE, a, b)) return;
  if (self->patches && flesh_near_finder_ignores(self, EDGE_EDGE, a, b)) return;
  const int nodes[4] = {p[0], p[1], q[0], q[1]};
  if (!flesh_hulls_stay_apart(2, 2, nodes, s->x0, s->x1, s->distance)) flesh_near_part_add(part, EDGE_EDGE, a, b);
}

static void visit_faces(void *data, flesh_near_part *part, int f, int g)
{
  const search *s = data;
  const flesh_near_finder *self = s->finder;
  const int *faces = self->surface->faces, *edges = self->surface->face_edges;
  const unsigned of_f = self->kept[f], of_g = self->kept[g];
  for (int k = 0; k < 3; k++) {
    if (of_f >> k & 1) try_point(s, part, faces[3 * (size_t)f + (size_t)k], g);
    if (of_g >> k & 1) try_point(s, part, faces[3 * (size_t)g + (size_t)k], f);
  }
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3 && of_f >> (3 + i) & 1; j++)
      if (of_g >> (3 + j) & 1) try_edges(s, part, edges[3 * (size_t)f + (size_t)i], edges[3 * (size_t)g + (size_t)j]);
}

int flesh_near_pairs_reserve(flesh_near_pairs *pairs, int points, int edges)
{
  return flesh_grow_to(&pairs->point_faces, 2 * sizeof *pairs->point_faces, points, &pairs->point_room) &&
                 flesh_grow_to(&pairs->edge_pairs, 2 * sizeof *pairs->edge_pairs, edges, &pairs->edge_room)
             ? FLESH_OK
             : FLESH_ERR_MEMORY;
}

/* Whether a node of this rank, or an edge whose first node is one, is assigned to the face. */
static int keeps_owned(const flesh_near_finder *self, int face)
{
  const flesh_contact_surface *s = self->surface;
  int keeps = 0;
  for (int k = 0; k < 3; k++) {
    const int edge = s->face_edges[3 * (size_t)face + (size_t)k];
    keeps |= self->kept[face] >> k & 1 && s->faces[3 * (size_t)face + (size_t)k] < self->own;
    keeps |= self->kept[face] >> (3 + k) & 1 && s->edges[2 * (size_t)edge] < self->own;
  }
  return keeps;
}

/* Computes finder->owned for the tree's present grouping; NULL if all nodes belong to this rank. */
static const int *count_owned(flesh_near_finder *self)
{
  if (self->own == INT_MAX) return NULL;
  self->owned[0] = 0;
  for (int p = 0; p < self->surface->face_count; p++)
    self->owned[p + 1] = self->owned[p] + keeps_owned(self, self->tree->order[p]);
  return self->owned;
}

int flesh_near_finder_restrict(flesh_near_finder *self, int own)
{
  if (!self->owned) self->owned = malloc(((size_t)self->surface->face_count + 1) * sizeof *self->owned);
  if (!self->owned) return no_memory(self->surface);
  self->own = own;
  return FLESH_OK;
}

static int search_pairs(flesh_near_finder *self, search *s, flesh_threads *threads, flesh_near_pairs *pairs)
{
  const flesh_contact_surface *surface = self->surface;
  pairs->point_count = pairs->edge_count = 0;
  pairs->distance = -INFINITY;
  int status = flesh_near_finder_fit(self, s->x0, s->x1, s->distance / 2, threads);
  if (status) return status;
  flesh_near_finder_walk(self, threads, count_owned(self), visit_faces, s);
  const int points = flesh_near_finder_count(self, POINT_FACE), edges = flesh_near_finder_count(self, EDGE_EDGE);
  if (points < 0 || edges < 0 || flesh_near_pairs_reserve(pairs, points, edges)) return no_memory(surface);
  flesh_near_finder_gather(self, POINT_FACE, surface->node_count, pairs->point_faces);
  flesh_near_finder_gather(self, EDGE_EDGE, surface->edge_count, pairs->edge_pairs);
  pairs->point_count = points;
  pairs->edge_count = edges;
  pairs->distance = s->distance;
  return FLESH_OK;
}

int flesh_near_pairs_find(flesh_near_finder *self, const double *x0, const double *x1, double distance,
                          flesh_threads *threads, flesh_near_pairs *pairs)
{
  return search_pairs(self, &(search){self, x0, x1, distance, 0}, threads, pairs);
}

/* Keeps the pairs of a kind that are nearer than `distance` at X, as rows. */
static int keep_rows(const flesh_near_finder *self, int kind, const flesh_near_pairs *found, const double *X,
                     double distance, flesh_near_rows *rows)
{
  const flesh_contact_surface *s = self->surface;
  const int firsts = kind == POINT_FACE ? s->node_count : s->edge_count;
  const int count = kind == POINT_FACE ? found->point_count : found->edge_count;
  const int *pairs = kind == POINT_FACE ? found->point_faces : found->edge_pairs;
  rows->start = calloc((size_t)firsts + 1, sizeof *rows->start);
  rows->second = malloc(((size_t)count + 1) * sizeof *rows->second);
  if (!rows->start || !rows->second) return no_memory(s);
  int kept = 0;
  for (int k = 0, i = 0; i < firsts; i++) {
    for (; k < count && pairs[2 * (size_t)k] == i; k++) {
      const int second = pairs[2 * (size_t)k + 1], *p = s->edges + 2 * (size_t)i;
      const int *q = kind == POINT_FACE ? s->faces + 3 * (size_t)second : s->edges + 2 * (size_t)second;
      const double *x[4] = {X + 3 * (size_t)(kind == POINT_FACE ? s->nodes[i] : p[0])};
      for (int j = 1; j < 4; j++)
        x[j] = X + 3 * (size_t)(kind == POINT_FACE ? q[j - 1] : j == 1 ? p[1] : q[j - 2]);
      double unit[3];
      if (flesh_hull_distance(kind == POINT_FACE ? 1 : 2, kind == POINT_FACE ? 3 : 2, x, unit) < distance)
        rows->second[kept++] = second;
    }
    rows->start[i + 1] = kept;
  }
  int *less = realloc(rows->second, ((size_t)kept + 1) * sizeof *less);
  if (less) rows->second = less;
  return FLESH_OK;
}

/* Finds the pairs to exclude. */
static int exclude(flesh_near_finder *self, const double *X, double distance, flesh_threads *threads)
{
  flesh_near_pairs pairs = {0};
  flesh_near_rows rows[2] = {{0}};
  int status = search_pairs(self, &(search){self, X, NULL, distance, 1}, threads, &pairs);
  if (!status) status = keep_rows(self, POINT_FACE, &pairs, X, distance, &rows[0]);
  if (!status) status = keep_rows(self, EDGE_EDGE, &pairs, X, distance, &rows[1]);
  memcpy(self->excluded, rows, sizeof rows);
  flesh_near_pairs_clear(&pairs);
  for (int k = 0; k < FLESH_NEAR_PARTS; k++) { /* free memory for more pairs than later searches will find */
    flesh_free(self->parts[k].found[0]);
    flesh_free(self->parts[k].found[1]);
    self->parts[k] = (flesh_near_part){0};
  }
  return status;
}

static int make(const double *X, const unsigned char *may_meet, double rest_distance, flesh_threads *threads,
                flesh_near_finder *self)
{
  const flesh_contact_surface *s = self->surface;
  const size_t faces = (size_t)s->face_count, edges = (size_t)s->edge_count, bodies = (size_t)s->body_count;
  const size_t rows = (size_t)(s->node_count > s->edge_count ? s->node_count : s->edge_count) + 1;
  self->may_meet = malloc(bodies * bodies);
  self->edge_body = malloc(edges * sizeof *self->edge_body);
  self->face_body = malloc(faces * sizeof *self->face_body);
  self->kept = calloc(faces, 1);
  self->face_boxes = malloc(faces * sizeof *self->face_boxes);
  self->edge_boxes = malloc(edges * sizeof *self->edge_boxes);
  self->row = malloc(rows * sizeof *self->row);
  if (!self->may_meet || !self->edge_body || !self->face_body || !self->kept || !self->face_boxes ||
      !self->edge_boxes || !self->row)
    return no_memory(s);
  for (size_t k = 0; k < bodies * bodies; k++) self->may_meet[k] = may_meet ? may_meet[k] : 1;
  int status = keep_primitives(self);
  if (!status) status = flesh_box_tree_create(s->face_count, 3, s->faces, self->face_body, X, &self->tree);
  if (!status && rest_distance > 0) status = exclude(self, X, rest_distance, threads);
  return status;
}

int flesh_near_finder_create(const flesh_contact_surface *surface, const double *X, const unsigned char *may_meet,
                             double rest_distance, flesh_threads *threads, flesh_near_finder **finder)
{
  *finder = NULL;
  if (surface->face_count < 1) return flesh_fail(FLESH_ERR_ARGUMENT, "a surface without faces has no near pairs");
  if (!(rest_distance >= 0 && rest_distance <= DBL_MAX))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the distance at rest is %g m; it must be 0 or more", rest_distance);
  for (int k = 0; k < 3 * surface->node_count; k++)
    if (!(fabs(X[3 * (size_t)surface->nodes[k / 3] + (size_t)k % 3]) <= DBL_MAX))
      return flesh_fail(FLESH_ERR_ARGUMENT, "node %d is not finite", surface->nodes[k / 3]);
  flesh_near_finder *self = calloc(1, sizeof *self);
  if (!self) return no_memory(surface);
  self->surface = surface;
  self->own = INT_MAX;
  int status = make(X, may_meet, rest_distance, threads, self);
  if (status) flesh_near_finder_destroy(&self);
  *finder = self;
  return status;
}

void flesh_near_finder_destroy(flesh_near_finder **finder)
{
  if (!finder || !*finder) return;
  flesh_near_finder *self = *finder;
  void *const owned[] = {self->may_meet, self->edge_body, self->face_body, self->kept, self->face_boxes,
                         self->edge_boxes, self->row, self->excluded[0].start, self->excluded[0].second,
                         self->excluded[1].start, self->excluded[1].second, self->owned};
  for (size_t k = 0; k < sizeof owned / sizeof *owned; k++) free(owned[k]);
  for (int k = 0; k < FLESH_NEAR_PARTS; k++) {
    flesh_free(self->parts[k].found[0]);
    flesh_free(self->parts[k].found[1]);
  }
  flesh_box_tree_destroy(&self->tree);
  free(self);
  *finder = NULL;
}

void flesh_near_pairs_clear(flesh_near_pairs *pairs)
{
  flesh_free(pairs->point_faces);
  flesh_free(pairs->edge_pairs);
  *pairs = (flesh_near_pairs){0};
}
