/* split_part.c: numbers in the whole of a part of a split mesh. */
#include "mesh/split_part.h"

#include "base/memory.h"
#include "base/rising.h"

void flesh_split_part_destroy(flesh_split_part *split)
{
  if (!split) return;
  flesh_free(split->nodes);
  flesh_free(split->tets);
  flesh_free(split->owners);
  flesh_free(split->regions);
  flesh_free(split);
}

int flesh_split_part_find(const flesh_split_part *split, int nodes, int node)
{
  return flesh_rising_find(split->nodes, 0, nodes, node);
}

int flesh_split_has_region(const flesh_split_part *split, int tag)
{
  for (int k = 0; split && k < split->region_count; k++)
    if (split->regions[k] == tag) return 1;
  return 0;
}
