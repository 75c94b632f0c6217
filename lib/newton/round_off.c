/* round_off.c: measures how much round-off in the unknowns changes the residual and the potential, by moving the point by
 * as much. */
#include <float.h>
#include <math.h>

#include "math/xorshift.h"
#include "newton/equations.h"

/* Moves the point of u by round-off: x by the last digit of the largest position, as differences of positions are what
 * counts, and v and a by that of the terms they are sums of, which may be far larger than the sums. */
static void disturb(flesh_equations *self, const double *u, uint32_t *random)
{
  flesh_evaluation *e = &self->evaluation;
  const flesh_stage *stage = &self->stage;
  const double largest = flesh_largest(self->threads, self->n, e->x);
  const double size = self->far_away ? flesh_largest(self->threads, self->n, self->relative) : 0;
  for (int d = 0; d < self->n; d++) {
    const double relative = DBL_EPSILON * (flesh_xorshift(random) * 0x1p-31 - 1); /* any signs and sizes will do */
    e->x[d] += relative * largest;
    if (self->far_away) self->relative[d] += relative * size;
    e->v[d] += relative * (fabs(stage->v0 ? stage->v0[d] : 0) + fabs(stage->shift.v * u[d]));
    e->a[d] += relative * (fabs(stage->a0 ? stage->a0[d] : 0) + fabs(stage->shift.a * u[d]));
  }
}

double flesh_equations_residual_round_off(flesh_equations *self, const double *u)
{
  double *exact = self->scratch, *moved = self->scratch + self->n;
  uint32_t random = flesh_xorshift_first;
  if (flesh_equations_residual(self, u, exact)) return 0;
  flesh_point point = flesh_equations_point(self, u);
  disturb(self, u, &random);
  self->stats->residuals++;
  if (flesh_system_residual(self->system, &point, moved)) return 0;
  for (int d = 0; d < self->n; d++) moved[d] = self->constrained.is[d] ? 0 : moved[d] - exact[d];
  return flesh_equations_norm(self, moved);
}

double flesh_equations_potential_round_off(flesh_equations *self, const double *u)
{
  enum { SAMPLES = 4 }; /* one may come out small by chance */
  double least = INFINITY, most = -INFINITY, value, magnitude;
  uint32_t random = flesh_xorshift_first;
  for (int sample = 0; sample < SAMPLES; sample++) {
    flesh_point point = flesh_equations_point(self, u);
    disturb(self, u, &random);
    self->stats->potentials++;
    if (flesh_system_potential(self->system, &point, &self->stage.shift, &value, &magnitude)) continue;
    least = fmin(least, value);
    most = fmax(most, value);
  }
  return fmax(most - least, 0);
}

int flesh_equations_at_round_off(flesh_equations *self, const double *u, double norm)
{
  const double largest = flesh_largest(self->threads, self->n, self->far_away ? self->relative : self->evaluation.x);
  const double guess = 1e-16 * self->constrained.stiffness * largest * sqrt(self->evaluation.all);
  return norm <= 1e3 * guess && norm <= FLESH_ROUND_OFF_LEAVES * flesh_equations_residual_round_off(self, u);
}

/* Ratio of the distance from the origin to the body's size from which on it is far away: x then lacks three digits of its
 * shape. */
static const double FAR = 1e3;

void flesh_equations_find_far_away(flesh_equations *self)
{
  const double *X = flesh_mesh_positions(flesh_system_mesh(self->system));
  double largest[2] = {0}; /* distances from the origin along an axis, and from the first node */
  for (int d = 0; d < self->n; d++) {
    largest[0] = fmax(largest[0], fabs(X[d]));
    largest[1] = fmax(largest[1], fabs(X[d] - X[d % 3]));
  }
  flesh_team_largest(self->team, 2, largest);
  self->far_away = largest[0] > FAR * largest[1];
}

const double *flesh_equations_relative(flesh_equations *self, const double *u)
{
  const flesh_stage *s = &self->stage;
  const flesh_constrained *constrained = &self->constrained;
  for (int d = 0; d < self->n; d++)
    self->relative[d] = s->x0[d] - s->x0[d % 3] + s->shift.x * (constrained->is[d] ? constrained->u[d] : u[d]);
  return self->relative;
}
