/* bdf2.c: the backward differentiation formula of order 2 with variable steps (Hairer, Norsett & Wanner 1993,
 * III.5). With w = h/h_before, for y = x and y = v alike,
 *   h y'_{n+1} = c (y_{n+1} - y_n) - d (y_n - y_{n-1}),   c = (1 + 2w)/(1 + w),  d = w^2/(1 + w).
 * Zero-stable for w < 1 + sqrt 2.
 *
 * A step without a past (the first, after an event or another state, or with w above 2) is one of the midpoint
 * rule: its local error is O(h^3), like BDF2's own. One step of backward Euler would keep order 2 as well, since it is
 * taken once, but would leave up to h^2 a/2 in x, of the size of the whole error. */
#include "time/midpoint.h"

static const double largest_growth = 2 * (1 + 1e-9);

/* vectors[0] = x_n - x_{n-1}, vectors[1] = v_n - v_{n-1}; the accelerations at the stages of the last two steps. */
enum { LAST = 2, BEFORE = 3 };

static int has_past(const flesh_method_memory *memory, double h)
{
  return memory->known && h <= largest_growth * memory->h;
}

static void bdf2_stage(const flesh_method_memory *memory, const flesh_state *state, double t_end,
                       double h, flesh_stage *stage)
{
  if (!has_past(memory, h)) {
    flesh_midpoint_stage(memory, state, t_end, h, stage);
    return;
  }
  double w = h / memory->h, c = (1 + 2 * w) / (1 + w), past = w * w / (1 + w);
  const double *dx = memory->vectors[0], *dv = memory->vectors[1];
  for (int d = 0; d < memory->n; d++) {
    memory->v0[d] = -past * dx[d] / h;
    memory->a0[d] = (c * (memory->v0[d] - state->v[d]) - past * dv[d]) / h;
  }
  *stage = (flesh_stage){.t = t_end,
                         .load = 1,
                         .prescribed_fraction = 1,
                         .shift = {.x = 1, .v = c / h, .a = c * c / (h * h)},
                         .x0 = state->x,
                         .v0 = memory->v0,
                         .a0 = memory->a0};
}

static void bdf2_velocity(const flesh_method_memory *memory, const flesh_state *state, const double *u, double h,
                          double *v)
{
  if (!has_past(memory, h)) {
    flesh_midpoint_velocity(memory, state, u, h, v);
    return;
  }
  const double w = h / memory->h, c = (1 + 2 * w) / (1 + w), past = w * w / (1 + w), *dx = memory->vectors[0];
  for (int d = 0; d < memory->n; d++) v[d] = (c * u[d] - past * dx[d]) / h;
}

static void bdf2_finish(flesh_method_memory *memory, const flesh_state *state, const double *u, double h)
{
  double *dx = memory->vectors[0], *dv = memory->vectors[1], *a = memory->vectors[LAST], *before = memory->vectors[BEFORE];
  const int known = has_past(memory, h);
  const double w = known ? h / memory->h : 0, c = (1 + 2 * w) / (1 + w), past = w * w / (1 + w);
  double *v = memory->a0; /* memory of the stage, which has been solved */
  bdf2_velocity(memory, state, u, h, v);
  for (int d = 0; d < memory->n; d++) {
    before[d] = a[d];
    a[d] = (c * (v[d] - state->v[d]) - past * dv[d]) / h;
    dx[d] = u[d];
    dv[d] = v[d] - state->v[d];
  }
  memory->before = known ? -h : 0;
}

static int bdf2_guess(const flesh_method_memory *memory, const flesh_stage *stage, double h, int which, double *u)
{
  return memory->known && flesh_method_guess(memory, stage, memory->vectors[LAST], memory->vectors[BEFORE], h, which, u);
}

/* (1 + w)^2/(6 w (1 + 2w)) h^3 v'' is the leading error term of the formula for x, v'' being the second difference of
 * three velocities. The midpoint rule's is h^3 v''/12 = h^2 (a - a_n)/6, a being the acceleration at its stage. a_n is
 * not known, and 0 is assumed, which gives the largest error. */
static int bdf2_error(const flesh_method_memory *memory, const flesh_state *state, const double *u, double h, double *e)
{
  const int past = has_past(memory, h);
  const double before = memory->h, w = past ? h / before : 1, *dv = memory->vectors[1];
  const double share = past ? (1 + w) * (1 + w) / (3 * w * (1 + 2 * w)) * h * h * h / (h + before) : h * h / 6;
  bdf2_velocity(memory, state, u, h, e);
  for (int d = 0; d < memory->n; d++) e[d] = share * ((e[d] - state->v[d]) / h - (past ? dv[d] / before : 0));
  return 1;
}

const flesh_method_row flesh_method_bdf2 = {.vectors = 4,
                                            .stage = bdf2_stage,
                                            .guess = bdf2_guess,
                                            .velocity = bdf2_velocity,
                                            .finish = bdf2_finish,
                                            .error = bdf2_error,
                                            .growth = 2};
