/* clearance.c: measures the distance of the body from obstacles, and how much of it later motion may have used up.
 *
 * The distance d(t, x) of a point to an obstacle changes by no more than both move: |d(t, x) - d(t', x')| <= |x - x'| + the
 * obstacle's displacement at x' between the times. An effect that does not reach the body by a distance d therefore cannot
 * act on it while both together have moved less than d, on whatever path. */
#include "system/clearance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/parallel_vector.h"
#include "effect/effect.h"
#include "system/parts.h"
#include "system/ranks.h"

/* Allowance for rounding in distances, relative to the body's size. */
static const double slack = 1e-9;

/* Returns the length of x, free, left and u together; the first three are saved. */
static size_t saved_numbers(const flesh_clearance *self)
{
  return (self->measures ? (size_t)self->n : 0) + 2 * (size_t)self->effects;
}

static size_t numbers_of(const flesh_clearance *self)
{
  return saved_numbers(self) + (flesh_system_has_proximity(self->system) ? (size_t)self->n : 0);
}

int flesh_clearance_create(const flesh_system *system, flesh_threads *threads, const flesh_proximity *proximity,
                           flesh_clearance *self)
{
  *self = (flesh_clearance){.system = system, .threads = threads, .proximity = proximity,
                            .n = flesh_system_unknowns(system), .effects = flesh_system_effect_count(system)};
  for (int k = 0; k < self->effects; k++)
    self->measures |= flesh_effect_as_barrier(flesh_system_effect(system, k))->clearance != NULL;
  if (!self->measures && !flesh_system_has_proximity(system)) return FLESH_OK;
  self->x = flesh_calloc(numbers_of(self), sizeof *self->x);
  if (!self->x) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", self->n);
  self->free = self->x + (self->measures ? self->n : 0);
  self->left = self->free + self->effects;
  if (flesh_system_has_proximity(system)) self->u = self->left + self->effects;
  return FLESH_OK;
}

void flesh_clearance_clear(flesh_clearance *self)
{
  flesh_free(self->x); /* the other arrays are in the same allocation */
  *self = (flesh_clearance){0};
}

double flesh_clearance_moved(const flesh_clearance *self, double shift, const double *u)
{
  if (!self->measures) return 0;
  return (1 + slack) * sqrt(3) * fabs(shift) * flesh_bound_apart(self->threads, self->n, u, NULL);
}

/* Returns the largest displacement of a node since the last look, m. */
static double displacement_since_look(const flesh_clearance *self, const double *x)
{
  return (1 + slack) * sqrt(3) * flesh_bound_apart(self->threads, self->n, x, self->x);
}

/* Returns an upper bound of how far the obstacle of effect k has moved from the last look to t. */
static double carried(const flesh_clearance *self, int k, double t)
{
  const flesh_effect *effect = flesh_system_effect(self->system, k);
  const flesh_effect_barrier *barrier = flesh_effect_as_barrier(effect);
  return barrier->approach ? barrier->approach(effect, self->t, t, self->low, self->high) : 0;
}

static void look(flesh_clearance *self, double t, const double *x)
{
  /* The box around the body, its low corner with opposite sign, and the effects' clearances, likewise. */
  double size = 0, numbers[6 + self->effects];
  self->known = 1;
  self->t = t;
  flesh_copy(self->threads, self->n, x, self->x);
  for (int c = 0; c < 3; c++) numbers[c] = -x[c], numbers[3 + c] = x[c];
  for (int d = 0; d < self->n; d++) {
    numbers[d % 3] = fmax(numbers[d % 3], -x[d]);
    numbers[3 + d % 3] = fmax(numbers[3 + d % 3], x[d]);
  }
  for (int k = 0; k < self->effects; k++) {
    const flesh_effect *effect = flesh_system_effect(self->system, k);
    const flesh_effect_barrier *barrier = flesh_effect_as_barrier(effect);
    numbers[6 + k] = barrier->clearance ? -barrier->clearance(effect, t, x) : 0;
  }
  flesh_team_largest(flesh_system_team(self->system), 6 + self->effects, numbers);
  for (int c = 0; c < 3; c++) {
    self->low[c] = -numbers[c];
    self->high[c] = numbers[3 + c];
    size += fabs(self->low[c]) + fabs(self->high[c]);
  }
  for (int k = 0; k < self->effects; k++) {
    const double found = -numbers[6 + k];
    self->free[k] = found > slack * (size + found) ? found - slack * (size + found) : 0;
    if (found == INFINITY) self->free[k] = INFINITY;
  }
}

/* Whether more than half of an effect's clearance is used up at t, for a body that has moved by `moved`. */
static int is_used_up(const flesh_clearance *self, double t, double moved)
{
  for (int k = 0; k < self->effects; k++)
    if (flesh_effect_as_barrier(flesh_system_effect(self->system, k))->clearance &&
        !(2 * (moved + carried(self, k, t)) < self->free[k]))
      return 1;
  return 0;
}

/* Finds whether surfaces are far from each other; u NULL: at x0. */
static int find_far(const flesh_clearance *self, const double *x0, double shift, const double *u)
{
  int far = 1;
  for (int k = 0; k < self->effects && far; k++) {
    void *near = flesh_proximity_of(self->proximity, k);
    const flesh_effect_private *can = flesh_effect_private_of(self->system->entries[k].effect);
    if (near) far = can->is_far && can->is_far(near, x0, shift, u);
  }
  return far;
}

/* Whether this rank's surfaces are far from all others at x0 + shift u. */
static int is_far_here(flesh_clearance *self, const double *x0, double shift, const double *u)
{
  const size_t size = (size_t)self->n * sizeof *u;
  if (!u) return 0;
  if (u[0] == 0 && !memcmp(u, u + 1, size - sizeof *u)) return 1; /* the start of the stage */
  if (self->u_known && !memcmp(u, self->u, size)) return self->u_far;
  memcpy(self->u, u, size);
  self->u_known = 1;
  return self->u_far = find_far(self, x0, shift, u);
}

int flesh_clearance_is_far(flesh_clearance *self, const double *x0, double shift, const double *u)
{
  if (!self->u) return 1;
  if (!self->begins_far) return 0;
  const int far = !flesh_team_any(flesh_system_team(self->system), !is_far_here(self, x0, shift, u));
  self->stays_far &= far;
  return far;
}

/* Measures how much of the effects' clearances is left. */
static void measure(flesh_clearance *self, double t, const double *x0, double t_lag, const double *x_lag)
{
  double moved = self->known ? displacement_since_look(self, x_lag) : INFINITY;
  if (!self->known || is_used_up(self, t_lag, moved)) {
    look(self, t_lag, x_lag);
    moved = displacement_since_look(self, x_lag); /* 0, or not finite */
  }
  if (x0 != x_lag) moved = fmax(moved, displacement_since_look(self, x0));
  self->moved = INFINITY;
  for (int k = 0; k < self->effects; k++)
    self->left[k] = self->free[k] - moved - fmax(carried(self, k, t_lag), carried(self, k, t));
}

void flesh_clearance_begin(flesh_clearance *self, double t, const double *x0, double t_lag, const double *x_lag,
                           const double *x_from)
{
  if (!self->free) return;
  self->moved = self->moved_most = 0;
  if (self->measures) measure(self, t, x0, t_lag, x_lag);
  self->least_left = INFINITY;
  for (int k = 0; k < self->effects; k++)
    if (flesh_effect_as_barrier(flesh_system_effect(self->system, k))->max_feasible_step &&
        !flesh_proximity_of(self->proximity, k))
      self->least_left = fmin(self->least_left, self->left[k]);
  const double *places[] = {x_lag, x_from, x0};
  self->begins_far = 1;
  for (int k = 0; k < 3 && self->begins_far; k++)
    if (k == 2 || places[k] != x0) self->begins_far = find_far(self, places[k], 0, NULL);
  if (self->u) self->begins_far = !flesh_team_any(flesh_system_team(self->system), !self->begins_far);
  self->stays_far = self->begins_far;
  self->u_known = 0;
}

void flesh_clearance_forget(flesh_clearance *self) { self->known = 0; }

void flesh_clearance_archive(flesh_clearance *self, flesh_archive *archive)
{
  if (!self->x) return;
  FLESH_ARCHIVE(archive, self->known);
  if (self->known) {
    FLESH_ARCHIVE(archive, self->t);
    flesh_archive_bytes(archive, self->x, saved_numbers(self) * sizeof *self->x);
    FLESH_ARCHIVE(archive, self->low);
    FLESH_ARCHIVE(archive, self->high);
  }
}
