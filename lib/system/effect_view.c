/* effect_view.c: views of a point for each effect, and the sums over ranks that effects need, found for all effects at
 * once. */
#include "system/effect_view.h"

#include <string.h>

#include "effect/effect.h"

static int needs_sums(const flesh_effect *effect)
{
  return flesh_effect_private_of(effect)->ranks && flesh_effect_private_of(effect)->ranks->sum_count > 0;
}

void flesh_effect_sums_count(flesh_system *system)
{
  system->summed = 0;
  for (int k = 0; k < system->entry_count; k++) {
    flesh_system_entry *entry = &system->entries[k];
    entry->sums = system->team && needs_sums(entry->effect) ? FLESH_RANK_SUMS * system->summed++ : -1;
  }
}

int flesh_effect_sums_room(const flesh_system *system) { return FLESH_RANK_SUMS * system->summed + 1; }

static void find_sums(const flesh_system *system, const flesh_point *point, double *sums)
{
  const int count = FLESH_RANK_SUMS * system->summed;
  if (!count) return;
  memset(sums, 0, (size_t)count * sizeof *sums);
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_system_entry *entry = &system->entries[k];
    if (entry->sums >= 0) flesh_effect_private_of(entry->effect)->ranks->sum(entry->effect, point, sums + entry->sums);
  }
  flesh_team_sum(system->team, count, sums);
}

int flesh_system_has_proximity(const flesh_system *system)
{
  for (int k = 0; k < system->entry_count; k++)
    if (flesh_effect_as_barrier(system->entries[k].effect)->remember) return 1;
  return 0;
}

flesh_effect_view flesh_effect_view_of(const flesh_system *system, const flesh_point *point)
{
  return (flesh_effect_view){.system = system, .internal = point->internal, .load = point->load, .point = *point,
                             .environment = *flesh_environment_of(point)};
}

flesh_effect_view flesh_effect_view_with(const flesh_system *system, const flesh_point *point, double *sums)
{
  flesh_effect_view view = flesh_effect_view_of(system, point);
  find_sums(system, point, sums);
  view.sums = sums;
  return view;
}

const flesh_point *flesh_effect_view_turn(flesh_effect_view *view, int k)
{
  const int first = view->sums ? view->system->entries[k].sums : -1;
  const flesh_proximity *proximity = view->environment.proximity;
  view->environment.near = flesh_proximity_of(proximity, k);
  view->environment.predicted = proximity && proximity->predicted ? proximity->predicted[k] : NULL;
  view->environment.sums = first >= 0 ? view->sums + first : NULL;
  view->point.internal = flesh_internal_of(view->system, k, view->internal);
  view->point.environment = &view->environment;
  const int follows = flesh_effect_has_trait(view->system->entries[k].effect, FLESH_IS_FOLLOWER_LOAD);
  view->point.load = view->load * (follows ? 1 - view->environment.unloaded : 1);
  return &view->point;
}
