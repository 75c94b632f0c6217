/* evaluation.c: values known at the point evaluated last, and the state that the run has returned; iterates and a caller's
 * state are compared by value here. */
#include "system/evaluation.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "base/parallel_vector.h"
#include "system/ranks.h"
#include "system/system.h"

int flesh_evaluation_create(const flesh_system *system, flesh_threads *threads, flesh_evaluation *self)
{
  size_t stride;
  *self = (flesh_evaluation){.system = system, .threads = threads, .team = flesh_system_team(system),
                             .n = flesh_system_unknowns(system), .serial = 1};
  self->own = 3 * flesh_team_own(self->team, self->n / 3);
  self->all = 3 * flesh_team_all(self->team, self->n / 3);
  self->x = flesh_huge_pages_vectors(3, (size_t)self->n, &stride);
  if (!self->x) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", self->n);
  self->v = self->x + stride;
  self->a = self->v + stride;
  return FLESH_OK;
}

int flesh_evaluation_worst_node(const flesh_evaluation *self, int parts, const double *y, const double *scale)
{
  int worst = 0;
  double most = -1;
  for (int d = 0; d < parts * self->n; d++) {
    const double size = fabs(y[d]) / (scale ? scale[d] : 1);
    if (size > most) most = size, worst = d % self->n / 3;
  }
  return (int)flesh_team_argmax(self->team, &most, self->team ? self->team->numbers[worst] : worst);
}

int flesh_evaluation_check_state(const flesh_evaluation *self, const flesh_state *state)
{
  int d = 0;
  while (d < self->own && isfinite(state->x[d]) && isfinite(state->v[d])) d++;
  if (d == self->own) return flesh_team_agree(self->team, FLESH_OK);
  const int node = d / 3, in_x = !isfinite(state->x[d]);
  const double *u = (in_x ? state->x : state->v) + 3 * (size_t)node;
  const int status = flesh_fail(FLESH_ERR_NONFINITE, "the state at t = %g s is not finite: node %d has %s = (%g, %g, %g) %s",
                                state->t, self->team ? self->team->numbers[node] : node, in_x ? "x" : "v", u[0], u[1], u[2],
                                in_x ? "m" : "m/s");
  return flesh_team_agree(self->team, status);
}

/* Returns the number of doubles of a state. */
static size_t room_of(const flesh_evaluation *self)
{
  return 2 * (size_t)self->n + (size_t)self->returned.multiplier_count + (size_t)self->returned.internal_count;
}

int flesh_evaluation_keep_state(flesh_evaluation *self)
{
  flesh_state *kept = &self->returned;
  kept->t = NAN; /* nobody's */
  kept->multiplier_count = flesh_system_multiplier_count(self->system);
  kept->internal_count = flesh_system_internal_count(self->system);
  kept->x = flesh_huge_pages_calloc((room_of(self) + 1) * sizeof *kept->x);
  if (!kept->x) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a state of %d unknowns", self->n);
  kept->v = kept->x + self->n;
  kept->multipliers = kept->v + self->n;
  kept->internal = kept->multipliers + kept->multiplier_count;
  return FLESH_OK;
}

int flesh_evaluation_keep_places(flesh_evaluation *self)
{
  double **vectors[] = {&self->residual.u, &self->residual.r, &self->residual.reactions, &self->potential.u,
                        &self->known_end.x, &self->zeros, &self->frozen};
  const size_t count = sizeof vectors / sizeof vectors[0] - 1, n = (size_t)self->n;
  const int freezes = flesh_system_freezes(self->system);
  size_t stride;
  double *memory = flesh_huge_pages_vectors(count + (freezes ? 2 : 0), n, &stride);
  if (!memory) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", self->n);
  for (size_t k = 0; k < count + (freezes ? 1 : 0); k++) *vectors[k] = memory + k * stride;
  self->environment.proximity = &self->proximity;
  int status = flesh_clearance_create(self->system, self->threads, &self->proximity, &self->clearance);
  return status ? status : flesh_proximity_create(self->system, self->threads, &self->proximity);
}

void flesh_evaluation_clear(flesh_evaluation *self)
{
  flesh_free(self->residual.u); /* the other arrays of flesh_evaluation_keep_places are in the same allocation */
  flesh_clearance_clear(&self->clearance);
  flesh_proximity_clear(&self->proximity);
  flesh_free(self->x); /* v and a are in the same allocation */
  flesh_free(self->returned.x);
  *self = (flesh_evaluation){0};
}

void flesh_evaluation_archive(flesh_evaluation *self, flesh_archive *archive)
{
  flesh_state *kept = &self->returned;
  FLESH_ARCHIVE(archive, self->serial);
  FLESH_ARCHIVE(archive, kept->t);
  flesh_archive_nodes(archive, kept->x, (size_t)self->n / 3);
  flesh_archive_nodes(archive, kept->v, (size_t)self->n / 3);
  if (kept->multiplier_count) flesh_archive_tets(archive, kept->multipliers, (size_t)kept->multiplier_count);
  if (kept->internal_count)
    flesh_archive_bytes(archive, kept->internal, (size_t)kept->internal_count * sizeof *kept->internal);
}

flesh_point flesh_evaluation_point(const flesh_evaluation *self, double t, const double *x, const double *v,
                                   const double *a)
{
  flesh_point point = flesh_point_at(t, x, v, a);
  point.threads = self->threads;
  point.environment = &self->environment;
  return point;
}

static int same(const flesh_evaluation *self, const double *a, const double *b)
{
  return flesh_same(self->threads, self->n, a, b);
}

int flesh_evaluation_knows_residual(const flesh_evaluation *self, const double *u)
{
  return self->residual.known && same(self, u, self->residual.u);
}

int flesh_evaluation_knows_potential(const flesh_evaluation *self, const double *u)
{
  const flesh_known_potential *potential = &self->potential;
  return potential->known && same(self, u, potential->with_residual ? self->residual.u : potential->u);
}

int flesh_evaluation_is_at_known_end(const flesh_evaluation *self) { return same(self, self->x, self->known_end.x); }

void flesh_evaluation_take_residual(flesh_evaluation *self, const double *u)
{
  flesh_copy(self->threads, self->n, u, self->residual.u);
  self->residual.known = 1;
}

void flesh_evaluation_take_potential(flesh_evaluation *self, const double *u)
{
  flesh_copy(self->threads, self->n, u, self->potential.u);
  self->potential.with_residual = 0;
}

void flesh_evaluation_drop_residual(flesh_evaluation *self)
{
  if (self->potential.known && self->potential.with_residual) flesh_evaluation_take_potential(self, self->residual.u);
  self->residual.known = 0;
}

void flesh_evaluation_forget(flesh_evaluation *self) { self->residual.known = self->potential.known = 0; }

void flesh_evaluation_changed(flesh_evaluation *self) { self->serial++; }

void flesh_evaluation_forces_changed(flesh_evaluation *self) { self->known_end.potential.known = 0; }

static int differ(const double *a, const double *b, int count)
{
  return count && memcmp(a, b, (size_t)count * sizeof *a) != 0;
}

int flesh_evaluation_is_at(const flesh_evaluation *self, const flesh_state *state, double tolerance)
{
  const flesh_state *kept = &self->returned;
  const int other = !(fabs(state->t - kept->t) <= tolerance) ||
                 differ(state->multipliers, kept->multipliers, kept->multiplier_count) ||
                 differ(state->internal, kept->internal, kept->internal_count);
  return !flesh_team_any(self->team, other) && same(self, state->x, kept->x) && same(self, state->v, kept->v);
}

void flesh_evaluation_remember(flesh_evaluation *self, const flesh_state *state)
{
  flesh_state *kept = &self->returned;
  kept->t = state->t;
  flesh_copy(self->threads, self->n, state->x, kept->x);
  flesh_copy(self->threads, self->n, state->v, kept->v);
  const size_t multipliers = (size_t)kept->multiplier_count, internals = (size_t)kept->internal_count;
  if (multipliers) memcpy(kept->multipliers, state->multipliers, multipliers * sizeof(double));
  if (internals) memcpy(kept->internal, state->internal, internals * sizeof(double));
}

void flesh_evaluation_restore(const flesh_evaluation *self, flesh_state *state)
{
  flesh_copy(self->threads, self->n, self->returned.x, state->x);
  flesh_copy(self->threads, self->n, self->returned.v, state->v);
}
