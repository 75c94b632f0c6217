/* midpoint.c: the implicit midpoint rule: balance at the middle of the step, where
 *   x = x_n + u/2,  v = u/h,  a = (v_{n+1} - v_n)/h  with  v_{n+1} = 2u/h - v_n.
 * Second order, symplectic: linear and angular momentum are kept exactly and energy without drift, and nothing is
 * damped, however fast it oscillates (Hairer, Lubich & Wanner 2006, IV.2 and VI). That holds for steps that resolve
 * the motion: energy may grow without bound where large and fast motion is stepped over (Simo & Tarnow 1992; a pulled
 * finger that snaps back gains 30 % in 20 steps of 1 ms and 0.07 % in the same time with steps of 1/16 ms). */
#include "time/midpoint.h"

void flesh_midpoint_stage(const flesh_method_memory *memory, const flesh_state *state, double t_end,
                          double h, flesh_stage *stage)
{
  for (int d = 0; d < memory->n; d++) {
    memory->v0[d] = 0;
    memory->a0[d] = -2 * state->v[d] / h;
  }
  *stage = (flesh_stage){.t = state->t + (t_end - state->t) / 2,
                         .load = 1,
                         .prescribed_fraction = 1,
                         .shift = {.x = 0.5, .v = 1 / h, .a = 2 / (h * h)},
                         .x0 = state->x,
                         .v0 = memory->v0,
                         .a0 = memory->a0};
}

void flesh_midpoint_velocity(const flesh_method_memory *memory, const flesh_state *state, const double *u, double h,
                             double *v)
{
  for (int d = 0; d < memory->n; d++) v[d] = 2 * u[d] / h - state->v[d];
}

const flesh_method_row flesh_method_midpoint = {
    .stage = flesh_midpoint_stage, .velocity = flesh_midpoint_velocity};
