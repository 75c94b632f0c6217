/* ahead.c: states between the ends of a step, by the cubic through their positions and velocities: its error falls with
 * h^4, faster than that which the steps of a method of order 3 add up to.
 *
 * However little a nearly incompressible body is off, its volumes are others, and with them its stresses, reactions and energy.
 * Where the imbalance of forces at half the step is worth an energy of more than 9 tolerance^2 mu/lambda of the elastic one,
 * states that are shown are solved for: as stages whose base is the cubic, with an acceleration that is exact but for h^3, so
 * that what steps resolve stays as it is, and all else balances. An error p of the pressure is worth p^2/(2 lambda), a shear
 * stress s has the energy s^2/(2 mu): hence mu/lambda. */
#include "time/ahead.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "math/hermite.h"
#include "system/feasible_step.h"

enum { VECTORS = 7 };
static const double most_off = 3;      /* tolerances that stresses may be off by: steps make them no larger */
static const double stage_part = 0.25; /* of the step: g of a stage solved for a shown state */
/* A correction serves another state whose cubic is off by at most this many times as much: what its solve left grows by
 * the same factor. */
static const double most_growth = 3;

int flesh_ahead_is_limited(const flesh_system *system)
{
  return flesh_system_limits_step(system) || flesh_system_has_role(system, FLESH_ROLE_CONTACT) ||
         flesh_system_multiplier_count(system) || flesh_system_internal_count(system);
}

int flesh_ahead_create(flesh_error_control *control, const uint8_t *fixed, const double *acceleration, flesh_ahead *ahead)
{
  double **vectors[VECTORS] = {&ahead->from.x, &ahead->from.v, &ahead->to.x, &ahead->to.v, &ahead->a, &ahead->between,
                               &ahead->correction};
  size_t stride;
  double *all = flesh_huge_pages_vectors(VECTORS, (size_t)control->n, &stride);
  if (!all) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the states of a step");
  for (size_t k = 0; k < VECTORS; k++) *vectors[k] = all + k * stride;
  ahead->control = control;
  ahead->fixed = fixed;
  ahead->acceleration = acceleration;
  return FLESH_OK;
}

void flesh_ahead_clear(flesh_ahead *ahead)
{
  flesh_free(ahead->from.x); /* and all others */
  *ahead = (flesh_ahead){.limit = -INFINITY};
}

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
  flesh_archive_nodes(archive, ahead->a, (size_t)n / 3);
  FLESH_ARCHIVE(archive, ahead->corrected);
  if (ahead->corrected > 0) flesh_archive_nodes(archive, ahead->correction, (size_t)n / 3);
  FLESH_ARCHIVE(archive, ahead->balances);
  FLESH_ARCHIVE(archive, ahead->target);
}

static void copy(int n, const flesh_state *from, flesh_state *to)
{
  to->t = from->t;
  memcpy(to->x, from->x, (size_t)n * sizeof *to->x);
  memcpy(to->v, from->v, (size_t)n * sizeof *to->v);
}

void flesh_ahead_remember(flesh_ahead *ahead, const flesh_state *state)
{
  const int n = ahead->control->n;
  copy(n, state, &ahead->from);
  if (ahead->acceleration) memcpy(ahead->a, ahead->acceleration, (size_t)n * sizeof *ahead->a);
}

/* Finds the state at t, and its acceleration in ahead->between: by the cubic and, where accelerations are known at the
 * ends, by the line through these, mixed so that polynomials of degree 4 are exact. Constrained dofs are where they are
 * prescribed to be. */
static void interpolate(const flesh_ahead *ahead, double t, double *room, flesh_state *state)
{
  const flesh_state *from = &ahead->from, *to = &ahead->to;
  const flesh_system *system = ahead->control->system;
  const double times[] = {from->t, to->t}, h = to->t - from->t, s = (t - from->t) / h;
  const double *a0 = ahead->a, *a1 = ahead->acceleration ? ahead->acceleration : ahead->a;
  const double cubic = ahead->acceleration ? 6 * s * (1 - s) : 1, line = 1 - cubic;
  double w[4], z[4];
  flesh_hermite_weights(2, times, 0, 0, t, w);
  flesh_hermite_weights(2, times, 0, 1, t, z);
  for (int d = 0; d < ahead->control->n; d++) {
    const double moved = to->x[d] - from->x[d]; /* the weights of positions add up to 1, but for rounding */
    const double bend = (6 - 12 * s) / h * moved + (6 * s - 4) * from->v[d] + (6 * s - 2) * to->v[d];
    state->x[d] = from->x[d] + z[0] * moved + w[1] * from->v[d] + z[1] * to->v[d];
    state->v[d] = z[2] * moved + w[3] * from->v[d] + z[3] * to->v[d];
    ahead->between[d] = cubic * bend / h + line * (a0[d] + s * (a1[d] - a0[d]));
  }
  state->t = t;
  flesh_system_prescribe(system, t, state->x);
  flesh_system_prescribe_velocity(system, t, state->v, room);
}

/* Returns whether the forces at half the step would be off by much if the state there were interpolated. Overwrites the
 * state. */
static int is_off(const flesh_ahead *ahead, double *room, flesh_state *state, flesh_solve_stats *stats)
{
  flesh_error_control *control = ahead->control;
  const double elastic =
      flesh_error_control_elastic(control, ahead->from.x) + flesh_error_control_elastic(control, ahead->to.x);
  interpolate(ahead, (ahead->from.t + ahead->to.t) / 2, room, state);
  const flesh_point point = flesh_evaluation_point(&control->nonlinear->newton->equations.evaluation, state->t, state->x,
                                                   state->v, ahead->between);
  const double off = flesh_error_control_imbalance(control, ahead->fixed, &point, stats);
  return !(off * control->stiffness <= pow(most_off * control->options.tolerance, 2) * elastic);
}

/* Returns the shift of the stage that is solved for a shown state. */
static flesh_shift shift_of(const flesh_ahead *ahead)
{
  const double rate = 1 / (stage_part * (ahead->to.t - ahead->from.t));
  return (flesh_shift){.x = 1, .v = rate, .a = rate * rate};
}

/* Finds whether states within the step just taken are to be solved for, and to which residual. */
static void judge(flesh_ahead *ahead, double *room, flesh_state *state, flesh_solve_stats *stats)
{
  flesh_nonlinear *nonlinear = ahead->control->nonlinear;
  const flesh_shift shift = shift_of(ahead);
  ahead->corrected = 0;
  ahead->balances = is_off(ahead, room, state, stats);
  flesh_error_control_set_target(ahead->control, &shift);
  ahead->target = nonlinear->newton->goal.target;
  nonlinear->newton->goal.target = 0;
  flesh_nonlinear_set_weights(nonlinear, NULL);
}

/* Returns the error of the cubic at t, without a factor that is the same throughout the step. */
static double error_at(const flesh_ahead *ahead, double t)
{
  const double h = ahead->to.t - ahead->from.t, s = (t - ahead->from.t) / h;
  return pow(s * (1 - s), 2);
}

/* Solves for the interpolated state as a stage whose base it is; the state stays as it is if that has no solution. The
 * correction of an earlier state of the same step predicts this one's. */
static int balance(flesh_ahead *ahead, double *guess, flesh_state *state, flesh_solve_stats *stats)
{
  flesh_nonlinear *nonlinear = ahead->control->nonlinear;
  const double error = error_at(ahead, state->t), growth = error / ahead->corrected;
  const double *const guesses[] = {growth < most_growth ? guess : NULL, NULL};
  const flesh_stage stage = {.t = state->t, .load = 1, .prescribed_fraction = 1, .shift = shift_of(ahead), .x0 = state->x,
                             .v0 = state->v, .a0 = ahead->between, .t_lag = state->t, .t_from = state->t};
  for (int d = 0; d < ahead->control->n && guesses[0]; d++) guess[d] = growth * ahead->correction[d];
  const flesh_newton_goal goal = nonlinear->newton->goal;
  nonlinear->newton->goal.target = ahead->target;
  nonlinear->newton->goal.of_load = INFINITY; /* no motion continues from this stage */
  nonlinear->newton->policy.stage_continues = 1; /* all states of the step have the same shift */
  const int status = flesh_nonlinear_solve(nonlinear, &stage, guesses, 0, stats);
  nonlinear->newton->goal = goal;
  ahead->corrected = status ? 0 : error;
  for (int d = 0; d < ahead->control->n && !status; d++) {
    ahead->correction[d] = nonlinear->u[d];
    state->x[d] += nonlinear->u[d];
    state->v[d] += stage.shift.v * nonlinear->u[d];
  }
  return status < 0 ? status : FLESH_OK;
}

static int show(flesh_ahead *ahead, double t, double *room, flesh_state *state, flesh_solve_stats *stats)
{
  interpolate(ahead, t, room, state);
  return ahead->balances ? balance(ahead, room, state, stats) : FLESH_OK;
}

int flesh_ahead_show(flesh_ahead *ahead, double end, double *room, flesh_state *state, flesh_solve_stats *stats)
{
  ahead->shown = ahead->from.x && state->t > end;
  if (!ahead->shown) return FLESH_OK;
  copy(ahead->control->n, state, &ahead->to);
  judge(ahead, room, state, stats);
  return show(ahead, end, room, state, stats);
}

int flesh_ahead_go_on(flesh_ahead *ahead, double end, double rounding, double *room, flesh_state *state, int *shown,
                      flesh_solve_stats *stats)
{
  *shown = ahead->shown && end <= ahead->to.t + rounding;
  if (*shown) return show(ahead, end, room, state, stats);
  if (ahead->shown) copy(ahead->control->n, &ahead->to, state);
  ahead->shown = 0;
  return FLESH_OK;
}
