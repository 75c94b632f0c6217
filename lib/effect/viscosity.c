/* viscosity.c: Kelvin-Voigt damping from the rate of the Green strain, E' = sym(F^T F').
 *
 * The dissipation function is D = sum over tets of volume * (shear dev E' : dev E' + bulk/2 (tr E')^2), r = dD/dv: a
 * second Piola-Kirchhoff stress S = 2 shear dev E' + bulk tr(E') I beside the elastic one. A rigid motion has E' = 0
 * and feels nothing. F is the lagged state's, so that r is linear in v and has the potential D/shift.v. */
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "effect/effect.h"
#include "effect/rows.h"
#include "effect/tet_batches.h"

typedef struct viscosity {
  flesh_tets tets;
  flesh_viscous *viscous; /* of every material the same */
} viscosity;

static const flesh_cells *viscosity_cells(const flesh_effect *effect)
{
  const viscosity *self = effect->data;
  return &self->tets.cells;
}

static int viscosity_evaluate(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *r,
                              double *phi, double *magnitude)
{
  const viscosity *self = effect->data;
  const flesh_tet_point at = {.x = point->x_lag, .v = point->v, .scale = 1, .viscous = self->viscous};
  return flesh_tets_dissipate(&self->tets, self->tets.kernels->viscous, &at, point->threads, shift, r, phi, magnitude);
}

static int viscosity_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  return viscosity_evaluate(effect, point, &(flesh_shift){0}, r, NULL, NULL);
}

static int viscosity_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                               double *phi, double *magnitude)
{
  return viscosity_evaluate(effect, point, shift, NULL, phi, magnitude);
}

static int viscosity_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                              flesh_block_matrix *K, const int *slots)
{
  const viscosity *self = effect->data;
  if (shift->v == 0) return FLESH_OK;
  const flesh_tet_point at = {.x = point->x_lag, .scale = shift->v, .viscous = self->viscous};
  return flesh_tets_second_order(&self->tets, self->tets.kernels->viscous, &at, point->threads, slots, K->values);
}

static flesh_instructions viscosity_instructions(const flesh_effect *effect)
{
  return ((const viscosity *)effect->data)->tets.instructions;
}

static size_t viscosity_memory(const flesh_effect *effect)
{
  const viscosity *self = effect->data;
  return sizeof *self + flesh_tets_memory(&self->tets) + (size_t)self->tets.materials * sizeof *self->viscous;
}

static void viscosity_destroy(void *data)
{
  viscosity *self = data;
  if (!self) return;
  flesh_tets_clear(&self->tets);
  free(self->viscous);
  free(self);
}

static const flesh_effect_operations viscosity_operations = {
    .name = "viscosity",
    .cells = viscosity_cells,
    .residual = viscosity_residual,
    .jacobian = viscosity_jacobian,
    .potential = viscosity_potential,
    .evaluate = viscosity_evaluate,
    .instructions = viscosity_instructions,
    .destroy = viscosity_destroy,
    .memory = viscosity_memory,
};

int flesh_effect_viscosity(const flesh_body *body, double shear, double bulk, flesh_effect **effect)
{
  if (!(shear >= 0 && shear < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "shear is %g Pa s; it must not be negative", shear);
  if (!(bulk >= 0 && bulk < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "bulk is %g Pa s; it must not be negative", bulk);
  if (shear + bulk == 0)
    return flesh_fail(FLESH_ERR_ARGUMENT, "shear and bulk are both 0; one of them must be positive");
  viscosity *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a viscosity effect");
  int status = flesh_tets_create(body, FLESH_TETS_SHAPES, &self->tets);
  if (!status) self->viscous = malloc((size_t)self->tets.materials * sizeof *self->viscous);
  if (!status && !self->viscous)
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for %d materials", self->tets.materials);
  for (int m = 0; !status && m < self->tets.materials; m++)
    self->viscous[m] = (flesh_viscous){.shear = shear, .bulk = bulk};
  if (status) {
    viscosity_destroy(self);
    return status;
  }
  return flesh_effect_create(&viscosity_operations, self, effect);
}

const flesh_key flesh_viscosity_keys[] = {
    {.name = "shear", .type = FLESH_KEY_NUMBER, .offset = offsetof(flesh_viscosity_parameters, shear),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "Pa s", .default_value = "0",
     .doc = "viscosity against changes of shape; shear modulus times a time of relaxation"},
    {.name = "bulk", .type = FLESH_KEY_NUMBER, .offset = offsetof(flesh_viscosity_parameters, bulk),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "Pa s", .default_value = "0",
     .doc = "viscosity against changes of volume"},
    {0}};

int flesh_viscosity_add(const void *parameters, const flesh_body *body, flesh_system *system)
{
  const flesh_viscosity_parameters *p = parameters;
  flesh_effect *effect = NULL;
  int status = flesh_effect_viscosity(body, p->shear, p->bulk, &effect);
  return status ? status : flesh_system_add_effect(system, &effect);
}
