/* clearance.c: measures how far the body is from obstacles, and how much of that distance later motion may have used.
 *
 * The distance d(t, x) of a point to an obstacle changes by no more than both move: |d(t, x) - d(t', x')| <= |x - x'| +
 * the obstacle's displacement at x' between the times. So an effect that ends at a distance d from the body still does
 * not act on it as long as both together have moved less than d, on whatever path. */
#include "system/clearance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/parallel_vector.h"
#include "effect/effect.h"
#include "system/ranks.h"

/* Reaches are widened by rounding, of a part of the body's size. */
static const double slack = 1e-9;

int flesh_clearance_create(const flesh_system *system, flesh_threads *threads, flesh_clearance *self)
{
  int some = 0;
  *self = (flesh_clearance){.system = system, .threads = threads, .n = flesh_system_unknowns(system),
                            .effects = flesh_system_effect_count(system)};
  for (int k = 0; k < self->effects; k++)
    some |= flesh_effect_as_barrier(flesh_system_effect(system, k))->clearance != NULL;
  if (!some) return FLESH_OK;
  self->x = flesh_malloc(((size_t)self->n + 2 * (size_t)self->effects) * sizeof *self->x);
  if (!self->x) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", self->n);
  self->free = self->x + self->n;
  self->left = self->free + self->effects;
  return FLESH_OK;
}

void flesh_clearance_clear(flesh_clearance *self)
{
  flesh_free(self->x); /* and the others with it */
  *self = (flesh_clearance){0};
}

size_t flesh_clearance_memory(const flesh_clearance *self)
{
  return self->x ? ((size_t)self->n + 2 * (size_t)self->effects) * sizeof *self->x : 0;
}

double flesh_clearance_moved(const flesh_clearance *self, double shift, const double *u)
{
  return (1 + slack) * sqrt(3) * fabs(shift) * flesh_bound_apart(self->threads, self->n, u, NULL);
}

/* From where it was looked last to x, m. */
static double displacement_since_look(const flesh_clearance *self, const double *x)
{
  return (1 + slack) * sqrt(3) * flesh_bound_apart(self->threads, self->n, x, self->x);
}

/* How far what effect k stands for is carried from the last look to t, at most. */
static double carried(const flesh_clearance *self, int k, double t)
{
  const flesh_effect *effect = flesh_system_effect(self->system, k);
  const flesh_effect_barrier *barrier = flesh_effect_as_barrier(effect);
  return barrier->approach ? barrier->approach(effect, self->t, t, self->low, self->high) : 0;
}

static void look(flesh_clearance *self, double t, const double *x)
{
  double size = 0;
  self->known = 1;
  self->t = t;
  flesh_copy(self->threads, self->n, x, self->x);
  for (int c = 0; c < 3; c++) self->low[c] = self->high[c] = x[c];
  for (int d = 0; d < self->n; d++) {
    self->low[d % 3] = fmin(self->low[d % 3], x[d]);
    self->high[d % 3] = fmax(self->high[d % 3], x[d]);
  }
  const flesh_team *team = flesh_system_team(self->system);
  flesh_team_unite_boxes(team, self->low, self->high);
  for (int c = 0; c < 3; c++) size += fabs(self->low[c]) + fabs(self->high[c]);
  for (int k = 0; k < self->effects; k++) {
    const flesh_effect *effect = flesh_system_effect(self->system, k);
    const flesh_effect_barrier *barrier = flesh_effect_as_barrier(effect);
    const double found = flesh_team_least(team, barrier->clearance ? barrier->clearance(effect, t, x) : 0);
    self->free[k] = found > slack * (size + found) ? found - slack * (size + found) : 0;
    if (found == INFINITY) self->free[k] = INFINITY;
  }
}

/* Whether more than half of an effect's clearance is used up at t, for a body that has moved so far. */
static int is_used_up(const flesh_clearance *self, double t, double moved)
{
  for (int k = 0; k < self->effects; k++)
    if (flesh_effect_as_barrier(flesh_system_effect(self->system, k))->clearance &&
        !(2 * (moved + carried(self, k, t)) < self->free[k]))
      return 1;
  return 0;
}

void flesh_clearance_begin(flesh_clearance *self, double t, const double *x0, double t_lag, const double *x_lag)
{
  if (!self->free) return;
  double moved = self->known ? displacement_since_look(self, x_lag) : INFINITY;
  if (!self->known || is_used_up(self, t_lag, moved)) {
    look(self, t_lag, x_lag);
    moved = displacement_since_look(self, x_lag); /* 0, or a place is none */
  }
  if (x0 != x_lag) moved = fmax(moved, displacement_since_look(self, x0));
  self->least_left = INFINITY;
  self->moved = INFINITY;
  self->moved_most = 0;
  for (int k = 0; k < self->effects; k++) {
    self->left[k] = self->free[k] - moved - fmax(carried(self, k, t_lag), carried(self, k, t));
    const flesh_effect_barrier *barrier = flesh_effect_as_barrier(flesh_system_effect(self->system, k));
    /* Surfaces with a memory are always near some others. */
    if (barrier->max_feasible_step && !barrier->remember)
      self->least_left = fmin(self->least_left, self->left[k]);
  }
}

void flesh_clearance_archive(flesh_clearance *self, flesh_archive *archive)
{
  if (!self->x) return;
  FLESH_ARCHIVE(archive, self->known);
  if (self->known) {
    FLESH_ARCHIVE(archive, self->t);
    flesh_archive_bytes(archive, self->x, ((size_t)self->n + 2 * (size_t)self->effects) * sizeof *self->x);
    FLESH_ARCHIVE(archive, self->low);
    FLESH_ARCHIVE(archive, self->high);
  }
}
