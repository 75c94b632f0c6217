/* softened.c: a system with other materials, made once. */
#include "system/softened.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "system/parts.h"
#include "system/ranks.h"

double flesh_system_stiffness_ratio(const flesh_system *system)
{
  double most = 0;
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    const flesh_effect_private *can = flesh_effect_private_of(effect);
    if (can->stiffness_ratio) most = fmax(most, can->stiffness_ratio(effect));
  }
  flesh_team_largest(system->team, 1, &most);
  return most;
}

int flesh_system_soften(const flesh_system *system, double ratio, flesh_system **softened)
{
  const size_t bytes = ((size_t)system->entry_count + 1) * sizeof *system->entries;
  flesh_system *self = *softened = flesh_malloc(sizeof *self);
  flesh_system_entry *entries = flesh_malloc(bytes);
  if (!self || !entries) {
    flesh_free(self), flesh_free(entries);
    *softened = NULL;
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a softened system");
  }
  *self = *system;
  self->entries = entries;
  if (system->entry_count) memcpy(entries, system->entries, bytes - sizeof *entries);
  int status = FLESH_OK;
  for (int k = 0; k < self->entry_count && !status; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    const flesh_effect_private *can = flesh_effect_private_of(effect);
    if (can->soften) status = can->soften(effect, ratio, &entries[k].effect);
    entries[k].softened = can->soften && !status;
  }
  if (status) flesh_softened_destroy(softened);
  return status;
}

void flesh_softened_destroy(flesh_system **softened)
{
  flesh_system *self = *softened;
  if (!self) return;
  for (int k = 0; k < self->entry_count; k++)
    if (self->entries[k].softened) flesh_effect_destroy(&self->entries[k].effect);
  flesh_free(self->entries);
  flesh_free(self);
  *softened = NULL;
}
