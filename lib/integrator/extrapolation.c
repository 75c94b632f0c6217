/* extrapolation.c: a first iterate from the last steps' velocities. */
#include "integrator/extrapolation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"

int flesh_extrapolation_create(int n, flesh_extrapolation *self)
{
  *self = (flesh_extrapolation){.n = n};
  for (int k = 0; k < FLESH_EXTRAPOLATION_POINTS; k++) {
    self->v[k] = calloc((size_t)n + 1, sizeof(double));
    if (!self->v[k]) {
      flesh_extrapolation_clear(self);
      return flesh_fail(FLESH_ERR_MEMORY, "no memory for velocities of %d unknowns", n);
    }
  }
  return FLESH_OK;
}

void flesh_extrapolation_clear(flesh_extrapolation *self)
{
  for (int k = 0; k < FLESH_EXTRAPOLATION_POINTS; k++) free(self->v[k]);
  *self = (flesh_extrapolation){0};
}

static int continues(const flesh_extrapolation *self, const flesh_state *state, double h)
{
  return self->known > 0 && fabs(h - self->h) <= 1e-9 * h && fabs(state->t - self->t) <= 1e-9 * h &&
         !memcmp(state->v, self->v[0], (size_t)self->n * sizeof *state->v);
}

int flesh_extrapolation_guess(const flesh_extrapolation *self, const flesh_state *state, double h, double *u)
{
  /* Row k: through the last k velocities, one step on. */
  static const double weights[FLESH_EXTRAPOLATION_POINTS + 1][FLESH_EXTRAPOLATION_POINTS] = {
      {0}, {1}, {2, -1}, {3, -3, 1}};
  if (!continues(self, state, h)) return 0;
  const double *w = weights[self->known];
  for (int d = 0; d < self->n; d++)
    u[d] = h * (w[0] * self->v[0][d] + w[1] * self->v[1][d] + w[2] * self->v[2][d]);
  return 1;
}

void flesh_extrapolation_remember(flesh_extrapolation *self, const flesh_state *state, double h, int easy)
{
  if (!easy || fabs(h - self->h) > 1e-9 * h || fabs(state->t - h - self->t) > 1e-6 * h) self->known = 0;
  double *oldest = self->v[FLESH_EXTRAPOLATION_POINTS - 1];
  memmove(self->v + 1, self->v, (FLESH_EXTRAPOLATION_POINTS - 1) * sizeof *self->v);
  self->v[0] = oldest;
  memcpy(oldest, state->v, (size_t)self->n * sizeof *oldest);
  if (self->known < FLESH_EXTRAPOLATION_POINTS) self->known++;
  self->t = state->t;
  self->h = h;
}
