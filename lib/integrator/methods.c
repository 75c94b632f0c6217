/* methods.c: backward Euler and statics. The unknown is the displacement over the step, so that differences of
 * nearby positions never cancel. */
#include <stddef.h>

#include "integrator/method.h"

/* x = x_n + u, v = u/h, a = (u/h - v_n)/h. */
static void backward_euler_stage(const flesh_state *state, double h, int unknowns, double *base,
                                 flesh_stage *stage)
{
  for (int d = 0; d < unknowns; d++) base[d] = -state->v[d] / h;
  *stage = (flesh_stage){.t = state->t + h, .load = 1, .share = 1, .shift = {.x = 1, .v = 1 / h, .a = 1 / (h * h)},
                         .x0 = state->x, .a0 = base};
}

static void backward_euler_finish(const flesh_stage *stage, const double *u, double h, int unknowns,
                                  flesh_state *state)
{
  for (int d = 0; d < unknowns; d++) {
    state->x[d] += u[d];
    state->v[d] = u[d] / h;
  }
  state->t = stage->t;
}

static void static_stage(const flesh_state *state, double h, int unknowns, double *base,
                         flesh_stage *stage)
{
  (void)unknowns, (void)base;
  *stage = (flesh_stage){.t = state->t + h, .load = 1, .share = 1, .shift = {.x = 1}, .x0 = state->x};
}

static void static_finish(const flesh_stage *stage, const double *u, double h, int unknowns,
                          flesh_state *state)
{
  (void)h;
  for (int d = 0; d < unknowns; d++) {
    state->x[d] += u[d];
    state->v[d] = 0;
  }
  state->t = stage->t;
}

const flesh_method_row *flesh_method_find(flesh_method method)
{
  static const flesh_method_row rows[] = {
      [FLESH_METHOD_BACKWARD_EULER] = {"backward-euler", backward_euler_stage, backward_euler_finish},
      [FLESH_METHOD_STATIC] = {"static", static_stage, static_finish},
      [FLESH_METHOD_ADAPTIVE] = {"adaptive", NULL, NULL},
      [FLESH_METHOD_CALM_ADAPTIVE] = {"calm-then-adaptive", backward_euler_stage, backward_euler_finish},
  };
  return (size_t)method < sizeof rows / sizeof rows[0] ? &rows[method] : NULL;
}
