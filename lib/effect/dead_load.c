/* dead_load.c: sums over the nodes of a dead load, computed by threads. */
#include "effect/dead_load.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/rank_share.h"

/* Numbers of tasks, and of interleaved partial sums in each, because a single sum would wait for each addition. Both
 * are fixed, so results do not depend on the number of threads. */
enum { TASKS = 32, SUMS = 8 };

typedef struct node_sums {
  const flesh_dead_load *load;
  const double *x;
  double factor, *r;
  double values[TASKS], sizes[TASKS]; /* sums of the terms f.(x - X) and of their magnitudes */
} node_sums;

static double factor_at(const flesh_dead_load *self, const flesh_point *point)
{
  return point->load * flesh_amplitude_at(&self->amplitude, point->t) * self->scale;
}

/* Runs the tasks; with a list serially, because it may repeat a node, which two threads must not write at once. */
static void run(const flesh_point *point, flesh_task *task, node_sums *sums)
{
  flesh_threads_run(sums->load->nodes ? NULL : point->threads, TASKS, task, sums);
}

static void range(const flesh_dead_load *self, int task, int *begin, int *end)
{
  const int64_t dofs = 3 * (int64_t)self->count;
  *begin = (int)(dofs * task / TASKS);
  *end = (int)(dofs * (task + 1) / TASKS);
}

/* Returns the degree of freedom of force[d] in vectors of the mesh. */
static inline size_t place(const flesh_dead_load *self, int d)
{
  return self->nodes ? 3 * (size_t)self->nodes[d / 3] + (size_t)(d % 3) : (size_t)d;
}

static void residual_part(void *data, int task)
{
  const node_sums *s = data;
  int begin, end;
  range(s->load, task, &begin, &end);
  for (int d = begin; d < end; d++) s->r[place(s->load, d)] -= s->factor * s->load->force[d];
}

/* Returns x - X of `count` degrees of freedom from `first` on, computed in `copy`; without a list, x itself. */
static inline const double *moves(const node_sums *s, int first, int count, double *copy)
{
  const flesh_dead_load *load = s->load;
  if (!load->nodes) return s->x + first;
  for (int l = 0; l < count; l++) {
    const size_t at = place(load, first + l);
    copy[l] = s->x[at] - load->X[at];
  }
  return copy;
}

static void potential_part(void *data, int task)
{
  node_sums *s = data;
  double values[SUMS] = {0}, sizes[SUMS] = {0}, copy[SUMS];
  int begin, end;
  range(s->load, task, &begin, &end);
  for (; begin < end; begin += SUMS) {
    const int count = end - begin < SUMS ? end - begin : SUMS;
    const double *move = moves(s, begin, count, copy);
    for (int l = 0; l < count; l++) {
      const double term = s->load->force[begin + l] * move[l];
      values[l] += term;
      sizes[l] += fabs(term);
    }
  }
  for (int l = 0; l < SUMS; l++) s->values[task] += values[l], s->sizes[task] += sizes[l];
}

int flesh_dead_load_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  node_sums sums = {.load = effect->data, .factor = factor_at(effect->data, point), .r = r};
  if (sums.factor != 0) run(point, residual_part, &sums);
  return FLESH_OK;
}

int flesh_dead_load_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                              double *phi, double *magnitude)
{
  const double factor = factor_at(effect->data, point);
  node_sums sums = {.load = effect->data, .x = point->x};
  double value = 0, size = 0;
  if (shift->x == 0 || factor == 0) return FLESH_OK;
  run(point, potential_part, &sums);
  for (int task = 0; task < TASKS; task++) value += sums.values[task], size += sums.sizes[task];
  *phi -= factor * value / shift->x;
  *magnitude += fabs(factor) * size / shift->x;
  return FLESH_OK;
}

int flesh_dead_load_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  double magnitude = 0;
  *energy = 0;
  return flesh_dead_load_potential(effect, point, &(flesh_shift){.x = 1}, energy, &magnitude);
}

static double next_event(const flesh_effect *effect, double t)
{
  const flesh_dead_load *self = effect->data;
  return flesh_amplitude_next_event(&self->amplitude, t);
}

static size_t memory(const flesh_effect *effect)
{
  const flesh_dead_load *self = effect->data;
  return sizeof *self + (size_t)self->count * (3 * sizeof *self->force + (self->nodes ? sizeof *self->nodes : 0)) +
         flesh_amplitude_memory(&self->amplitude);
}

void flesh_dead_load_destroy(void *data)
{
  flesh_dead_load *self = data;
  if (!self) return;
  flesh_free(self->nodes);
  flesh_free(self->force);
  flesh_amplitude_clear(&self->amplitude);
  flesh_free(self);
}

int flesh_dead_load_create(const char *name, const char *unit, const double vector[3], int count,
                           const flesh_amplitude *amplitude, flesh_dead_load **load)
{
  if (!(fabs(vector[0]) + fabs(vector[1]) + fabs(vector[2]) < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s is (%g, %g, %g) %s; it must be finite", name, vector[0], vector[1],
                      vector[2], unit);
  flesh_dead_load *self = *load = flesh_calloc(1, sizeof *self);
  int status = self ? flesh_amplitude_take(amplitude, &self->amplitude) : FLESH_OK;
  if (self) self->force = flesh_calloc(3 * (size_t)count + 1, sizeof *self->force);
  if (!status && (!self || !self->force)) status = flesh_fail(FLESH_ERR_MEMORY, "no memory for a load on %d nodes", count);
  if (status) {
    flesh_dead_load_destroy(self);
    return status;
  }
  self->count = count;
  self->scale = 1;
  memcpy(self->vector, vector, sizeof self->vector);
  return FLESH_OK;
}

/* Restricts the load to the nodes that the rank owns, with their forces. */
static int restrict_to_part(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                            flesh_effect **restricted)
{
  const flesh_dead_load *from = whole->data;
  const size_t count = (size_t)from->count + 1;
  int *kept = flesh_malloc(count * sizeof *kept), status = FLESH_OK;
  flesh_dead_load *self = flesh_malloc(sizeof *self);
  if (self) {
    *self = *from;
    self->X = flesh_mesh_positions(body->mesh);
    self->nodes = flesh_malloc(count * sizeof *self->nodes);
    self->force = flesh_malloc(3 * count * sizeof *self->force);
    status = flesh_amplitude_copy_of(&from->amplitude, &self->amplitude);
  }
  if (!status && (!kept || !self || !self->nodes || !self->force))
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for a load on %d nodes", from->count);
  if (!status) {
    self->count = flesh_rank_share_nodes(part, from->count, from->nodes, kept, self->nodes);
    for (int d = 0; d < 3 * self->count; d++) self->force[d] = from->force[3 * kept[d / 3] + d % 3];
    status = flesh_effect_create(whole->operations, body->mesh, self, restricted);
  } else {
    flesh_dead_load_destroy(self);
  }
  flesh_free(kept);
  return status;
}

/* Counts the nodes that share a force, because a part of a split mesh knows only its own. */
static void count_nodes(const flesh_effect *restricted, flesh_rank_numbers *numbers)
{
  const flesh_dead_load *self = restricted->data;
  numbers->sums[0] = self->is_shared ? self->count : 0;
}

static void take_nodes(flesh_effect *restricted, const flesh_rank_numbers *numbers)
{
  flesh_dead_load *self = restricted->data;
  if (numbers->sums[0] > 0) self->scale = 1 / numbers->sums[0];
}

const flesh_effect_time flesh_dead_load_time = {.next_event = next_event};
const flesh_effect_figures flesh_dead_load_figures = {.memory = memory};
const flesh_effect_private flesh_dead_load_private = {
    .ranks = &(const flesh_effect_ranks){.restrict_to_part = restrict_to_part, .count = count_nodes, .take = take_nodes}};
