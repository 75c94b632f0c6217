/* surface_reach.c: for which places, and which ways, the pairs that a run has found serve. */
#include <math.h>
#include <string.h>

#include "effect/surface_contact.h"
#include "math/mat3.h"

typedef flesh_surface_near near;

/* How often a bound is used for a tighter one. */
enum { TIGHTENED = 4 };

/* Beside what touches, a step is limited by what loses more than nine tenths of its distance, and a little less where
 * collision detection is not exact: by nothing that is further apart than what moves relative to each other, over this. */
static const double LOST = 0.8;

/* Proofs that the pairs suffice cover this much more than needed, over the slack, so that the next places need no
 * proof. */
static const double MARGIN = 0.25;

/* self->moved = x without the mean displacement of the surface from where it was, at the places `from` [3*nodes] of its
 * own or, NULL, at x_from: distances do not depend on a motion that all share, and what is thrown needs no search. Only
 * the surface's nodes of it are set. */
const double *flesh_surface_near_without_mean(near *self, const double *from, const double *x_from, const double *x)
{
  const flesh_contact_surface *surface = &self->contact->surface;
  double mean[3] = {0};
  for (int k = 0; k < surface->node_count; k++) {
    const double *at = from ? from + 3 * (size_t)k : x_from + 3 * (size_t)surface->nodes[k];
    for (int c = 0; c < 3; c++) mean[c] += (x[3 * (size_t)surface->nodes[k] + c] - at[c]) / surface->node_count;
  }
  for (int k = 0; k < surface->node_count; k++)
    for (size_t d = 3 * (size_t)surface->nodes[k], c = 0; c < 3; c++) self->moved[d + c] = x[d + c] - mean[c];
  return self->moved;
}

/* Pieces of a surface are told apart where so few, and are groups where they are so many times farther apart than what is
 * searched for. */
enum { GROUPS = 64 };
static const double FAR = 8;

typedef struct box {
  double low[3], high[3];
} box;

/* The distance of two boxes along the axis where it is largest. */
static double box_gap(const box *a, const box *b)
{
  double gap = -INFINITY;
  for (int c = 0; c < 3; c++) gap = fmax(gap, fmax(a->low[c] - b->high[c], b->low[c] - a->high[c]));
  return gap;
}

/* The number of each node's piece, from 0 on, and the pieces' boxes; returns how many, 1 where they are too many. */
static int list_pieces(const flesh_contact_surface *s, const double *places, int *piece, box *boxes)
{
  int names[GROUPS], count = 0;
  for (int k = 0; k < s->node_count; k++) {
    int at = k && s->node_piece[k] == s->node_piece[k - 1] ? piece[k - 1] : 0;
    while (at < count && names[at] != s->node_piece[k]) at++;
    if (at == GROUPS) return 1;
    if (at == count) {
      names[count] = s->node_piece[k];
      for (int c = 0; c < 3; c++) boxes[count].low[c] = INFINITY, boxes[count].high[c] = -INFINITY;
      count++;
    }
    piece[k] = at;
    for (int c = 0; c < 3; c++) {
      boxes[at].low[c] = fmin(boxes[at].low[c], places[3 * (size_t)k + (size_t)c]);
      boxes[at].high[c] = fmax(boxes[at].high[c], places[3 * (size_t)k + (size_t)c]);
    }
  }
  return count;
}

void flesh_surface_near_group(near *self)
{
  const flesh_contact_surface *s = &self->contact->surface;
  box boxes[GROUPS];
  int group[GROUPS];
  const int pieces = list_pieces(s, self->around.x, self->group, boxes);
  self->groups = pieces > 1 ? pieces : 1;
  self->apart = INFINITY;
  for (int a = 0; a < pieces; a++) group[a] = a;
  for (int a = 0; a < pieces; a++)
    for (int b = a + 1; b < pieces; b++) {
      const double gap = box_gap(&boxes[a], &boxes[b]);
      const int from = group[b], to = group[a];
      if (gap > FAR * self->around.distance) self->apart = fmin(self->apart, gap);
      else
        for (int k = 0; k < pieces && from != to; k++) group[k] = group[k] == from ? to : group[k];
    }
  for (int k = 0; k < s->node_count; k++) self->group[k] = self->groups > 1 ? group[self->group[k]] : 0;
}

/* The most that two nodes have moved relative to each other since they were at some places: two of one group, and any
 * two; NaN where a place is not finite. */
typedef struct drift {
  double within, all;
} drift;

/* Since the places `from` [3*nodes of the surface]. */
static drift largest_drift(const near *self, const double *from, const double *x)
{
  const flesh_contact_surface *surface = &self->contact->surface;
  double mean[GROUPS][3] = {{0}}, count[GROUPS] = {0}, farthest = 0, sound = 0, apart = 0;
  for (int k = 0; k < surface->node_count; k++) {
    const double *to = x + 3 * (size_t)surface->nodes[k], *at = from + 3 * (size_t)k;
    count[self->group[k]]++;
    for (int c = 0; c < 3; c++) mean[self->group[k]][c] += to[c] - at[c];
  }
  for (int g = 0; g < self->groups; g++)
    for (int c = 0; c < 3; c++) mean[g][c] /= count[g] > 0 ? count[g] : 1;
  for (int k = 0; k < surface->node_count; k++) {
    const double *to = x + 3 * (size_t)surface->nodes[k], *at = from + 3 * (size_t)k, *of = mean[self->group[k]];
    const double d[3] = {to[0] - at[0] - of[0], to[1] - at[1] - of[1], to[2] - at[2] - of[2]};
    const double square = flesh_vec3_dot(d, d);
    farthest = square > farthest ? square : farthest;
    sound += 0 * square;
  }
  for (int g = 0; g < self->groups; g++)
    for (int h = 0; h < g && count[g] > 0; h++) {
      const double d[3] = {mean[g][0] - mean[h][0], mean[g][1] - mean[h][1], mean[g][2] - mean[h][2]};
      if (count[h] > 0) apart = fmax(apart, flesh_vec3_dot(d, d));
    }
  const double within = 2 * (1 + 1e-12) * sqrt(farthest) + sound;
  return (drift){within, within + (1 + 1e-12) * sqrt(apart)};
}

/* Shows that what is at most `within` apart at x was found, and keeps x. */
static int show(near *self, const double *x, double within)
{
  const double left = self->around.distance - within;
  if (!(left > 0) || !(flesh_near_drift_bound(&self->drift, self->finder, self->around.x, x, within) <= left)) return 0;
  flesh_surface_near_gather(self, x, self->x_shown);
  self->shown = within;
  return 1;
}

int flesh_surface_near_serves(near *self, const double *x, double within)
{
  if (!self->around_known) return 0;
  const drift since = largest_drift(self, self->around.x, x);
  const int far = self->apart - since.all > within; /* what is of two groups */
  if ((far ? since.within : since.all) <= self->around.distance - within) return 1;
  if (self->shown > 0 && self->shown >= within) {
    const drift after = largest_drift(self, self->x_shown, x);
    if ((far ? after.within : after.all) <= self->shown - within) return 1;
  }
  return show(self, x, within + MARGIN * self->contact->slack) || show(self, x, within);
}

double flesh_surface_near_on_way(near *self, const double *x_from, const double *x_to)
{
  flesh_surface_near_gather(self, x_from, self->x_from);
  const drift way = largest_drift(self, self->x_from, x_to);
  const int far = self->around_known &&
                  self->apart - largest_drift(self, self->around.x, x_from).all > way.all / LOST;
  double apart = (far ? way.within : way.all) / LOST;
  for (int k = 0; k < TIGHTENED && apart > self->contact->slack && apart < INFINITY; k++) {
    const double tighter = flesh_near_drift_bound(&self->drift, self->finder, self->x_from, x_to, apart) / LOST;
    if (!(tighter < apart)) break;
    apart = tighter;
  }
  return apart;
}
