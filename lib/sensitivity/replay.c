/* replay.c: blocks of parts, their checkpoints, and repetition of parts by the integrator. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "sensitivity/trajectory.h"
#include "system/ranks.h"

/* Number of states that fill a block: with fewer there are more checkpoints, with more the solvers forget less often. */
enum { BLOCK = 16 };

/* Records a new call of flesh_integrator_step. */
static int take_call(flesh_trajectory *self, const flesh_step_place *place)
{
  if (!flesh_grow(&self->calls, sizeof *self->calls, self->call_count, &self->call_room))
    return flesh_fail(FLESH_ERR_MEMORY, "no memory to record more than %d steps", self->call_count);
  self->now.call = self->call_count;
  self->calls[self->call_count++] = (flesh_recorded_call){place->begin, place->h};
  return FLESH_OK;
}

/* Returns the bytes of the budget that a block of parts leaves. */
static size_t left_of(const flesh_trajectory *self)
{
  return self->budget > self->block_bytes ? self->budget - self->block_bytes : 0;
}

/* Returns how many blocks can be repeated, the last one first, from this number of checkpoints, each block at most `passes`
 * + 1 times: a binomial coefficient. */
static double reach_of(int checkpoints, int passes)
{
  double reach = 1;
  for (int k = 1; k <= passes; k++) reach *= (double)(checkpoints + k) / k;
  return round(reach);
}

/* Returns after how many of the `blocks` (at least two) following a checkpoint the next of `checkpoints` (at least two)
 * must be saved: Griewank & Walther 2000. */
static int split(int blocks, int checkpoints)
{
  int passes = 0;
  while (reach_of(checkpoints, passes) < blocks) passes++;
  const double most = reach_of(checkpoints, passes - 1), after = blocks - reach_of(checkpoints - 1, passes - 1);
  return (int)fmax(1, fmin(most, after));
}

/* Chooses the next block at which to save a checkpoint of `bytes` while parts are repeated. */
static void plan(flesh_trajectory *self, size_t bytes)
{
  flesh_pass *now = &self->now;
  const int blocks = now->last - now->blocks + 2;
  const size_t left = left_of(self), held = self->checkpoints.bytes;
  const int more = left > held ? (int)((left - held) / bytes) : 0;
  now->next = blocks > 1 && more > 0 ? now->blocks - 1 + split(blocks, more + 1) : -1;
}

/* Records a new block of the run. */
static int take_block(flesh_trajectory *self)
{
  if (!flesh_grow(&self->blocks, sizeof *self->blocks, self->block_count, &self->block_room))
    return flesh_fail(FLESH_ERR_MEMORY, "no memory to record more than %d blocks of steps", self->block_count);
  self->blocks[self->block_count++] = self->now.at;
  return FLESH_OK;
}

/* Begins a block: solvers forget, and the integrator may be saved. Drops earlier parts for which there is no room beside
 * the checkpoints and the block. */
static int begin_block(flesh_trajectory *self, const flesh_step_place *place)
{
  flesh_pass *now = &self->now;
  const int again = now->limit >= 0;
  int status = again ? FLESH_OK : take_block(self);
  if (status) return status;
  now->block = now->at;
  now->blocks++;
  if (now->bytes > self->block_bytes) self->block_bytes = now->bytes;
  now->bytes = 0;
  flesh_integrator_forget(self->integrator);
  const size_t left = left_of(self);
  const flesh_checkpoint at = {.at = now->at, .call = now->call, .block = now->blocks - 1, .place = *place};
  if (!again || now->next == at.block)
    status = flesh_checkpoints_add(&self->checkpoints, self->integrator, &at, !again, left);
  if (again && now->next == at.block) plan(self, self->checkpoints.all[self->checkpoints.count - 1].bytes);
  while (self->count > 0 && self->checkpoints.bytes + self->kept > left) flesh_trajectory_forget(self, self->first + 1);
  flesh_trajectory_count(self);
  return status;
}

/* Whether a block begins: when the last one is full. */
static int begins(const flesh_trajectory *self)
{
  const flesh_pass *now = &self->now;
  if (now->block == now->at) return 0;
  if (now->limit >= 0) return now->blocks < self->block_count && self->blocks[now->blocks] == now->at;
  return now->at == 0 || now->bytes >= BLOCK * flesh_trajectory_state(self);
}

int flesh_trajectory_pass(void *data, const flesh_step_place *place)
{
  flesh_trajectory *self = data;
  const flesh_pass *now = &self->now;
  flesh_trajectory_drop_start(self);
  memset(self->tape.jump, 0, flesh_trajectory_state(self));
  self->now.opens |= place->at_begin;
  if (now->limit >= 0 && now->at >= now->limit) return FLESH_ERR_INTERRUPTED;
  const int status = now->limit < 0 && place->at_begin ? take_call(self, place) : FLESH_OK;
  return status || !begins(self) ? status : begin_block(self, place);
}

/* Saves the integrator at the run's end. */
static int set_aside(flesh_trajectory *self)
{
  if (self->aside) return FLESH_OK;
  int status = flesh_integrator_save(self->integrator, 0, NULL, &self->aside_bytes);
  if (status) return status;
  self->aside = flesh_malloc(self->aside_bytes);
  if (!self->aside) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %zu bytes of an integrator", self->aside_bytes);
  status = flesh_integrator_save(self->integrator, self->aside_bytes, self->aside, &self->aside_bytes);
  if (!status) {
    self->run = self->now;
    memcpy(self->run_reached, self->reached, sizeof self->reached);
    memset(self->reached, 0, sizeof self->reached);
    return FLESH_OK;
  }
  flesh_free(self->aside);
  self->aside = NULL;
  return status;
}

/* Whether a step that failed with this status in the run was followed by another from the same state. */
static int may_fail(int status)
{
  return status == FLESH_ERR_SOLVE || status == FLESH_ERR_ENERGY || status == FLESH_ERR_NONFINITE;
}

/* Repeats parts from a place up to the limit. */
static int take_again(flesh_trajectory *self, const flesh_step_place *place)
{
  flesh_integrator *integrator = self->integrator;
  const flesh_state *kept = &integrator->evaluation->returned;
  const size_t n = (size_t)self->n, multipliers = (size_t)kept->multiplier_count, internals = (size_t)kept->internal_count;
  double *all = flesh_malloc((2 * n + multipliers + internals + 1) * sizeof *all);
  if (!all) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a state of %d unknowns", self->n);
  flesh_state state = *kept;
  state.x = all;
  state.v = all + n;
  state.multipliers = multipliers ? all + 2 * n : NULL;
  state.internal = internals ? all + 2 * n + multipliers : NULL;
  memcpy(state.x, kept->x, n * sizeof *all);
  memcpy(state.v, kept->v, n * sizeof *all);
  if (multipliers) memcpy(state.multipliers, kept->multipliers, multipliers * sizeof *all);
  if (internals) memcpy(state.internal, kept->internal, internals * sizeof *all);
  int status = flesh_integrator_resume(integrator, place, &state);
  while (self->now.at < self->now.limit && (!status || may_fail(status)) && self->now.call + 1 < self->call_count) {
    const flesh_recorded_call *call = &self->calls[++self->now.call];
    state.t = call->t;
    status = flesh_integrator_step(integrator, &state, call->h, NULL);
  }
  flesh_free(all);
  if (self->now.at >= self->now.limit) return FLESH_OK;
  return status ? status : flesh_fail(FLESH_ERR_INTEGRATOR, "a repeated step does not get as far as it did in the run");
}

/* Returns to a checkpoint and repeats steps up to part `limit`; keeps parts from block `last` on as far as there is room. */
static int go_back(flesh_trajectory *self, const flesh_checkpoint *from, int last, int limit)
{
  flesh_integrator *integrator = self->integrator;
  flesh_trajectory_forget(self, self->first + self->count);
  self->first = from->at;
  self->now = (flesh_pass){.at = from->at, .call = from->call, .block = from->at, .blocks = from->block + 1, .last = last,
                           .next = -1, .limit = limit};
  if (last > from->block) plan(self, from->bytes);
  int status = flesh_integrator_load(integrator, from->data, from->bytes);
  if (status) return status;
  int (*observe)(void *data, const flesh_internal_step *step) = integrator->control.options.observe;
  integrator->control.options.observe = NULL;
  self->tape.anew = 0;
  status = take_again(self, &from->place);
  integrator->control.options.observe = observe;
  return status;
}

static int check_integrator(const flesh_trajectory *self)
{
  if (self->integrator) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "the integrator is gone, but must repeat steps that are not kept: destroy it after the "
                                        "trajectory, or keep more states");
}

/* Returns to the last checkpoint before part k, and repeats steps through that part. */
static int replay(flesh_trajectory *self, int k)
{
  int status = check_integrator(self), last = self->block_count - 1;
  if (!status) status = set_aside(self);
  if (status) return status;
  flesh_checkpoints_drop(&self->checkpoints, k + 1);
  const flesh_checkpoint from = self->checkpoints.all[self->checkpoints.count - 1];
  while (self->blocks[last] > k) last--;
  return go_back(self, &from, last, k + 1);
}

int flesh_trajectory_visit(flesh_trajectory *self, flesh_part_visit visit, void *data)
{
  const flesh_recorded_part *part;
  int status = FLESH_OK;
  if (self->count == self->total) {
    for (int k = 0; k < self->total && !status; k++) {
      status = flesh_trajectory_part(self, k, &part);
      if (!status) status = visit(data, part);
    }
    return status;
  }
  status = check_integrator(self);
  if (!status) status = set_aside(self);
  if (status) return status;
  self->visit = visit;
  self->visit_data = data;
  status = go_back(self, &self->checkpoints.all[0], 0, self->total);
  self->visit = NULL;
  const int returned = flesh_trajectory_return(self);
  return status ? status : returned;
}

int flesh_trajectory_part(flesh_trajectory *self, int k, const flesh_recorded_part **part)
{
  const int kept = k >= self->first && k < self->first + self->count;
  const flesh_stop stop = self->integrator ? self->integrator->nonlinear->newton->stop : (flesh_stop){0};
  int status = flesh_ask_together(flesh_system_team(self->system), stop.stop, stop.data);
  if (!status && !kept) status = replay(self, k);
  return status ? status : flesh_trajectory_find_known(self, &self->parts[k - self->first], part);
}

int flesh_trajectory_return(flesh_trajectory *self)
{
  if (!self->aside) return FLESH_OK;
  const int status = flesh_integrator_load(self->integrator, self->aside, self->aside_bytes);
  flesh_free(self->aside);
  self->aside = NULL;
  self->now = self->run;
  flesh_known_clear(self->reached);
  memcpy(self->reached, self->run_reached, sizeof self->reached);
  self->tape.anew = 0;
  flesh_trajectory_forget(self, self->first + self->count);
  self->first = self->total;
  return status;
}
