/* acceleration.c: the acceleration that balances all effects at a given position and velocity. */
#include <string.h>

#include "sparse/block_matrix.h"
#include "sparse/pcg.h"
#include "sundials/problem.h"

int flesh_problem_acceleration(flesh_problem *self, double t, const double *x, const double *v,
                               double *a)
{
  const size_t bytes = (size_t)self->n * sizeof *a;
  double *r = self->gradient, *correction = self->step, norm;
  flesh_system_fixed(self->system, t, self->fixed);
  for (int d = 0; d < self->n; d++) a[d] = self->fixed[d] ? a[d] : 0;
  memcpy(self->x, x, bytes);
  memcpy(self->v, v, bytes);
  memcpy(self->a, a, bytes);
  self->residual.known = self->potential.known = 0; /* K and the point are no longer theirs */
  const flesh_point point = {.t = t, .load = 1, .x = self->x, .v = self->v, .a = self->a};
  self->stats.residuals++;
  int status = flesh_system_residual(self->system, &point, r);
  if (status) return status;
  for (int d = 0; d < self->n; d++) r[d] = self->fixed[d] ? 0 : -r[d];
  norm = flesh_norm(self->n, r);
  if (!(norm < 1e300)) return FLESH_NONFINITE;
  if (norm == 0) return FLESH_OK;
  self->stats.assemblies++;
  status = flesh_system_jacobian(self->system, &point, &(flesh_shift){.a = 1}, self->K);
  if (status) return status;
  flesh_block_fix(self->K, self->fixed, self->fixed_scale);
  status = flesh_problem_factor(self);
  if (status) return status;
  if (self->direct) {
    status = flesh_direct_solve(self->direct, r, correction);
  } else {
    flesh_pcg_result result;
    status = flesh_pcg(self->K, self->preconditioner, NULL, 1e-13 * norm, self->options.max_linear, r,
                       correction, self->work, &result);
    self->stats.linear += result.iterations;
  }
  if (status) return status;
  for (int d = 0; d < self->n; d++)
    if (!self->fixed[d]) a[d] += correction[d];
  return FLESH_OK;
}
