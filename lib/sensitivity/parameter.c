/* parameter.c: change of the residual at a solution by a parameter, from differences of systems. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "effect/private.h"
#include "math/differences.h"
#include "sensitivity/stage_tangent.h"
#include "system/one_effect.h"
#include "system/system.h"

enum { SYSTEMS = FLESH_DIFFERENCES };

/* Computes the weights of the parameter's systems, divided by `difference`. */
static void weigh(const flesh_parameter *parameter, double weights[SYSTEMS])
{
  static const double second[SYSTEMS] = {0, -1. / 2, 1. / 2, 0};
  for (int k = 0; k < SYSTEMS; k++)
    weights[k] = (parameter->systems[0] ? flesh_difference_weight : second)[k] / parameter->difference;
}

/* Checks that a parameter's systems fit each other and the state's. FLESH_ERR_ARGUMENT. */
static int check(const flesh_parameter *parameter, const flesh_system *system)
{
  const int fourth = parameter->systems[0] || parameter->systems[3];
  if (!(fabs(parameter->difference) > 0 && fabs(parameter->difference) < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "a parameter's difference is %g; it must be finite and not 0", parameter->difference);
  if (!parameter->systems[1] || !parameter->systems[2] || (fourth && !(parameter->systems[0] && parameter->systems[3])))
    return flesh_fail(FLESH_ERR_ARGUMENT, "a parameter lacks systems; it needs those of p - difference and p + difference, and "
                                          "maybe both of twice that");
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

static int fail_kinds(double t)
{
  return flesh_fail(FLESH_ERR_ARGUMENT, "at t = %g s the parameter changes which dofs are constrained, so that nothing has a "
                                        "derivative by it", t);
}

/* Moves constrained dofs at t by the other system's motion over the span of `own`, in x, v and a, `to` [3][n]. Sets *moved
 * to 1 if they are elsewhere than in the state's system. */
static int find_prescribed(flesh_stage_tangent *self, const flesh_system *other, const flesh_prescribed *own, double t,
                           double *const to[3], int *moved)
{
  flesh_prescribed *its = &self->others;
  const size_t bytes = (size_t)self->n * sizeof(double);
  double *now = self->room + 5 * (size_t)self->n;
  int differs = 0;
  its->system = other;
  flesh_prescribed_set(its, own->begin, own->end, own->x[0]);
  if (memcmp(its->fixed, own->fixed, (size_t)self->n) != 0) return fail_kinds(t);
  flesh_prescribed_at(its, t, to[0], to[1], to[2]);
  memcpy(now, own->x[0], bytes);
  flesh_system_prescribe(own->system, t, now);
  for (int k = 0; k < FLESH_PRESCRIBED_POINTS; k++) differs |= memcmp(its->x[k], own->x[k], bytes) != 0;
  differs |= memcmp(its->now, now, bytes) != 0;
  *moved |= differs;
  return FLESH_OK;
}

/* Refuses a parameter that changes the times at which steps are cut, for which there is no derivative here. *alike: whether
 * all of its systems constrain dofs to the same places as the state's, which needs no derivatives of these. */
static int compare_constraints(const flesh_stage_tangent *self, const flesh_parameter *parameter, const flesh_prescribed *own,
                               int *alike)
{
  const double turns = own ? flesh_system_next_event(self->system, own->begin) : INFINITY;
  *alike = 1;
  for (int k = 0; k < SYSTEMS; k++) {
    const flesh_system *other = parameter->systems[k];
    if (!other) continue;
    *alike &= flesh_system_prescribes_alike(self->system, other);
    const double its_turns = own ? flesh_system_next_event(other, own->begin) : INFINITY;
    if (turns != its_turns && fmin(turns, its_turns) <= own->end)
      return flesh_fail(FLESH_ERR_ARGUMENT, "the parameter changes the time %g s, at which a prescribed motion or a load turns, "
                                            "begins or ends; that has sensitivities by backward-euler only", turns);
  }
  return FLESH_OK;
}

/* Computes the point's x, v and a with the other system's constrained dofs, in `to` [3][n]. */
static int find_places(flesh_stage_tangent *self, const flesh_system *other, double *const to[3], int *moved)
{
  const flesh_stage *s = &self->stage;
  const flesh_constrained *constrained = &self->newton->equations.constrained;
  const size_t bytes = (size_t)self->n * sizeof(double);
  double *u = self->room + 4 * (size_t)self->n;
  memcpy(to[0], self->x, bytes);
  memcpy(to[1], self->v, bytes);
  memcpy(to[2], self->a, bytes);
  if (self->prescribed) return find_prescribed(self, other, self->prescribed, s->t, to, moved);
  uint8_t *fixed = (uint8_t *)u; /* work space, for now */
  flesh_system_fixed(other, s->t, fixed);
  if (memcmp(fixed, constrained->is, (size_t)self->n) != 0) return fail_kinds(s->t);
  memcpy(u, s->x0, bytes);
  flesh_system_prescribe(other, s->t, u);
  for (int k = 0; k < constrained->count; k++) {
    const int d = constrained->dofs[k];
    const double own = s->prescribed_fraction * (u[d] - s->x0[d]) / s->shift.x;
    if (own == constrained->u[d]) continue;
    *moved = 1;
    to[0][d] = s->x0[d] + s->shift.x * own;
    to[1][d] = (s->v0 ? s->v0[d] : 0) + s->shift.v * own;
    to[2][d] = (s->a0 ? s->a0[d] : 0) + s->shift.a * own;
  }
  return FLESH_OK;
}

/* Computes r [n], the residual of the other system's effects except the `same` ones; `room` [n] is work space. */
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

/* Refuses a parameter that moves constraints with multipliers, which would have to be solved for, too. */
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
                              double *force, double *const moves[3])
{
  const size_t n = (size_t)self->n;
  double weights[SYSTEMS], *room = self->room, *const to[3] = {room, room + n, room + 2 * n}, *r = room + 3 * n;
  const double *const own[3] = {self->x, self->v, self->a};
  int status = check(parameter, self->system), alike = 1, moved = 0;
  weigh(parameter, weights);
  memset(force, 0, n * sizeof *force);
  for (int i = 0; i < 3 && moves; i++) memset(moves[i], 0, n * sizeof *force);
  if (!status) status = compare_constraints(self, parameter, self->prescribed, &alike);
  for (int k = 0; k < SYSTEMS && !status && !alike; k++)
    if (parameter->systems[k]) status = find_places(self, parameter->systems[k], to, &moved);
  for (int k = 0; k < SYSTEMS && !status; k++) {
    const flesh_system *other = parameter->systems[k];
    if (!other) continue;
    flesh_point point = self->point;
    const flesh_environment elsewhere = flesh_environment_elsewhere(&self->point);
    point.environment = &elsewhere;
    status = check_gaps(self, other);
    if (!status && moved) status = find_places(self, other, to, &moved);
    if (!status && moved) point.x = to[0], point.v = to[1], point.a = to[2];
    if (self->follows >> FLESH_LAGGED_X & 1) point.lagged.x = point.x;
    if (self->follows >> FLESH_LAGGED_V & 1) point.lagged.v = point.v;
    if (self->follows >> FLESH_FROZEN_X & 1) point.frozen = (flesh_frozen){point.x, point.v};
    if (!status) status = sum_others(other, moved ? NULL : same, &point, room + 4 * n, r);
    if (status > 0)
      return flesh_fail(FLESH_ERR_SOLVE, "at t = %g s the residual has no value where the parameter is %+g from its own; take a "
                                         "smaller difference", self->stage.t, parameter->difference * (k < 2 ? k - 2 : k - 1));
    for (size_t d = 0; d < n && !status; d++) force[d] += weights[k] * r[d];
    for (size_t d = 0; d < 3 * n && !status && moved && moves; d++)
      moves[d / n][d % n] += weights[k] * (to[d / n][d % n] - own[d / n][d % n]);
  }
  return status;
}

int flesh_stage_tangent_mass_force(flesh_stage_tangent *self, const flesh_parameter *parameter, const double *w,
                                   double *force)
{
  double weights[SYSTEMS], *r = self->room;
  const flesh_environment elsewhere = flesh_environment_elsewhere(&self->point);
  flesh_point point = self->point;
  int status = check(parameter, self->system);
  point.a = w;
  point.environment = &elsewhere;
  weigh(parameter, weights);
  memset(force, 0, (size_t)self->n * sizeof *force);
  for (int k = 0; k < SYSTEMS; k++) {
    const flesh_system *other = parameter->systems[k];
    for (int e = 0; other && e < flesh_system_effect_count(other) && !status; e++) {
      if (flesh_system_effect(other, e)->operations->role != FLESH_ROLE_INERTIA) continue;
      status = flesh_system_effect_residual(other, e, &point, r);
      for (int d = 0; d < self->n && !status; d++) force[d] += weights[k] * r[d];
    }
  }
  return status;
}

int flesh_stage_tangent_moves(flesh_stage_tangent *self, const flesh_parameter *parameter, const flesh_prescribed *own,
                              double t, double *const moves[3], int *moved)
{
  const size_t n = (size_t)self->n;
  double weights[SYSTEMS], *room = self->room, *const to[3] = {room, room + n, room + 2 * n};
  int status = check(parameter, self->system), alike = 1;
  *moved = 0;
  if (!status) status = compare_constraints(self, parameter, own, &alike);
  if (status || alike) return status;
  weigh(parameter, weights);
  memset(room, 0, 3 * n * sizeof *room);
  for (int i = 0; i < 3; i++) memset(moves[i], 0, n * sizeof *room);
  for (int k = 0; k < SYSTEMS && !status; k++) {
    if (!parameter->systems[k]) continue;
    status = find_prescribed(self, parameter->systems[k], own, t, to, moved);
    for (size_t d = 0; d < 3 * n && !status; d++)
      moves[d / n][d % n] += weights[k] * (to[d / n][d % n] - (d < n && own->fixed[d] ? own->x[0][d] : 0));
  }
  for (size_t d = 0; d < 3 * n && !*moved; d++) moves[d / n][d % n] = 0;
  return status;
}
