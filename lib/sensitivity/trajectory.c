/* trajectory.c: records the steps of an integrator, and makes their stages again. */
#include "sensitivity/trajectory.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "effect/private.h"
#include "system/parts.h"

static void clear_part(flesh_recorded_part *part)
{
  for (int k = 0; k < FLESH_KNOWN; k++) flesh_free(part->known[k]);
  for (int k = 0; k < part->count; k++) {
    flesh_free(part->solves[k].u);
    flesh_free(part->solves[k].multipliers);
  }
  flesh_free(part->solves);
  flesh_free(part->internal);
  memset(part, 0, sizeof *part);
}

/* A copy of numbers; NULL where there is no memory, or nothing to copy. */
static double *copy_of(const double *from, int count)
{
  double *to = from && count ? flesh_malloc((size_t)count * sizeof *to) : NULL;
  if (to) memcpy(to, from, (size_t)count * sizeof *to);
  return to;
}

static int fail_memory(const flesh_trajectory *self)
{
  return flesh_fail(FLESH_ERR_MEMORY, "no memory to record %d parts of steps of %d unknowns", self->count + 1, self->n);
}

static void try_part(void *data)
{
  flesh_trajectory *self = data;
  clear_part(&self->next);
}

static int solved(void *data, const flesh_stage *stage, int at, const double *u)
{
  flesh_trajectory *self = data;
  const int multipliers = self->tangent.multipliers;
  flesh_recorded_part *part = &self->next;
  flesh_recorded_solve *solves = flesh_realloc(part->solves, ((size_t)part->count + 1) * sizeof *solves);
  if (!solves) return fail_memory(self);
  part->solves = solves;
  flesh_recorded_solve *solve = &solves[part->count];
  *solve = (flesh_recorded_solve){.stage = *stage, .at = at, .has_v0 = stage->v0 != NULL, .u = copy_of(u, self->n),
                                  .multipliers = copy_of(stage->multipliers, multipliers)};
  part->count++;
  return solve->u && (!multipliers || solve->multipliers) ? FLESH_OK : fail_memory(self);
}

/* Refuses internal variables that change, but for what breaks, and that stays broken. */
static int check_internal(const flesh_trajectory *self, const flesh_recorded_part *before, const double *internal)
{
  for (int e = 0; e < flesh_system_effect_count(self->system) && before->internal; e++) {
    const flesh_effect *effect = flesh_system_effect(self->system, e);
    const int first = self->system->entries[e].internal,
              last = e + 1 < self->system->entry_count ? self->system->entries[e + 1].internal : self->system->internal_count;
    if (flesh_effect_private_of(effect)->bonds || last <= first) continue;
    if (memcmp(before->internal + first, internal + first, (size_t)(last - first) * sizeof *internal) != 0)
      return flesh_fail(FLESH_ERR_ARGUMENT, "the internal variables of effect %s change, of which sensitivities know no "
                                            "derivative", effect->operations->name);
  }
  return FLESH_OK;
}

/* Checks what has no sensitivities. */
static int check_part(const flesh_trajectory *self, const flesh_taken_part *taken)
{
  const flesh_recorded_part *next = &self->next;
  if (self->tape.untangled)
    return flesh_fail(FLESH_ERR_ARGUMENT, "before t = %g s a tangle was removed, by what is no step and has no sensitivities",
                      taken->begin);
  for (int k = 0; k < next->count && self->tangent.multipliers; k++)
    if (next->solves[k].stage.shift.x != 1)
      return flesh_fail(FLESH_ERR_ARGUMENT, "incompressible tets (poisson 0.5) have sensitivities by methods that balance at the "
                                            "end of a step: backward-euler, newmark, runge-kutta");
  return self->count && taken->from->internal ? check_internal(self, &self->parts[self->count - 1], taken->from->internal)
                                              : FLESH_OK;
}

static int taken(void *data, const flesh_taken_part *taken)
{
  flesh_trajectory *self = data;
  flesh_recorded_part *part = &self->next;
  const flesh_method_row *row = self->integrator->row;
  int status = check_part(self, taken);
  if (status) return status;
  if (self->count == self->room) {
    const int room = 2 * self->room + 64;
    flesh_recorded_part *parts = flesh_realloc(self->parts, (size_t)room * sizeof *parts);
    if (!parts) return fail_memory(self);
    self->parts = parts;
    self->room = room;
  }
  part->taken = *taken;
  part->memory = *taken->memory;
  part->vectors = row->remembered ? row->remembered : row->vectors;
  part->t = taken->from->t;
  part->t_lag = taken->lagged->t;
  part->known[FLESH_KNOWN_X] = copy_of(taken->from->x, self->n);
  part->known[FLESH_KNOWN_V] = copy_of(taken->from->v, self->n);
  int lacks = !part->known[FLESH_KNOWN_X] || !part->known[FLESH_KNOWN_V];
  for (int k = 0; k < part->vectors; k++)
    lacks |= !(part->known[FLESH_KNOWN_VECTORS + k] = copy_of(taken->memory->vectors[k], self->n));
  if (taken->lagged != taken->from) {
    part->known[FLESH_KNOWN_LAGGED_X] = copy_of(taken->lagged->x, self->n);
    part->known[FLESH_KNOWN_LAGGED_V] = copy_of(taken->lagged->v, self->n);
    lacks |= !part->known[FLESH_KNOWN_LAGGED_X] || !part->known[FLESH_KNOWN_LAGGED_V];
  }
  if (taken->from->internal_count) lacks |= !(part->internal = copy_of(taken->from->internal, taken->from->internal_count));
  if (lacks) return fail_memory(self);
  self->parts[self->count++] = *part;
  memset(part, 0, sizeof *part);
  return FLESH_OK;
}

static void gone(void *data) { ((flesh_trajectory *)data)->integrator = NULL; }

int flesh_trajectory_create(flesh_integrator *integrator, double tolerance, flesh_trajectory **trajectory)
{
  FLESH_NEED({trajectory, "trajectory"});
  *trajectory = NULL;
  FLESH_NEED({integrator, "integrator"});
  if (!(tolerance >= 1e-13 && tolerance < 1))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the tolerance of sensitivities is %g; it must be in [1e-13, 1)", tolerance);
  if (integrator->ida)
    return flesh_fail(FLESH_ERR_ARGUMENT, "ida has no sensitivities: take a method of fixed steps, or runge-kutta");
  if (integrator->method == FLESH_METHOD_STATIC)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a sequence of equilibria is no motion: flesh_sensitivity has derivatives of each");
  if (integrator->tape) return flesh_fail(FLESH_ERR_ARGUMENT, "another trajectory records this integrator's steps");
  flesh_trajectory *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a trajectory");
  self->system = integrator->evaluation->system;
  self->n = flesh_system_unknowns(self->system);
  self->tape = (flesh_tape){.data = self, .try_part = try_part, .solved = solved, .taken = taken, .gone = gone};
  int status = flesh_stage_tangent_create(self->system, &integrator->options, tolerance, &self->tangent);
  if (!status) status = flesh_prescribed_create(self->system, &self->prescribed);
  if (!status) {
    self->vectors = flesh_calloc((5 + 3 * (size_t)FLESH_MAP_COLUMNS) * (size_t)self->n + 1, sizeof *self->vectors);
    if (!self->vectors) status = fail_memory(self);
  }
  self->integrator = integrator;
  if (status) {
    self->integrator = NULL;
    flesh_trajectory_destroy(&self);
    return status;
  }
  integrator->tape = &self->tape;
  *trajectory = self;
  return FLESH_OK;
}

void flesh_trajectory_destroy(flesh_trajectory **trajectory)
{
  if (!trajectory || !*trajectory) return;
  flesh_trajectory *self = *trajectory;
  if (self->integrator) self->integrator->tape = NULL;
  for (int k = 0; k < self->count; k++) clear_part(&self->parts[k]);
  clear_part(&self->next);
  flesh_free(self->parts);
  flesh_stage_tangent_clear(&self->tangent);
  flesh_prescribed_clear(&self->prescribed);
  flesh_free(self->vectors);
  free(self);
  *trajectory = NULL;
}

void flesh_trajectory_map(const flesh_recorded_part *part, flesh_method_map *map)
{
  const int takes_over = !part->taken.own && part->taken.acceleration;
  flesh_method_map_find(part->taken.row, &part->memory, part->vectors, part->taken.h, takes_over, map);
}

/* y = the sum of what is known, and of the unknowns of earlier stages, by their last solves. */
static void combine(const flesh_recorded_part *part, const double columns[FLESH_MAP_COLUMNS], int solve, int n, double *y)
{
  memset(y, 0, (size_t)n * sizeof *y);
  for (int k = 0; k < FLESH_KNOWN; k++)
    for (int d = 0; d < n && columns[k] != 0 && part->known[k]; d++) y[d] += columns[k] * part->known[k][d];
  for (int s = 0; s < solve; s++) {
    const int at = part->solves[s].at, last = part->solves[s + 1].at != at; /* there is one after it */
    const double weight = columns[FLESH_KNOWN + at];
    for (int d = 0; d < n && last && weight != 0; d++) y[d] += weight * part->solves[s].u[d];
  }
}

/* The stage of a solve with its bases x0, v0 and a0, which go to `bases` [n] each. */
static void find_bases(flesh_trajectory *self, const flesh_recorded_part *part, const flesh_method_map *map, int solve,
                       double *const bases[3], flesh_stage *stage)
{
  double *x0 = bases[0], *v0 = bases[1], *a0 = bases[2];
  const flesh_recorded_solve *recorded = &part->solves[solve];
  *stage = recorded->stage;
  combine(part, map->x0[recorded->at], solve, self->n, x0);
  combine(part, map->v0[recorded->at], solve, self->n, v0);
  combine(part, map->a0[recorded->at], solve, self->n, a0);
  stage->x0 = x0;
  stage->v0 = recorded->has_v0 ? v0 : NULL;
  stage->a0 = a0;
  if (!part->taken.second || !part->taken.own) return;
  flesh_prescribed_set(&self->prescribed, part->taken.begin, part->taken.end, part->known[FLESH_KNOWN_X]);
  flesh_prescribed_stage(&self->prescribed, stage, v0, a0);
}

/* The lagged state of a solve: where the solve before it has ended, of its own stage or of the one before, or that of the
 * part. Overwrites a0 [n]. */
static void find_lagged(flesh_trajectory *self, const flesh_recorded_part *part, const flesh_method_map *map, int solve,
                        double *x_lag, double *v_lag, double *a0)
{
  const int lags_stage = part->known[FLESH_KNOWN_LAGGED_X] != NULL;
  const size_t bytes = (size_t)self->n * sizeof *x_lag;
  flesh_stage before;
  if (solve == 0) {
    memcpy(x_lag, part->known[lags_stage ? FLESH_KNOWN_LAGGED_X : FLESH_KNOWN_X], bytes);
    memcpy(v_lag, part->known[lags_stage ? FLESH_KNOWN_LAGGED_V : FLESH_KNOWN_V], bytes);
    return;
  }
  const double *u = part->solves[solve - 1].u;
  find_bases(self, part, map, solve - 1, (double *const[]){x_lag, v_lag, a0}, &before);
  if (!before.v0) memset(v_lag, 0, bytes);
  for (int d = 0; d < self->n; d++) {
    x_lag[d] += before.shift.x * u[d];
    v_lag[d] += before.shift.v * u[d];
  }
}

void flesh_trajectory_stage(flesh_trajectory *self, const flesh_recorded_part *part, const flesh_method_map *map, int solve,
                            double *room, flesh_stage *stage)
{
  const size_t n = (size_t)self->n;
  double *const bases[] = {room, room + n, room + 2 * n}, *x_lag = room + 3 * n, *v_lag = room + 4 * n;
  find_lagged(self, part, map, solve, x_lag, v_lag, bases[2]);
  find_bases(self, part, map, solve, bases, stage);
  stage->x_lag = x_lag;
  stage->v_lag = v_lag;
  stage->x_from = NULL;
  stage->multipliers = part->solves[solve].multipliers;
  stage->internal = part->internal;
}
