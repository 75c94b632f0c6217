/* rank_ties.c: makes a rank's part of a body whose effects tie nodes of several ranks together. */
#include "flesh/ranks.h"

#include "base/error.h"
#include "base/memory.h"
#include "effect/private.h"
#include "parallel/rank_part.h"
#include "system/parts.h"

int flesh_rank_part_create_for(flesh_communicator *communicator, const flesh_system *whole, const int *ranks,
                               flesh_rank_part **rank_part)
{
  FLESH_NEED({rank_part, "rank_part"});
  *rank_part = NULL;
  FLESH_NEED({communicator, "communicator"}, {whole, "whole"});
  flesh_rank_tie *ties = flesh_malloc(((size_t)whole->entry_count + 1) * sizeof *ties);
  int count = 0, status = ties ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d effects", whole->entry_count);
  for (int k = 0; k < whole->entry_count && !status; k++) {
    const flesh_effect *effect = whole->entries[k].effect;
    const flesh_effect_ranks *can = flesh_effect_private_of(effect)->ranks;
    int everywhere = 0;
    const flesh_cells *cells = can && can->cells ? can->cells(effect, &everywhere) : NULL;
    if (cells && cells->count)
      ties[count++] = (flesh_rank_tie){cells->count, cells->nodes_per_cell, cells->nodes, everywhere};
  }
  status = flesh_communicator_agree(communicator, status);
  if (!status) status = flesh_rank_part_create_tied(communicator, whole->mesh, ranks, count, ties, rank_part);
  flesh_free(ties);
  return status;
}
