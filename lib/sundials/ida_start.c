/* ida_start.c: consistent starts for IDA: jumps of constrained dofs, y', and the scales of tolerances. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/parallel_vector.h"
#include "linear/block_matrix.h"
#include "sundials/ida_problem.h"
#include "system/state.h"
#include "system/velocity_scale.h"

static const double mass_tolerance = 1e-14; /* tolerance of solves with the mass matrix, which is well conditioned */

static int assemble_mass(flesh_ida_problem *self, const flesh_point *point)
{
  return flesh_system_jacobian(self->evaluation.system, point, &(flesh_shift){.a = 1}, self->jacobian.D);
}

double flesh_ida_scale_of_velocity(flesh_ida_problem *self)
{
  flesh_evaluation *e = &self->evaluation;
  double *const room[FLESH_VELOCITY_SCALE_ROOM] = {e->x, self->solver.right, e->v, e->a, self->solver.change};
  return flesh_system_velocity_scale(e->system, self->jacobian.K, room, &self->scale.mass);
}

/* Applies jumps of the constrained dofs from u to `prescribed`, and their effect on the free dofs. */
static int apply_constraints(flesh_ida_problem *self, const double *prescribed, double *u)
{
  flesh_evaluation *e = &self->evaluation;
  flesh_ida_constraints *held = &self->constraints;
  double *jump = self->solver.change, *right = self->solver.right;
  for (int d = 0; d < e->n; d++) {
    jump[d] = held->fixed[d] ? prescribed[d] - u[d] : 0;
    if (held->fixed[d]) u[d] = prescribed[d];
  }
  flesh_block_multiply_of_team(e->team, self->jacobian.D, jump, right);
  for (int d = 0; d < e->n; d++) right[d] = held->fixed[d] ? 0 : -right[d];
  if (flesh_largest(self->threads, e->n, right) == 0) return FLESH_OK;
  int status = flesh_ida_solve(self, mass_tolerance, right, jump);
  for (int d = 0; d < e->n && !status; d++)
    if (!held->fixed[d]) u[d] += jump[d];
  return status;
}

/* Computes a: on the free dofs from M a = -r(t, x, v, 0), on the others as prescribed. K is M, factored. */
static int accelerate(flesh_ida_problem *self, double t, const double *x, const double *v, double *a)
{
  flesh_evaluation *e = &self->evaluation;
  flesh_ida_constraints *held = &self->constraints;
  double *r = self->solver.right, *correction = self->solver.change;
  for (int d = 0; d < e->n; d++) a[d] = held->fixed[d] ? held->a[d] : 0;
  flesh_point point = flesh_point_at(t, x, v, a);
  point.environment = &e->environment;
  e->environment.starts = 1;
  self->stats.residuals++;
  int status = flesh_system_residual(e->system, &point, r);
  if (status) return status;
  if (!(flesh_norm(self->threads, e->n, r) < INFINITY)) return FLESH_NONFINITE;
  for (int d = 0; d < e->n; d++) r[d] = held->fixed[d] ? 0 : -r[d];
  status = flesh_ida_solve(self, mass_tolerance, r, correction);
  for (int d = 0; d < e->n && !status; d++)
    if (!held->fixed[d]) a[d] = correction[d];
  return status;
}

int flesh_ida_start(flesh_ida_problem *self, const flesh_state *state, N_Vector y_vector, N_Vector yp_vector)
{
  FLESH_NEED({self, "problem"});
  FLESH_NEED_STATE(state);
  flesh_ida_matrices *J = &self->jacobian;
  flesh_evaluation *e = &self->evaluation;
  flesh_ida_constraints *held = &self->constraints;
  const int n = e->n;
  const size_t bytes = (size_t)n * sizeof(double);
  const double t = state->t;
  if (!isfinite(t)) return flesh_fail(FLESH_ERR_ARGUMENT, "the state's t is %g s; it must be finite", t);
  double *x = flesh_ida_open(self, y_vector, 0), *xp = x ? flesh_ida_open(self, yp_vector, 1) : NULL;
  if (!xp) return FLESH_ERR_ARGUMENT;
  int status = flesh_evaluation_check_state(e, state);
  if (status) return status;
  double *v = x + n, *a = xp + n;
  self->accepted.limits = held->started = 0;
  held->begin = t;
  held->event = flesh_system_next_event(e->system, t);
  flesh_system_fixed(e->system, t, held->fixed);
  /* Nodes of no tet are constrained, too, and stay where they are. */
  memcpy(held->x, state->x, bytes);
  memset(held->v, 0, bytes);
  memset(held->a, 0, bytes);
  flesh_system_prescribe(e->system, t, held->x);
  flesh_system_prescribe_velocity(e->system, t, held->v, held->a);
  held->t = t;
  memmove(x, state->x, bytes);
  memmove(v, state->v, bytes);
  memset(a, 0, bytes);
  flesh_point point = flesh_point_at(t, x, v, a);
  point.environment = &e->environment;
  status = assemble_mass(self, &point);
  if (status) return status;
  memcpy(J->K->values, J->D->values, (size_t)J->K->row_start[J->K->rows] * 9 * sizeof(double));
  double mass = 0;
  for (int i = 0; i < J->K->rows; i++) mass += J->K->values[9 * (size_t)J->K->row_start[i]];
  flesh_block_fix(J->K, held->fixed, mass / J->K->rows, self->threads);
  J->content = FLESH_IDA_NOTHING;
  status = flesh_ida_factor(self);
  if (!status) J->content = FLESH_IDA_MASS;
  if (!status) status = apply_constraints(self, held->x, x);
  if (!status) status = apply_constraints(self, held->v, v);
  if (!status) status = accelerate(self, t, x, v, a);
  memcpy(xp, v, bytes);
  flesh_ida_accept(self, t, x, v);
  self->accepted.starts++;
  flesh_ida_close(self, y_vector, x);
  flesh_ida_close(self, yp_vector, xp);
  held->started = !status;
  return status;
}

int flesh_ida_tolerances(const flesh_ida_problem *self, double tolerance, N_Vector atol_vector)
{
  FLESH_NEED({self, "problem"});
  if (!(tolerance > 0 && tolerance < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "tolerance is %g; it must be positive and finite", tolerance);
  double *atol = flesh_ida_open(self, atol_vector, 0);
  if (!atol) return FLESH_ERR_ARGUMENT;
  for (int d = 0; d < self->evaluation.n; d++) {
    atol[d] = self->constraints.fixed[d] ? 1e100 : tolerance * self->scale.length;
    atol[self->evaluation.n + d] = self->constraints.fixed[d] ? 1e100 : tolerance * self->scale.velocity;
  }
  flesh_ida_close(self, atol_vector, atol);
  return FLESH_OK;
}

/* Returns the root mean square over the free dofs, scaled by length and velocity. */
static double scaled_norm(const flesh_ida_problem *self, const double *dx, const double *dv)
{
  const flesh_evaluation *e = &self->evaluation;
  double sums[2] = {0}; /* sum of squares, and number of free dofs */
  for (int d = 0; d < e->own; d++) {
    if (self->constraints.fixed[d]) continue;
    double p = dx[d] / self->scale.length, q = dv[d] / self->scale.velocity;
    sums[0] += p * p + q * q;
    sums[1]++;
  }
  flesh_team_sum(e->team, 2, sums);
  return sums[1] > 0 ? sqrt(sums[0] / (2 * sums[1])) : 0;
}

double flesh_ida_curvature(flesh_ida_problem *self, double ahead, N_Vector y_vector, N_Vector yp_vector)
{
  flesh_evaluation *e = &self->evaluation;
  flesh_ida_constraints *held = &self->constraints;
  const int n = e->n;
  const double *x = flesh_ida_read(self, y_vector, 0, 0), *rate = x ? flesh_ida_read(self, yp_vector, 0, 1) : NULL;
  if (!rate || self->jacobian.content != FLESH_IDA_MASS) return INFINITY;
  const double *v = x + n, *a = rate + n;
  double speed = scaled_norm(self, v, a);
  if (!(speed < INFINITY)) return INFINITY;
  /* Large enough for the difference to exceed rounding, small enough to be a difference. */
  double dt = fmin(1e-7 / speed, 1e-3 * fmin(held->event - held->begin, ahead));
  double *x1 = e->x, *v1 = e->v, *a1 = e->a;
  for (int d = 0; d < n; d++) {
    x1[d] = x[d] + dt * (v[d] + dt / 2 * a[d]);
    v1[d] = v[d] + dt * a[d];
  }
  if (accelerate(self, held->begin + dt, x1, v1, a1)) return INFINITY;
  for (int d = 0; d < n; d++) a1[d] = (a1[d] - a[d]) / dt;
  return scaled_norm(self, a, a1);
}

int flesh_ida_get_state(flesh_ida_problem *self, double t, N_Vector y_vector, flesh_state *state)
{
  FLESH_NEED({self, "problem"});
  FLESH_NEED_STATE(state);
  flesh_evaluation *e = &self->evaluation;
  flesh_ida_constraints *held = &self->constraints;
  const int n = e->n;
  if (t - held->event > 1e-9 * (held->event - held->begin)) /* allows for rounding of the integrator's time */
    return flesh_fail(FLESH_ERR_ARGUMENT, "t is %g s, after the event at %g s, up to which the start is valid; stop the "
                                          "integrator there and start again",
                      t, held->event);
  const double *y = flesh_ida_read_at(self, t, y_vector);
  if (!y) return FLESH_ERR_ARGUMENT;
  memmove(state->x, y, (size_t)n * sizeof *y);
  memmove(state->v, y + n, (size_t)n * sizeof *y);
  double before = t >= held->event ? nextafter(held->event, held->begin) : t;
  flesh_system_prescribe(e->system, before, held->x);
  flesh_system_prescribe_velocity(e->system, before, held->v, held->a);
  held->t = before;
  for (int d = 0; d < n; d++)
    if (held->fixed[d]) {
      state->x[d] = held->x[d];
      state->v[d] = held->v[d];
    }
  state->t = t;
  return FLESH_OK;
}
