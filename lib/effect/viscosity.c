/* viscosity.c: Kelvin-Voigt damping from the rate of the Green strain, E' = sym(F^T F').
 *
 * The dissipation function is D = sum over tets of volume * (shear dev E' : dev E' + bulk/2 (tr E')^2), and r = dD/dv:
 * a second Piola-Kirchhoff stress S = 2 shear dev E' + bulk tr(E') I in addition to the elastic one. A rigid motion has
 * E' = 0 and is not damped. Forces F S with a symmetric S at the point's own F have no torque.
 *
 * With both F and E' of the point, r is no gradient. (Under the midpoint rule, no r that vanishes in every rigid step,
 * never adds energy and has no torque can be a gradient: its S would have to be 0 wherever E_{n+1} = E_n, and then
 * change its sign with E_{n+1} - E_n nearby.) So E' is computed from a frozen state (viscous_kernel.c), which gives r
 * the potential D/shift.v. Repeated until the frozen state is the point itself, E' is sym(F^T F') there; under the
 * midpoint rule that is exactly (E_{n+1} - E_n)/h. Under backward Euler this holds at once, with the state frozen at
 * the step's start. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "element/body.h"
#include "element/tet_batches.h"

typedef struct viscosity {
  flesh_tets tets;
  flesh_viscous *viscous; /* [materials] the same for each */
} viscosity;

static const flesh_cells *viscosity_cells(const flesh_effect *effect)
{
  const viscosity *self = effect->data;
  return &self->tets.cells;
}

/* Returns the kernel's arguments. A state frozen at the point itself does not count as frozen. */
static flesh_tet_point point_of(const viscosity *self, const flesh_point *point)
{
  const int frozen = point->frozen.x != point->x;
  return (flesh_tet_point){.x = point->x,
                           .v = point->v,
                           .x_frozen = frozen ? point->frozen.x : NULL,
                           .v_frozen = frozen ? point->frozen.v : NULL,
                           .scale = 1,
                           .viscous = self->viscous};
}

static int viscosity_evaluate(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *r,
                              double *phi, double *magnitude)
{
  const viscosity *self = effect->data;
  const flesh_tet_point at = point_of(self, point);
  return flesh_tets_dissipate(&self->tets, FLESH_KERNEL_VISCOUS, &at, point->threads,
                              &(flesh_contribution){shift->v, r, phi, magnitude});
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
  flesh_tet_point at = point_of(self, point);
  at.scale = shift->v;
  at.scale_x = shift->x;
  at.filter = (flesh_eigenvalue_filter)shift->filter;
  return flesh_tets_hessian(&self->tets, FLESH_KERNEL_VISCOUS, &at, point->threads, slots, K->values);
}

/* States in the terms of derivatives; W is the vector that is multiplied. */
enum { X, V, X_FROZEN, V_FROZEN, W, STATES };

/* The forces A S(B^T C) of the gradients A, B and C of states, times `halves`/2; 0: no term. */
typedef struct term {
  signed char halves;
  unsigned char a, b, c;
} term;

/* Terms of the derivatives. S is linear and G = 1/2 F^T (F' - F_0') + 1/2 F_0^T (F' + F_0') (viscous_batch.h), so the
 * derivative of the forces F S(G) along W is F S(dG), plus W S(G) for a derivative by F. The transposed terms are those
 * of S(F^T W) : G. */
enum { MOST_TERMS = 6 };
static const term terms[2][FLESH_ARGUMENTS][MOST_TERMS] = {
    {[FLESH_FROZEN_X] = {{1, X, W, V}, {1, X, W, V_FROZEN}},
     [FLESH_FROZEN_V] = {{-1, X, X, W}, {1, X, X_FROZEN, W}},
     [FLESH_OWN_V] = {{1, X, X, W}, {1, X, X_FROZEN, W}},
     [FLESH_OWN_X] = {{1, W, X, V}, {-1, W, X, V_FROZEN}, {1, W, X_FROZEN, V}, {1, W, X_FROZEN, V_FROZEN},
                      {1, X, W, V}, {-1, X, W, V_FROZEN}}},
    {[FLESH_FROZEN_X] = {{1, V, X, W}, {1, V_FROZEN, X, W}},
     [FLESH_FROZEN_V] = {{-1, X, X, W}, {1, X_FROZEN, X, W}},
     [FLESH_OWN_V] = {{1, X, X, W}, {1, X_FROZEN, X, W}},
     [FLESH_OWN_X] = {{1, W, X, V}, {-1, W, X, V_FROZEN}, {1, W, X_FROZEN, V}, {1, W, X_FROZEN, V_FROZEN},
                      {1, V, X, W}, {-1, V_FROZEN, X, W}}}};

static int terms_are_same(const term *t, const term *other, const double *const states[STATES])
{
  return states[t->a] == states[other->a] && states[t->b] == states[other->b] && states[t->c] == states[other->c];
}

static void viscosity_multiply(const flesh_effect *effect, const flesh_point *point, flesh_argument argument, int transposed,
                               double scale, const double *w, double *y)
{
  const viscosity *self = effect->data;
  const double *const states[STATES] = {point->x, point->v, point->frozen.x, point->frozen.v, w};
  double halves[MOST_TERMS] = {0};
  for (int k = 0; k < MOST_TERMS; k++) { /* if the state is frozen at the point itself, terms coincide and may cancel */
    const term *t = &terms[transposed][argument][k];
    int j = 0;
    while (j < k && !terms_are_same(t, &terms[transposed][argument][j], states)) j++;
    halves[j] += t->halves;
  }
  for (int k = 0; k < MOST_TERMS; k++) {
    const term *t = &terms[transposed][argument][k];
    const double *a = states[t->a], *b = states[t->b], *c = states[t->c];
    if (halves[k] == 0 || !a || !c) continue; /* NULL: the frozen state is at rest */
    /* With B frozen at the rate C, the rate G is B^T C for any A. */
    const flesh_tet_point at = {.x = a, .v = c, .x_frozen = b, .v_frozen = c, .scale = scale * halves[k] / 2,
                                .viscous = self->viscous};
    flesh_tets_residual(&self->tets, FLESH_KERNEL_VISCOUS, &at, point->threads, y, NULL); /* cannot fail */
  }
}

static flesh_instructions viscosity_instructions(const flesh_effect *effect)
{
  return ((const viscosity *)effect->data)->tets.instructions;
}

static int viscosity_is_same(const flesh_effect *effect, const flesh_effect *other)
{
  const viscosity *self = effect->data, *its = other->data;
  return flesh_tets_are_same(&self->tets, &its->tets, 0) &&
         !memcmp(self->viscous, its->viscous, (size_t)self->tets.materials * sizeof *self->viscous);
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
  flesh_free(self->viscous);
  flesh_free(self);
}

static const flesh_effect_operations viscosity_operations = {
    .name = "viscosity",
    .role = FLESH_ROLE_DAMPING,
    .traits = FLESH_FREEZES | FLESH_IS_PASSIVE | FLESH_IS_SUM_OVER_TETS,
    .cells = viscosity_cells,
    .residual = viscosity_residual,
    .jacobian = viscosity_jacobian,
    .potential = viscosity_potential,
    .destroy = viscosity_destroy,
    .library = &(const flesh_effect_private){
        .evaluate = viscosity_evaluate, .instructions = viscosity_instructions, .is_same = viscosity_is_same,
        .partials = &(const flesh_effect_partials){.multiply = viscosity_multiply, .reads = 0xfu << FLESH_FROZEN_X}},
    .figures = &(const flesh_effect_figures){.memory = viscosity_memory},
};

int flesh_effect_viscosity(const flesh_body *body, double shear, double bulk, flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"});
  if (!(shear >= 0 && shear < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "shear is %g Pa s; it must not be negative", shear);
  if (!(bulk >= 0 && bulk < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "bulk is %g Pa s; it must not be negative", bulk);
  if (shear + bulk == 0)
    return flesh_fail(FLESH_ERR_ARGUMENT, "shear and bulk are both 0; one of them must be positive");
  viscosity *self = flesh_calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a viscosity effect");
  int status = flesh_tets_create(body, FLESH_TETS_SHAPES, &self->tets);
  if (!status) self->viscous = flesh_malloc((size_t)self->tets.materials * sizeof *self->viscous);
  if (!status && !self->viscous)
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for %d materials", self->tets.materials);
  for (int m = 0; !status && m < self->tets.materials; m++)
    self->viscous[m] = (flesh_viscous){.shear = shear, .bulk = bulk};
  return flesh_effect_create_after(status, &viscosity_operations, body->mesh, self, effect);
}
