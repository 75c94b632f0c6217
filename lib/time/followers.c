/* followers.c: directions of Newton's method are found by repeated solves with the symmetric stiffness of all else, which
 * Anderson's mixing turns into a Krylov method (Walker & Ni 2011); products with the whole derivative are differences. */
#include "time/followers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/parallel_vector.h"
#include "newton/stage.h"

static const double depth = 1e-2, exactness = 1e-3; /* directions, and their solves, over the first */
static const double resolution = 1e-4; /* moves over steps of differences that round-off may hide */

int flesh_followers_create(flesh_newton *newton, int wanted, flesh_followers *self)
{
  const flesh_equations *equations = &newton->equations;
  const int n = wanted ? equations->n : 0;
  *self = (flesh_followers){.newton = newton};
  int status = flesh_mixing_create(n, newton->threads, &self->mixing);
  if (status || !n) return status;
  self->r = calloc(4 * (size_t)n, sizeof *self->r);
  if (!self->r) return flesh_fail(FLESH_ERR_MEMORY, "no memory for loads that follow %d unknowns", n);
  self->change = self->r + n;
  self->moved = self->change + n;
  self->back = self->moved + n;
  return FLESH_OK;
}

void flesh_followers_clear(flesh_followers *self)
{
  flesh_mixing_clear(&self->mixing);
  free(self->r);
}

/* Finds r(x; x) on free dofs, and its norm. */
static int find_residual(flesh_followers *self, const double *x, double *r, double *norm)
{
  const flesh_equations *equations = &self->newton->equations;
  const flesh_constrained *constrained = &equations->constrained;
  flesh_point point = self->point;
  point.x = point.lagged.x = point.frozen.x = x;
  const int status = flesh_system_residual(equations->system, &point, r);
  for (int k = 0; k < constrained->count; k++) r[constrained->dofs[k]] = 0;
  *norm = status ? INFINITY : flesh_norm(self->newton->threads, equations->n, r);
  return status || *norm < INFINITY ? status : FLESH_NONFINITE;
}

/* Sets moved = x + length p. */
static void move(flesh_followers *self, const double *x, double length, const double *p)
{
  for (int d = 0; d < self->mixing.n; d++) self->moved[d] = x[d] + length * p[d];
}

/* Sets left = -r - J p, by a central difference. */
static int find_left(flesh_followers *self, const double *x, const double *p, double *left)
{
  const int n = self->mixing.n;
  const double size = flesh_norm(self->newton->threads, n, p), step = size > 0 ? self->step / size : 0;
  double unused;
  int status = FLESH_OK;
  memset(self->back, 0, (size_t)n * sizeof *left);
  memset(left, 0, (size_t)n * sizeof *left);
  if (step > 0) {
    move(self, x, step, p);
    status = find_residual(self, self->moved, left, &unused);
    move(self, x, -step, p);
    if (!status) status = find_residual(self, self->moved, self->back, &unused);
  }
  for (int d = 0; d < n; d++) left[d] = -self->r[d] - (step > 0 ? (left[d] - self->back[d]) / (2 * step) : 0);
  return status;
}

/* Sets back = the move that the tangent at the state makes of the residual `change`; *length [m] is its norm. Where
 * volumes are stiff, these lengths say more than residuals (natural monotonicity test, Deuflhard 2004, section 3.3). */
static int find_move(flesh_followers *self, double *length)
{
  const int status = flesh_newton_solve_tangent(self->newton, self->change, exactness, self->back);
  *length = status ? INFINITY : flesh_norm(self->newton->threads, self->mixing.n, self->back);
  return status;
}

/* Finds the direction p with J p = -r from x, left in the mixing's x. *found: whether there is one; *first: the length
 * of the first move. */
static int find_direction(flesh_followers *self, const double *x, double *first, int *found)
{
  enum { SOLVES = 24 };
  const int n = self->mixing.n;
  double length = INFINITY;
  memset(self->back, 0, (size_t)n * sizeof *self->back);
  flesh_mixing_begin(&self->mixing, self->back);
  *found = 0;
  for (int k = 0; k < SOLVES && !*found; k++) {
    int status = find_left(self, x, self->mixing.x, self->change);
    if (!status) status = find_move(self, &length);
    if (status) return status;
    if (k == 0) *first = length;
    if (k == 1) self->contracts = length < *first / 2;
    *found = length <= depth * *first;
    for (int d = 0; d < n; d++) self->back[d] += self->mixing.x[d];
    flesh_mixing_go_on(&self->mixing, self->back);
  }
  return FLESH_OK;
}

/* Sets the stage of the last solve, from x alone, and the tangent there without loads that follow the shape. */
static int set_stage(flesh_followers *self, const flesh_state *state)
{
  flesh_newton *newton = self->newton;
  flesh_evaluation *evaluation = &newton->equations.evaluation;
  flesh_stage stage = newton->equations.stage;
  stage.x0 = stage.x_lag = stage.x_from = state->x;
  stage.t = stage.t_lag = stage.t_from = state->t;
  flesh_newton_set_stage(newton, &stage);
  const double unloaded = evaluation->environment.unloaded;
  evaluation->environment.unloaded = 1;
  const int status = flesh_newton_factor_tangent(newton, evaluation->zeros);
  evaluation->environment.unloaded = unloaded;
  self->point = flesh_equations_point(&newton->equations, evaluation->zeros);
  self->point.v = self->point.a = self->point.lagged.v = evaluation->zeros;
  self->point.environment = &evaluation->environment;
  return status;
}

/* Moves x along the mixing's x until the move asked for is shorter than `before`. *found: whether that succeeded; norm:
 * that of the residual. Where solves contract, they lead on sooner than short steps. */
static int search(flesh_followers *self, double before, double *x, double *norm, int *found)
{
  const double least = self->contracts ? 1. / 2 : 1. / 64;
  const size_t bytes = (size_t)self->mixing.n * sizeof *x;
  double reached = INFINITY;
  int status = FLESH_OK;
  *found = 0;
  for (double part = 1; part >= least && !status && !*found; part /= 2) {
    move(self, x, part, self->mixing.x);
    if (find_residual(self, self->moved, self->r, norm)) continue;
    memcpy(self->change, self->r, bytes);
    status = find_move(self, &reached);
    *found = !status && reached < (1 - part / 4) * before;
  }
  if (*found) memcpy(x, self->moved, bytes);
  return status;
}

int flesh_followers_improve(flesh_followers *self, double target, flesh_state *state, flesh_solve_stats *stats)
{
  enum { ITERATIONS = 30, PATIENCE = 4 }; /* iterations in which the first move must halve: near the largest load none
                                          * does */
  flesh_newton *newton = self->newton;
  double norm, length = INFINITY, least = INFINITY;
  memset(&newton->stats, 0, sizeof newton->stats);
  int status = set_stage(self, state), found = 1, left = PATIENCE;
  if (!status) status = find_residual(self, state->x, self->r, &norm);
  for (int k = 0; k < ITERATIONS && !status && found && norm > target; k++) {
    if (k) status = set_stage(self, state);
    if (!status) status = find_direction(self, state->x, &length, &found);
    left = length < least / 2 ? PATIENCE : left - 1;
    least = fmin(least, length);
    found &= left > 0;
    if (!status && found) status = search(self, length, state->x, &norm, &found);
    newton->stats.newton += found;
  }
  flesh_stage_count(newton, stats);
  const int at_round_off = !found && length <= resolution * self->step;
  if (status == FLESH_ERR_SOLVE) { /* there is no tangent by which to judge */
    self->contracts = 1;
    return FLESH_NOT_CONVERGED;
  }
  return status ? status : norm <= target || at_round_off ? FLESH_OK : FLESH_NOT_CONVERGED;
}
