/* viscosity.c: Kelvin-Voigt damping from the rate of the Green strain, E' = sym(F^T F').
 *
 * The dissipation function is D = sum over tets of volume * (shear dev E' : dev E' + bulk/2 (tr E')^2), r = dD/dv: a
 * second Piola-Kirchhoff stress S = 2 shear dev E' + bulk tr(E') I beside the elastic one. A rigid motion has E' = 0
 * and feels nothing. F is the lagged state's, so that r is linear in v and has the potential D/shift.v. */
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "effect/effect.h"
#include "effect/element.h"
#include "effect/rows.h"

typedef struct viscosity {
  double shear, bulk; /* Pa s */
  flesh_cells cells;
  flesh_element *elements;
} viscosity;

static const flesh_cells *viscosity_cells(const flesh_effect *effect)
{
  const viscosity *self = effect->data;
  return &self->cells;
}

/* F at the lagged state, S [symmetric 9], and D per rest volume. */
static double stress(const viscosity *self, const flesh_element *e, const flesh_point *point, double F[9], double S[9])
{
  double rate[9], G[9], density = 0;
  flesh_element_gradient(e, point->x_lag, F);
  flesh_element_gradient(e, point->v, rate);
  flesh_mat3_transposed_multiply(F, rate, G);
  double trace = flesh_mat3_trace(G);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      double deviator = (G[3 * i + j] + G[3 * j + i]) / 2 - (i == j ? trace / 3 : 0);
      S[3 * i + j] = 2 * self->shear * deviator + (i == j ? self->bulk * trace : 0);
      density += self->shear * deviator * deviator;
    }
  return density + self->bulk / 2 * trace * trace;
}

static int viscosity_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const viscosity *self = effect->data;
  for (int k = 0; k < self->cells.count; k++) {
    const flesh_element *e = &self->elements[k];
    double F[9], S[9], P[9], f[3][3];
    stress(self, e, point, F, S);
    flesh_mat3_multiply(F, S, P);
    for (int a = 0; a < 3; a++)
      for (int i = 0; i < 3; i++) f[a][i] = e->volume * flesh_vec3_dot(P + 3 * i, e->gradient + 3 * a);
    flesh_element_add_forces(e, (const double (*)[3])f, r);
  }
  return FLESH_OK;
}

/* With p_a = F g_a: K_ab = shear ((g_a.g_b) F F^T + p_b p_a^T) + (bulk - 2/3 shear) p_a p_b^T. */
static int viscosity_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                              flesh_block_matrix *K, const int *slots)
{
  const viscosity *self = effect->data;
  if (shift->v == 0) return FLESH_OK;
  for (int k = 0; k < self->cells.count; k++) {
    const flesh_element *e = &self->elements[k];
    const double *g = e->gradient, scale = shift->v * e->volume, shear = scale * self->shear,
                 trace = scale * (self->bulk - 2 * self->shear / 3);
    double F[9], FF[9], p[3][3], pair[6][9];
    flesh_element_gradient(e, point->x_lag, F);
    flesh_mat3_multiply_transposed(F, F, FF);
    for (int a = 0; a < 3; a++) flesh_mat3_times(F, g + 3 * a, p[a]);
    for (int a = 0, n = 0; a < 3; a++)
      for (int b = a; b < 3; b++, n++) {
        double gg = shear * flesh_vec3_dot(g + 3 * a, g + 3 * b);
        for (int i = 0; i < 3; i++)
          for (int j = 0; j < 3; j++)
            pair[n][3 * i + j] = gg * FF[3 * i + j] + shear * p[b][i] * p[a][j] + trace * p[a][i] * p[b][j];
      }
    flesh_element_add_blocks((const double (*)[9])pair, slots + 10 * (size_t)k, K->values);
  }
  return FLESH_OK;
}

static int viscosity_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                               double *phi, double *magnitude)
{
  const viscosity *self = effect->data;
  if (shift->v == 0) return FLESH_OK;
  double sum = 0;
  for (int k = 0; k < self->cells.count; k++) {
    double F[9], S[9];
    sum += self->elements[k].volume * stress(self, &self->elements[k], point, F, S);
  }
  *phi += sum / shift->v;
  *magnitude += sum / shift->v;
  return FLESH_OK;
}

static size_t viscosity_memory(const flesh_effect *effect)
{
  const viscosity *self = effect->data;
  return sizeof *self + (size_t)self->cells.count * (4 * sizeof(int) + sizeof *self->elements);
}

static void viscosity_destroy(void *data)
{
  viscosity *self = data;
  if (!self) return;
  flesh_cells_clear(&self->cells);
  free(self->elements);
  free(self);
}

static const flesh_effect_operations viscosity_operations = {
    .name = "viscosity",
    .cells = viscosity_cells,
    .residual = viscosity_residual,
    .jacobian = viscosity_jacobian,
    .potential = viscosity_potential,
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
  self->shear = shear;
  self->bulk = bulk;
  int status = flesh_cells_of_tets(body->mesh, &self->cells);
  if (!status) status = flesh_elements_create(body, &self->cells, &self->elements);
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
