/* checkpoints.c: adds, thins out and drops checkpoints. */
#include "sensitivity/checkpoints.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"

static void remove_one(flesh_checkpoints *self, int k)
{
  self->bytes -= self->all[k].bytes;
  flesh_free(self->all[k].data);
  memmove(self->all + k, self->all + k + 1, (size_t)(self->count - k - 1) * sizeof *self->all);
  self->count--;
}

/* Doubles the spacing of checkpoints and drops those that do not fit it; the first one stays. */
static void thin_out(flesh_checkpoints *self)
{
  self->spacing *= 2;
  for (int k = self->count - 1; k > 0; k--)
    if (self->all[k].block % self->spacing != 0) remove_one(self, k);
}

int flesh_checkpoints_add(flesh_checkpoints *self, const flesh_integrator *integrator, const flesh_checkpoint *at,
                          int may_thin, size_t budget)
{
  flesh_checkpoint added = *at;
  if (self->spacing == 0) self->spacing = 1;
  if (may_thin && added.block % self->spacing != 0) return FLESH_OK;
  int status = flesh_integrator_save(integrator, 0, NULL, &added.bytes);
  if (!status && !flesh_grow(&self->all, sizeof *self->all, self->count, &self->room))
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for more than %d checkpoints", self->count);
  if (status) return status;
  while (may_thin && self->count > 1 && self->bytes + added.bytes > budget) thin_out(self);
  if (self->count > 0 && (self->bytes + added.bytes > budget || (may_thin && added.block % self->spacing != 0))) return FLESH_OK;
  added.data = flesh_malloc(added.bytes);
  if (!added.data) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a checkpoint of %zu bytes", added.bytes);
  status = flesh_integrator_save(integrator, added.bytes, added.data, &added.bytes);
  if (status) {
    flesh_free(added.data);
    return status;
  }
  self->all[self->count++] = added;
  self->bytes += added.bytes;
  return FLESH_OK;
}

void flesh_checkpoints_drop(flesh_checkpoints *self, int at)
{
  while (self->count > 0 && self->all[self->count - 1].at >= at) remove_one(self, self->count - 1);
}

void flesh_checkpoints_clear(flesh_checkpoints *self)
{
  flesh_checkpoints_drop(self, 0);
  flesh_free(self->all);
  *self = (flesh_checkpoints){0};
}
