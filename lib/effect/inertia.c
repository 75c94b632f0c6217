/* inertia.c: r = M a with the lumped or the consistent mass of linear tets. */
#include <stdlib.h>

#include "base/error.h"
#include "effect/effect.h"
#include "effect/mass.h"

static const flesh_cells *inertia_cells(const flesh_effect *effect)
{
  const flesh_mass_matrix *mass = effect->data;
  return mass->lumped ? NULL : &mass->cells;
}

static int inertia_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  flesh_mass_matrix_times(effect->data, 1, point->a, r);
  return FLESH_OK;
}

static int inertia_jacobian(const flesh_effect *effect, const flesh_point *point,
                            const flesh_shift *shift, flesh_block_matrix *K, const int *slots)
{
  if (shift->a != 0)
    flesh_mass_matrix_add(effect->data, shift->a, point->threads, K, slots);
  return FLESH_OK;
}

static int inertia_potential(const flesh_effect *effect, const flesh_point *point,
                             const flesh_shift *shift, double *phi, double *magnitude)
{
  if (shift->a == 0) return FLESH_OK;
  double value = flesh_mass_matrix_half_square(effect->data, point->a) / shift->a;
  *phi += value;
  *magnitude += value;
  return FLESH_OK;
}

static int inertia_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  *energy = flesh_mass_matrix_half_square(effect->data, point->v);
  return FLESH_OK;
}

static size_t inertia_memory(const flesh_effect *effect)
{
  return sizeof(flesh_mass_matrix) + flesh_mass_matrix_memory(effect->data);
}

static void inertia_destroy(void *data)
{
  if (data) flesh_mass_matrix_clear(data);
  free(data);
}

static const flesh_effect_operations inertia_operations = {
    .name = "inertia",
    .cells = inertia_cells,
    .residual = inertia_residual,
    .jacobian = inertia_jacobian,
    .potential = inertia_potential,
    .energy = inertia_energy,
    .destroy = inertia_destroy,
    .memory = inertia_memory,
};

int flesh_effect_inertia(const flesh_body *body, flesh_effect **effect)
{
  flesh_mass_matrix *mass = malloc(sizeof *mass);
  if (!mass) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the inertia effect");
  int status = flesh_mass_matrix_create(body, mass);
  if (status) {
    free(mass);
    return status;
  }
  return flesh_effect_create(&inertia_operations, mass, effect);
}
