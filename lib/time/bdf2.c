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

/* vectors[0] = x_n - x_{n-1}, vectors[1] = v_n - v_{n-1}. */
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

static void bdf2_finish(flesh_method_memory *memory, const double *u, double h, flesh_state *state)
{
  double *dx = memory->vectors[0], *dv = memory->vectors[1];
  double w = h / memory->h, c = (1 + 2 * w) / (1 + w), past = w * w / (1 + w);
  int start = !has_past(memory, h);
  for (int d = 0; d < memory->n; d++) {
    double v = start ? 2 * u[d] / h - state->v[d] : (c * u[d] - past * dx[d]) / h;
    dx[d] = u[d];
    dv[d] = v - state->v[d];
    state->x[d] += u[d];
    state->v[d] = v;
  }
}

const flesh_method_row flesh_method_bdf2 = {
    .vectors = 2, .stage = bdf2_stage, .finish = bdf2_finish};
