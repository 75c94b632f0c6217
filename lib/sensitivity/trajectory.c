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

void flesh_trajectory_forget(flesh_trajectory *self, int first)
{
  const int gone = first - self->first;
  if (gone <= 0) return;
  for (int k = 0; k < gone; k++) {
    self->kept -= self->parts[k].bytes;
    clear_part(&self->parts[k]);
  }
  self->count -= gone;
  self->first = first;
  memmove(self->parts, self->parts + gone, (size_t)self->count * sizeof *self->parts);
}

void flesh_trajectory_count(flesh_trajectory *self)
{
  const size_t bytes = self->kept + self->checkpoints.bytes + (size_t)self->call_count * sizeof *self->calls;
  if (bytes > self->most) self->most = bytes;
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
static int check_internal(const flesh_trajectory *self, const double *internal)
{
  for (int e = 0; e < flesh_system_effect_count(self->system); e++) {
    const flesh_effect *effect = flesh_system_effect(self->system, e);
    const int first = self->system->entries[e].internal,
              last = e + 1 < self->system->entry_count ? self->system->entries[e + 1].internal : self->system->internal_count;
    if (flesh_effect_private_of(effect)->bonds || last <= first) continue;
    if (memcmp(self->internal + first, internal + first, (size_t)(last - first) * sizeof *internal) != 0)
      return flesh_fail(FLESH_ERR_ARGUMENT, "the internal variables of effect %s change, of which sensitivities know no "
                                            "derivative", effect->operations->name);
  }
  return FLESH_OK;
}

/* Checks what has no sensitivities. */
static int check_part(const flesh_trajectory *self, const flesh_taken_part *taken)
{
  if (self->tape.untangled)
    return flesh_fail(FLESH_ERR_ARGUMENT, "before t = %g s a tangle was removed, by what is no step and has no sensitivities",
                      taken->begin);
  return self->total && self->internal ? check_internal(self, taken->from->internal) : FLESH_OK;
}

/* Whether a stage of the part reads the method's vector. */
static int is_read(const flesh_taken_part *taken, const flesh_method_map *map, int vector)
{
  const int column = FLESH_KNOWN_VECTORS + vector;
  int read = vector == 0 && taken->acceleration;
  for (int s = 0; s < map->stages; s++) read |= map->x0[s][column] != 0 || map->v0[s][column] != 0 || map->a0[s][column] != 0;
  return read;
}

/* A copy of what is known to a part; counts its bytes. */
static int copy_known(const flesh_trajectory *self, flesh_recorded_part *part, int k, const double *from)
{
  part->known[k] = copy_of(from, self->n);
  part->bytes += (size_t)self->n * sizeof *from;
  return part->known[k] ? FLESH_OK : fail_memory(self);
}

/* Remembers where the part begins. */
static int take_known(flesh_trajectory *self, const flesh_taken_part *taken, flesh_recorded_part *part)
{
  flesh_method_map map;
  flesh_trajectory_map(part, &map);
  int status = copy_known(self, part, FLESH_KNOWN_X, taken->from->x);
  if (!status) status = copy_known(self, part, FLESH_KNOWN_V, taken->from->v);
  for (int k = 0; k < part->vectors && !status; k++)
    if (is_read(taken, &map, k)) status = copy_known(self, part, FLESH_KNOWN_VECTORS + k, taken->memory->vectors[k]);
  if (status || taken->lagged == taken->from) return status;
  status = copy_known(self, part, FLESH_KNOWN_LAGGED_X, taken->lagged->x);
  return status ? status : copy_known(self, part, FLESH_KNOWN_LAGGED_V, taken->lagged->v);
}

/* Room for one more part. */
static int make_room(flesh_trajectory *self)
{
  const int room = 2 * self->room + 64;
  if (self->count < self->room) return FLESH_OK;
  flesh_recorded_part *parts = flesh_realloc(self->parts, (size_t)room * sizeof *parts);
  if (!parts) return fail_memory(self);
  self->parts = parts;
  self->room = room;
  return FLESH_OK;
}

/* Parts in a block: as many as take some 16 states, from 2 to 8. Fewer take more checkpoints, more forget less often. */
static int choose_block(const flesh_trajectory *self, size_t part)
{
  const size_t parts = 16 * flesh_trajectory_state(self) / part;
  return parts < 2 ? 2 : parts > 8 ? 8 : (int)parts;
}

static int taken(void *data, const flesh_taken_part *taken)
{
  flesh_trajectory *self = data;
  flesh_recorded_part *part = &self->next;
  const flesh_method_row *row = self->integrator->row;
  const size_t internals = (size_t)taken->from->internal_count * sizeof(double);
  int status = self->now.limit < 0 ? check_part(self, taken) : FLESH_OK;
  if (!status) status = make_room(self);
  if (status) return status;
  part->taken = *taken;
  part->memory = *taken->memory;
  part->vectors = row->remembered ? row->remembered : row->vectors;
  part->t = taken->from->t;
  part->t_lag = taken->lagged->t;
  const size_t numbers = (size_t)self->n + (size_t)self->tangent.multipliers;
  part->bytes = sizeof *part + internals + (size_t)part->count * (sizeof *part->solves + numbers * sizeof(double));
  status = take_known(self, taken, part);
  if (!status && internals && !(part->internal = copy_of(taken->from->internal, taken->from->internal_count)))
    status = fail_memory(self);
  if (status) return status;
  if (internals) memcpy(self->internal, taken->from->internal, internals);
  if (!self->block_parts) self->block_parts = choose_block(self, part->bytes);
  self->now.at++;
  self->now.bytes += part->bytes;
  self->kept += part->bytes;
  if (self->now.limit < 0) self->total++;
  else self->repeated++;
  self->parts[self->count++] = *part;
  memset(part, 0, sizeof *part);
  flesh_trajectory_count(self);
  return FLESH_OK;
}

static int moved(void *data)
{
  const flesh_trajectory *self = data;
  if (!self->total) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "the state is not that which the last step has led to, so that the steps that are "
                                        "recorded do not follow each other");
}

static void gone(void *data) { ((flesh_trajectory *)data)->integrator = NULL; }

int flesh_trajectory_create(flesh_integrator *integrator, double tolerance, int states, flesh_trajectory **trajectory)
{
  FLESH_NEED({trajectory, "trajectory"});
  *trajectory = NULL;
  FLESH_NEED({integrator, "integrator"});
  if (!(tolerance >= 1e-13 && tolerance < 1))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the tolerance of sensitivities is %g; it must be in [1e-13, 1)", tolerance);
  if (states < 10)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the states to be kept for sensitivities are %d; they must be at least 10", states);
  if (integrator->ida)
    return flesh_fail(FLESH_ERR_ARGUMENT, "ida has no sensitivities: take a method of fixed steps, or runge-kutta");
  if (integrator->method == FLESH_METHOD_STATIC)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a sequence of equilibria is no motion: flesh_sensitivity has derivatives of each");
  /* Other methods balance within the step, or begin with an acceleration that is the solution of two more stages. */
  if (flesh_system_multiplier_count(integrator->evaluation->system) && integrator->method != FLESH_METHOD_BACKWARD_EULER)
    return flesh_fail(FLESH_ERR_ARGUMENT, "motions of incompressible tets (poisson 0.5) have sensitivities by backward-euler "
                                          "only: take that, or poisson: 0.4999");
  if (integrator->tape) return flesh_fail(FLESH_ERR_ARGUMENT, "another trajectory records this integrator's steps");
  flesh_trajectory *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a trajectory");
  self->system = integrator->evaluation->system;
  self->n = flesh_system_unknowns(self->system);
  self->budget = (size_t)states * flesh_trajectory_state(self);
  self->now = (flesh_pass){.call = -1, .block = -1, .limit = -1};
  self->tape = (flesh_tape){.data = self, .try_part = try_part, .solved = solved, .taken = taken,
                            .pass = flesh_trajectory_pass, .moved = moved, .gone = gone};
  int status = flesh_stage_tangent_create(self->system, &integrator->options, tolerance, &self->tangent);
  if (!status) status = flesh_prescribed_create(self->system, &self->prescribed);
  if (!status) {
    const int internals = flesh_system_internal_count(self->system);
    self->internal = flesh_calloc((size_t)internals + 1, sizeof *self->internal);
    self->vectors = flesh_calloc((5 + 3 * (size_t)FLESH_MAP_COLUMNS) * (size_t)self->n + 1, sizeof *self->vectors);
    if (!self->vectors || !self->internal) status = fail_memory(self);
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
  flesh_trajectory_forget(self, self->first + self->count);
  clear_part(&self->next);
  flesh_checkpoints_clear(&self->checkpoints);
  flesh_free(self->parts);
  flesh_free(self->calls);
  flesh_free(self->internal);
  flesh_free(self->aside);
  flesh_stage_tangent_clear(&self->tangent);
  flesh_prescribed_clear(&self->prescribed);
  flesh_free(self->vectors);
  free(self);
  *trajectory = NULL;
}

flesh_trajectory_costs flesh_trajectory_get_costs(const flesh_trajectory *self)
{
  return (flesh_trajectory_costs){self->total, self->repeated, self->most};
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
