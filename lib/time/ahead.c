/* ahead.c: states between the ends of a step, by the cubic through their positions and velocities: its error falls with
 * h^4, faster than that which the steps of a method of order 3 add up to. */
#include "time/ahead.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "math/hermite.h"
#include "system/feasible_step.h"

int flesh_ahead_is_limited(const flesh_system *system)
{
  return flesh_system_limits_step(system) || flesh_system_has_role(system, FLESH_ROLE_CONTACT) ||
         flesh_system_multiplier_count(system) || flesh_system_internal_count(system);
}

int flesh_ahead_create(int n, flesh_ahead *ahead)
{
  double **vectors[] = {&ahead->from.x, &ahead->from.v, &ahead->to.x, &ahead->to.v};
  size_t stride;
  double *all = flesh_huge_pages_vectors(4, (size_t)n, &stride);
  if (!all) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the states of a step");
  for (size_t k = 0; k < 4; k++) *vectors[k] = all + k * stride;
  return FLESH_OK;
}

void flesh_ahead_clear(flesh_ahead *ahead)
{
  flesh_free(ahead->from.x); /* and all others */
  *ahead = (flesh_ahead){.limit = -INFINITY};
}

size_t flesh_ahead_memory(const flesh_ahead *ahead, int n) { return ahead->from.x ? 4 * sizeof(double) * (size_t)n : 0; }

void flesh_ahead_archive(flesh_ahead *ahead, int n, flesh_archive *archive)
{
  if (!ahead->from.x) return;
  FLESH_ARCHIVE(archive, ahead->shown);
  if (!ahead->shown) return;
  flesh_state *states[] = {&ahead->from, &ahead->to};
  for (int k = 0; k < 2; k++) {
    FLESH_ARCHIVE(archive, states[k]->t);
    flesh_archive_nodes(archive, states[k]->x, (size_t)n / 3);
    flesh_archive_nodes(archive, states[k]->v, (size_t)n / 3);
  }
}

static void copy(int n, const flesh_state *from, flesh_state *to)
{
  to->t = from->t;
  memcpy(to->x, from->x, (size_t)n * sizeof *to->x);
  memcpy(to->v, from->v, (size_t)n * sizeof *to->v);
}

void flesh_ahead_remember(flesh_ahead *ahead, int n, const flesh_state *state)
{
  copy(n, state, &ahead->from);
}

/* Constrained dofs are where they are prescribed to be. */
static void interpolate(const flesh_ahead *ahead, const flesh_system *system, double t, double *room, flesh_state *state)
{
  const flesh_state *from = &ahead->from, *to = &ahead->to;
  const double times[] = {from->t, to->t};
  const int n = flesh_system_unknowns(system);
  double a[4], b[4];
  flesh_hermite_weights(2, times, 0, 0, t, a);
  flesh_hermite_weights(2, times, 0, 1, t, b);
  for (int d = 0; d < n; d++) {
    const double moved = to->x[d] - from->x[d]; /* weights of places alike add up to 1 but for rounding */
    state->x[d] = from->x[d] + b[0] * moved + a[1] * from->v[d] + b[1] * to->v[d];
    state->v[d] = b[2] * moved + a[3] * from->v[d] + b[3] * to->v[d];
  }
  state->t = t;
  flesh_system_prescribe(system, t, state->x);
  flesh_system_prescribe_velocity(system, t, state->v, room);
}

void flesh_ahead_show(flesh_ahead *ahead, const flesh_system *system, double end, double *room, flesh_state *state)
{
  ahead->shown = ahead->from.x && state->t > end;
  if (!ahead->shown) return;
  copy(flesh_system_unknowns(system), state, &ahead->to);
  interpolate(ahead, system, end, room, state);
}

int flesh_ahead_go_on(flesh_ahead *ahead, const flesh_system *system, double end, double rounding, double *room,
                      flesh_state *state)
{
  if (!ahead->shown) return 0;
  ahead->shown = end <= ahead->to.t + rounding;
  if (ahead->shown) interpolate(ahead, system, end, room, state);
  else copy(flesh_system_unknowns(system), &ahead->to, state);
  return ahead->shown;
}
