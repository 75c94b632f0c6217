/* surface_reach.c: for which places, and which ways, the pairs that a run has found serve. */
#include <math.h>
#include <string.h>

#include "effect/surface_contact.h"

typedef flesh_surface_near near;

/* How often a bound is used for a tighter one. */
enum { TIGHTENED = 4 };

/* Beside what touches, a step is limited by what loses more than nine tenths of its distance, and a little less where
 * collision detection is not exact: by nothing that is further apart than what moves relative to each other, over this. */
static const double LOST = 0.8;

/* Where the pairs are shown to serve, they do so this much beyond, over the slack: the next places need not be shown. */
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

/* What two nodes have moved relative to each other since they were at `from` [3*nodes of the surface], at most; NaN where
 * a place is not finite. */
static double largest_drift(near *self, const double *from, const double *x)
{
  const flesh_contact_surface *surface = &self->contact->surface;
  const double *moved = flesh_surface_near_without_mean(self, from, NULL, x);
  double farthest = 0, sound = 0;
  for (int k = 0; k < surface->node_count; k++) {
    const double *to = moved + 3 * (size_t)surface->nodes[k], *at = from + 3 * (size_t)k;
    double square = 0;
    for (int c = 0; c < 3; c++) square += (to[c] - at[c]) * (to[c] - at[c]);
    farthest = square > farthest ? square : farthest;
    sound += 0 * square;
  }
  return 2 * (1 + 1e-12) * sqrt(farthest) + sound;
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
  if (largest_drift(self, self->around.x, x) <= self->around.distance - within) return 1;
  if (self->shown > 0 && self->shown >= within && largest_drift(self, self->x_shown, x) <= self->shown - within) return 1;
  return show(self, x, within + MARGIN * self->contact->slack) || show(self, x, within);
}

double flesh_surface_near_on_way(near *self, const double *x_from, const double *x_to)
{
  flesh_surface_near_gather(self, x_from, self->x_from);
  double apart = largest_drift(self, self->x_from, x_to) / LOST;
  for (int k = 0; k < TIGHTENED && apart > self->contact->slack && apart < INFINITY; k++) {
    const double tighter = flesh_near_drift_bound(&self->drift, self->finder, self->x_from, x_to, apart) / LOST;
    if (!(tighter < apart)) break;
    apart = tighter;
  }
  return apart;
}
