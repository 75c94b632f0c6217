/* rank_sums.c: one sum over the ranks for all effects. */
#include "system/rank_sums.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/effect.h"

static int count_of(const flesh_effect *effect)
{
  return effect->operations->ranks ? effect->operations->ranks->sum_count : 0;
}

int flesh_rank_sums_create(flesh_system *system)
{
  int some = 0;
  for (int k = 0; k < system->entry_count; k++) some += count_of(system->entries[k].effect);
  if (!some || !system->team || system->rank_sums) return FLESH_OK;
  system->rank_sums = flesh_calloc((size_t)system->entry_count * FLESH_RANK_SUMS, sizeof *system->rank_sums);
  return system->rank_sums ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for the sums of ranks");
}

void flesh_rank_sums_find(const flesh_system *system, const flesh_point *point)
{
  if (!system->rank_sums) return;
  memset(system->rank_sums, 0, (size_t)system->entry_count * FLESH_RANK_SUMS * sizeof *system->rank_sums);
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    if (count_of(effect)) effect->operations->ranks->sum(effect, point, system->rank_sums + FLESH_RANK_SUMS * (size_t)k);
  }
  flesh_team_sum(system->team, system->entry_count * FLESH_RANK_SUMS, system->rank_sums);
}

const double *flesh_rank_sums_of(const flesh_system *system, int effect)
{
  return system->rank_sums && count_of(system->entries[effect].effect)
             ? system->rank_sums + FLESH_RANK_SUMS * (size_t)effect
             : NULL;
}
