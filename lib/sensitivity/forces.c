/* forces.c: derivatives of a sum of forces at a state. As free accelerations a_f follow from M a = -r, a change dr of the
 * residual at fixed accelerations changes w . r by (w - lambda) . dr, where M_ff lambda = M_fc w. */
#include "sensitivity/forces.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"

/* Shift of the positions in a stage of zero length, whose unknown is the acceleration: so small that K is M. */
static const double no_time = 1e-30;

int flesh_force_slopes(flesh_stage_tangent *tangent, const flesh_force_sum *sum, double *by_x, double *by_v)
{
  const size_t n = (size_t)tangent->n;
  double *zeros = flesh_calloc(5 * n + 1, sizeof *zeros), *w = zeros + n, *lambda = w + n, *x = lambda + n, *v = x + n;
  if (!zeros) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the sensitivities of %zu unknowns", n);
  const flesh_state *state = sum->state;
  const double *velocity = sum->a ? state->v : zeros;
  const flesh_stage stage = {.t = state->t, .load = 1, .prescribed_fraction = 1,
                             .shift = {.x = sum->a ? no_time : 1, .a = sum->a != NULL}, .x0 = state->x, .v0 = velocity,
                             .a0 = sum->a ? sum->a : zeros, .x_lag = state->x, .v_lag = velocity, .t_lag = state->t,
                             .internal = state->internal, .multipliers = state->multipliers};
  tangent->couplings.left_out = sum->left_out;
  int status = flesh_stage_tangent_set(tangent, &stage, zeros, (1u << FLESH_OWN_V) - 1);
  memcpy(w, sum->weights, n * sizeof *w);
  if (!status && sum->a && !sum->left_out) {
    status = flesh_stage_tangent_mass_times(tangent, w, x);
    if (!status) status = flesh_stage_tangent_solve(tangent, 1, x, NULL, lambda);
  }
  if (!status) {
    for (size_t d = 0; d < n; d++) w[d] -= lambda[d];
    status = flesh_stage_tangent_read(tangent, w, x, v);
  }
  for (size_t d = 0; d < n && !status; d++) by_x[d] += x[d], by_v[d] += v[d];
  flesh_free(zeros);
  return status;
}
