/* trajectory.c: records the steps of an integrator. */
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
  flesh_known_clear(part->known);
  for (int k = 0; k < part->count; k++) {
    flesh_free(part->solves[k].u);
    flesh_free(part->solves[k].multipliers);
  }
  flesh_free(part->solves);
  flesh_free(part->internal);
  flesh_free(part->jump);
  memset(part, 0, sizeof *part);
}

static int fail_memory(const flesh_trajectory *self)
{
  return flesh_fail(FLESH_ERR_MEMORY, "no memory to record %d parts of steps of %d unknowns", self->count + 1, self->n);
}

void flesh_trajectory_forget(flesh_trajectory *self, int first)
{
  int gone = first - self->first;
  if (gone <= 0) return;
  while (gone < self->count && self->parts[gone].follows) gone++;
  for (int k = 0; k < gone; k++) {
    self->kept -= self->parts[k].bytes;
    clear_part(&self->parts[k]);
  }
  self->count -= gone;
  self->first += gone;
  memmove(self->parts, self->parts + gone, (size_t)self->count * sizeof *self->parts);
}

void flesh_trajectory_count(flesh_trajectory *self)
{
  const size_t bytes = self->kept + self->checkpoints.bytes + (size_t)self->call_count * sizeof *self->calls +
                       (size_t)self->block_count * sizeof *self->blocks;
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
  if (flesh_trajectory_passes(self)) return FLESH_OK;
  flesh_recorded_solve *solves = flesh_realloc(part->solves, ((size_t)part->count + 1) * sizeof *solves);
  if (!solves) return fail_memory(self);
  part->solves = solves;
  flesh_recorded_solve *solve = &solves[part->count];
  *solve = (flesh_recorded_solve){.stage = *stage, .at = at, .has_v0 = stage->v0 != NULL, .u = flesh_trajectory_copy(u, self->n),
                                  .multipliers = flesh_trajectory_copy(stage->multipliers, multipliers)};
  part->count++;
  return solve->u && (!multipliers || solve->multipliers) ? FLESH_OK : fail_memory(self);
}

/* Refuses internal variables that change, except those of effects that break and stay broken. */
static int check_internal(const flesh_trajectory *self, const double *internal)
{
  for (int e = 0; e < flesh_system_effect_count(self->system); e++) {
    const flesh_effect *effect = flesh_system_effect(self->system, e);
    const int first = self->system->entries[e].internal,
              last = e + 1 < self->system->entry_count ? self->system->entries[e + 1].internal : self->system->internal_count;
    if (flesh_effect_private_of(effect)->bonds || last <= first) continue;
    if (memcmp(self->internal + first, internal + first, (size_t)(last - first) * sizeof *internal) != 0)
      return flesh_fail(FLESH_ERR_ARGUMENT, "the internal variables of effect %s change; sensitivities have no derivative "
                                            "by them", effect->operations->name);
  }
  return FLESH_OK;
}

/* Refuses a part that has no sensitivities. */
static int check_part(const flesh_trajectory *self, const flesh_taken_part *taken)
{
  if (self->tape.untangled)
    return flesh_fail(FLESH_ERR_ARGUMENT, "before t = %g s a tangle was removed, which is no step and has no sensitivities",
                      taken->begin);
  if (flesh_integrator_separation(self->integrator).ignored)
    return flesh_fail(FLESH_ERR_ARGUMENT, "before t = %g s contact is still ignored between bodies that intersect at the start, "
                                          "and has no sensitivities; start with bodies that are apart", taken->end);
  return self->total && self->internal ? check_internal(self, taken->from->internal) : FLESH_OK;
}

/* Gives the part the jump before it; constrained dofs that stay where they are make none. */
static int take_jump(flesh_trajectory *self, flesh_recorded_part *part)
{
  const int n = 2 * self->n;
  int d = 0;
  while (d < n && self->tape.jump[d] == 0) d++;
  if (d == n) return FLESH_OK;
  part->jump = flesh_trajectory_copy(self->tape.jump, n);
  part->bytes += flesh_trajectory_state(self);
  memset(self->tape.jump, 0, flesh_trajectory_state(self));
  return part->jump ? FLESH_OK : fail_memory(self);
}

static int taken(void *data, const flesh_taken_part *taken)
{
  flesh_trajectory *self = data;
  flesh_recorded_part *part = &self->next;
  const flesh_method_row *row = self->integrator->row;
  const size_t internals = (size_t)taken->from->internal_count * sizeof(double);
  const int begins = taken->anew && taken->acceleration && self->tangent.multipliers;
  if (begins && !self->now.started)
    return flesh_fail(FLESH_ERR_ARGUMENT, "at t = %g s the stages that find an acceleration of incompressible tets failed; it "
                                          "has no sensitivities then", taken->begin);
  self->now.started = taken->starts;
  if (flesh_trajectory_passes(self)) {
    self->now.opens = 0;
    self->first = ++self->now.at;
    self->repeated++;
    return FLESH_OK;
  }
  int status = self->now.limit < 0 ? check_part(self, taken) : FLESH_OK;
  if (!status && !flesh_grow(&self->parts, sizeof *self->parts, self->count, &self->room)) status = fail_memory(self);
  if (status) return status;
  part->taken = *taken;
  part->memory = *taken->memory;
  part->vectors = row->remembered ? row->remembered : row->vectors;
  part->t = taken->from->t;
  part->opens = self->now.opens;
  self->now.opens = 0;
  part->t_lag = taken->lagged->t;
  const size_t numbers = (size_t)self->n + (size_t)self->tangent.multipliers;
  part->bytes = sizeof *part + internals + (size_t)part->count * (sizeof *part->solves + numbers * sizeof(double));
  status = flesh_trajectory_take_known(self, taken, part);
  if (!status && internals && !(part->internal = flesh_trajectory_copy(taken->from->internal, taken->from->internal_count)))
    status = fail_memory(self);
  if (status) return status;
  if (internals) memcpy(self->internal, taken->from->internal, internals);
  status = take_jump(self, part);
  if (status) return status;
  flesh_known_go_on(self, part, self->reached);
  self->now.at++;
  self->now.bytes += part->bytes;
  self->kept += part->bytes;
  if (self->now.limit < 0) self->total++;
  else self->repeated++;
  self->parts[self->count++] = *part;
  memset(part, 0, sizeof *part);
  flesh_trajectory_count(self);
  const flesh_recorded_part *found;
  if (!self->visit) return FLESH_OK;
  status = flesh_trajectory_find_known(self, &self->parts[self->count - 1], &found);
  return status ? status : self->visit(self->visit_data, found);
}

void flesh_trajectory_drop_start(flesh_trajectory *self)
{
  flesh_pass *now = &self->now;
  if (!now->started) return;
  now->started = 0;
  now->at--;
  if (now->limit < 0) self->total--;
  if (self->first > now->at) self->first = now->at; /* the part was only passed */
  else clear_part(&self->parts[--self->count]);
}

static int moved(void *data)
{
  const flesh_trajectory *self = data;
  if (!self->total) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "the state is not the end of the last step, so that the recorded steps do not follow "
                                        "each other");
}

int flesh_trajectory_check(const flesh_trajectory *self)
{
  if (self->total) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "the trajectory has recorded no step of which there could be derivatives");
}

static void gone(void *data) { ((flesh_trajectory *)data)->integrator = NULL; }

int flesh_trajectory_create(flesh_integrator *integrator, double tolerance, int states, flesh_trajectory **trajectory)
{
  FLESH_NEED({trajectory, "trajectory"});
  *trajectory = NULL;
  FLESH_NEED({integrator, "integrator"});
  if (!(tolerance >= 1e-13 && tolerance < 1))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the tolerance of sensitivities is %g; it must be in [1e-13, 1)", tolerance);
  if (states < 20)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the number of states to keep for sensitivities is %d; it must be at least 20", states);
  if (integrator->ida)
    return flesh_fail(FLESH_ERR_ARGUMENT, "ida has no sensitivities: take a method of fixed steps, or runge-kutta");
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
    self->bases = flesh_calloc(3 * (size_t)self->n + 1, sizeof *self->bases);
    self->tape.jump = flesh_calloc(2 * (size_t)self->n + 1, sizeof *self->tape.jump);
    self->vectors = flesh_calloc(FLESH_PASS_ARRAYS * (size_t)self->n + 1, sizeof *self->vectors);
    if (!self->vectors || !self->bases || !self->internal || !self->tape.jump) status = fail_memory(self);
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
  flesh_free(self->blocks);
  flesh_free(self->internal);
  flesh_free(self->aside);
  flesh_stage_tangent_clear(&self->tangent);
  flesh_prescribed_clear(&self->prescribed);
  flesh_free(self->vectors);
  flesh_free(self->bases);
  flesh_free(self->tape.jump);
  flesh_known_clear(self->reached);
  flesh_known_clear(self->found);
  free(self);
  *trajectory = NULL;
}

flesh_trajectory_costs flesh_trajectory_get_costs(const flesh_trajectory *self)
{
  return (flesh_trajectory_costs){self->total, self->repeated, self->most};
}
