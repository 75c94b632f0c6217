/* prescribed.c: finds positions, velocities and accelerations of constrained dofs from the prescribed positions alone. */
#include "time/prescribed.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"

enum { LAST = FLESH_PRESCRIBED_POINTS - 1 };

int flesh_prescribed_create(const flesh_system *system, flesh_prescribed *prescribed)
{
  int n = flesh_system_unknowns(system), failed = 0;
  *prescribed = (flesh_prescribed){.system = system, .n = n, .h = 1};
  failed |= !(prescribed->fixed = calloc((size_t)n + 1, 1));
  failed |= !(prescribed->now = calloc((size_t)n + 1, sizeof(double)));
  for (int k = 0; k <= LAST; k++)
    failed |= !(prescribed->x[k] = calloc((size_t)n + 1, sizeof(double)));
  if (!failed) return FLESH_OK;
  flesh_prescribed_clear(prescribed);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for the constraints of %d unknowns", n);
}

void flesh_prescribed_clear(flesh_prescribed *prescribed)
{
  free(prescribed->fixed);
  free(prescribed->now);
  for (int k = 0; k <= LAST; k++) free(prescribed->x[k]);
  *prescribed = (flesh_prescribed){0};
}

void flesh_prescribed_set(flesh_prescribed *self, double begin, double end, const double *x)
{
  self->begin = begin;
  self->end = end;
  self->h = end - begin;
  flesh_system_fixed(self->system, begin + (end - begin) / 2, self->fixed);
  for (int k = 0; k <= LAST; k++) {
    memcpy(self->x[k], x, (size_t)self->n * sizeof *x);
    double t = k == LAST ? end : begin + (end - begin) * k / LAST;
    flesh_system_prescribe(self->system, t, self->x[k]);
  }
}

/* Computes the derivatives at begin + s h of the cubic through the four positions (Newton's form); exactly 0 at rest. */
static void derivatives(const flesh_prescribed *self, int d, double s, double *v, double *a)
{
  double x0 = self->x[0][d], x1 = self->x[1][d], x2 = self->x[2][d], x3 = self->x[3][d];
  double first = x1 - x0, second = (x2 - x1) - first, third = ((x3 - x2) - (x2 - x1)) - second;
  double rate = LAST / self->h, p = s * LAST;
  *v = rate * (first + second * (2 * p - 1) / 2 + third * (3 * p * p - 6 * p + 2) / 6);
  *a = rate * rate * (second + third * (p - 1));
}

void flesh_prescribed_begin(const flesh_prescribed *self, double *v, double *a)
{
  for (int d = 0; d < self->n; d++)
    if (self->fixed[d]) derivatives(self, d, 0, &v[d], &a[d]);
}

void flesh_prescribed_stage(flesh_prescribed *self, const flesh_stage *stage, double *v0, double *a0)
{
  double s = (stage->t - self->begin) / self->h;
  memcpy(self->now, stage->x0, (size_t)self->n * sizeof *self->now);
  flesh_system_prescribe(self->system, stage->t, self->now);
  for (int d = 0; d < self->n; d++) {
    if (!self->fixed[d]) continue;
    double u = (self->now[d] - stage->x0[d]) / stage->shift.x, v, a;
    derivatives(self, d, s, &v, &a);
    v0[d] = v - stage->shift.v * u;
    a0[d] = a - stage->shift.a * u;
  }
}

void flesh_prescribed_at(flesh_prescribed *self, double t, double *x, double *v, double *a)
{
  memcpy(self->now, self->x[0], (size_t)self->n * sizeof *self->now);
  flesh_system_prescribe(self->system, t, self->now);
  for (int d = 0; d < self->n; d++) {
    if (!self->fixed[d]) continue;
    x[d] = self->now[d];
    derivatives(self, d, (t - self->begin) / self->h, &v[d], &a[d]);
  }
}

void flesh_prescribed_finish(const flesh_prescribed *self, double *x, double *v)
{
  for (int d = 0; d < self->n; d++) {
    if (!self->fixed[d]) continue;
    double ignored;
    x[d] = self->x[LAST][d];
    derivatives(self, d, 1, &v[d], &ignored);
  }
}
