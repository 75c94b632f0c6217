/* pass.c: arrays of a pass over a motion, and linearisation of its stages. */
#include "sensitivity/pass.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"

/* Shift of the positions in a stage of zero length, whose unknown is the acceleration: so small that K is M. */
static const double no_time = 1e-30;

flesh_motion_pass flesh_pass_of(flesh_trajectory *self, double *room)
{
  flesh_motion_pass p = {.self = self};
  const size_t n = (size_t)self->n;
  memset(room, 0, FLESH_PASS_ARRAYS * n * sizeof *room);
  for (int k = 0; k < FLESH_KNOWN; k++, room += 2 * n) p.known[k] = room, p.next[k] = room + n;
  for (int k = 0; k < FLESH_MAP_STAGES; k++, room += n) p.stages[k] = room;
  double **const own[] = {&p.lambda,   &p.c,        &p.m,        &p.lag,      &p.force,      &p.moves[0],
                          &p.moves[1], &p.moves[2], &p.ended[0], &p.ended[1], &p.reached[0], &p.reached[1]};
  for (size_t k = 0; k < sizeof own / sizeof *own; k++, room += n) *own[k] = room;
  p.base = room;
  return p;
}

int flesh_pass_take_parameters(flesh_motion_pass *p, int count, const flesh_parameter *parameters)
{
  const flesh_system *system = p->self->system;
  const size_t each = 1 + (size_t)flesh_system_effect_count(system);
  if (count < 0) return flesh_fail(FLESH_ERR_ARGUMENT, "the number of parameters is %d; it must be at least 0", count);
  p->count = count;
  p->parameters = parameters;
  p->same = flesh_calloc((size_t)count * each + 1, 1);
  if (!p->same) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d parameters", count);
  for (int k = 0; k < count; k++) {
    unsigned char *same = p->same + (size_t)k * each;
    *same = (unsigned char)flesh_parameter_compare(&parameters[k], system, same + 1);
  }
  return FLESH_OK;
}

int flesh_pass_force(flesh_motion_pass *p, int k)
{
  const unsigned char *same = p->same + (size_t)k * (1 + (size_t)flesh_system_effect_count(p->self->system));
  return flesh_stage_tangent_force(&p->self->tangent, &p->parameters[k], *same ? same + 1 : NULL, p->force, p->moves);
}

/* Whether an equilibrium is its own lagged state, as found by repeated solves. Its derivative is then that of all forces,
 * lagged ones included, of which a solve that found the state at once has only a part. */
static int is_settled(const flesh_motion_pass *p, const flesh_recorded_solve *solve)
{
  int d = 0;
  while (d < p->self->n && solve->u[d] == 0) d++;
  return !solve->stage.x_lag && d == p->self->n;
}

int flesh_pass_linearise(flesh_motion_pass *p, const flesh_recorded_part *part, int solve)
{
  flesh_trajectory_stage(p->self, part, &p->map, solve, p->base, &p->stage);
  flesh_environment *environment = &p->self->tangent.newton->equations.evaluation.environment;
  environment->starts = 0;
  environment->past = p->stage.shift.v == 0 ? part->taken.h : 0;
  p->self->tangent.prescribed = part->taken.second && part->taken.own ? &p->self->prescribed : NULL;
  p->follows = p->stage.frozen_at_solution ? 1u << FLESH_FROZEN_X | 1u << FLESH_FROZEN_V : 0;
  if (is_settled(p, &part->solves[solve])) p->follows |= 1u << FLESH_LAGGED_X;
  const double *u = part->solves[solve].u, *at_end = p->self->prescribed.x[FLESH_PRESCRIBED_POINTS - 1];
  for (int d = 0; d < p->self->n && p->stage.shift.x != 1; d++) /* such a stage is the only one of its step */
    p->self->tangent.end[d] = p->self->prescribed.fixed[d] ? at_end[d] : p->stage.x0[d] + u[d];
  return flesh_stage_tangent_set(&p->self->tangent, &p->stage, u, p->follows);
}

int flesh_pass_linearise_start(flesh_motion_pass *p, const flesh_recorded_part *part)
{
  flesh_trajectory *self = p->self;
  const double *x = part->known[FLESH_KNOWN_X], *v = part->known[FLESH_KNOWN_V];
  double *u = p->moves[0];
  memset(u, 0, (size_t)self->n * sizeof *u);
  flesh_pass_prescribe(p, part, 1);
  self->tangent.prescribed = &self->prescribed;
  p->stage = (flesh_stage){.t = part->taken.begin, .load = 1, .prescribed_fraction = 1, .shift = {.x = no_time, .a = 1},
                           .x0 = x, .v0 = v, .a0 = part->known[FLESH_KNOWN_VECTORS], .x_lag = x, .v_lag = v,
                           .t_lag = part->taken.begin, .internal = part->internal,
                           .multipliers = part->solves[0].multipliers};
  self->tangent.newton->equations.evaluation.environment.starts = 1;
  self->tangent.newton->equations.evaluation.environment.past = 0;
  p->follows = (1u << FLESH_OWN_V) - 1; /* nothing is lagged or frozen there */
  return flesh_stage_tangent_set(&self->tangent, &p->stage, u, p->follows);
}

int flesh_pass_begins_by_acceleration(const flesh_motion_pass *p, const flesh_recorded_part *part)
{
  return part->taken.anew && part->taken.acceleration && !p->self->tangent.multipliers;
}

int flesh_pass_jumps(const flesh_motion_pass *p, const flesh_recorded_part *part)
{
  const int has_started = part->taken.acceleration && p->self->tangent.multipliers;
  return part->taken.second && (part->taken.starts || (part->taken.anew && !has_started));
}

void flesh_pass_prescribe(flesh_motion_pass *p, const flesh_recorded_part *part, int begins)
{
  const flesh_taken_part *taken = &part->taken;
  flesh_prescribed_set(&p->self->prescribed, taken->begin, begins ? taken->seen : taken->end, part->known[FLESH_KNOWN_X]);
}

int flesh_pass_moves(flesh_motion_pass *p, int k, double t, int *moved)
{
  return flesh_stage_tangent_moves(&p->self->tangent, &p->parameters[k], &p->self->prescribed, t, p->moves, moved);
}

void flesh_pass_forget_constrained(const flesh_motion_pass *p, double *y)
{
  const flesh_prescribed *prescribed = &p->self->prescribed;
  for (int d = 0; d < prescribed->n; d++)
    y[d] = prescribed->fixed[d] ? 0 : y[d];
}
