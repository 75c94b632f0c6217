/* internal.c: counts and updates the internal variables of a system's effects. */
#include "system/internal.h"

#include "base/error.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "system/effect_view.h"
#include "system/one_effect.h"

static int takes_bonds(const flesh_effect *effect)
{
  return flesh_effect_private_of(effect)->take_bonds != NULL;
}

/* Lists the bonds of all effects, new, with the indices of their variables among all. FLESH_ERR_MEMORY. */
static int list_bonds(const flesh_system *system, int *count, flesh_bond **bonds)
{
  *count = 0;
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    if (flesh_effect_private_of(effect)->bonds) *count += flesh_effect_private_of(effect)->bonds->count(effect);
  }
  flesh_bond *next = *bonds = flesh_malloc(((size_t)*count + 1) * sizeof *next);
  if (!next) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d bonds", *count);
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    const int own = flesh_effect_private_of(effect)->bonds ? flesh_effect_private_of(effect)->bonds->count(effect) : 0;
    for (int b = 0; b < own; b++, next++) {
      flesh_effect_private_of(effect)->bonds->get(effect, b, next);
      if (next->variable >= 0) next->variable += system->entries[k].internal;
    }
  }
  return FLESH_OK;
}

/* Assigns places to the internal variables of the effects that take bonds, or of the others. */
static void place_internals(flesh_system *system, int taking)
{
  for (int k = 0; k < system->entry_count; k++) {
    flesh_system_entry *entry = &system->entries[k];
    if (takes_bonds(entry->effect) != taking) continue;
    entry->internal = system->internal_count;
    system->internal_count += flesh_effect_internal_count(entry->effect);
  }
}

int flesh_system_settle_internals(flesh_system *system)
{
  flesh_bond *bonds = NULL;
  int count = 0, some = 0, status = FLESH_OK;
  system->internal_count = 0;
  place_internals(system, 0);
  for (int k = 0; k < system->entry_count; k++) some |= takes_bonds(system->entries[k].effect);
  if (some) status = list_bonds(system, &count, &bonds);
  for (int k = 0; k < system->entry_count && !status; k++) {
    flesh_effect *effect = system->entries[k].effect;
    if (takes_bonds(effect)) status = flesh_effect_private_of(effect)->take_bonds(effect, count, bonds);
  }
  flesh_free(bonds);
  place_internals(system, 1);
  return status;
}

/* Updates the variables of the effects that take bonds, or of the others. */
static int update_those(int taking, flesh_effect_view *view, double *internal, int *changed)
{
  const flesh_system *system = view->system;
  const unsigned long said = flesh_fail_count();
  int status = FLESH_OK;
  view->environment.all_internal = internal;
  for (int k = 0; k < system->entry_count && !status; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    const flesh_effect_internal *can = effect->operations->internal;
    if (!can || takes_bonds(effect) != taking) continue;
    status = can->update(effect, flesh_effect_view_turn(view, k), internal + system->entries[k].internal, changed);
    status = flesh_effect_returned(effect, said, status);
    if (status > 0)
      status = flesh_fail(FLESH_ERR_NONFINITE, "the internal variables of effect %s have no value at t = %g s",
                          effect->operations->name, view->point.t);
  }
  return status;
}

int flesh_system_update_internal(const flesh_system *system, const flesh_point *point, double *internal, int *changed)
{
  FLESH_NEED({system, "system"}, {point, "point"}, {internal, "internal"}, {changed, "changed"});
  double of_ranks[flesh_effect_sums_room(system)];
  flesh_effect_view view = flesh_effect_view_with(system, point, of_ranks);
  *changed = 0;
  int status = update_those(0, &view, internal, changed);
  if (!status) status = update_those(1, &view, internal, changed);
  double any = *changed != 0; /* bits that depend on how a rank numbers its nodes become equal */
  status = flesh_team_sum_agreed(system->team, status, 1, &any);
  if (!status && any > 0) flesh_team_largest(system->team, system->internal_count, internal);
  *changed = any > 0;
  return status;
}

static int has_internal(const flesh_effect *effect, int ignored)
{
  (void)ignored;
  return effect->operations->internal != NULL;
}

int flesh_system_internal_energies(const flesh_system *system, const flesh_point *point, double *energies, double *sum)
{
  return flesh_system_some_energies(system, has_internal, 0, point, energies, sum);
}

int flesh_system_internal_count(const flesh_system *system) { return system->internal_count; }
