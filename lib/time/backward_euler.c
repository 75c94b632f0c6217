/* backward_euler.c: x_{n+1} = x_n + h v_{n+1}, v_{n+1} = v_n + h a_{n+1}. First order; L-stable.
 *
 * Where errors choose its steps it is the Runge-Kutta method of one stage, with the trapezoidal rule for its error. */
#include "time/method.h"

static void backward_euler_stage(const flesh_method_memory *memory, const flesh_state *state,
                                 double t_end, double h, flesh_stage *stage)
{
  for (int d = 0; d < memory->n; d++) memory->a0[d] = -state->v[d] / h;
  *stage = (flesh_stage){.t = t_end,
                         .load = 1,
                         .prescribed_fraction = 1,
                         .shift = {.x = 1, .v = 1 / h, .a = 1 / (h * h)},
                         .x0 = state->x,
                         .a0 = memory->a0};
}

static void backward_euler_velocity(const flesh_method_memory *memory, const flesh_state *state, const double *u,
                                    double h, double *v)
{
  (void)state;
  for (int d = 0; d < memory->n; d++) v[d] = u[d] / h;
}

const flesh_method_row flesh_method_backward_euler = {.stage = backward_euler_stage,
                                                      .velocity = backward_euler_velocity,
                                                      .controlled = &flesh_method_runge_kutta};
