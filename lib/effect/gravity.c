/* gravity.c: a uniform acceleration on the lumped masses (the exact load of linear tets), or by the exact load of
 * quadratic ones. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "element/body.h"

typedef struct gravity {
  int nodes;
  double acceleration[3];
  double *force; /* [3*nodes] m g */
} gravity;

/* Tasks whose sums are added up one by one, however many threads there are, and sums of each: additions wait for each
 * other. */
enum { TASKS = 32, SUMS = 8 };

typedef struct pull {
  const gravity *gravity;
  const flesh_point *point;
  double *r;
  double values[TASKS], sizes[TASKS]; /* of the potential's terms */
} pull;

static void range(const gravity *self, int task, int *begin, int *end)
{
  const int64_t dofs = 3 * (int64_t)self->nodes;
  *begin = (int)(dofs * task / TASKS);
  *end = (int)(dofs * (task + 1) / TASKS);
}

static void pull_part(void *data, int task)
{
  const pull *p = data;
  int begin, end;
  range(p->gravity, task, &begin, &end);
  for (int d = begin; d < end; d++) p->r[d] -= p->point->load * p->gravity->force[d];
}

static int gravity_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const gravity *self = effect->data;
  flesh_threads_run(point->threads, TASKS, pull_part, &(pull){.gravity = self, .point = point, .r = r});
  return FLESH_OK;
}

static void sum_part(void *data, int task)
{
  pull *p = data;
  double values[SUMS] = {0}, sizes[SUMS] = {0};
  int begin, end;
  range(p->gravity, task, &begin, &end);
  for (; begin < end; begin += SUMS)
    for (int l = 0; l < SUMS && begin + l < end; l++) {
      double term = p->gravity->force[begin + l] * p->point->x[begin + l];
      values[l] += term;
      sizes[l] += fabs(term);
    }
  for (int l = 0; l < SUMS; l++) p->values[task] += values[l], p->sizes[task] += sizes[l];
}

static int gravity_potential(const flesh_effect *effect, const flesh_point *point,
                             const flesh_shift *shift, double *phi, double *magnitude)
{
  if (shift->x == 0) return FLESH_OK;
  pull p = {.gravity = effect->data, .point = point};
  double value = 0, size = 0;
  flesh_threads_run(point->threads, TASKS, sum_part, &p);
  for (int task = 0; task < TASKS; task++) value += p.values[task], size += p.sizes[task];
  *phi -= point->load * value / shift->x;
  *magnitude += point->load * size / shift->x;
  return FLESH_OK;
}

static int gravity_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  double magnitude = 0;
  *energy = 0;
  return gravity_potential(effect, point, &(flesh_shift){.x = 1}, energy, &magnitude);
}

static size_t gravity_memory(const flesh_effect *effect)
{
  const gravity *self = effect->data;
  return sizeof *self + (size_t)self->nodes * 3 * sizeof *self->force;
}

static void gravity_destroy(void *data)
{
  gravity *self = data;
  if (!self) return;
  flesh_free(self->force);
  flesh_free(self);
}

static const flesh_effect_operations gravity_operations = {
    .name = "gravity",
    .role = FLESH_ROLE_LOAD,
    .traits = FLESH_IS_PASSIVE | FLESH_IS_SUM_OVER_TETS,
    .residual = gravity_residual,
    .potential = gravity_potential,
    .energy = gravity_energy,
    .destroy = gravity_destroy,
    .figures = &(const flesh_effect_figures){.memory = gravity_memory},
};

/* M g, so that a free fall is rigid; `work` [3*nodes]. Of linear tets both masses give the same. */
static void weigh(const flesh_body *body, const double acceleration[3], double *work, double *force)
{
  const int nodes = flesh_mesh_node_count(body->mesh);
  if (body->mass == FLESH_MASS_CONSISTENT && flesh_mesh_order(body->mesh) == 2) {
    for (int d = 0; d < 3 * nodes; d++) work[d] = acceleration[d % 3];
    flesh_mesh_consistent_mass_times(body->mesh, body->density, work, force);
    return;
  }
  flesh_mesh_lumped_mass(body->mesh, body->density, work);
  for (int d = 0; d < 3 * nodes; d++) force[d] = work[d / 3] * acceleration[d % 3];
}

int flesh_effect_gravity(const flesh_body *body, const double acceleration[3],
                         flesh_effect **effect)
{
  FLESH_NEED({effect, "effect"});
  *effect = NULL;
  FLESH_NEED({body, "body"}, {acceleration, "acceleration"});
  if (!(fabs(acceleration[0]) + fabs(acceleration[1]) + fabs(acceleration[2]) < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "acceleration is (%g, %g, %g) m/s^2; it must be finite",
                      acceleration[0], acceleration[1], acceleration[2]);
  int nodes = flesh_mesh_node_count(body->mesh), status = flesh_body_check_density(body);
  if (status) return status;
  gravity *self = flesh_calloc(1, sizeof *self);
  double *work = flesh_calloc((size_t)nodes * 3, sizeof *work);
  if (self) self->force = flesh_malloc((size_t)nodes * 3 * sizeof *self->force);
  if (!self || !work || !self->force) {
    flesh_free(work);
    gravity_destroy(self);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the weights of %d nodes", nodes);
  }
  self->nodes = nodes;
  memcpy(self->acceleration, acceleration, sizeof self->acceleration);
  weigh(body, acceleration, work, self->force);
  flesh_free(work);
  return flesh_effect_create(&gravity_operations, body->mesh, self, effect);
}

const double *flesh_effect_acceleration(const flesh_effect *effect)
{
  return effect->operations == &gravity_operations ? ((const gravity *)effect->data)->acceleration : NULL;
}
