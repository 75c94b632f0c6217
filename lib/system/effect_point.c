/* effect_point.c: completes points, and sums up over the ranks what effects need, for all effects at once. */
#include "system/effect_point.h"

#include <string.h>

#include "effect/effect.h"
#include "system/proximity.h"

static int needs_sums(const flesh_effect *effect)
{
  return effect->operations->ranks && effect->operations->ranks->sum_count > 0;
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
    if (entry->sums >= 0) entry->effect->operations->ranks->sum(entry->effect, point, sums + entry->sums);
  }
  flesh_team_sum(system->team, count, sums);
}

flesh_point flesh_effect_point(const flesh_system *system, const flesh_point *point, double *sums)
{
  flesh_point full = *point;
  if (!full.x_lag) full.x_lag = full.x, full.t_lag = full.t;
  if (!full.v_lag) full.v_lag = full.v;
  if (!full.x_frozen) full.x_frozen = full.x, full.v_frozen = full.v;
  full.near = NULL;
  find_sums(system, &full, sums);
  return full;
}

void flesh_effect_point_turn(const flesh_system *system, int k, const double *internal, const double *sums,
                             flesh_point *full)
{
  const int first = system->entries[k].sums;
  full->near = flesh_proximity_of(full->proximity, k);
  full->internal = flesh_internal_of(system, k, internal);
  full->sums = first >= 0 ? sums + first : NULL;
}
