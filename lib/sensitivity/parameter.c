/* parameter.c: what a parameter changes in the residual at a solution: differences of systems that differ in it. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "effect/private.h"
#include "sensitivity/stage_tangent.h"
#include "system/one_effect.h"
#include "system/system.h"

enum { SYSTEMS = 4 };

/* The weights of its systems over `difference`. */
static void weigh(const flesh_parameter *parameter, double weights[SYSTEMS])
{
  const double step = parameter->difference;
  const int fourth = parameter->systems[0] != NULL;
  weights[0] = fourth ? 1 / (12 * step) : 0;
  weights[1] = fourth ? -2 / (3 * step) : -1 / (2 * step);
  weights[2] = -weights[1];
  weights[3] = -weights[0];
}

int flesh_parameter_check(const flesh_parameter *parameter, const flesh_system *system)
{
  const int fourth = parameter->systems[0] || parameter->systems[3];
  if (!(fabs(parameter->difference) > 0 && fabs(parameter->difference) < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "a parameter's difference is %g; it must be finite and not 0", parameter->difference);
  if (!parameter->systems[1] != !parameter->systems[2] ||
      (fourth && !(parameter->systems[0] && parameter->systems[1] && parameter->systems[3])))
    return flesh_fail(FLESH_ERR_ARGUMENT, "a parameter has systems on one side only; it needs those of p - difference and p + "
                                          "difference, and maybe both of twice that");
  for (int k = 0; k < SYSTEMS; k++) {
    const flesh_system *other = parameter->systems[k];
    if (!other) continue;
    if (flesh_system_unknowns(other) != flesh_system_unknowns(system) ||
        flesh_mesh_tet_count(flesh_system_mesh(other)) != flesh_mesh_tet_count(flesh_system_mesh(system)))
      return flesh_fail(FLESH_ERR_ARGUMENT, "a system of a parameter has %d unknowns and %d tets; that of the state has %d and "
                                            "%d",
                        flesh_system_unknowns(other), flesh_mesh_tet_count(flesh_system_mesh(other)),
                        flesh_system_unknowns(system), flesh_mesh_tet_count(flesh_system_mesh(system)));
    if (flesh_system_internal_count(other) != flesh_system_internal_count(system) ||
        flesh_system_multiplier_count(other) != flesh_system_multiplier_count(system))
      return flesh_fail(FLESH_ERR_ARGUMENT, "a system of a parameter has other internal variables or multipliers than that of "
                                            "the state");
  }
  return FLESH_OK;
}

int flesh_parameter_compare(const flesh_parameter *parameter, const flesh_system *system, unsigned char *same)
{
  const int count = flesh_system_effect_count(system);
  int some = 0;
  for (int e = 0; e < count; e++) {
    const flesh_effect *own = flesh_system_effect(system, e);
    const flesh_effect_private *can = flesh_effect_private_of(own);
    same[e] = can->is_same != NULL;
    for (int k = 0; k < SYSTEMS && same[e]; k++) {
      const flesh_system *other = parameter->systems[k];
      if (!other) continue;
      if (flesh_system_effect_count(other) != count) return 0;
      const flesh_effect *its = flesh_system_effect(other, e);
      same[e] = its->operations == own->operations && can->is_same(own, its);
    }
    some |= same[e];
  }
  return some;
}

/* u [n] becomes that of the constrained dofs where the other system has them; *moved: whether any is elsewhere. */
static int find_places(const flesh_stage_tangent *self, const flesh_system *other, double *u, int *moved)
{
  const flesh_stage *s = &self->stage;
  const flesh_constrained *constrained = &self->newton->equations.constrained;
  uint8_t *fixed = (uint8_t *)u; /* room, for now */
  flesh_system_fixed(other, s->t, fixed);
  if (memcmp(fixed, constrained->is, (size_t)self->n) != 0)
    return flesh_fail(FLESH_ERR_ARGUMENT, "at t = %g s the parameter changes which dofs are constrained, so that nothing has a "
                                          "derivative by it", s->t);
  memset(u, 0, (size_t)self->n * sizeof *u);
  for (int k = 0; k < constrained->count; k++) u[constrained->dofs[k]] = s->x0[constrained->dofs[k]];
  flesh_system_prescribe(other, s->t, u);
  for (int k = 0; k < constrained->count; k++) {
    const int d = constrained->dofs[k];
    u[d] = s->prescribed_fraction * (u[d] - s->x0[d]) / s->shift.x;
    *moved |= u[d] != constrained->u[d];
  }
  return FLESH_OK;
}

/* The point's x, v and a go there. `of` [3][n]: room for them. */
static void place(const flesh_stage_tangent *self, const double *u, double *const of[3], flesh_point *point)
{
  const flesh_stage *s = &self->stage;
  const flesh_constrained *constrained = &self->newton->equations.constrained;
  double *x = of[0], *v = of[1], *a = of[2];
  memcpy(x, self->x, (size_t)self->n * sizeof *x);
  memcpy(v, self->v, (size_t)self->n * sizeof *v);
  memcpy(a, self->a, (size_t)self->n * sizeof *a);
  for (int k = 0; k < constrained->count; k++) {
    const int d = constrained->dofs[k];
    if (u[d] == constrained->u[d]) continue;
    x[d] = s->x0[d] + s->shift.x * u[d];
    v[d] = (s->v0 ? s->v0[d] : 0) + s->shift.v * u[d];
    a[d] = (s->a0 ? s->a0[d] : 0) + s->shift.a * u[d];
  }
  point->x = x;
  point->v = v;
  point->a = a;
}

/* r [n]: the residual of the other system's effects but for the same ones; `room` [n]. */
static int sum_others(const flesh_system *other, const unsigned char *same, const flesh_point *point, double *room, double *r)
{
  const int n = flesh_system_unknowns(other);
  int status = FLESH_OK;
  if (!same) return flesh_system_residual(other, point, r);
  memset(r, 0, (size_t)n * sizeof *r);
  for (int e = 0; e < flesh_system_effect_count(other) && !status; e++) {
    if (same[e] || !flesh_system_effect(other, e)->operations->residual) continue;
    status = flesh_system_effect_residual(other, e, point, room);
    for (int d = 0; d < n; d++) r[d] += room[d];
  }
  return status;
}

/* Refuses a parameter that moves constraints with multipliers: they would have to be solved for, too. */
static int check_gaps(flesh_stage_tangent *self, const flesh_system *other)
{
  double *own = self->gaps, *others = own + self->multipliers;
  if (!self->multipliers) return FLESH_OK;
  int status = flesh_system_constraint_gaps(self->system, &self->point, own, NULL);
  if (!status) status = flesh_system_constraint_gaps(other, &self->point, others, NULL);
  for (int e = 0; e < self->multipliers && !status; e++)
    if (fabs(own[e] - others[e]) > 1e-12)
      return flesh_fail(FLESH_ERR_ARGUMENT, "a parameter that changes the rest shape of incompressible tets (poisson 0.5) has no "
                                            "sensitivities");
  return status;
}

int flesh_stage_tangent_force(flesh_stage_tangent *self, const flesh_parameter *parameter, const unsigned char *same,
                              double *force, double *moves)
{
  const size_t n = (size_t)self->n;
  double weights[SYSTEMS], *u = self->room, *r = u + n, *const of[3] = {r + n, r + 2 * n, r + 3 * n};
  int status = flesh_parameter_check(parameter, self->system), moved = 0;
  weigh(parameter, weights);
  memset(force, 0, n * sizeof *force);
  if (moves) memset(moves, 0, n * sizeof *moves);
  for (int k = 0; k < SYSTEMS && !status; k++)
    if (parameter->systems[k]) status = find_places(self, parameter->systems[k], u, &moved);
  for (int k = 0; k < SYSTEMS && !status; k++) {
    const flesh_system *other = parameter->systems[k];
    if (!other) continue;
    flesh_point point = self->point;
    point.environment = NULL; /* that is of the run's own system */
    status = check_gaps(self, other);
    if (!status && moved) status = find_places(self, other, u, &moved);
    if (!status && moved) place(self, u, of, &point);
    if (self->follows >> FLESH_LAGGED_X & 1) point.lagged.x = point.x;
    if (self->follows >> FLESH_LAGGED_V & 1) point.lagged.v = point.v;
    if (self->follows >> FLESH_FROZEN_X & 1) point.frozen = (flesh_frozen){point.x, point.v};
    if (!status) status = sum_others(other, moved ? NULL : same, &point, of[0], r);
    if (status > 0)
      return flesh_fail(FLESH_ERR_SOLVE, "at t = %g s the residual has no value where the parameter is %+g from its own; take a "
                                         "smaller difference", self->stage.t, parameter->difference * (k < 2 ? k - 2 : k - 1));
    for (size_t d = 0; d < n && !status; d++) force[d] += weights[k] * r[d];
    for (size_t d = 0; d < n && !status && moved && moves; d++) moves[d] += weights[k] * u[d];
  }
  return status;
}
