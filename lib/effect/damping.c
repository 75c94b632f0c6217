/* damping.c: Rayleigh damping, r = a M v + b K v with K the stiffness at rest or at the lagged state.
 *
 * K is the elasticity's Hessian with its negative eigenvalues set to zero, so that nothing is ever fed. It is gone
 * through tet by tet from its closed spectrum in the frame of the singular vectors; at rest that frame is the world's
 * and the spectrum one per material. Lord Rayleigh, The Theory of Sound, 1877, section 102. */
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "effect/effect.h"
#include "effect/element.h"
#include "effect/mass.h"
#include "effect/rows.h"
#include "material/spectrum.h"
#include "math/svd3.h"

typedef struct damping {
  double mass, stiffness; /* 1/s, s */
  flesh_mass_matrix M;    /* where mass > 0 */
  flesh_cells cells;      /* of all tets, where stiffness > 0 */
  flesh_element *elements;
  const flesh_material *materials; /* borrowed */
  flesh_spectrum *rest;            /* of every material; NULL: K of the lagged state */
} damping;

static const flesh_cells *damping_cells(const flesh_effect *effect)
{
  const damping *self = effect->data;
  if (self->elements) return &self->cells;
  return self->M.cell_mass ? &self->M.cells : NULL;
}

static int spectrum_at(const flesh_material *material, double I_C, double J, const double sigma[3],
                       flesh_spectrum *spectrum)
{
  flesh_psi psi;
  int status = material->psi(I_C, J, material, &psi);
  if (!status && !flesh_spectrum_make(&psi, sigma, spectrum)) status = FLESH_NONFINITE;
  if (!status) flesh_spectrum_filter(spectrum, FLESH_FILTER_CLAMP);
  return status;
}

/* scale K of one tet, by nodes: 11 12 13 22 23 33. */
static int blocks(const damping *self, const flesh_element *e, const double *x_lag, double scale, double pair[6][9])
{
  double U[9], V[9], g[3][3];
  flesh_spectrum current;
  const flesh_spectrum *spectrum = &current;
  scale *= e->volume;
  if (self->rest) {
    spectrum = &self->rest[e->material];
  } else {
    double F[9], sigma[3];
    flesh_element_gradient(e, x_lag, F);
    flesh_svd3(F, U, sigma, V);
    int status = spectrum_at(&self->materials[e->material], flesh_mat3_norm2(F), flesh_mat3_determinant(F), sigma,
                             &current);
    if (status) return status;
    for (int a = 0; a < 3; a++) flesh_mat3_transposed_times(V, e->gradient + 3 * a, g[a]);
  }
  for (int a = 0, n = 0; a < 3; a++)
    for (int b = a; b < 3; b++, n++) {
      double B[9], UB[9];
      if (self->rest) {
        flesh_spectrum_block(spectrum, e->gradient + 3 * a, e->gradient + 3 * b, pair[n]);
      } else {
        flesh_spectrum_block(spectrum, g[a], g[b], B);
        flesh_mat3_multiply(U, B, UB);
        flesh_mat3_multiply_transposed(UB, U, pair[n]);
      }
      for (int c = 0; c < 9; c++) pair[n][c] *= scale;
    }
  return FLESH_OK;
}

/* f_a = sum_b K_ab (v_b - v_0). */
static void multiply(const flesh_element *e, const double pair[6][9], const double *v, double f[3][3])
{
  double d[3][3], y[3];
  for (int a = 0; a < 3; a++)
    for (int i = 0; i < 3; i++) {
      d[a][i] = v[3 * e->node[a + 1] + i] - v[3 * e->node[0] + i];
      f[a][i] = 0;
    }
  for (int a = 0, n = 0; a < 3; a++)
    for (int b = a; b < 3; b++, n++) {
      flesh_mat3_times(pair[n], d[b], y);
      for (int i = 0; i < 3; i++) f[a][i] += y[i];
      if (a == b) continue;
      flesh_mat3_transposed_times(pair[n], d[a], y);
      for (int i = 0; i < 3; i++) f[b][i] += y[i];
    }
}

/* Adds C v to r, where that is not NULL, and v.Cv to *power. */
static int force(const damping *self, const flesh_point *point, double *r, double *power)
{
  const double *v = point->v;
  if (self->mass > 0) {
    if (r) flesh_mass_matrix_times(&self->M, self->mass, v, r);
    *power += 2 * self->mass * flesh_mass_matrix_half_square(&self->M, v);
  }
  for (int k = 0; k < self->cells.count; k++) {
    const flesh_element *e = &self->elements[k];
    double pair[6][9], f[3][3];
    int status = blocks(self, e, point->x_lag, self->stiffness, pair);
    if (status) return status;
    multiply(e, (const double (*)[9])pair, v, f);
    if (r) flesh_element_add_forces(e, (const double (*)[3])f, r);
    for (int a = 0; a < 3; a++)
      for (int i = 0; i < 3; i++) *power += f[a][i] * (v[3 * e->node[a + 1] + i] - v[3 * e->node[0] + i]);
  }
  return FLESH_OK;
}

static int damping_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  double power = 0;
  return force(effect->data, point, r, &power);
}

static int damping_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                            flesh_block_matrix *K, const int *slots)
{
  const damping *self = effect->data;
  if (shift->v == 0) return FLESH_OK;
  if (self->mass > 0) flesh_mass_matrix_add(&self->M, shift->v * self->mass, point->threads, K, slots);
  for (int k = 0; k < self->cells.count; k++) {
    double pair[6][9];
    int status = blocks(self, &self->elements[k], point->x_lag, shift->v * self->stiffness, pair);
    if (status) return status;
    flesh_element_add_blocks((const double (*)[9])pair, slots + 10 * (size_t)k, K->values);
  }
  return FLESH_OK;
}

static int damping_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                             double *phi, double *magnitude)
{
  if (shift->v == 0) return FLESH_OK;
  double power = 0;
  int status = force(effect->data, point, NULL, &power);
  if (status) return status;
  *phi += power / (2 * shift->v);
  *magnitude += power / (2 * shift->v);
  return FLESH_OK;
}

static void damping_destroy(void *data)
{
  damping *self = data;
  if (!self) return;
  flesh_mass_matrix_clear(&self->M);
  flesh_cells_clear(&self->cells);
  free(self->elements);
  free(self->rest);
  free(self);
}

static const flesh_effect_operations damping_operations = {
    .name = "damping",
    .cells = damping_cells,
    .residual = damping_residual,
    .jacobian = damping_jacobian,
    .potential = damping_potential,
    .destroy = damping_destroy,
};

static int material_count(const flesh_body *body)
{
  int last = 0, tets = flesh_mesh_tet_count(body->mesh);
  for (int k = 0; body->tet_material && k < tets; k++)
    if (body->tet_material[k] > last) last = body->tet_material[k];
  return last + 1;
}

static int take_stiffness(damping *self, const flesh_body *body, flesh_stiffness against)
{
  if (!body->materials)
    return flesh_fail(FLESH_ERR_ARGUMENT, "stiffness is %g s; it must be 0 for a body without a material",
                      self->stiffness);
  self->materials = body->materials;
  int status = flesh_cells_of_tets(body->mesh, &self->cells);
  if (!status) status = flesh_elements_create(body, &self->cells, &self->elements);
  if (status || against == FLESH_STIFFNESS_CURRENT) return status;
  int count = material_count(body);
  self->rest = malloc((size_t)count * sizeof *self->rest);
  if (!self->rest) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d materials", count);
  for (int m = 0; m < count; m++)
    if (spectrum_at(&body->materials[m], 3, 1, (const double[3]){1, 1, 1}, &self->rest[m]))
      return flesh_fail(FLESH_ERR_ARGUMENT, "material %d has no stiffness at rest", m);
  return FLESH_OK;
}

int flesh_effect_damping(const flesh_body *body, double mass, double stiffness, flesh_stiffness against,
                         flesh_effect **effect)
{
  if (!(mass >= 0 && mass < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "mass is %g 1/s; it must not be negative", mass);
  if (!(stiffness >= 0 && stiffness < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "stiffness is %g s; it must not be negative", stiffness);
  if (mass + stiffness == 0)
    return flesh_fail(FLESH_ERR_ARGUMENT, "mass and stiffness are both 0; one of them must be positive");
  damping *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a damping effect");
  self->mass = mass;
  self->stiffness = stiffness;
  int status = mass > 0 ? flesh_mass_matrix_create(body, &self->M) : FLESH_OK;
  if (!status && stiffness > 0) status = take_stiffness(self, body, against);
  if (status) {
    damping_destroy(self);
    return status;
  }
  return flesh_effect_create(&damping_operations, self, effect);
}

static const char *const stiffnesses[] = {"rest", "current", NULL}; /* in the order of flesh_stiffness */

const flesh_key flesh_damping_keys[] = {
    {.name = "mass", .type = FLESH_KEY_NUMBER, .offset = offsetof(flesh_damping_parameters, mass),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "1/s", .default_value = "0",
     .doc = "a of r = a M v: of a mode of angular frequency w the damping ratio a/(2 w); brakes rigid motion too"},
    {.name = "stiffness", .type = FLESH_KEY_NUMBER, .offset = offsetof(flesh_damping_parameters, stiffness),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "s", .default_value = "0",
     .doc = "b of r = b K v: the damping ratio b w/2, most of fast modes"},
    {.name = "against", .type = FLESH_KEY_CHOICE, .offset = offsetof(flesh_damping_parameters, against),
     .choices = stiffnesses, .default_value = "rest",
     .doc = "which stiffness K: rest, cheap, but it brakes a body that has turned; or current, of the last accepted "
            "state, with negative curvature taken out, so that it always dissipates"},
    {0}};

int flesh_damping_add(const void *parameters, const flesh_body *body, flesh_system *system)
{
  const flesh_damping_parameters *p = parameters;
  flesh_effect *effect = NULL;
  int status = flesh_effect_damping(body, p->mass, p->stiffness, (flesh_stiffness)p->against, &effect);
  return status ? status : flesh_system_add_effect(system, &effect);
}
