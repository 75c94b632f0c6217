/* settling_damping.c: artificial damping, to reach equilibrium sooner: mass-proportional damping r = rate w M v that is
 * on while the body moves and from <= t < until.
 *
 * w goes from 0 to 1 as 3 s^2 - 2 s^3 while the mass-weighted root mean square speed of the lagged state goes from half
 * of `speed` to `speed`. So slow motion is not damped, and r stays linear in v with the potential v.Cv/(2 shift.v). */
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "effect/effect.h"
#include "effect/environment.h"
#include "element/body.h"
#include "element/mass.h"
#include "flesh/ranks.h"

typedef struct settling_damping {
  double rate, speed, from, until; /* 1/s, m/s, s, s */
  double total, own;               /* kg, mass of the body and of this rank's part */
  flesh_mass_matrix M;
} settling_damping;

static const flesh_cells *settling_cells(const flesh_effect *effect)
{
  const settling_damping *self = effect->data;
  return flesh_mass_matrix_cells(&self->M);
}

static double rate_at(const settling_damping *self, const flesh_point *point)
{
  if (!(self->from <= point->t && point->t < self->until)) return 0;
  if (self->speed == 0) return self->rate;
  double half_square = flesh_environment_of(point)->sums ? flesh_environment_of(point)->sums[0] : 0;
  if (!flesh_environment_of(point)->sums) flesh_mass_matrix_apply(&self->M, 1, point->threads, point->lagged.v, NULL, &half_square);
  double speed = sqrt(2 * half_square / self->total), s = fmin(fmax(2 * speed / self->speed - 1, 0), 1);
  return self->rate * s * s * (3 - 2 * s);
}

static int settling_evaluate(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *r,
                         double *phi, double *magnitude)
{
  const settling_damping *self = effect->data;
  double rate = r || shift->v != 0 ? rate_at(self, point) : 0;
  if (rate > 0)
    flesh_mass_matrix_evaluate(&self->M, rate, point->threads, point->v,
                               &(flesh_contribution){shift->v, r, phi, magnitude});
  return FLESH_OK;
}

static int settling_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  return settling_evaluate(effect, point, &(flesh_shift){0}, r, NULL, NULL);
}

static int settling_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                         flesh_block_matrix *K, const int *slots)
{
  const settling_damping *self = effect->data;
  double rate = shift->v != 0 ? rate_at(self, point) : 0;
  if (rate > 0) flesh_mass_matrix_add(&self->M, shift->v * rate, point->threads, K, slots);
  return FLESH_OK;
}

static int settling_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                              double *phi, double *magnitude)
{
  return settling_evaluate(effect, point, shift, NULL, phi, magnitude);
}

static flesh_instructions settling_instructions(const flesh_effect *effect)
{
  return ((const settling_damping *)effect->data)->M.tets.instructions;
}

static double settling_next_event(const flesh_effect *effect, double t)
{
  const settling_damping *self = effect->data;
  return flesh_interval_next_event(self->from, self->until, t);
}

static size_t settling_memory(const flesh_effect *effect)
{
  const settling_damping *self = effect->data;
  return sizeof *self + flesh_mass_matrix_memory(&self->M);
}

static void settling_destroy(void *data)
{
  settling_damping *self = data;
  if (self) flesh_mass_matrix_clear(&self->M);
  free(self);
}

/* Computes the part's kinetic energy at the lagged state, for the speed over all ranks. */
static void settling_sum(const flesh_effect *effect, const flesh_point *point, double *sums)
{
  const settling_damping *self = effect->data;
  if (self->speed > 0) flesh_mass_matrix_apply(&self->M, 1, point->threads, point->lagged.v, NULL, sums);
}

static double mass_of(const flesh_body *body)
{
  double mass = 0;
  for (int e = 0; e < flesh_mesh_tet_count(body->mesh); e++)
    mass += body->density[e] * flesh_mesh_tet_volumes(body->mesh)[e];
  return mass;
}

static void settling_count(const flesh_effect *restricted, flesh_rank_numbers *numbers)
{
  const settling_damping *self = restricted->data;
  numbers->sums[0] = self->own;
}

static void settling_take(flesh_effect *restricted, const flesh_rank_numbers *numbers)
{
  settling_damping *self = restricted->data;
  self->total = numbers->sums[0];
}

static int settling_restrict(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                             flesh_effect **restricted)
{
  settling_damping *self = malloc(sizeof *self);
  (void)part; /* `body` is that of the part */
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a settling damping effect");
  *self = *(const settling_damping *)whole->data; /* includes the mass of the whole body */
  self->own = mass_of(body);
  const int status = flesh_mass_matrix_create(body, &self->M);
  return flesh_effect_create_after(status, whole->operations, body->mesh, self, restricted);
}

static const flesh_effect_operations settling_operations = {
    .name = "settling_damping",
    .role = FLESH_ROLE_DAMPING,
    .traits = FLESH_IS_PASSIVE,
    .cells = settling_cells,
    .residual = settling_residual,
    .jacobian = settling_jacobian,
    .potential = settling_potential,
    .destroy = settling_destroy,
    .time = &(const flesh_effect_time){.next_event = settling_next_event},
    .figures = &(const flesh_effect_figures){.memory = settling_memory},
    .library = &(const flesh_effect_private){
        .evaluate = settling_evaluate, .instructions = settling_instructions,
        .ranks = &(const flesh_effect_ranks){.restrict_to_part = settling_restrict, .sum_count = 1, .sum = settling_sum,
                                             .count = settling_count, .take = settling_take}},
};

int flesh_effect_settling_damping(const flesh_body *body, double rate, double speed, double from, double until,
                      flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"});
  if (!(rate > 0 && rate < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "rate is %g 1/s; it must be positive", rate);
  if (!(speed >= 0 && speed < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "speed is %g m/s; it must not be negative", speed);
  if (!(until > from))
    return flesh_fail(FLESH_ERR_ARGUMENT, "until is %g s; it must be after from, %g s", until, from);
  settling_damping *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a settling damping effect");
  self->rate = rate;
  self->speed = speed;
  self->from = from;
  self->until = until;
  int status = flesh_mass_matrix_create(body, &self->M);
  self->total = self->own = mass_of(body);
  return flesh_effect_create_after(status, &settling_operations, body->mesh, self, effect);
}
