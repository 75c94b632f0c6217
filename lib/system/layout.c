/* layout.c: the system's pattern with more pairs, and the slots of the effects in it. */
#include "system/layout.h"

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "system/parts.h"

static size_t pairs_of(const flesh_system_entry *entry)
{
  return flesh_pattern_pairs(entry->effect->operations->cells(entry->effect));
}

/* Returns the new slots of an entry; NULL: no memory. */
static int *move_slots(const flesh_system_entry *entry, const int *place)
{
  const size_t count = pairs_of(entry);
  int *slots = flesh_huge_pages_alloc((count + 1) * sizeof *slots);
  for (size_t k = 0; slots && k < count; k++) slots[k] = place[entry->slots[k]];
  return slots;
}

static int move_all(flesh_layout *self, const int *place)
{
  const flesh_system *system = self->system;
  self->slots = flesh_calloc((size_t)system->entry_count + 1, sizeof *self->slots);
  if (!self->slots) return FLESH_ERR_MEMORY;
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_system_entry *e = &system->entries[k];
    for (int j = 0; j < k && e->slots && !e->owns_slots; j++)
      if (system->entries[j].slots == e->slots) self->slots[k] = self->slots[j];
    if (!e->owns_slots) continue;
    self->slots[k] = move_slots(e, place);
    if (!self->slots[k]) return FLESH_ERR_MEMORY;
  }
  return FLESH_OK;
}

static int mark_own(flesh_layout *self, const int *place)
{
  const flesh_pattern *base = &self->system->pattern;
  self->own = flesh_calloc((size_t)self->pattern.row_start[self->pattern.rows] + 1, 1);
  if (!self->own) return FLESH_ERR_MEMORY;
  for (int i = 0; i < base->rows; i++)
    for (int k = base->row_start[i]; k < base->row_end[i]; k++) self->own[place[k]] = 1;
  return FLESH_OK;
}

int flesh_layout_create(const flesh_system *system, int count, const flesh_cells *const *cells, flesh_layout *self)
{
  int *place = NULL;
  *self = (flesh_layout){.system = system};
  int status = flesh_pattern_extend(&system->pattern, count, cells, &self->pattern, &place);
  if (!status) status = mark_own(self, place);
  if (!status) status = move_all(self, place);
  flesh_free(place);
  if (!status && system->leader >= 0)
    status = flesh_pattern_rest(&self->pattern, pairs_of(&system->entries[system->leader]), self->slots[system->leader],
                                &self->left_count, &self->left);
  if (!status) return FLESH_OK;
  flesh_layout_clear(self);
  return status == FLESH_ERR_MEMORY
             ? flesh_fail(status, "no memory for the slots of %d effects", system->entry_count)
             : status;
}

void flesh_layout_clear(flesh_layout *self)
{
  for (int k = 0; self->slots && k < self->system->entry_count; k++)
    if (self->system->entries[k].owns_slots) flesh_free(self->slots[k]);
  flesh_free(self->slots);
  flesh_free(self->own);
  flesh_free(self->left);
  flesh_pattern_clear(&self->pattern);
  *self = (flesh_layout){0};
}
