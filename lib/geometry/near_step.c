/* near_step.c: selects near pairs at given positions, and limits a step so that no pair touches. */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "base/error.h"
#include "geometry/continuous_collision.h"
#include "geometry/near_pairs.h"

enum { PARTS = 64, PART = 256 }; /* largest number of parts; least number of pairs in one */

typedef struct stepping {
  const flesh_contact_surface *surface;
  const flesh_near_pairs *pairs;
  const double *x0, *x1;
  double keep, apart, place;
  int parts;
  double least[PARTS];
} stepping;

/* Lists the corners of a pair's two hulls. Returns the number of the first hull's. */
static int corners_of(const flesh_contact_surface *surface, int is_point, const int *pair, int corner[4])
{
  const int *p = is_point ? surface->nodes + pair[0] : surface->edges + 2 * (size_t)pair[0];
  const int *q = is_point ? surface->faces + 3 * (size_t)pair[1] : surface->edges + 2 * (size_t)pair[1];
  const int first = is_point ? 1 : 2;
  for (int j = 0; j < 4; j++) corner[j] = j < first ? p[j] : q[j - first];
  return first;
}

static double smaller(double a, double b) { return a < b ? a : b; }
static double larger(double a, double b) { return a > b ? a : b; }

/* Whether the boxes around the hulls' corners are more than `apart` apart; false for NaN. */
static int are_far(int first, const double *const x[4], double apart)
{
  for (int c = 0; c < 3; c++) {
    const double a = x[0][c], b = x[1][c], low = smaller(x[2][c], x[3][c]), high = larger(x[2][c], x[3][c]);
    if (first == 1 && (smaller(b, low) - a > apart || a - larger(b, high) > apart)) return 1;
    if (first == 2 && (low - larger(a, b) > apart || smaller(a, b) - high > apart)) return 1;
  }
  return 0;
}

static void step_part(void *data, int part)
{
  stepping *s = data;
  const flesh_contact_surface *surface = s->surface;
  const size_t points = (size_t)s->pairs->point_count, all = points + (size_t)s->pairs->edge_count;
  const size_t begin = all * (size_t)part / (size_t)s->parts, end = all * ((size_t)part + 1) / (size_t)s->parts;
  double least = 1;
  for (size_t k = begin; k < end; k++) {
    const int is_point = k < points;
    const int *pair = is_point ? s->pairs->point_faces + 2 * k : s->pairs->edge_pairs + 2 * (k - points);
    int corner[4];
    const int first = corners_of(surface, is_point, pair, corner);
    const double *from[4], *to[4];
    for (int j = 0; j < 4; j++) from[j] = s->x0 + 3 * (size_t)corner[j], to[j] = s->x1 + 3 * (size_t)corner[j];
    if (are_far(first, from, s->apart) || flesh_hulls_move_little(first, 4 - first, from, to, s->keep, s->place)) continue;
    const double t = flesh_feasible_fraction(first, 4 - first, from, to, s->keep);
    least = t < least ? t : least;
  }
  s->least[part] = least;
}

/* Returns the largest magnitude of the surface nodes' coordinates; NaN if one is not finite. */
static double largest_place(const flesh_contact_surface *surface, const double *x)
{
  double largest = 0, sound = 0;
  for (int k = 0; k < surface->node_count; k++)
    for (size_t d = 3 * (size_t)surface->nodes[k], c = 0; c < 3; c++) {
      const double size = fabs(x[d + c]);
      largest = size > largest ? size : largest;
      sound += 0 * size;
    }
  return largest + sound;
}

double flesh_near_pairs_feasible_step(const flesh_near_finder *finder, const flesh_near_pairs *pairs, const double *x0,
                                      const double *x1, double keep, double apart,
                                      flesh_threads *threads)
{
  if (!(pairs->point_count + pairs->edge_count)) return 1;
  const int wanted = 1 + (pairs->point_count + pairs->edge_count) / PART;
  stepping s = {.surface = finder->surface, .pairs = pairs, .x0 = x0, .x1 = x1, .keep = keep, .apart = apart,
                .place = largest_place(finder->surface, x0) + largest_place(finder->surface, x1),
                .parts = wanted < PARTS ? wanted : PARTS};
  flesh_threads_run(threads, s.parts, step_part, &s);
  double least = 1;
  for (int k = 0; k < s.parts; k++) least = s.least[k] < least ? s.least[k] : least;
  return least;
}

/* Selection of pairs of one kind. Each part writes the selected pairs at its own beginning; they are moved together
 * afterwards. */
typedef struct choice {
  const flesh_contact_surface *surface;
  const double *x;
  int is_point, count, parts;
  const int *from;
  int *to;
  double distance;
  int chosen[PARTS];
} choice;

static int begin_of(const choice *c, int part) { return (int)((long long)c->count * part / c->parts); }

static void choose_part(void *data, int part)
{
  choice *c = data;
  const int begin = begin_of(c, part), end = begin_of(c, part + 1);
  int at = begin, corner[4];
  for (int k = begin; k < end; k++) {
    const int *pair = c->from + 2 * (size_t)k, first = corners_of(c->surface, c->is_point, pair, corner);
    const double *x[4];
    for (int j = 0; j < 4; j++) x[j] = c->x + 3 * (size_t)corner[j];
    if (are_far(first, x, c->distance) || flesh_hulls_stay_apart(first, 4 - first, corner, c->x, NULL, c->distance)) continue;
    memcpy(c->to + 2 * (size_t)at++, pair, 2 * sizeof *pair);
  }
  c->chosen[part] = at - begin;
}

static int choose(choice *c, flesh_threads *threads)
{
  const int wanted = 1 + c->count / PART;
  int all = 0;
  if (!c->count) return 0; /* without pairs the array may be NULL */
  c->parts = wanted < PARTS ? wanted : PARTS;
  flesh_threads_run(threads, c->parts, choose_part, c);
  for (int part = 0; part < c->parts; part++) {
    const size_t size = 2 * (size_t)c->chosen[part] * sizeof *c->to;
    memmove(c->to + 2 * (size_t)all, c->to + 2 * (size_t)begin_of(c, part), size);
    all += c->chosen[part];
  }
  return all;
}

int flesh_near_pairs_choose(const flesh_near_finder *finder, const flesh_near_pairs *from, const double *x, double points,
                            double edges, flesh_threads *threads, flesh_near_pairs *to)
{
  to->point_count = to->edge_count = 0;
  if (flesh_near_pairs_reserve(to, from->point_count, from->edge_count))
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for near pairs of %d faces", finder->surface->face_count);
  choice c = {.surface = finder->surface, .x = x, .is_point = 1, .count = from->point_count, .from = from->point_faces,
              .to = to->point_faces, .distance = points};
  to->point_count = choose(&c, threads);
  c = (choice){.surface = finder->surface, .x = x, .count = from->edge_count, .from = from->edge_pairs,
               .to = to->edge_pairs, .distance = edges};
  to->edge_count = choose(&c, threads);
  return FLESH_OK;
}
