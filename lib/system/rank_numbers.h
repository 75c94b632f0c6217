/* rank_numbers.h: what effects on parts of a body learn from each other (flesh_effect_ranks.count, .report_part). */
#ifndef FLESH_SYSTEM_RANK_NUMBERS_H
#define FLESH_SYSTEM_RANK_NUMBERS_H

#include "effect/private.h"
#include "flesh/system.h"

/* Every effect of a part's system takes its numbers of the body, before the system is finished. Collective; cannot
 * fail. */
void flesh_rank_numbers_settle(flesh_system *system);
/* Finds what the effects of all ranks report at the end of a step or at its stage (flesh_effect_reports_stage), into
 * reports [effects*FLESH_RANK_SUMS]; those of others are left. Likewise. */
void flesh_rank_numbers_report(const flesh_system *system, const flesh_point *end, const flesh_point *stage,
                               double *reports);

/* The table of an effect that says something of all ranks; NULL: every rank has it by itself. */
static inline const flesh_effect_ranks *flesh_rank_numbers_reporting(const flesh_effect *effect)
{
  const flesh_effect_ranks *ranks = flesh_effect_private_of(effect)->ranks;
  return ranks && ranks->report_whole ? ranks : NULL;
}

#endif
