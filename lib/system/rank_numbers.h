/* rank_numbers.h: numbers that effects on parts of a body exchange (flesh_effect_ranks.count, .report_part). */
#ifndef FLESH_SYSTEM_RANK_NUMBERS_H
#define FLESH_SYSTEM_RANK_NUMBERS_H

#include "effect/private.h"
#include "flesh/system.h"

/* Gives every effect of a part's system the numbers of the whole body, before the system is finalized. Collective; cannot
 * fail. */
void flesh_rank_numbers_settle(flesh_system *system);
/* Collects the reports of the effects of all ranks, at the end of a step or at its stage (flesh_effect_reports_stage), in
 * reports [effects*FLESH_RANK_SUMS]; entries of other effects are unchanged. Collective; cannot fail. */
void flesh_rank_numbers_report(const flesh_system *system, const flesh_point *end, const flesh_point *stage,
                               double *reports);

/* Returns the table of an effect that reports for all ranks together; NULL: each rank reports by itself. */
static inline const flesh_effect_ranks *flesh_rank_numbers_reporting(const flesh_effect *effect)
{
  const flesh_effect_ranks *ranks = flesh_effect_private_of(effect)->ranks;
  return ranks && ranks->report_whole ? ranks : NULL;
}

#endif
