/* calm.c: winds a motion down: mass-proportional damping r = rate w M v that is on while the body moves and while from
 * <= t < until.
 *
 * w goes from 0 to 1 (3 s^2 - 2 s^3) as the root of the mean square speed of the lagged state, weighed by mass, goes
 * from half of `speed` to `speed`: what is calm is let be, and r stays linear in v with the potential v.Cv/(2 shift.v).
 */
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "effect/effect.h"
#include "effect/mass.h"
#include "effect/rows.h"

typedef struct calm {
  double rate, speed, from, until, total; /* 1/s, m/s, s, s, kg */
  flesh_mass_matrix M;
} calm;

static const flesh_cells *calm_cells(const flesh_effect *effect)
{
  const calm *self = effect->data;
  return flesh_mass_matrix_cells(&self->M);
}

static double rate_at(const calm *self, const flesh_point *point)
{
  if (!(self->from <= point->t && point->t < self->until)) return 0;
  if (self->speed == 0) return self->rate;
  double half_square;
  flesh_mass_matrix_apply(&self->M, 1, point->threads, point->v_lag, NULL, &half_square);
  double speed = sqrt(2 * half_square / self->total), s = fmin(fmax(2 * speed / self->speed - 1, 0), 1);
  return self->rate * s * s * (3 - 2 * s);
}

static int calm_evaluate(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *r,
                         double *phi, double *magnitude)
{
  const calm *self = effect->data;
  double rate = r || shift->v != 0 ? rate_at(self, point) : 0;
  if (rate > 0)
    flesh_mass_matrix_evaluate(&self->M, rate, point->threads, point->v, shift->v, r, phi, magnitude);
  return FLESH_OK;
}

static int calm_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  return calm_evaluate(effect, point, &(flesh_shift){0}, r, NULL, NULL);
}

static int calm_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                         flesh_block_matrix *K, const int *slots)
{
  const calm *self = effect->data;
  double rate = shift->v != 0 ? rate_at(self, point) : 0;
  if (rate > 0) flesh_mass_matrix_add(&self->M, shift->v * rate, point->threads, K, slots);
  return FLESH_OK;
}

static int calm_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                          double *magnitude)
{
  return calm_evaluate(effect, point, shift, NULL, phi, magnitude);
}

static flesh_instructions calm_instructions(const flesh_effect *effect)
{
  return ((const calm *)effect->data)->M.tets.instructions;
}

static double calm_next_event(const flesh_effect *effect, double t)
{
  const calm *self = effect->data;
  return flesh_interval_next_event(self->from, self->until, t);
}

static size_t calm_memory(const flesh_effect *effect)
{
  const calm *self = effect->data;
  return sizeof *self + flesh_mass_matrix_memory(&self->M);
}

static void calm_destroy(void *data)
{
  calm *self = data;
  if (self) flesh_mass_matrix_clear(&self->M);
  free(self);
}

static const flesh_effect_operations calm_operations = {
    .name = "calm",
    .cells = calm_cells,
    .residual = calm_residual,
    .jacobian = calm_jacobian,
    .potential = calm_potential,
    .evaluate = calm_evaluate,
    .instructions = calm_instructions,
    .next_event = calm_next_event,
    .destroy = calm_destroy,
    .memory = calm_memory,
};

int flesh_effect_calm(const flesh_body *body, double rate, double speed, double from, double until,
                      flesh_effect **effect)
{
  if (!(rate > 0 && rate < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "rate is %g 1/s; it must be positive", rate);
  if (!(speed >= 0 && speed < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "speed is %g m/s; it must not be negative", speed);
  if (!(until > from))
    return flesh_fail(FLESH_ERR_ARGUMENT, "until is %g s; it must be after from, %g s", until, from);
  calm *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a calm effect");
  self->rate = rate;
  self->speed = speed;
  self->from = from;
  self->until = until;
  int status = flesh_mass_matrix_create(body, &self->M);
  if (status) {
    calm_destroy(self);
    return status;
  }
  for (int e = 0; e < flesh_mesh_tet_count(body->mesh); e++)
    self->total += body->density[e] * flesh_mesh_tet_volumes(body->mesh)[e];
  return flesh_effect_create(&calm_operations, self, effect);
}

const flesh_key flesh_calm_keys[] = {
    {.name = "rate", .type = FLESH_KEY_NUMBER, .offset = offsetof(flesh_calm_parameters, rate),
     .range = FLESH_RANGE_POSITIVE, .unit = "1/s", .doc = "at which velocities decay while it is on"},
    {.name = "speed", .type = FLESH_KEY_NUMBER, .offset = offsetof(flesh_calm_parameters, speed),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "m/s", .default_value = "0",
     .doc = "it is on while the body's root mean square speed is above this, fades below and is off below half of "
            "it; 0: on at any speed"},
    FLESH_INTERVAL_KEYS(flesh_calm_parameters),
    {0}};

int flesh_calm_add(const void *parameters, const flesh_body *body, flesh_system *system)
{
  const flesh_calm_parameters *p = parameters;
  flesh_effect *effect = NULL;
  int status = flesh_effect_calm(body, p->rate, p->speed, p->from, p->until, &effect);
  return status ? status : flesh_system_add_effect(system, &effect);
}
