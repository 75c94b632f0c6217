/* slip.c: stiffness of friction for a solve. */
#include "geometry/slip.h"

#include <math.h>
#include <string.h>

#include "math/mat3.h"

/* Computes the stiffness for d; if d is NULL, the tangent. */
static void find_stiffness(const double u[3], const double *d, double e, double stiffness[9])
{
  const double y = sqrt(flesh_vec3_dot(u, u)), ratio = flesh_slip_ratio(y, e), one = y > 0 ? 1 / y : 0;
  const double bend = y > 0 ? flesh_slip_fall(y, e) / (2 * y) : 0, along[3] = {u[0] * one, u[1] * one, u[2] * one};
  if (!d) d = along;
  for (int k = 0; k < 9; k++) stiffness[k] = ratio * (k % 4 == 0) + bend * (u[k / 3] * d[k % 3] + d[k / 3] * u[k % 3]);
}

/* Predicts d at the slip u for the matrix of this number. */
static void expect(flesh_slip_expected *self, int matrix, const double u[3], const double *normal, double e)
{
  const int expects = self->matrix > 0 && self->matrix == matrix - 1;
  const double y = sqrt(flesh_vec3_dot(u, u)), force = flesh_slip_ratio(y, e) * y;
  double stiffness[9], change[3], d[3] = {0};
  self->matrix = matrix;
  if (expects && !memcmp(self->u, u, sizeof self->u)) return; /* another matrix at the same place */
  if (expects && force > 0) {
    find_stiffness(self->u, self->d, e, stiffness);
    for (int c = 0; c < 3; c++) change[c] = u[c] - self->u[c];
    flesh_mat3_times(stiffness, change, d);
    const double before = flesh_slip_ratio(sqrt(flesh_vec3_dot(self->u, self->u)), e);
    for (int c = 0; c < 3; c++) d[c] += before * self->u[c];
    const double out = normal ? flesh_vec3_dot(d, normal) : 0;
    for (int c = 0; c < 3 && normal; c++) d[c] -= out * normal[c];
    const double most = fmax(force, sqrt(flesh_vec3_dot(d, d)));
    for (int c = 0; c < 3; c++) d[c] /= most;
  }
  memcpy(self->u, u, sizeof self->u);
  memcpy(self->d, d, sizeof self->d);
}

void flesh_slip_stiffness(flesh_slip_expected *self, int matrix, const double u[3], const double *normal, double e,
                          double stiffness[9])
{
  const int predicts = self && matrix > 0;
  if (predicts && self->matrix != matrix) expect(self, matrix, u, normal, e);
  find_stiffness(u, predicts && !memcmp(self->u, u, sizeof self->u) ? self->d : NULL, e, stiffness);
}
