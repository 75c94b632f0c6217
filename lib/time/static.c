/* static.c: equilibrium, r(t, x, 0, 0) = 0. */
#include "time/method.h"

static void static_stage(const flesh_method_memory *memory, const flesh_state *state, double t_end,
                         double h, flesh_stage *stage)
{
  (void)memory, (void)h;
  *stage =
      (flesh_stage){.t = t_end, .load = 1, .prescribed_fraction = 1, .shift = {.x = 1}, .x0 = state->x};
}

/* The velocities are set to zero only once the whole load is on: a part of it may yet be taken back. */
const flesh_method_row flesh_method_static = {.stage = static_stage};
