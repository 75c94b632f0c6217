/* near_step.c: how far a surface can move before one of its near pairs touches. */
#include <math.h>
#include <stddef.h>

#include "geometry/continuous_collision.h"
#include "geometry/near_pairs.h"

enum { PARTS = 64, PART = 256 }; /* parts at most; pairs of one, at least */

typedef struct stepping {
  const flesh_contact_surface *surface;
  const flesh_near_pairs *pairs;
  const double *x0, *x1;
  double keep, apart;
  int parts;
  double least[PARTS];
} stepping;

/* Whether boxes around the hulls' corners are further apart than that; NaN is not. */
static int are_far(int first, const double *const x[4], double apart)
{
  for (int c = 0; c < 3; c++) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int k = 0; k < 4; k++) {
      const int hull = k >= first;
      low[hull] = x[k][c] < low[hull] ? x[k][c] : low[hull];
      high[hull] = x[k][c] > high[hull] ? x[k][c] : high[hull];
    }
    if (low[0] - high[1] > apart || low[1] - high[0] > apart) return 1;
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
    const int *q = is_point ? surface->faces + 3 * (size_t)pair[1] : surface->edges + 2 * (size_t)pair[1];
    const int *p = is_point ? surface->nodes + pair[0] : surface->edges + 2 * (size_t)pair[0];
    const int first = is_point ? 1 : 2;
    const double *from[4], *to[4];
    for (int j = 0; j < 4; j++) {
      const size_t node = (size_t)(j < first ? p[j] : q[j - first]);
      from[j] = s->x0 + 3 * node;
      to[j] = s->x1 + 3 * node;
    }
    if (are_far(first, from, s->apart) || flesh_hulls_move_little(first, 4 - first, from, to, s->keep)) continue;
    const double t = flesh_feasible_fraction(first, 4 - first, from, to, s->keep);
    least = t < least ? t : least;
  }
  s->least[part] = least;
}

double flesh_near_pairs_feasible_step(const flesh_near_finder *finder, const flesh_near_pairs *pairs, const double *x0,
                                      const double *x1, double keep, double apart,
                                      flesh_threads *threads)
{
  const int wanted = 1 + (pairs->point_count + pairs->edge_count) / PART;
  stepping s = {.surface = finder->surface, .pairs = pairs, .x0 = x0, .x1 = x1, .keep = keep, .apart = apart,
                .parts = wanted < PARTS ? wanted : PARTS};
  flesh_threads_run(threads, s.parts, step_part, &s);
  double least = 1;
  for (int k = 0; k < s.parts; k++) least = s.least[k] < least ? s.least[k] : least;
  return least;
}
