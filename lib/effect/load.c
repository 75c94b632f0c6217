/* load.c: dead loads, which keep their direction and size however the body moves: a force on nodes, and a traction per
 * reference area of surface triangles. r_a = -share_a vector(t), V = -sum share_a vector.(x_a - X_a). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/amplitude.h"
#include "effect/effect.h"
#include "effect/face_shares.h"
#include "effect/rank_share.h"
#include "mesh/mesh.h"

typedef struct load {
  int count;
  int *nodes;     /* [count] */
  double *shares; /* [count] of the vector */
  const double *X; /* borrowed from the mesh */
  double vector[3];
  flesh_amplitude_copy amplitude;
} load;

static int load_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const load *self = effect->data;
  double factor = point->load * flesh_amplitude_at(&self->amplitude, point->t);
  if (factor == 0) return FLESH_OK;
  for (int k = 0; k < self->count; k++)
    for (int c = 0; c < 3; c++) r[3 * self->nodes[k] + c] -= factor * self->shares[k] * self->vector[c];
  return FLESH_OK;
}

static int load_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                          double *phi, double *magnitude)
{
  const load *self = effect->data;
  double factor = point->load * flesh_amplitude_at(&self->amplitude, point->t), value = 0, size = 0;
  if (shift->x == 0 || factor == 0) return FLESH_OK;
  for (int k = 0; k < self->count; k++)
    for (int c = 0; c < 3; c++) {
      int d = 3 * self->nodes[k] + c;
      double term = self->shares[k] * self->vector[c] * (point->x[d] - self->X[d]);
      value -= term;
      size += fabs(term);
    }
  *phi += factor * value / shift->x;
  *magnitude += fabs(factor) * size / shift->x;
  return FLESH_OK;
}

static int load_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  double magnitude = 0;
  *energy = 0;
  return load_potential(effect, point, &(flesh_shift){.x = 1}, energy, &magnitude);
}

static double load_next_event(const flesh_effect *effect, double t)
{
  const load *self = effect->data;
  return flesh_amplitude_next_event(&self->amplitude, t);
}

static size_t load_memory(const flesh_effect *effect)
{
  const load *self = effect->data;
  return sizeof *self + (size_t)self->count * (sizeof *self->nodes + sizeof *self->shares) +
         (size_t)self->amplitude.curve.count * sizeof *self->amplitude.curve.keyframes;
}

static void load_destroy(void *data)
{
  load *self = data;
  if (!self) return;
  flesh_free(self->nodes);
  flesh_free(self->shares);
  flesh_amplitude_clear(&self->amplitude);
  flesh_free(self);
}

/* Of each node that the rank owns the whole's share. */
static int load_restrict(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                         flesh_effect **restricted)
{
  const load *from = whole->data;
  const size_t count = (size_t)from->count;
  int *kept = flesh_malloc((count + 1) * sizeof *kept);
  load *self = flesh_calloc(1, sizeof *self);
  int status = FLESH_ERR_MEMORY;
  if (self) {
    self->nodes = flesh_malloc((count + 1) * sizeof *self->nodes);
    self->shares = flesh_malloc((count + 1) * sizeof *self->shares);
    self->X = flesh_mesh_positions(body->mesh);
    memcpy(self->vector, from->vector, sizeof self->vector);
    status = flesh_amplitude_copy_of(&from->amplitude, &self->amplitude);
  }
  if (!status && kept && self->nodes && self->shares) {
    self->count = flesh_rank_share_nodes(part, from->count, from->nodes, kept, self->nodes);
    for (int k = 0; k < self->count; k++) self->shares[k] = from->shares[kept[k]];
    status = flesh_effect_create(whole->operations, body->mesh, self, restricted);
  } else {
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for a load on %d nodes", from->count);
    load_destroy(self);
  }
  flesh_free(kept);
  return status;
}

/* The nodes of a force, of which a part of a split mesh knows its own alone. */
static void force_count(const flesh_effect *restricted, flesh_rank_numbers *numbers)
{
  const load *self = restricted->data;
  numbers->sums[0] = self->count;
}

static void force_take(flesh_effect *restricted, const flesh_rank_numbers *numbers)
{
  load *self = restricted->data;
  for (int k = 0; k < self->count; k++) self->shares[k] = 1. / numbers->sums[0];
}

static const flesh_effect_ranks
    traction_ranks = {.restrict_to_part = load_restrict},
    force_ranks = {.restrict_to_part = load_restrict, .count = force_count, .take = force_take};

static const flesh_effect_operations force_operations = {
    .name = "force",
    .role = FLESH_ROLE_LOAD,
    .residual = load_residual,
    .potential = load_potential,
    .energy = load_energy,
    .destroy = load_destroy,
    .time = &(const flesh_effect_time){.next_event = load_next_event},
    .figures = &(const flesh_effect_figures){.memory = load_memory},
    .ranks = &force_ranks,
};

static const flesh_effect_operations traction_operations = {
    .name = "traction",
    .role = FLESH_ROLE_LOAD,
    .residual = load_residual,
    .potential = load_potential,
    .energy = load_energy,
    .destroy = load_destroy,
    .time = &(const flesh_effect_time){.next_event = load_next_event},
    .figures = &(const flesh_effect_figures){.memory = load_memory},
    .ranks = &traction_ranks,
};

/* With room for `count` nodes, and their numbers where `nodes` is not NULL. */
static int load_create(const flesh_body *body, int count, const int *nodes, const double vector[3],
                       const char *name, const flesh_amplitude *amplitude, load **result)
{
  int total = flesh_mesh_node_count(body->mesh);
  if (!(fabs(vector[0]) + fabs(vector[1]) + fabs(vector[2]) < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s is (%g, %g, %g); it must be finite", name, vector[0], vector[1],
                      vector[2]);
  if (count < 1 && !body->mesh->split) return flesh_fail(FLESH_ERR_ARGUMENT, "a %s needs something that it acts on", name);
  load *self = flesh_calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a load");
  int status = flesh_amplitude_take(amplitude, &self->amplitude);
  self->nodes = flesh_malloc(((size_t)count + 1) * sizeof *self->nodes); /* none here of a part of a split mesh */
  self->shares = flesh_calloc((size_t)count + 1, sizeof *self->shares);
  if (!status && (!self->nodes || !self->shares))
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for a load on %d nodes", count);
  for (int k = 0; !status && nodes && k < count; k++) {
    if (nodes[k] < 0 || nodes[k] >= total)
      status = flesh_fail(FLESH_ERR_ARGUMENT, "node %d is loaded; the mesh has the nodes 0 to %d", nodes[k], total - 1);
    self->nodes[k] = nodes[k];
  }
  if (status) {
    load_destroy(self);
    return status;
  }
  self->count = count;
  self->X = flesh_mesh_positions(body->mesh);
  for (int c = 0; c < 3; c++) self->vector[c] = vector[c];
  *result = self;
  return FLESH_OK;
}

int flesh_effect_force(const flesh_body *body, int count, const int *nodes, const double force[3],
                       const flesh_amplitude *amplitude, flesh_effect **effect)
{
  FLESH_NEED({effect, "effect"});
  *effect = NULL;
  FLESH_NEED({body, "body"}, {nodes, "nodes"}, {force, "force"});
  load *self = NULL;
  int status = load_create(body, count, nodes, force, "force", amplitude, &self);
  if (status) return status;
  for (int k = 0; k < count; k++) self->shares[k] = 1. / count;
  return flesh_effect_create(&force_operations, body->mesh, self, effect);
}

int flesh_effect_traction(const flesh_body *body, int count, const int *triangles, const double traction[3],
                          const flesh_amplitude *amplitude, flesh_effect **effect)
{
  FLESH_NEED({effect, "effect"});
  *effect = NULL;
  FLESH_NEED({body, "body"}, {triangles, "triangles"}, {traction, "traction"});
  int total = flesh_mesh_node_count(body->mesh);
  load *self = NULL;
  double *areas = flesh_calloc((size_t)total, sizeof *areas);
  int *nodes = flesh_calloc((size_t)total, sizeof *nodes), used = 0;
  int status = areas && nodes ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for a traction");
  if (!status) status = flesh_face_shares(body->mesh, count, triangles, areas);
  for (int i = 0; !status && i < total; i++)
    if (areas[i] != 0) nodes[used++] = i;
  if (!status) status = load_create(body, used, nodes, traction, "traction", amplitude, &self);
  for (int k = 0; !status && k < used; k++) self->shares[k] = areas[nodes[k]];
  flesh_free(areas);
  flesh_free(nodes);
  return status ? status : flesh_effect_create(&traction_operations, body->mesh, self, effect);
}
