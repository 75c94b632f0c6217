/* internals.c: keeps and updates the internal variables of effects. */
#include "time/internals.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"

int flesh_internals_create(const flesh_system *system, flesh_internals *self)
{
  *self = (flesh_internals){.system = system, .count = flesh_system_internal_count(system)};
  if (!self->count) return FLESH_OK;
  const size_t count = (size_t)self->count, n = (size_t)flesh_system_unknowns(system);
  self->n = (int)n;
  self->own = calloc(3 * count + 2 * n, sizeof *self->own);
  if (!self->own) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d internal variables", self->count);
  self->next = self->own + count;
  self->before = self->next + count;
  self->x = self->before + count;
  self->v = self->x + n;
  return FLESH_OK;
}

void flesh_internals_clear(flesh_internals *self)
{
  free(self->own);
  *self = (flesh_internals){0};
}

void flesh_internals_archive(flesh_internals *self, flesh_archive *archive)
{
  FLESH_ARCHIVE(archive, self->restart);
  if (self->count) flesh_archive_bytes(archive, self->own, (size_t)self->count * sizeof *self->own);
}

int flesh_internals_view(const flesh_internals *self, flesh_state *view)
{
  if (view->internal && view->internal_count != self->count)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the state has %d internal variables; the system has %d", view->internal_count,
                      self->count);
  if (view->internal || !self->count) return FLESH_OK;
  view->internal = self->own;
  view->internal_count = self->count;
  return FLESH_OK;
}

int flesh_internals_foresee(flesh_internals *self, const flesh_energy_watch *watch, const flesh_state *state, double tolerance,
                            int *changed)
{
  *changed = 0;
  if (!self->count) return FLESH_OK;
  const flesh_point point = flesh_energy_watch_point(watch, state->t, state, NULL);
  memcpy(self->next, state->internal, (size_t)self->count * sizeof *self->next);
  const int status = flesh_system_update_internal(self->system, &point, self->next, changed);
  if (status || !*changed || tolerance < 0) return status;
  if (!flesh_energy_watch_puts_off(watch, state, self->next, tolerance)) return FLESH_OK;
  memcpy(self->next, state->internal, (size_t)self->count * sizeof *self->next);
  *changed = 0;
  return FLESH_OK;
}

int flesh_internals_update(flesh_internals *self, flesh_energy_watch *watch, flesh_state *state, double tolerance,
                           int *changed)
{
  int status = flesh_internals_foresee(self, watch, state, tolerance, changed);
  if (status) return status;
  for (int k = 0; k < self->count; k++) { /* the values before are kept in `next` */
    const double now = self->next[k];
    self->next[k] = state->internal[k];
    state->internal[k] = now;
  }
  if (!*changed) return FLESH_OK;
  flesh_evaluation_changed(watch->evaluation);
  return flesh_energy_watch_release(watch, self->next, state);
}

void flesh_internals_remember(flesh_internals *self, const flesh_state *state)
{
  const size_t bytes = (size_t)self->n * sizeof *self->x;
  memcpy(self->x, state->x, bytes);
  memcpy(self->v, state->v, bytes);
  memcpy(self->before, state->internal, (size_t)self->count * sizeof *self->before);
  self->t = state->t;
}

void flesh_internals_give_back(const flesh_internals *self, flesh_state *state)
{
  const size_t bytes = (size_t)self->n * sizeof *self->x;
  memcpy(state->x, self->x, bytes);
  memcpy(state->v, self->v, bytes);
  memcpy(state->internal, self->before, (size_t)self->count * sizeof *self->before);
  state->t = self->t;
}
