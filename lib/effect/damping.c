/* damping.c: Rayleigh damping, r = a M v + b K v with K the stiffness at rest or at the lagged state.
 *
 * K is the elasticity's Hessian with its negative eigenvalues set to zero, so that it never adds energy. At rest, where
 * the Hessian of psi(I_C, J) is isotropic, this is a viscosity of the rest shape. lambda is limited to LARGEST_RATIO
 * mu. A larger lambda would damp no real motion, because the rate of J goes to 0; but K of one state takes a change of
 * volume that is of second order in the step for a real one, and would multiply it.
 *
 * Lord Rayleigh, The Theory of Sound, 1877, section 102. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "element/body.h"
#include "element/mass.h"
#include "element/tet_batches.h"

/* lambda/mu for a Poisson's ratio of 0.45. */
static const double LARGEST_RATIO = 9;

typedef struct damping {
  double mass, stiffness; /* coefficients a and b: 1/s, s */
  flesh_mass_matrix M;    /* set if mass > 0 */
  flesh_tets tets;        /* set if stiffness > 0 */
  flesh_viscous *rest;    /* [materials] stiffness at rest; NULL: K is that of the lagged state */
  double *excess;         /* [materials] Pa, the part of lambda above LARGEST_RATIO mu; set if stiffness > 0 */
  flesh_body body;        /* the body it was created for */
} damping;

static const flesh_cells *damping_cells(const flesh_effect *effect)
{
  const damping *self = effect->data;
  return self->stiffness > 0 ? &self->tets.cells : flesh_mass_matrix_cells(&self->M);
}

static flesh_kernel kernel_of(const damping *self)
{
  return self->rest ? FLESH_KERNEL_VISCOUS : FLESH_KERNEL_STIFFNESS;
}

static flesh_tet_point point_of(const damping *self, const flesh_point *point, double scale)
{
  return (flesh_tet_point){.x = self->rest ? NULL : point->lagged.x,
                           .v = point->v,
                           .scale = scale * self->stiffness,
                           .filter = FLESH_FILTER_CLAMP,
                           .viscous = self->rest,
                           .multipliers = point->multipliers,
                           .excess = self->excess};
}

static int damping_evaluate(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *r,
                            double *phi, double *magnitude)
{
  const damping *self = effect->data;
  if (self->mass > 0)
    flesh_mass_matrix_evaluate(&self->M, self->mass, point->threads, point->v,
                               &(flesh_contribution){shift->v, r, phi, magnitude});
  if (self->stiffness == 0) return FLESH_OK;
  const flesh_tet_point at = point_of(self, point, 1);
  return flesh_tets_dissipate(&self->tets, kernel_of(self), &at, point->threads,
                              &(flesh_contribution){shift->v, r, phi, magnitude});
}

static int damping_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  return damping_evaluate(effect, point, &(flesh_shift){0}, r, NULL, NULL);
}

static int damping_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                             double *phi, double *magnitude)
{
  return damping_evaluate(effect, point, shift, NULL, phi, magnitude);
}

static int damping_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                            flesh_block_matrix *K, const int *slots)
{
  const damping *self = effect->data;
  if (shift->v == 0) return FLESH_OK;
  if (self->mass > 0) flesh_mass_matrix_add(&self->M, shift->v * self->mass, point->threads, K, slots);
  if (self->stiffness == 0) return FLESH_OK;
  const flesh_tet_point at = point_of(self, point, shift->v);
  return flesh_tets_hessian(&self->tets, kernel_of(self), &at, point->threads, slots, K->values);
}

static flesh_instructions damping_instructions(const flesh_effect *effect)
{
  const damping *self = effect->data;
  return self->stiffness > 0 ? self->tets.instructions : self->M.tets.instructions;
}

static size_t damping_memory(const flesh_effect *effect)
{
  const damping *self = effect->data;
  return sizeof *self + (self->mass > 0 ? flesh_mass_matrix_memory(&self->M) : 0) + flesh_tets_memory(&self->tets) +
         (size_t)self->tets.materials * ((self->rest ? sizeof *self->rest : 0) + sizeof *self->excess);
}

static int damping_is_same(const flesh_effect *effect, const flesh_effect *other)
{
  const damping *self = effect->data, *its = other->data;
  return self->mass == its->mass && self->stiffness == its->stiffness && flesh_mass_matrices_are_same(&self->M, &its->M) &&
         flesh_tets_are_same(&self->tets, &its->tets, 1) &&
         (!self->rest || !memcmp(self->rest, its->rest, (size_t)self->tets.materials * sizeof *self->rest));
}

/* Tears only the stiffness: the mass depends on neither a lagged state nor a material. */
static int damping_tear(const flesh_effect *effect, const flesh_body *body, const flesh_mesh *torn, flesh_effect **torn_effect)
{
  const damping *self = effect->data;
  flesh_body own = body ? *body : self->body;
  own.mesh = torn;
  own.part_count = 0;
  return flesh_effect_damping(&own, 0, self->stiffness,
                              self->rest ? FLESH_STIFFNESS_REST : FLESH_STIFFNESS_CURRENT, torn_effect);
}

static void damping_destroy(void *data)
{
  damping *self = data;
  if (!self) return;
  flesh_mass_matrix_clear(&self->M);
  flesh_tets_clear(&self->tets);
  flesh_free(self->rest);
  flesh_free(self->excess);
  flesh_free(self);
}

#define OPERATIONS(more, ...)                                                                                          \
  {                                                                                                                    \
      .name = "damping",                                                                                               \
      .role = FLESH_ROLE_DAMPING,                                                                                      \
      .traits = FLESH_IS_PASSIVE | FLESH_IS_SUM_OVER_TETS | (more),                                                    \
      .cells = damping_cells,                                                                                          \
      .residual = damping_residual,                                                                                    \
      .jacobian = damping_jacobian,                                                                                    \
      .potential = damping_potential,                                                                                  \
      .destroy = damping_destroy,                                                                                      \
      .library = &(const flesh_effect_private){.evaluate = damping_evaluate,                                           \
                                               .linear_in_v = 1,                                                       \
                                               .is_same = damping_is_same,                                             \
                                               .instructions = damping_instructions, __VA_ARGS__},                     \
      .figures = &(const flesh_effect_figures){.memory = damping_memory},                                              \
  }
/* Operations for damping by mass alone, and with K at rest or at the lagged shape. */
static const flesh_effect_partials partials = {.tear = damping_tear};
static const flesh_effect_operations mass_operations = OPERATIONS(0, .partials = NULL),
                                     rest_operations = OPERATIONS(0, .partials = &partials),
                                     current_operations = OPERATIONS(FLESH_IS_FOLLOWER_LOAD, .partials = &partials);
#undef OPERATIONS

static int take_stiffness(damping *self, const flesh_body *body, flesh_stiffness against)
{
  if (!body->materials)
    return flesh_fail(FLESH_ERR_ARGUMENT, "stiffness is %g s; it must be 0 for a body without a material",
                      self->stiffness);
  int status = flesh_tets_create(body, FLESH_TETS_SHAPES, &self->tets), count = self->tets.materials;
  if (status) return status;
  self->excess = flesh_calloc((size_t)count, sizeof *self->excess);
  if (against == FLESH_STIFFNESS_REST) self->rest = flesh_calloc((size_t)count, sizeof *self->rest);
  if (!self->excess || (against == FLESH_STIFFNESS_REST && !self->rest))
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d materials", count);
  for (int m = 0; m < count; m++) {
    flesh_material finite = body->materials[m];
    double mu, lambda, stress;
    finite.incompressible = 0; /* to get lambda of the penalty */
    if (flesh_material_small_strain(&finite, &mu, &lambda, &stress))
      return flesh_fail(FLESH_ERR_ARGUMENT, "material %d has no stiffness at rest", m);
    const double taken = fmin(lambda, LARGEST_RATIO * mu);
    self->excess[m] = lambda - taken;
    if (self->rest) /* eigenvalues for changes of shape, for changes of volume, and for rotation */
      self->rest[m] = (flesh_viscous){fmax(mu, 0), fmax(taken + 2 * mu / 3, 0), fmax(stress / 2, 0)};
  }
  return FLESH_OK;
}

int flesh_effect_damping(const flesh_body *body, double mass, double stiffness, flesh_stiffness against,
                         flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"});
  if (!(mass >= 0 && mass < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "mass is %g 1/s; it must not be negative", mass);
  if (!(stiffness >= 0 && stiffness < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "stiffness is %g s; it must not be negative", stiffness);
  if (mass + stiffness == 0)
    return flesh_fail(FLESH_ERR_ARGUMENT, "mass and stiffness are both 0; one of them must be positive");
  if (against != FLESH_STIFFNESS_REST && against != FLESH_STIFFNESS_CURRENT)
    return flesh_fail(FLESH_ERR_ARGUMENT, "there is no stiffness number %d", (int)against);
  damping *self = flesh_calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a damping effect");
  self->mass = mass;
  self->stiffness = stiffness;
  self->body = *body;
  const flesh_effect_operations *operations =
      !(stiffness > 0) ? &mass_operations : against == FLESH_STIFFNESS_CURRENT ? &current_operations : &rest_operations;
  int status = mass > 0 ? flesh_mass_matrix_create(body, &self->M) : FLESH_OK;
  if (!status && stiffness > 0) status = take_stiffness(self, body, against);
  return flesh_effect_create_after(status, operations, body->mesh, self, effect);
}
