/* surface_tunnel.c: detects a step that led a piece of a surface past another one on its straight path, because the
 * solve found a way around it, for example over the rim of a sheet. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/team.h"
#include "effect/surface_contact.h"
#include "geometry/displacement_box.h"

typedef flesh_surface_near near;

/* Pieces meet on a path if this fraction of the distance of two features, or less, is left. */
static const double LEFT = 1e-6;

/* Shortest portion of a path that is searched. */
static const double SHORTEST = 1e-3;

/* Pairs of pieces that need not be examined: bit b of [a], and bit a of [b]. */
typedef uint64_t piece_pairs[FLESH_SURFACE_GROUPS];

static void add(uint64_t *pairs, int a, int b)
{
  pairs[a] |= UINT64_C(1) << b;
  pairs[b] |= UINT64_C(1) << a;
}

static int has(const uint64_t *pairs, int a, int b) { return (int)(pairs[a] >> b & 1); }

static int piece_of(const near *self, int node) { return self->piece[self->contact->surface.node_place[node]]; }

/* Finds the pieces that touch each other at x, unless they are known. FLESH_UNDEFINED, FLESH_ERR_MEMORY. */
static int find_touching(near *self, const double *x, flesh_surface_touching *touching)
{
  if (touching->known && flesh_surface_near_is_at(self, x, touching->x)) return FLESH_OK;
  const int status = flesh_surface_near_update_pairs(self, x);
  touching->known = !status;
  if (status) return status;
  flesh_surface_near_keep(self, x, touching->x);
  memset(touching->pieces, 0, sizeof touching->pieces);
  for (int k = 0; k < self->set.count; k++) {
    const int *nodes = self->set.pairs[k].nodes;
    add(touching->pieces, piece_of(self, nodes[0]), piece_of(self, nodes[3]));
  }
  return FLESH_OK;
}

/* Adds the pairs of pieces that touch each other at x_from to `pairs`, and those at x_to, where the next step starts if
 * this one is accepted, to `after`. FLESH_UNDEFINED, FLESH_ERR_MEMORY. */
static int add_touching(near *self, const double *x_from, const double *x_to, uint64_t *pairs, uint64_t *after)
{
  flesh_surface_touching *ends = self->touching;
  if (ends[1].known && flesh_surface_near_is_at(self, x_from, ends[1].x)) {
    const flesh_surface_touching before = ends[0];
    ends[0] = ends[1];
    ends[1] = before;
  }
  int status = find_touching(self, x_from, &ends[0]);
  if (!status) status = find_touching(self, x_to, &ends[1]);
  for (int a = 0; a < self->pieces && !status; a++) {
    pairs[a] |= ends[0].pieces[a];
    after[a] |= ends[1].pieces[a];
  }
  return status;
}

/* Adds the pairs of pieces whose paths have separate bounding boxes. */
static void add_apart(const near *self, const double *x_from, const double *x_to, uint64_t *pairs)
{
  flesh_displacement_box boxes[FLESH_SURFACE_GROUPS];
  for (int a = 0; a < self->pieces; a++) boxes[a] = (flesh_displacement_box)FLESH_NO_DISPLACEMENT;
  for (int k = 0; k < self->run_count; k++) {
    const flesh_surface_run *run = &self->runs[k];
    const size_t first = 3 * (size_t)run->begin;
    flesh_displacement_box_add(&boxes[run->piece], run->end - run->begin, NULL, x_from + first);
    flesh_displacement_box_add(&boxes[run->piece], run->end - run->begin, NULL, x_to + first);
  }
  for (int a = 0; a < self->pieces; a++)
    for (int b = a + 1; b < self->pieces; b++)
      if (flesh_displacement_box_gap(&boxes[a], &boxes[b]) > 0) add(pairs, a, b);
}

/* Unites the pairs known to the ranks, and adds each piece with itself. Returns whether other pairs exist, provided
 * that no rank has an error. */
static int unite(const near *self, const flesh_team *team, int status, uint64_t *pairs)
{
  double known[FLESH_SURFACE_GROUPS * (FLESH_SURFACE_GROUPS - 1) / 2];
  int count = 0, others = 0;
  for (int a = 0; a < self->pieces; a++)
    for (int b = a + 1; b < self->pieces; b++) known[count++] = has(pairs, a, b);
  if (flesh_team_sum_agreed(team, status, count, known)) return 0;
  for (int a = self->pieces - 1; a >= 0; a--) {
    for (int b = self->pieces - 1; b > a; b--)
      if (known[--count] > 0) add(pairs, a, b);
      else others = 1;
    add(pairs, a, a);
  }
  return others;
}

/* Keeps those of near->swept_pairs that belong to other pairs of pieces. */
static void choose(near *self, const uint64_t *pairs)
{
  const flesh_contact_surface *s = &self->contact->surface;
  flesh_near_pairs *swept = &self->swept_pairs;
  int points = 0, edges = 0;
  for (int k = 0; k < swept->point_count; k++) {
    const int *pair = swept->point_faces + 2 * (size_t)k;
    if (!has(pairs, self->piece[pair[0]], piece_of(self, s->faces[3 * (size_t)pair[1]])))
      memmove(swept->point_faces + 2 * (size_t)points++, pair, 2 * sizeof *pair);
  }
  for (int k = 0; k < swept->edge_count; k++) {
    const int *pair = swept->edge_pairs + 2 * (size_t)k;
    if (!has(pairs, piece_of(self, s->edges[2 * (size_t)pair[0]]), piece_of(self, s->edges[2 * (size_t)pair[1]])))
      memmove(swept->edge_pairs + 2 * (size_t)edges++, pair, 2 * sizeof *pair);
  }
  swept->point_count = points;
  swept->edge_count = edges;
}

/* Whether other pairs of pieces meet on the straight path from x_from by `way` [3*n], which is searched in portions. */
static int meet(near *self, const uint64_t *pairs, double portion, const double *x_from, const double *way)
{
  const size_t n = 3 * (size_t)self->contact->surface.mesh_nodes;
  double *x[2] = {malloc(n * sizeof **x), malloc(n * sizeof **x)};
  int found = 0;
  for (double begin = 0; x[0] && x[1] && begin < 1 && !found; begin += portion) {
    const double end = fmin(1, begin + portion);
    for (size_t d = 0; d < n; d++) x[0][d] = x_from[d] + begin * way[d], x[1][d] = x_from[d] + end * way[d];
    if (flesh_near_pairs_find(self->finder, x[0], x[1], 0, self->threads, &self->swept_pairs)) break;
    choose(self, pairs);
    found = flesh_near_pairs_feasible_step(self->finder, &self->swept_pairs, x[0], x[1], LEFT, INFINITY, self->threads) < 1;
  }
  free(x[0]);
  free(x[1]);
  return found;
}

/* Ignores pieces that touch before the step and after it: they may have slid on, around corners that their straight path
 * cuts. */
int flesh_surface_near_tunnelled(void *memory, const flesh_team *team, const double *internal, const double *x_from,
                                 const double *x_to)
{
  near *self = memory;
  const flesh_contact_surface *s = &self->contact->surface;
  piece_pairs pairs = {0}, after;
  flesh_surface_near_take(self, internal);
  if (self->pieces < 2) return 0;
  add_apart(self, x_from, x_to, pairs);
  memcpy(after, pairs, sizeof after);
  const int status = add_touching(self, x_from, x_to, pairs, after);
  const int others = unite(self, team, status, pairs), others_after = unite(self, team, status, after);
  if (!others && !others_after) return 0;
  for (int a = 0; a < self->pieces; a++) pairs[a] &= after[a];
  if (flesh_team_least(team, flesh_surface_near_feasible_step(self, x_from, x_to)) == 1) return 0;
  const double *to = flesh_surface_near_without_mean(self, x_from, x_to);
  double longest = 0, portion = 1;
  for (int k = 0; k < s->node_count; k++)
    for (size_t d = 3 * (size_t)s->nodes[k], c = 0; c < 3; c++) longest = fmax(longest, fabs(to[d + c] - x_from[d + c]));
  while (portion * longest > FLESH_SURFACE_LONG * s->mean_edge && portion > SHORTEST) portion /= 2;
  double *way = calloc(3 * (size_t)s->mesh_nodes, sizeof *way);
  for (int k = 0; way && k < s->node_count; k++)
    for (size_t d = 3 * (size_t)s->nodes[k], c = 0; c < 3; c++) way[d + c] = to[d + c] - x_from[d + c];
  const int found = way && meet(self, pairs, portion, x_from, way);
  free(way);
  return found;
}
