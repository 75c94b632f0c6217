/* muscle.c: contracting fibres: V(x,t) = sum over tets of volume * W(|F a|), with W of fibre.h and an activation that
 * changes in time.
 *
 * At a fixed shape the activation changes V: dV/dt is the power that the activation supplies, the volume times its rate
 * times the active energy W(L), which is the work of a fibre that shortens to nothing at full activation. The effect is
 * not passive and has an energy, so the energy balance counts this as external work.
 *
 * If the tension depends on the speed, the difference is a dissipation with a potential in the rate, as in viscosity.c.
 * It has no energy, is never larger than the fibres' own tension, and uses a frozen state. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/amplitude.h"
#include "effect/effect.h"
#include "effect/rank_share.h"
#include "element/body.h"
#include "element/tet_batches.h"
#include "material/fibre.h"
#include "mesh/mesh.h"

typedef struct muscle {
  flesh_body body; /* borrowed members */
  flesh_tets tets;
  int mesh_tets;
  double *directions; /* [3 * mesh_tets] unit directions at rest; 0 in tets without fibres */
  flesh_fibre_constants fibre;
  flesh_amplitude_copy activation;
} muscle;

static const flesh_cells *muscle_cells(const flesh_effect *effect)
{
  const muscle *self = effect->data;
  return &self->tets.cells;
}

/* Returns the arguments of the kernel at zero speed. The load factor scales the activation, but not the passive
 * tension. */
static flesh_tet_point still_at(const muscle *self, const flesh_point *point)
{
  return (flesh_tet_point){.x = point->x,
                           .fibre = &self->fibre,
                           .activation = point->load * flesh_amplitude_at(&self->activation, point->t)};
}

/* Returns the arguments with speeds. A state frozen at the point itself does not count as frozen. */
static flesh_tet_point point_of(const muscle *self, const flesh_point *point, const flesh_shift *shift)
{
  flesh_tet_point at = still_at(self, point);
  if (self->fibre.max_shortening_velocity == 0) return at;
  const int frozen = point->frozen.x != point->x;
  at.v = point->v;
  at.x_frozen = frozen ? point->frozen.x : NULL;
  at.v_frozen = frozen ? point->frozen.v : NULL;
  at.ratio = shift->x != 0 ? shift->v / shift->x : 0;
  return at;
}

/* Whether the fibres have no tension at all, so that nothing needs to be computed. */
static int is_slack(const muscle *self, const flesh_tet_point *at)
{
  return at->activation * self->fibre.peak_stress == 0 && self->fibre.passive_stress == 0;
}

static int evaluate_at(const muscle *self, const flesh_tet_point *at, const flesh_point *point,
                       const flesh_shift *shift, double *r, double *phi, double *magnitude)
{
  double sums[2];
  if (is_slack(self, at) || (!r && shift->x == 0)) return FLESH_OK;
  int status = flesh_tets_residual(&self->tets, FLESH_KERNEL_FIBRE, at, point->threads, r, shift->x != 0 ? sums : NULL);
  if (status || shift->x == 0) return status;
  *phi += sums[0] / shift->x;
  *magnitude += sums[1] / shift->x;
  return FLESH_OK;
}

static int muscle_evaluate(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *r,
                           double *phi, double *magnitude)
{
  const flesh_tet_point at = point_of(effect->data, point, shift);
  return evaluate_at(effect->data, &at, point, shift, r, phi, magnitude);
}

static int muscle_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  return muscle_evaluate(effect, point, &(flesh_shift){0}, r, NULL, NULL);
}

static int muscle_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                            double *magnitude)
{
  return muscle_evaluate(effect, point, shift, NULL, phi, magnitude);
}

static int muscle_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  const flesh_tet_point at = still_at(effect->data, point);
  double magnitude = 0;
  *energy = 0;
  return evaluate_at(effect->data, &at, point, &(flesh_shift){.x = 1}, NULL, energy, &magnitude);
}

static int muscle_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                           flesh_block_matrix *K, const int *slots)
{
  const muscle *self = effect->data;
  flesh_tet_point at = point_of(self, point, shift);
  if (shift->x == 0 || is_slack(self, &at)) return FLESH_OK;
  at.scale = shift->x;
  at.filter = (flesh_eigenvalue_filter)shift->filter;
  return flesh_tets_hessian(&self->tets, FLESH_KERNEL_FIBRE, &at, point->threads, slots, K->values);
}

static double muscle_next_event(const flesh_effect *effect, double t)
{
  const muscle *self = effect->data;
  return flesh_amplitude_next_event(&self->activation, t);
}

static const char *const report_names[] = {"activation", NULL};

static void muscle_report(const flesh_effect *effect, const flesh_point *point, double *values)
{
  const muscle *self = effect->data;
  values[0] = flesh_amplitude_at(&self->activation, point->t);
}

static void muscle_stress(const flesh_effect *effect, double t, int tet, const double F[9], double tau[9])
{
  const muscle *self = effect->data;
  const double *a = self->directions + 3 * (size_t)tet;
  double f[3];
  for (int i = 0; i < 3; i++) f[i] = F[3 * i] * a[0] + F[3 * i + 1] * a[1] + F[3 * i + 2] * a[2];
  flesh_fibre_add_stress(&self->fibre, flesh_amplitude_at(&self->activation, t), f, tau);
}

static flesh_instructions muscle_instructions(const flesh_effect *effect)
{
  return ((const muscle *)effect->data)->tets.instructions;
}

static size_t muscle_memory(const flesh_effect *effect)
{
  const muscle *self = effect->data;
  return sizeof *self + flesh_tets_memory(&self->tets) + 3 * (size_t)self->mesh_tets * sizeof *self->directions +
         flesh_amplitude_memory(&self->activation);
}

static void muscle_destroy(void *data)
{
  muscle *self = data;
  if (!self) return;
  flesh_tets_clear(&self->tets);
  flesh_amplitude_clear(&self->activation);
  flesh_free(self->directions);
  flesh_free(self);
}

/* Creates the same effect for the tets of `body`, which have these numbers in `whole` (NULL: the same). If no tet has
 * fibres, it gets one tet without fibres, which exerts no force. */
static int make_of(const flesh_effect *whole, const int *numbers, const flesh_body *body, flesh_effect **made)
{
  const muscle *from = whole->data;
  const int own = flesh_mesh_tet_count(body->mesh);
  muscle *self = flesh_calloc(1, sizeof *self);
  int *tets = flesh_malloc(((size_t)own + 1) * sizeof *tets), count = 0;
  int status = FLESH_ERR_MEMORY;
  if (self) {
    self->fibre = from->fibre;
    self->mesh_tets = own;
    self->directions = flesh_calloc(3 * (size_t)own + 1, sizeof *self->directions);
    status = flesh_amplitude_copy_of(&from->activation, &self->activation);
  }
  if (!status && (!tets || !self->directions)) status = FLESH_ERR_MEMORY;
  if (status) flesh_fail(status, "no memory for a muscle");
  for (int t = 0; t < own && !status; t++) {
    const double *a = from->directions + 3 * (size_t)(numbers ? numbers[t] : t);
    if (a[0] == 0 && a[1] == 0 && a[2] == 0) continue;
    memcpy(self->directions + 3 * (size_t)t, a, 3 * sizeof *a);
    tets[count++] = t;
  }
  if (!status && !count) tets[count++] = 0;
  if (!status)
    status = flesh_tets_create_fibres(
        body, &(flesh_tets_choice){.count = count, .tets = tets, .directions = self->directions}, &self->tets);
  flesh_free(tets);
  return flesh_effect_create_after(status, whole->operations, body->mesh, self, made);
}

static int muscle_restrict(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                           flesh_effect **restricted)
{
  return make_of(whole, flesh_rank_part_tets(part), body, restricted);
}

static int muscle_tear(const flesh_effect *effect, const flesh_body *body, const flesh_mesh *torn, flesh_effect **torn_effect)
{
  flesh_body own = body ? *body : ((const muscle *)effect->data)->body;
  own.mesh = torn;
  own.part_count = 0;
  return make_of(effect, NULL, &own, torn_effect);
}

/* Operations of fibres whose tension is independent of the speed, and of those whose tension depends on it. */
#define OPERATIONS(own_traits, own_partials)                                                                          \
  {                                                                                                                   \
    .name = "muscle", .role = FLESH_ROLE_LOAD, .traits = own_traits, .cells = muscle_cells,                           \
    .residual = muscle_residual, .jacobian = muscle_jacobian, .potential = muscle_potential, .energy = muscle_energy, \
    .destroy = muscle_destroy,                                                                                        \
    .time = &(const flesh_effect_time){.next_event = muscle_next_event},                                              \
    .figures = &(const flesh_effect_figures){                                                                         \
      .memory = muscle_memory, .report_names = report_names, .report = muscle_report, .stress = muscle_stress},       \
    .library = &(const flesh_effect_private){                                                                         \
        .evaluate = muscle_evaluate, .instructions = muscle_instructions, .partials = own_partials,                   \
        .ranks = &(const flesh_effect_ranks){.restrict_to_part = muscle_restrict}},                                   \
  }

static const flesh_effect_partials fast_partials = {.tear = muscle_tear};
static const flesh_effect_operations muscle_operations = OPERATIONS(0, NULL),
                                     fast_muscle_operations = OPERATIONS(FLESH_FREEZES, &fast_partials);

/* Checks that the activation is within 0 to 1, and that the tets belong to the mesh, ascending and without
 * duplicates. */
static int check(const flesh_mesh *mesh, int count, const int *tets, const flesh_amplitude *activation)
{
  for (int k = 0; activation && k < activation->count; k++)
    if (!(activation->points[k].value >= 0 && activation->points[k].value <= 1))
      return flesh_fail(FLESH_ERR_ARGUMENT, "the activation is %g at %g s; it must be from 0 to 1",
                        activation->points[k].value, activation->points[k].t);
  if (tets ? count < 1 && !mesh->split : count != mesh->tets)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a muscle of %d tets; %s %d", count,
                      tets ? "it must have at least" : "the mesh has", tets ? 1 : mesh->tets);
  for (int k = 0; tets && k < count; k++)
    if (tets[k] < 0 || tets[k] >= mesh->tets || (k && tets[k] <= tets[k - 1]))
      return flesh_fail(FLESH_ERR_ARGUMENT, "tets[%d] of a muscle is %d; tets must ascend within 0 to %d", k, tets[k],
                        mesh->tets - 1);
  return FLESH_OK;
}

/* Creates unit directions for all tets of the mesh, [3 * tets], from `fibres` [3 * count] of the chosen ones;
 * directions of 0 stay 0. */
static int take_directions(const flesh_mesh *mesh, int count, const int *tets, const double *fibres, double **directions)
{
  double *all = *directions = flesh_calloc(3 * (size_t)mesh->tets, sizeof *all);
  if (!all) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the fibres of %d tets", count);
  for (int k = 0; k < count; k++) {
    const double *a = fibres + 3 * (size_t)k, length = hypot(hypot(a[0], a[1]), a[2]);
    if (!(length < INFINITY))
      return flesh_fail(FLESH_ERR_ARGUMENT, "the fibre of tet %d is (%g, %g, %g); it must be finite", tets ? tets[k] : k,
                        a[0], a[1], a[2]);
    for (int c = 0; c < 3 && length > 0; c++) all[3 * (size_t)(tets ? tets[k] : k) + (size_t)c] = a[c] / length;
  }
  return FLESH_OK;
}

int flesh_effect_muscle(const flesh_body *body, int count, const int *tets, const double *fibres,
                        const flesh_fibre *fibre, const flesh_amplitude *activation, flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"}, {fibres, "fibres"}, {fibre, "fibre"});
  static const int none = 0;
  muscle *self = flesh_calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a muscle");
  self->body = *body;
  int status = flesh_fibre_constants_of(fibre, &self->fibre);
  if (!status) status = check(body->mesh, count, tets, activation);
  if (!status) status = flesh_amplitude_take(activation, &self->activation);
  self->mesh_tets = body->mesh->tets;
  if (!status) status = take_directions(body->mesh, count, tets, fibres, &self->directions);
  if (!count) tets = &none, count = 1; /* only for a part of a split mesh: a tet without fibres exerts no force */
  if (!status)
    status = flesh_tets_create_fibres(
        body, &(flesh_tets_choice){.count = count, .tets = tets, .directions = self->directions}, &self->tets);
  const int has_speed = self->fibre.max_shortening_velocity > 0;
  return flesh_effect_create_after(status, has_speed ? &fast_muscle_operations : &muscle_operations, body->mesh, self, effect);
}
