/* surface_contact.c: contact of bodies with each other or themselves: forces of a barrier between their surfaces, and
 * lagged friction. */
#include "effect/surface_contact.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "effect/effect.h"
#include "effect/environment.h"
#include "linear/block_matrix.h"

typedef flesh_surface_contact contact;
typedef flesh_surface_near near;

/* Gets the contact cache of the run, or a new one for this call, and updates its pairs to the point. */
static int open_near(const flesh_effect *effect, const flesh_point *point, int with_friction, near **self, int *own)
{
  int status = flesh_surface_near_of(effect, point, self, own);
  if (!status && with_friction) status = flesh_surface_near_update_friction(*self, point);
  if (!status) status = flesh_surface_near_update_pairs(*self, point->x);
  return status;
}

static int close_near(near *self, int own, int status)
{
  if (own) flesh_surface_near_destroy(self);
  return status;
}

int flesh_surface_contact_evaluate(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                                    double *r, double *phi, double *magnitude)
{
  near *self;
  int own;
  double energy = 0, size = 0;
  int status = open_near(effect, point, 1, &self, &own);
  if (!status)
    status = flesh_contact_set_evaluate(&self->set, point->x, point->threads, phi ? &energy : NULL, phi ? &size : NULL, r);
  if (status) return close_near(self, own, status);
  const double seated = flesh_surface_seats_evaluate(self, point->x, r);
  energy += seated;
  size += seated;
  if (phi && shift->x != 0) {
    *phi += energy / shift->x;
    *magnitude += fabs(size / shift->x);
  }
  if (self->contact->friction > 0)
    flesh_contact_friction_evaluate(&self->friction,
                                    &(flesh_contact_motion){point->x, point->lagged.x, point->v, shift ? shift->x : 0,
                                                            shift ? shift->v : 0}, phi, magnitude, r);
  return close_near(self, own, FLESH_OK);
}

static int surface_contact_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  return flesh_surface_contact_evaluate(effect, point, NULL, r, NULL, NULL);
}

static int surface_contact_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                                     double *phi, double *magnitude)
{
  return shift->x != 0 || shift->v != 0 ? flesh_surface_contact_evaluate(effect, point, shift, NULL, phi, magnitude)
                                        : FLESH_OK;
}

static int surface_contact_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  near *self;
  int own;
  *energy = 0;
  int status = open_near(effect, point, 0, &self, &own);
  if (!status) status = flesh_contact_set_evaluate(&self->set, point->x, point->threads, energy, NULL, NULL);
  if (!status) *energy += flesh_surface_seats_evaluate(self, point->x, NULL);
  return close_near(self, own, status);
}

/* Adds H [12*12] of `count` nodes to K. Blocks missing in K's pattern are skipped, which only happens if a matrix is
 * evaluated without a run (see `covers`). */
static void add_blocks(flesh_block_matrix *K, int count, const int *nodes, const double *H)
{
  for (int a = 0; a < count; a++)
    for (int b = 0; b < count; b++) {
      if (nodes[a] > nodes[b]) continue;
      const int block = a == b ? K->row_start[nodes[a]] : flesh_block_find(K, nodes[a], nodes[b]);
      if (block < 0) continue;
      double *values = K->values + 9 * (size_t)block;
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) values[3 * i + j] += H[12 * (3 * a + i) + 3 * b + j];
    }
}

static int surface_contact_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                                    flesh_block_matrix *K, const int *slots)
{
  near *self;
  int own;
  (void)slots;
  const int has_friction = ((const contact *)effect->data)->friction > 0 && shift->v != 0;
  if (shift->x == 0 && !has_friction) return FLESH_OK;
  int status = open_near(effect, point, 1, &self, &own);
  const int matrix = status ? 0 : flesh_surface_near_expect(self, point);
  if (!status && shift->x != 0 && !(status = flesh_surface_near_reserve(self, self->set.count))) {
    flesh_contact_set_hessians(&self->set, point->x, shift->x, shift->filter, point->threads, self->hessians);
    for (int k = 0; k < self->set.count; k++) {
      const flesh_contact_pair *pair = &self->set.pairs[k];
      if (!flesh_contact_set_owns(&self->set, pair)) continue;
      add_blocks(K, flesh_contact_kind_nodes(pair->kind), pair->nodes, self->hessians + 144 * (size_t)k);
    }
  }
  if (!status && shift->x != 0)
    for (int k = 0; k < self->seat_count; k++) {
      double H[144];
      flesh_contact_seat_hessian(&self->seats[k], point->x, shift->filter, H);
      for (int e = 0; e < 144; e++) H[e] *= shift->x;
      add_blocks(K, 4, self->seats[k].nodes, H);
    }
  const int friction_pairs = self && has_friction ? self->friction.count : 0;
  if (!status && friction_pairs && !(status = flesh_surface_near_reserve(self, friction_pairs))) {
    flesh_contact_friction_hessians(&self->friction, point->v, shift->v, matrix, self->hessians);
    for (int k = 0; k < friction_pairs; k++)
      add_blocks(K, 4, self->friction.pairs[k].nodes, self->hessians + 144 * (size_t)k);
  }
  return close_near(self, own, status);
}

int flesh_surface_contact_couple(const flesh_effect *effect, const flesh_point *point, flesh_argument argument,
                                 flesh_block_add add, void *to)
{
  const contact *contact = effect->data;
  const flesh_contact_friction friction = {.coefficient = contact->friction, .slip_speed = contact->slip_speed};
  near *self;
  int own;
  if (argument != FLESH_LAGGED_X || !(friction.coefficient > 0)) return FLESH_OK;
  int status = flesh_surface_near_of(effect, point, &self, &own);
  if (!status) status = flesh_surface_near_update_pairs(self, point->lagged.x);
  if (!status) status = flesh_contact_friction_turn(&friction, &self->set, point->lagged.x, point->v, add, to);
  return close_near(self, own, status);
}

static const char *const report_names[] = {"gap", "pairs", "force", NULL},
                  *const separating_names[] = {"gap", "pairs", "force", "ignored", NULL};

/* Reports the least distance between surfaces (at most the thickness), the number of pairs of features within it, half
 * of the sum of the magnitudes of the nodes' forces (each force acts twice) and, for an effect that separates, the
 * number of ignored pairs of patches. */
static void surface_contact_report(const flesh_effect *effect, const flesh_point *point, double *values)
{
  const contact *contact = effect->data;
  const size_t n = 3 * (size_t)flesh_mesh_node_count(contact->mesh);
  near *self;
  int own;
  values[0] = contact->law.thickness;
  values[1] = values[2] = 0;
  if (contact->separates) values[3] = 0;
  double *r = calloc(n + 1, sizeof *r);
  int status = open_near(effect, point, 0, &self, &own);
  if (!status && r && !flesh_contact_set_evaluate(&self->set, point->x, point->threads, NULL, NULL, r)) {
    values[0] = fmin(values[0], self->set.distance);
    values[1] = self->set.count;
    flesh_surface_seats_evaluate(self, point->x, r);
    for (size_t d = 0; d < n; d += 3) values[2] += sqrt(r[d] * r[d] + r[d + 1] * r[d + 1] + r[d + 2] * r[d + 2]) / 2;
  }
  if (!status && contact->separates) values[3] = self->patches.pair_count;
  free(r);
  close_near(self, own, status);
}

static int surface_contact_variables(const flesh_effect *effect)
{
  const contact *self = effect->data;
  return self->adaptive + (self->bonds ? self->bonds->variables : 0);
}

static int surface_contact_update(const flesh_effect *effect, const flesh_point *point, double *internal, int *changed)
{
  const contact *contact = effect->data;
  near *self;
  int own;
  if (flesh_surface_contact_release(contact, point, internal)) *changed = 1;
  if (!contact->adaptive || flesh_environment_of(point)->within_step) return FLESH_OK;
  const int status = open_near(effect, point, 0, &self, &own);
  if (!status && flesh_surface_near_adapt(self, point->x, internal)) *changed = 1;
  return close_near(self, own, status);
}

static void surface_contact_tell(const flesh_effect *effect, const double *internal, size_t size, char *text)
{
  const contact *self = effect->data;
  if (!self->adaptive) *text = 0;
  else
    snprintf(text, size, "the stiffness was %.3g Pa at first and is %.3g Pa", self->law.stiffness,
             self->law.stiffness * exp(internal[0]));
}

static size_t surface_contact_memory(const flesh_effect *effect)
{
  const contact *self = effect->data;
  return sizeof *self + flesh_contact_surface_memory(&self->surface) +
         (size_t)self->surface.body_count * (size_t)self->surface.body_count +
         flesh_near_bonds_memory(self->bonds, self->surface.node_count, self->surface.edge_count);
}

static void surface_contact_destroy(void *data)
{
  contact *self = data;
  if (!self) return;
  flesh_contact_surface_clear(&self->surface);
  free(self->may_meet);
  if (self->owns_bonds) flesh_near_bonds_destroy((flesh_near_bonds *)self->bonds);
  free(self);
}

#define TABLE(names, barrier_, library_)                                                                                \
  {                                                                                                                     \
      .name = "contact",                                                                                                \
      .role = FLESH_ROLE_CONTACT,                                                                                       \
      .traits = FLESH_IS_PASSIVE,                                                                                       \
      .residual = surface_contact_residual,                                                                             \
      .jacobian = surface_contact_jacobian,                                                                             \
      .potential = surface_contact_potential,                                                                           \
      .energy = surface_contact_energy,                                                                                 \
      .destroy = surface_contact_destroy,                                                                               \
      .barrier = &(barrier_),                                                                                           \
      .figures = &(const flesh_effect_figures){.report_names = (names), .report = surface_contact_report,               \
                                               .memory = surface_contact_memory},                                       \
      .internal = &(const flesh_effect_internal){.count = surface_contact_variables, .update = surface_contact_update,  \
                                                 .tell = surface_contact_tell},                                         \
      .library = &(library_),                                                                                           \
  }
const flesh_effect_operations flesh_surface_contact_operations = TABLE(report_names, flesh_surface_contact_barrier,
                                                                       flesh_surface_contact_private),
                              flesh_separating_contact_operations = TABLE(separating_names,
                                                                          flesh_separating_contact_barrier,
                                                                          flesh_separating_contact_private);
#undef TABLE
