/* rank_numbers.c: numbers that effects on parts of a body share over all ranks. */
#include "system/rank_numbers.h"

#include "effect/effect.h"
#include "system/effect_view.h"
#include "system/ranks.h"

static void add_up(const flesh_team *team, flesh_rank_numbers *numbers)
{
  flesh_team_sum(team, FLESH_RANK_SUMS, numbers->sums);
  flesh_team_largest(team, FLESH_RANK_SUMS, numbers->largest);
}

void flesh_rank_numbers_settle(flesh_system *system)
{
  const flesh_team *team = flesh_system_team(system);
  for (int k = 0; k < system->entry_count; k++) {
    flesh_effect *effect = system->entries[k].effect;
    const flesh_effect_ranks *ranks = flesh_effect_private_of(effect)->ranks;
    flesh_rank_numbers numbers = {0};
    if (!ranks || !ranks->take) continue;
    ranks->count(effect, &numbers);
    add_up(team, &numbers);
    ranks->take(effect, &numbers);
  }
}

void flesh_rank_numbers_report(const flesh_system *system, const flesh_point *end, const flesh_point *stage,
                               double *reports)
{
  const flesh_team *team = flesh_system_team(system);
  for (int k = 0; k < flesh_system_effect_count(system); k++) {
    const flesh_effect *effect = flesh_system_effect(system, k);
    const flesh_effect_ranks *ranks = flesh_rank_numbers_reporting(effect);
    flesh_rank_numbers numbers = {0};
    if (!ranks) continue;
    flesh_effect_view view = flesh_effect_view_of(system, flesh_effect_reports_stage(effect) ? stage : end);
    ranks->report_part(effect, flesh_effect_view_turn(&view, k), &numbers);
    add_up(team, &numbers);
    ranks->report_whole(effect, &numbers, reports + FLESH_RANK_SUMS * (size_t)k);
  }
}
