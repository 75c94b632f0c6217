/* surface_adapt.c: a contact stiffness that adapts to the pressures.
 *
 * The barrier holds a pressure p at the gap s (in thicknesses) where p = k |B'(s)|. The stiffness p / |B'(1/2)| leaves
 * half of the thickness. If k is much larger, gaps lie at the edge of the barrier, where forces begin with a kink; if
 * it is much smaller, gaps are small and the barrier is nearly singular. The logarithm of the stiffness over its
 * initial value is the effect's internal variable, so the stiffness changes only between steps, not between the parts
 * of a step: parts may be as short as an impact, during which a stiffening barrier would add energy. */
#include <math.h>
#include <stdio.h>

#include "effect/surface_contact.h"
#include "geometry/barrier.h"

typedef flesh_surface_near near;

/* Desired gap in thicknesses; factor by which the pressure may differ from the one at this gap; largest change of the
 * stiffness in a step; least and largest stiffness over the initial one. */
static const double AIM = 0.5, BAND = 4, MOST = 4, SOFTEST = 1e-6, STIFFEST = 1e3;

void flesh_surface_near_harden(near *self, const double *internal)
{
  const double stiffness = self->contact->law.stiffness * (internal && self->contact->adaptive ? exp(internal[0]) : 1);
  if (stiffness == self->set.law.stiffness) return;
  self->set.law.stiffness = stiffness;
  self->set_known = self->friction_known = self->secant_known = 0;
}

/* Returns the mean of the nodes' pressures over the stiffness, weighted by their forces; 0 without contact. */
static double mean_pressure(const flesh_contact_set *set, const double *x)
{
  double forces = 0, weighed = 0;
  for (int k = 0; k < set->count; k++) {
    const flesh_contact_pair *pair = &set->pairs[k];
    flesh_contact_closest at;
    if (pair->owner < 0 || !(pair->weight > 0)) continue;
    const double force = flesh_contact_pair_force(pair, x, &at);
    forces += force;
    weighed += force * (force / pair->weight);
  }
  return forces > 0 ? weighed / forces : 0;
}

int flesh_surface_near_adapt(const near *self, const double *x, double *internal)
{
  double value, slope, curvature;
  flesh_barrier_law(AIM, &value, &slope, &curvature);
  const double pressure = mean_pressure(&self->set, x), off = pressure / -slope;
  if (!(pressure > 0) || (off > 1 / BAND && off < BAND)) return 0;
  const double before = internal[0], wanted = before + fmin(fmax(log(off), -log(MOST)), log(MOST));
  internal[0] = fmin(fmax(wanted, log(SOFTEST)), log(STIFFEST));
  return internal[0] != before;
}
