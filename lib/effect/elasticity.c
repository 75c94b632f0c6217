/* elasticity.c: V(x) = sum over tets of volume * psi(F), its gradient and its (projected) Hessian. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "effect/environment.h"
#include "element/body.h"
#include "element/element.h"
#include "element/tet_batches.h"

typedef struct elasticity {
  flesh_tets tets;
  double stiffness_ratio; /* lambda/mu of the stiffest material at rest */
  /* [materials] softened materials of an effect that borrows another's tets; else NULL. */
  flesh_material *soft;
  flesh_volume_share *soft_shares; /* NULL also if the element needs none */
} elasticity;

static const flesh_cells *elasticity_cells(const flesh_effect *effect)
{
  const flesh_tets *tets = effect->data;
  return &tets->cells;
}

/* Computes r and the sums {V, magnitude of its terms}; either may be NULL. */
static int residual_kernel(const flesh_effect *effect, const flesh_point *point, double *r, double *sums)
{
  const flesh_tets *tets = effect->data;
  const flesh_tet_point at = {.x = flesh_relative_positions(point), .multipliers = point->multipliers, .penalty = point->penalty};
  return flesh_tets_residual(tets, FLESH_KERNEL_ELASTIC, &at, point->threads, r, sums);
}

static int elasticity_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  return residual_kernel(effect, point, r, NULL);
}

static int hessian_kernel(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, int assign,
                        const int *slots, double *values)
{
  const flesh_tets *tets = effect->data;
  const flesh_tet_point at = {
      .x = flesh_relative_positions(point), .scale = shift->x, .filter = (flesh_eigenvalue_filter)shift->filter, .assign = assign,
      .multipliers = point->multipliers, .penalty = point->penalty};
  return flesh_tets_hessian(tets, FLESH_KERNEL_ELASTIC, &at, point->threads, slots, values);
}

static int elasticity_jacobian(const flesh_effect *effect, const flesh_point *point,
                               const flesh_shift *shift, flesh_block_matrix *K, const int *slots)
{
  return shift->x == 0 ? FLESH_OK : hessian_kernel(effect, point, shift, 0, slots, K->values);
}

static int elasticity_jacobian_assign(const flesh_effect *effect, const flesh_point *point,
                                    const flesh_shift *shift, flesh_block_matrix *K, const int *slots)
{
  if (shift->x != 0) return hessian_kernel(effect, point, shift, 1, slots, K->values);
  for (int k = 0; k < elasticity_cells(effect)->pair_count; k++)
    memset(K->values + 9 * (size_t)slots[k], 0, 9 * sizeof *K->values);
  return FLESH_OK;
}

static int elasticity_evaluate(const flesh_effect *effect, const flesh_point *point,
                               const flesh_shift *shift, double *r, double *phi, double *magnitude)
{
  double sums[2];
  if (shift->x == 0) return r ? residual_kernel(effect, point, r, NULL) : FLESH_OK;
  int status = residual_kernel(effect, point, r, sums);
  if (status) return status;
  *phi += sums[0] / shift->x;
  *magnitude += sums[1] / shift->x;
  return FLESH_OK;
}

static int elasticity_potential(const flesh_effect *effect, const flesh_point *point,
                                const flesh_shift *shift, double *phi, double *magnitude)
{
  return elasticity_evaluate(effect, point, shift, NULL, phi, magnitude);
}

static int elasticity_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  double sums[2];
  int status = residual_kernel(effect, point, NULL, sums);
  if (!status) *energy = sums[0];
  return status;
}

static int elasticity_part(const flesh_effect *effect, int count, const int *chosen, const flesh_mesh *mesh,
                           flesh_effect **part)
{
  const flesh_tets *tets = effect->data;
  int *material = flesh_malloc(((size_t)count + 1) * sizeof *material);
  if (!material) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a part of %d elements", count);
  for (int k = 0, batch = 0, g = 0; k < count; k++) {
    for (; g + 1 < tets->group_count && tets->groups[g + 1].first <= chosen[k]; g++) batch = 0;
    const flesh_tet_group *group = &tets->groups[g];
    while (group->batches.first[batch + 1] <= chosen[k] - group->first) batch++;
    material[k] = group->batches.material[batch];
  }
  int status = flesh_effect_elasticity(&(flesh_body){.mesh = mesh,
                                                     .materials = tets->groups[0].batches.materials,
                                                     .tet_material = material,
                                                     .instructions = tets->instructions,
                                                     .element = tets->given,
                                                     .material_elements = tets->material_elements},
                                       part);
  flesh_free(material);
  return status;
}

static int elasticity_cell_nodes(const flesh_effect *effect, int cell, int nodes[10])
{
  static const int place[10] = {0, 1, 2, 3, 4, 6, 7, 5, 8, 9}; /* position in the mesh's order of each of the batches' nodes */
  const flesh_tets *tets = effect->data;
  const flesh_tet_group *group = &tets->groups[tets->group_count > 1 && cell >= tets->groups[1].first];
  const int size = group->batches.nodes_per_tet;
  const int *own = group->batches.nodes + (size_t)size * (size_t)(cell - group->first);
  for (int a = 0; a < size; a++) nodes[place[a]] = own[a];
  return size;
}

static void elasticity_stiff_rows(const flesh_effect *effect, flesh_stiff_rows *rows)
{
  const flesh_tets *tets = effect->data;
  const flesh_tet_group *group = flesh_tets_stiff(tets);
  *rows = (flesh_stiff_rows){0};
  if (!group) return;
  const flesh_batches *batches = &group->batches;
  *rows = (flesh_stiff_rows){
      .count = group->tets, .nodes_per_row = batches->nodes_per_tet, .nodes = batches->nodes, .first_main = 4};
  for (int k = 0; k < tets->materials; k++) {
    const flesh_volume_share *s = &batches->volume_shares[k];
    if (!(s->moderate > 0)) continue;
    rows->ratio = fmax(rows->ratio, (s->held ? FLESH_LEAST_PENALTY : 1) * s->share / s->moderate);
    rows->modulus = rows->modulus > 0 ? fmin(rows->modulus, s->moderate) : s->moderate;
  }
}

static void elasticity_stiff_values(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                                    float *values)
{
  const flesh_tets *tets = effect->data;
  const flesh_tet_point at = {.x = flesh_relative_positions(point), .scale = shift->x, .penalty = point->penalty};
  flesh_tets_rows(tets, &at, point->threads, values);
}

static flesh_instructions elasticity_instructions(const flesh_effect *effect)
{
  return ((const flesh_tets *)effect->data)->instructions;
}

static int elasticity_is_same(const flesh_effect *effect, const flesh_effect *other)
{
  return flesh_tets_are_same(effect->data, other->data, 1);
}

static size_t elasticity_memory(const flesh_effect *effect)
{
  const elasticity *self = effect->data;
  if (!self->soft) return sizeof *self + flesh_tets_memory(&self->tets);
  const size_t of_material = sizeof *self->soft + (self->soft_shares ? sizeof *self->soft_shares : 0);
  return sizeof *self + (size_t)self->tets.materials * of_material;
}

static void elasticity_destroy(void *data)
{
  elasticity *self = data;
  if (!self) return;
  if (!self->soft) flesh_tets_clear(&self->tets);
  flesh_free(self->soft);
  flesh_free(self->soft_shares);
  flesh_free(self);
}

static int elasticity_gaps(const flesh_effect *effect, const flesh_point *point, double *gaps)
{
  const flesh_tets *tets = effect->data;
  const flesh_tet_point at = {.x = flesh_relative_positions(point)};
  return flesh_tets_residual(tets, FLESH_KERNEL_GAPS, &at, point->threads, gaps, NULL);
}

static void elasticity_penalties(const flesh_effect *effect, double *stiffness)
{
  const flesh_tets *tets = effect->data;
  const flesh_batches *batches = &tets->groups[tets->group_count - 1].batches; /* the batches of ten-node tets */
  for (int b = 0; b < batches->count; b++)
    for (int k = batches->first[b]; k < batches->first[b + 1]; k++) {
      const flesh_volume_share *share = &batches->volume_shares[batches->material[b]];
      stiffness[batches->tet[k]] = share->held ? share->share : 0;
    }
}

/* Makes a material of form S with the same shear modulus at rest and at most the given ratio lambda/mu. Its energy is
 * finite and restoring everywhere, whatever the original form does. */
static void soften_material(const flesh_material *material, double ratio, flesh_material *soft)
{
  double mu, lambda;
  *soft = *material;
  if (flesh_material_small_strain(material, &mu, &lambda, NULL)) return;
  if (flesh_material_from_lame(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, mu, fmin(lambda, ratio * mu),
                               soft))
    *soft = *material;
}

/* Returns the largest lambda/mu. It evaluates each material at rest, so a faulty user-defined form is reported when the
 * effect is created. */
static double find_stiffness_ratio(const flesh_tets *tets)
{
  double mu, lambda, most = 0;
  for (int k = 0; k < tets->materials; k++)
    if (!flesh_material_small_strain(&tets->groups[0].batches.materials[k], &mu, &lambda, NULL))
      most = fmax(most, lambda / mu);
  return most;
}

static double elasticity_stiffness_ratio(const flesh_effect *effect)
{
  return ((const elasticity *)effect->data)->stiffness_ratio;
}

/* Copies `whole` with softened materials; the tets are shared. */
static int take_soft_materials(const flesh_tets *whole, double ratio, elasticity *self)
{
  const size_t count = (size_t)whole->materials;
  const flesh_volume_share *shares = NULL; /* only ten-node tets have shares */
  int status = FLESH_OK;
  for (int g = 0; g < whole->group_count && !shares; g++) shares = whole->groups[g].batches.volume_shares;
  self->tets = *whole;
  self->soft = flesh_malloc((count + 1) * sizeof *self->soft);
  if (shares) self->soft_shares = flesh_malloc((count + 1) * sizeof *self->soft_shares);
  if (!self->soft || (shares && !self->soft_shares)) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %zu materials", count);
  for (size_t k = 0; k < count && !status; k++) {
    soften_material(&whole->groups[0].batches.materials[k], ratio, &self->soft[k]);
    if (!shares) continue;
    self->soft_shares[k] = shares[k];
    if (shares[k].term != FLESH_VOLUME_NONE) status = flesh_volume_share_of(&self->soft[k], &self->soft_shares[k]);
  }
  for (int g = 0; g < whole->group_count; g++) {
    flesh_batches *batches = &self->tets.groups[g].batches;
    batches->materials = self->soft;
    if (batches->volume_shares) batches->volume_shares = self->soft_shares;
  }
  return status;
}

static int elasticity_soften(const flesh_effect *effect, double ratio, flesh_effect **softened)
{
  elasticity *self = flesh_calloc(1, sizeof *self);
  flesh_effect *made = *softened = flesh_malloc(sizeof *made);
  int status = self && made ? take_soft_materials(effect->data, ratio, self)
                            : flesh_fail(FLESH_ERR_MEMORY, "no memory for the elasticity effect");
  if (!status) {
    *made = *effect;
    made->data = self;
    return FLESH_OK;
  }
  if (self && !self->soft) self->tets = (flesh_tets){0}; /* the tets belong to the other effect */
  elasticity_destroy(self);
  flesh_free(made);
  *softened = NULL;
  return status;
}

static const flesh_effect_figures figures = {.memory = elasticity_memory};

#define OPERATIONS                                                                                                     \
  .name = "elasticity", .role = FLESH_ROLE_ELASTICITY,                                                                 \
  .traits = FLESH_IS_PASSIVE | FLESH_DEPENDS_ON_POSITION_ONLY | FLESH_IS_SUM_OVER_TETS,                                \
  .cells = elasticity_cells, .residual = elasticity_residual, .jacobian = elasticity_jacobian,                         \
  .potential = elasticity_potential, .energy = elasticity_energy, .destroy = elasticity_destroy, .figures = &figures

#define SHORTCUTS                                                                                                      \
  .jacobian_assign = elasticity_jacobian_assign, .evaluate = elasticity_evaluate, .stiff_rows = elasticity_stiff_rows, \
  .stiff_values = elasticity_stiff_values, .stiffness_ratio = elasticity_stiffness_ratio,                              \
  .soften = elasticity_soften, .instructions = elasticity_instructions, .is_same = elasticity_is_same

static const flesh_effect_operations elasticity_operations = {
    OPERATIONS, .library = &(const flesh_effect_private){SHORTCUTS, .restrict_to_cells = elasticity_part,
                                                     .cell_nodes = elasticity_cell_nodes}};

/* Operations for bodies with incompressible tets. */
static const flesh_effect_operations holding_operations = {
    OPERATIONS, .library = &(const flesh_effect_private){SHORTCUTS},
    .constraints = &(const flesh_effect_constraints){.gaps = elasticity_gaps, .stiffness = elasticity_penalties}};

int flesh_effect_elasticity(const flesh_body *body, flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"});
  if (!body->materials)
    return flesh_fail(FLESH_ERR_ARGUMENT, "elasticity needs a body with a material");
  elasticity *self = flesh_calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the elasticity effect");
  const int status = flesh_tets_create(body, FLESH_TETS_SHAPES, &self->tets);
  if (!status) self->stiffness_ratio = find_stiffness_ratio(&self->tets);
  const flesh_effect_operations *operations =
      !status && flesh_tets_hold_means(&self->tets) ? &holding_operations : &elasticity_operations;
  return flesh_effect_create_after(status, operations, body->mesh, self, effect);
}
