/* balance.c: the forces that balance each other at an iterate, inertia among them. A residual is small beside these. The
 * first iterate's residual is no measure where an obstacle has just moved into the barrier, a prescribed motion has
 * jumped, or a short step begins with a jolt: it is then far larger than any force at the end of the step. */
#include "newton/balance.h"

#include <math.h>
#include <string.h>

#include "math/xorshift.h"
#include "mesh/inspect.h"
#include "system/feasible_step.h"
#include "system/one_effect.h"

/* Forces balance where the sum of all is less than this part of the largest. Where it is more, they fade together, as
 * in a body that comes to rest without a load: then nothing is left that the residual could be compared with. */
static const double balanced = 0.1;

/* Loads without a Jacobian do not change from iterate to iterate. */
static int loads_are_dead(const flesh_equations *self)
{
  for (int k = 0; k < flesh_system_effect_count(self->system); k++) {
    const flesh_effect_operations *can = flesh_system_effect(self->system, k)->operations;
    if (can->role == FLESH_ROLE_LOAD && can->jacobian) return 0;
  }
  return 1;
}

/* 2-norm of what one effect does at `point`: over the free dofs and, where it couples nodes, the constrained ones, as
 * these are what passes reactions on. */
static int effect_norm(flesh_equations *self, int k, const flesh_point *point, double *norm)
{
  flesh_constrained *constrained = &self->constrained;
  double *r = self->scratch;
  int status = flesh_system_effect_residual(self->system, k, point, r);
  if (!flesh_system_effect(self->system, k)->operations->cells)
    for (int j = 0; j < constrained->count; j++) r[constrained->dofs[j]] = 0;
  *norm = flesh_norm(self->threads, self->n, r);
  return status;
}

/* The largest of the applied load, whose norm is given, and the norms of all other effects at u; those that are not
 * needed to find `enough` are not asked, the cheap ones first. */
static int largest_force(flesh_equations *self, const double *u, double load, double enough, double *size)
{
  double norm;
  *size = load;
  const flesh_point point = flesh_equations_point(self, u);
  for (int coupled = 0; coupled < 2; coupled++)
    for (int k = 0; k < flesh_system_effect_count(self->system) && !(*size >= enough); k++) {
      const flesh_effect_operations *can = flesh_system_effect(self->system, k)->operations;
      if (!can->residual || can->role == FLESH_ROLE_LOAD || coupled != (can->cells != NULL)) continue;
      if (flesh_clearance_holds(self->evaluation.at_stage.clearance, k)) continue; /* it does nothing */
      int status = effect_norm(self, k, &point, &norm);
      if (status) return status;
      if (norm < INFINITY) *size = fmax(*size, norm);
    }
  return FLESH_OK;
}

/* Adds up in r what all effects that have a value do to nodes that stand still at x, of the materials as they are. */
static int forces_at(flesh_equations *self, const double *x, double *one, double *r)
{
  flesh_evaluation *e = &self->evaluation;
  const flesh_stage *s = &self->stage;
  flesh_point point = flesh_evaluation_point(e, s->t, x, e->zeros, e->zeros);
  point.internal = s->internal;
  memset(r, 0, (size_t)self->n * sizeof *r);
  for (int k = 0; k < flesh_system_effect_count(self->system); k++) {
    int status = flesh_system_effect_residual(e->system, k, &point, one);
    if (status < 0) return status;
    for (int d = 0; d < self->n && !status; d++) r[d] += one[d];
  }
  return FLESH_OK;
}

/* The force that strains an edge by its own length, on a typical node of the softest: the harmonic mean of how far the
 * forces change on nodes that a millionth of that displaces from rest at random. 0 where none does. */
static int find_edge_force(flesh_equations *self, double *edge_force)
{
  static const double part = 1e-6;
  const flesh_mesh *mesh = flesh_system_mesh(self->system);
  const double *X = flesh_mesh_positions(mesh), edge = flesh_mesh_mean_edge(mesh, self->team);
  const int own = self->evaluation.own;
  double *one = self->scratch, *before = one + self->n, *after = before + self->n, *x = after + self->n, sums[2] = {0};
  uint32_t random = flesh_xorshift_first;
  for (int d = 0; d < self->n; d++) x[d] = X[d] + part * edge * (flesh_xorshift(&random) >> 31 ? 1 : -1);
  flesh_team_share(self->team, x);
  int status = forces_at(self, X, one, before);
  if (!status) status = forces_at(self, x, one, after);
  for (int i = 0; i < own && !status; i += 3) {
    double square = 0;
    for (int c = 0; c < 3; c++) square += (after[i + c] - before[i + c]) * (after[i + c] - before[i + c]);
    if (square > 0) sums[0] += 1 / sqrt(square), sums[1]++;
  }
  flesh_team_sum(self->team, 2, sums);
  *edge_force = sums[1] > 0 ? sums[1] / sums[0] / part : 0;
  return status;
}

int flesh_balance_sharpen(flesh_balance *balance, double tolerance, const double *u, double norm, double first,
                          double load, double *target)
{
  flesh_equations *self = balance->equations;
  const double enough = norm / tolerance;
  double size;
  int status = FLESH_OK;
  if (!loads_are_dead(self)) status = flesh_equations_load_norm(self, u, &load);
  if (status || load >= enough) return status;
  if (first < enough) { /* the load was larger */
    *target = tolerance * fmax(first, load);
    return FLESH_OK;
  }
  status = largest_force(self, u, load, enough, &size);
  if (status || size >= enough) return status;
  if (load == 0 && norm > balanced * size) {
    if (!(balance->edge_force >= 0)) status = find_edge_force(self, &balance->edge_force);
    if (status) return status;
    size = fmax(size, balance->edge_force);
  }
  if (size < enough) *target = tolerance * size;
  return FLESH_OK;
}
