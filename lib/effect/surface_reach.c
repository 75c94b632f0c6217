/* surface_reach.c: at which positions, and for which steps, the pairs that a run has found are valid. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "effect/surface_contact.h"
#include "geometry/displacement_box.h"

typedef flesh_surface_near near;

/* Largest number of times that a bound is used to find a tighter one. */
enum { TIGHTENED = 2 };

/* A pair limits a step only if it loses more than nine tenths of its distance, or slightly less because collision
 * detection is not exact. So a pair cannot limit a step if its distance exceeds its relative displacement divided by
 * LOST. */
static const double LOST = 0.8;

/* Margin, over the slack, by which a proof that the pairs suffice exceeds what is needed, so that the next positions
 * need no proof. */
static const double MARGIN = 0.25;

const double *flesh_surface_near_without_mean(near *self, const double *x_from, const double *x)
{
  const flesh_contact_surface *surface = &self->contact->surface;
  double mean[3] = {0};
  for (int k = 0; k < surface->node_count; k++)
    for (size_t d = 3 * (size_t)surface->nodes[k], c = 0; c < 3; c++) mean[c] += (x[d + c] - x_from[d + c]) / surface->node_count;
  for (int k = 0; k < surface->node_count; k++)
    for (size_t d = 3 * (size_t)surface->nodes[k], c = 0; c < 3; c++) self->moved[d + c] = x[d + c] - mean[c];
  return self->moved;
}

/* Close pairs are those that come within the thickness if nodes come nearer by this, over the thickness. */
static const double CLOSE = 0.5;

/* Least distance between groups of pieces, over the distance that is searched. */
static const double FAR = 8;

typedef flesh_displacement_box box;

static const box EMPTY = FLESH_NO_DISPLACEMENT;

/* Adds the displacements of a run of nodes from `from` [3*n] to x; the positions x if `from` is NULL. */
static void add_run(box *to, const flesh_surface_run *run, const double *from, const double *x)
{
  const size_t first = 3 * (size_t)run->begin;
  flesh_displacement_box_add(to, run->end - run->begin, from ? from + first : NULL, x + first);
}

/* Returns the first surface node from mesh node `node` on. */
static int next_on_surface(const flesh_contact_surface *s, int node)
{
  while (node < s->mesh_nodes && s->node_place[node] < 0) node++;
  return node;
}

int flesh_surface_near_runs_create(near *self)
{
  const flesh_contact_surface *s = &self->contact->surface;
  int names[FLESH_SURFACE_GROUPS];
  self->runs = calloc((size_t)s->node_count + 1, sizeof *self->runs);
  self->piece = calloc((size_t)s->node_count + 1, sizeof *self->piece);
  if (!self->runs || !self->piece) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the neighbours of %d nodes", s->node_count);
  for (int k = 0; k < s->node_count; k++) {
    flesh_surface_run *last = self->runs + self->run_count - 1;
    if (!k || s->node_piece[k] != names[last->piece] || s->nodes[k] != next_on_surface(s, last->end)) { /* the same runs
                                                                                                         * on all
                                                                                                         * ranks */
      int piece = 0;
      while (piece < self->pieces && names[piece] != s->node_piece[k]) piece++;
      if (piece == FLESH_SURFACE_GROUPS) { /* too many pieces: treat all as one */
        self->pieces = self->run_count = 1;
        memset(self->piece, 0, (size_t)s->node_count);
        self->runs[0] = (flesh_surface_run){0, s->mesh_nodes, 0};
        return FLESH_OK;
      }
      if (piece == self->pieces) names[self->pieces++] = s->node_piece[k];
      last = self->runs + self->run_count++;
      *last = (flesh_surface_run){s->nodes[k], 0, piece};
    }
    last->end = s->nodes[k] + 1;
    self->piece[k] = (unsigned char)last->piece;
  }
  return FLESH_OK;
}

void flesh_surface_near_group(near *self)
{
  box boxes[FLESH_SURFACE_GROUPS];
  int *group = self->group;
  self->apart = INFINITY;
  for (int a = 0; a < self->pieces; a++) group[a] = a, boxes[a] = EMPTY;
  for (int k = 0; k < self->run_count; k++) add_run(&boxes[self->runs[k].piece], &self->runs[k], NULL, self->x_static);
  for (int a = 0; a < self->pieces; a++)
    for (int b = a + 1; b < self->pieces; b++) {
      const double gap = flesh_displacement_box_gap(&boxes[a], &boxes[b]);
      const int from = group[b], to = group[a];
      if (gap > FAR * self->static_pairs.distance) self->apart = fmin(self->apart, gap);
      else
        for (int k = 0; k < self->pieces && from != to; k++) group[k] = group[k] == from ? to : group[k];
    }
}

/* Returns the largest relative displacements of two nodes since the positions `from` [3*n]: the diagonals of the boxes
 * around the displacements of a group, and of all nodes. */
static flesh_surface_drift largest_drift(const near *self, const double *from, const double *x)
{
  box boxes[FLESH_SURFACE_GROUPS], all = EMPTY;
  double within = 0;
  for (int g = 0; g < self->pieces; g++) boxes[g] = EMPTY;
  for (int k = 0; k < self->run_count; k++)
    add_run(&boxes[self->group[self->runs[k].piece]], &self->runs[k], from, x);
  for (int g = 0; g < self->pieces; g++) {
    const double diagonal = flesh_displacement_box_diagonal(&boxes[g]);
    within = diagonal > within ? diagonal : within;
    flesh_displacement_box_unite(&all, &boxes[g]);
  }
  return (flesh_surface_drift){within + all.sound, flesh_displacement_box_diagonal(&all) + all.sound};
}

/* Returns the drift since static_pairs were found. It is kept for the last two positions: both ends of a step. */
static flesh_surface_drift drift_since_search(near *self, const double *x)
{
  flesh_surface_since *since = self->since;
  for (int k = 0; k < 2; k++)
    if (since[k].known && flesh_surface_near_is_at(self, x, since[k].x)) return self->latest = k, since[k].drift;
  since += self->latest = 1 - self->latest;
  since->known = 1;
  since->drift = largest_drift(self, self->x_static, x);
  flesh_surface_near_keep(self, x, since->x);
  return since->drift;
}

/* Whether static_pairs are known, without a proof cube by cube, to have all pairs at most `within` apart at x. */
static int is_known(near *self, const double *x, double within)
{
  if (!self->static_known) return 0;
  const flesh_surface_drift since = drift_since_search(self, x);
  const int far = self->apart - since.all > within; /* whether pairs of two groups are farther apart */
  if ((far ? since.within : since.all) <= self->static_pairs.distance - within) return 1;
  if (self->shown > 0 && self->shown >= within) {
    const flesh_surface_drift after = largest_drift(self, self->x_shown, x);
    if ((far ? after.within : after.all) <= self->shown - within) return 1;
  }
  return 0;
}

int flesh_surface_near_is_valid(near *self, const double *x, double within)
{
  if (!self->static_known) return 0;
  if (is_known(self, x, within)) return 1;
  const double margin = MARGIN * self->contact->slack, left = self->static_pairs.distance - within;
  if (!(left > 0)) return 0;
  const double spare = left - flesh_near_drift_bound(&self->drift, self->finder, self->x_static, x, within + margin);
  if (!(spare >= 0)) return 0;
  flesh_surface_near_keep(self, x, self->x_shown);
  self->shown = within + fmin(margin, spare);
  return 1;
}

/* Whether close_pairs have all pairs within these distances at x. */
static int has_close(near *self, const double *x, double points, double edges)
{
  const flesh_contact_law *law = &self->contact->law;
  const double reach = CLOSE * law->thickness, room = fmin(law->thickness - points, law->edge_thickness - edges) + reach;
  if (!self->static_known || !self->close_known || !(room >= 0)) return 0;
  const flesh_surface_drift after = largest_drift(self, self->x_close, x);
  const int far = self->apart - drift_since_search(self, x).all > fmax(points, edges);
  return (far ? after.within : after.all) <= room;
}

const flesh_near_pairs *flesh_surface_near_pairs_at(near *self, const double *x, double points, double edges)
{
  const flesh_contact_law *law = &self->contact->law;
  const double within = fmax(points, edges), reach = CLOSE * law->thickness;
  if (has_close(self, x, points, edges)) return &self->close_pairs;
  const int may_touch = self->static_pairs.point_count + self->static_pairs.edge_count > 0;
  if (may_touch && points <= law->thickness && edges <= law->edge_thickness && is_known(self, x, law->thickness + reach)) {
    self->close_known = !flesh_near_pairs_choose(self->finder, &self->static_pairs, x, law->thickness + reach,
                                                 law->edge_thickness + reach, self->threads, &self->close_pairs);
    flesh_surface_near_keep(self, x, self->x_close);
    if (self->close_known) return &self->close_pairs;
  }
  return flesh_surface_near_is_valid(self, x, within) ? &self->static_pairs : NULL;
}

int flesh_surface_near_is_free(near *self, const double *x_from, const double *x_to)
{
  if (!self->static_known || self->static_pairs.point_count || self->static_pairs.edge_count) return 0;
  const flesh_surface_drift from = drift_since_search(self, x_from), to = drift_since_search(self, x_to);
  return self->static_pairs.distance - from.within > (from.within + to.within) / LOST &&
         self->apart - from.all > (from.all + to.all) / LOST;
}

/* Returns the drifts of two nodes of one group, and of any two, from x0 up to which a step between any two positions is
 * free. Positive only near x_static, and if no pairs were found there. */
static flesh_surface_drift room_at(near *self, const double *x0)
{
  if (!self->static_known || self->static_pairs.point_count || self->static_pairs.edge_count || self->contact->bonds ||
      self->contact->separates)
    return (flesh_surface_drift){-1, -1};
  const double reach = self->contact->law.thickness, part = 1 / (1 + 2 / LOST);
  const flesh_surface_drift begin = drift_since_search(self, x0);
  return (flesh_surface_drift){fmin(part * self->static_pairs.distance, self->static_pairs.distance - reach) - begin.within,
                               fmin(part * self->apart, self->apart - reach) - begin.all};
}

int flesh_surface_near_is_far(void *memory, const double *x0, double shift, const double *u)
{
  near *self = memory;
  if (!u || !self->room_known) self->room = room_at(self, x0);
  self->room_known = 1;
  if (!u || !(self->room.within > 0 && self->room.all > 0)) return self->room.within > 0 && self->room.all > 0;
  const flesh_surface_drift way = largest_drift(self, NULL, u);
  return fabs(shift) * way.within < self->room.within && fabs(shift) * way.all < self->room.all;
}

double flesh_surface_near_limiting_distance(near *self, const double *x_from, const double *x_to)
{
  const flesh_surface_drift way = largest_drift(self, x_from, x_to);
  const int far = self->static_known && self->apart - drift_since_search(self, x_from).all > way.all / LOST;
  double apart = (far ? way.within : way.all) / LOST;
  /* Searching the known pairs costs less than a tighter bound. */
  for (int k = 0; k < TIGHTENED && apart > self->contact->slack && apart < INFINITY && !is_known(self, x_from, apart); k++) {
    const double tighter = flesh_near_drift_bound(&self->drift, self->finder, x_from, x_to, apart) / LOST;
    if (!(tighter < apart)) break;
    apart = tighter;
  }
  return apart;
}
