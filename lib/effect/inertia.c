/* inertia.c: r = M a with the lumped or the consistent mass of linear tets. */
#include <stdlib.h>

#include "base/error.h"
#include "effect/effect.h"
#include "element/body.h"
#include "element/mass.h"

static const flesh_cells *inertia_cells(const flesh_effect *effect)
{
  return flesh_mass_matrix_cells(effect->data);
}

static int inertia_evaluate(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *r,
                            double *phi, double *magnitude)
{
  flesh_mass_matrix_evaluate(effect->data, 1, point->threads, point->a,
                             &(flesh_contribution){shift->a, r, phi, magnitude});
  return FLESH_OK;
}

static int inertia_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  return inertia_evaluate(effect, point, &(flesh_shift){0}, r, NULL, NULL);
}

static int inertia_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                             double *phi, double *magnitude)
{
  return inertia_evaluate(effect, point, shift, NULL, phi, magnitude);
}

static int inertia_jacobian(const flesh_effect *effect, const flesh_point *point,
                            const flesh_shift *shift, flesh_block_matrix *K, const int *slots)
{
  if (shift->a != 0)
    flesh_mass_matrix_add(effect->data, shift->a, point->threads, K, slots);
  return FLESH_OK;
}

static int inertia_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  flesh_mass_matrix_apply(effect->data, 1, point->threads, point->v, NULL, energy);
  return FLESH_OK;
}

static flesh_instructions inertia_instructions(const flesh_effect *effect)
{
  return ((const flesh_mass_matrix *)effect->data)->tets.instructions;
}

static int inertia_is_same(const flesh_effect *effect, const flesh_effect *other)
{
  return flesh_mass_matrices_are_same(effect->data, other->data);
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
    .role = FLESH_ROLE_INERTIA,
    .traits = FLESH_IS_PASSIVE | FLESH_IS_SUM_OVER_TETS,
    .cells = inertia_cells,
    .residual = inertia_residual,
    .jacobian = inertia_jacobian,
    .potential = inertia_potential,
    .energy = inertia_energy,
    .destroy = inertia_destroy,
    .library = &(const flesh_effect_private){
        .evaluate = inertia_evaluate, .instructions = inertia_instructions, .is_same = inertia_is_same},
    .figures = &(const flesh_effect_figures){.memory = inertia_memory},
};

int flesh_effect_inertia(const flesh_body *body, flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"});
  flesh_mass_matrix *mass = malloc(sizeof *mass);
  if (!mass) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the inertia effect");
  int status = flesh_mass_matrix_create(body, mass);
  if (status) {
    free(mass);
    return status;
  }
  return flesh_effect_create(&inertia_operations, body->mesh, mass, effect);
}
