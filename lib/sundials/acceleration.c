/* acceleration.c: what the mass matrix says at the start of a motion: accelerations that balance all effects, and what
 * jumps of the constrained dofs do to the free ones. */
#include <string.h>

#include "sparse/block_matrix.h"
#include "sparse/pcg.h"
#include "sundials/problem.h"

/* M, without constraints, into K; the caches are lost. */
static int assemble_mass(flesh_problem *self, double t, const double *x, const double *v)
{
  const size_t bytes = (size_t)self->n * sizeof *x;
  if (x != self->x) memcpy(self->x, x, bytes);
  if (v != self->v) memcpy(self->v, v, bytes);
  self->residual.known = self->potential.known = 0;
  self->stats.assemblies++;
  const flesh_point point = {.t = t, .load = 1, .x = self->x, .v = self->v, .a = self->a,
                             .threads = self->threads, .costs = self->costs};
  self->age = -1;
  self->solved = 0;
  return flesh_system_jacobian(self->system, &point, &(flesh_shift){.a = 1}, self->K);
}

/* M y = right on the free dofs, whose K is M; right is 0 on the others, and so becomes y. */
static int solve_mass(flesh_problem *self, const double *right, double *y)
{
  double norm = flesh_norm(self->threads, self->n, right);
  if (!(norm < 1e300)) return FLESH_NONFINITE;
  if (norm == 0) {
    memset(y, 0, (size_t)self->n * sizeof *y);
    return FLESH_OK;
  }
  flesh_problem_fix_matrix(self);
  int status = flesh_problem_factor(self);
  if (status) return status;
  if (self->direct) return flesh_direct_solve(self->direct, right, y);
  flesh_pcg_result result;
  status = self->linear->pcg(self->pcg, self->K, self->preconditioner, NULL, 1e-13 * norm, self->options.max_linear,
                             right, y, &result);
  self->stats.linear += result.iterations;
  return status;
}

int flesh_problem_acceleration(flesh_problem *self, double t, const double *x, const double *v,
                               double *a)
{
  double *r = self->gradient, *correction = self->step;
  flesh_problem_find_fixed(self, t);
  for (int d = 0; d < self->n; d++) self->a[d] = a[d] = self->fixed[d] ? a[d] : 0;
  int status = assemble_mass(self, t, x, v);
  if (status) return status;
  const flesh_point point = {.t = t, .load = 1, .x = self->x, .v = self->v, .a = self->a,
                             .threads = self->threads, .costs = self->costs};
  self->stats.residuals++;
  status = flesh_system_residual(self->system, &point, r);
  if (status) return status;
  for (int d = 0; d < self->n; d++) r[d] = self->fixed[d] ? 0 : -r[d];
  status = solve_mass(self, r, correction);
  for (int d = 0; d < self->n && !status; d++)
    if (!self->fixed[d]) a[d] = correction[d];
  return status;
}

/* Of positions or velocities y. */
static int take_up(flesh_problem *self, double t, const double *prescribed, double *y)
{
  double *jump = self->step, *right = self->gradient;
  int any = 0;
  for (int d = 0; d < self->n; d++) {
    jump[d] = self->fixed[d] ? prescribed[d] - y[d] : 0;
    any |= jump[d] != 0;
  }
  if (!any) return FLESH_OK;
  int status = assemble_mass(self, t, self->x, self->v);
  if (status) return status;
  flesh_block_multiply(self->K, jump, right);
  for (int d = 0; d < self->n; d++) {
    right[d] = self->fixed[d] ? 0 : -right[d];
    if (self->fixed[d]) y[d] = prescribed[d];
  }
  status = solve_mass(self, right, jump);
  for (int d = 0; d < self->n && !status; d++)
    if (!self->fixed[d]) y[d] += jump[d];
  return status;
}

int flesh_problem_take_up(flesh_problem *self, double t, const double *x_prescribed,
                          const double *v_prescribed, double *x, double *v)
{
  const size_t bytes = (size_t)self->n * sizeof *x;
  flesh_problem_find_fixed(self, t);
  memcpy(self->x, x, bytes);
  memcpy(self->v, v, bytes);
  memset(self->a, 0, bytes);
  int status = take_up(self, t, x_prescribed, x);
  return status ? status : take_up(self, t, v_prescribed, v);
}
