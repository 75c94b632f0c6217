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
  int rest_count;
  flesh_spectrum *rest; /* [rest_count] of every material; NULL: K of the lagged state */
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

/* The frame of a tet's spectrum: U, V and the spectrum; at rest the world's. */
typedef struct frame {
  double U[9], V[9];
  flesh_spectrum spectrum;
} frame;

static int frame_at(const damping *self, const flesh_element *e, const double *x_lag, frame *f)
{
  double F[9], sigma[3];
  flesh_element_gradient(e, x_lag, F);
  flesh_svd3(F, f->U, sigma, f->V);
  return spectrum_at(&self->materials[e->material], flesh_mat3_norm2(F), flesh_mat3_determinant(F), sigma,
                     &f->spectrum);
}

/* The second derivative of psi in direction Y, both in the frame of the singular vectors. */
static void multiply(const flesh_spectrum *spectrum, const double Y[9], double S[9])
{
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    double t = spectrum->twist[k], f = spectrum->flip[k], up = Y[3 * i + j], down = Y[3 * j + i];
    S[4 * i] = 0;
    for (int c = 0; c < 3; c++) S[4 * i] += spectrum->A[3 * i + c] * Y[4 * c];
    S[3 * i + j] = (t + f) / 2 * up + (f - t) / 2 * down;
    S[3 * j + i] = (t + f) / 2 * down + (f - t) / 2 * up;
  }
}

/* Adds C v to r, where that is not NULL, and v.Cv to *power. */
static int force(const damping *self, const flesh_point *point, double *r, double *power)
{
  if (self->mass > 0) {
    if (r) flesh_mass_matrix_times(&self->M, self->mass, point->v, r);
    *power += 2 * self->mass * flesh_mass_matrix_half_square(&self->M, point->v);
  }
  for (int k = 0; k < self->cells.count; k++) {
    const flesh_element *e = &self->elements[k];
    const double scale = self->stiffness * e->volume;
    double rate[9], P[9], forces[3][3];
    flesh_element_gradient(e, point->v, rate);
    if (self->rest) {
      multiply(&self->rest[e->material], rate, P);
    } else {
      frame f;
      double A[9], B[9];
      int status = frame_at(self, e, point->x_lag, &f);
      if (status) return status;
      flesh_mat3_transposed_multiply(f.U, rate, A);
      flesh_mat3_multiply(A, f.V, B);
      multiply(&f.spectrum, B, A);
      flesh_mat3_multiply(f.U, A, B);
      flesh_mat3_multiply_transposed(B, f.V, P);
    }
    *power += scale * flesh_mat3_inner(rate, P);
    for (int a = 0; a < 3; a++)
      for (int i = 0; i < 3; i++) forces[a][i] = scale * flesh_vec3_dot(P + 3 * i, e->gradient + 3 * a);
    if (r) flesh_element_add_forces(e, (const double (*)[3])forces, r);
  }
  return FLESH_OK;
}

/* scale K of one tet, by nodes: 11 12 13 22 23 33. */
static int blocks(const damping *self, const flesh_element *e, const double *x_lag, double scale, double pair[6][9])
{
  frame f;
  double g[3][3], B[9], UB[9];
  scale *= e->volume;
  if (!self->rest) {
    int status = frame_at(self, e, x_lag, &f);
    if (status) return status;
    for (int a = 0; a < 3; a++) flesh_mat3_transposed_times(f.V, e->gradient + 3 * a, g[a]);
  }
  for (int a = 0, n = 0; a < 3; a++)
    for (int b = a; b < 3; b++, n++) {
      if (self->rest) {
        flesh_spectrum_block(&self->rest[e->material], e->gradient + 3 * a, e->gradient + 3 * b, pair[n]);
      } else {
        flesh_spectrum_block(&f.spectrum, g[a], g[b], B);
        flesh_mat3_multiply(f.U, B, UB);
        flesh_mat3_multiply_transposed(UB, f.U, pair[n]);
      }
      for (int c = 0; c < 9; c++) pair[n][c] *= scale;
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

static size_t damping_memory(const flesh_effect *effect)
{
  const damping *self = effect->data;
  size_t bytes = sizeof *self + (size_t)self->cells.count * (4 * sizeof(int) + sizeof *self->elements);
  if (self->mass > 0) bytes += flesh_mass_matrix_memory(&self->M);
  return bytes + (size_t)self->rest_count * sizeof *self->rest;
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
    .memory = damping_memory,
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
  self->rest_count = count;
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
