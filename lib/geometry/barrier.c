/* barrier.c: the barrier around a point, a line or a plane. */
#include "geometry/barrier.h"

#include <math.h>

double flesh_barrier_secant(double s, double t)
{
  double value, first[2] = {0, 0}, second[2] = {0, 0};
  if (s < 1) flesh_barrier_law(s, &value, &first[0], &second[0]);
  if (t < 1) flesh_barrier_law(t, &value, &first[1], &second[1]);
  if (fabs(t - s) <= 1e-6 * fmin(s, fabs(1 - s))) return second[0]; /* the difference cancels here: use the tangent */
  return (first[1] - first[0]) / (t - s);
}

void flesh_barrier_add(flesh_barrier *barrier, double w, double weight, const flesh_barrier_core *core)
{
  const double *direction = core->direction, *axis = core->axis, d = core->distance - core->radius;
  const int flat = core->flat;
  if (!(d < w)) return;
  barrier->distance = fmin(barrier->distance, d);
  if (!(d > 0)) return;
  double value, first, second;
  flesh_barrier_law(d / w, &value, &first, &second);
  const double along = weight * second / w, across = flat < 2 ? weight * first / core->distance : 0;
  barrier->value += weight * w * value;
  for (int i = 0; i < 3; i++) {
    barrier->gradient[i] += weight * first * direction[i];
    for (int j = 0; j < 3; j++) {
      double normal = direction[i] * direction[j];
      double bent = (i == j) - normal - (flat == 1 ? axis[i] * axis[j] : 0);
      barrier->hessian[3 * i + j] += along * normal + across * bent;
    }
  }
}
