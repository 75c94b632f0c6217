/* balance.c: the forces that balance each other at an iterate, inertia among them. A residual is small beside these. The
 * first iterate's residual is no measure where an obstacle has just moved into the barrier, a prescribed motion has
 * jumped, or a short step begins with a jolt: it is then far larger than any force at the end of the step. */
#include "newton/balance.h"

#include <math.h>

#include "system/edge_force.h"
#include "system/one_effect.h"

/* Forces balance where the sum of all is less than this part of the largest. Where it is more, they fade together, as
 * in a body that comes to rest without a load: then nothing is left that the residual could be compared with. */
static const double balanced = 0.1;

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

/* The force that strains an edge by its own length, of the softest (system/edge_force.h). */
static int find_edge_force(flesh_equations *self, double *softest)
{
  const flesh_evaluation *e = &self->evaluation;
  const double *X = flesh_mesh_positions(flesh_system_mesh(self->system));
  flesh_point rest = flesh_evaluation_point(e, self->stage.t, X, e->zeros, e->zeros);
  flesh_edge_force force;
  rest.internal = self->stage.internal;
  const int status = flesh_system_edge_force(e, FLESH_ROLES_ALL, &rest, self->scratch, &force);
  if (!status) *softest = force.softest;
  return status;
}

int flesh_balance_sharpen(flesh_balance *balance, double tolerance, const double *u, double norm, double first,
                          double load, double *target)
{
  flesh_equations *self = balance->equations;
  const double enough = norm / tolerance;
  double size;
  int status = flesh_equations_load_norm(self, u, &load);
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
