/* layout.h: places of the blocks of a system's effects in a matrix whose pattern has grown beyond the system's own because
 * nodes came near each other (flesh_effect_barrier.coupled). */
#ifndef FLESH_SYSTEM_LAYOUT_H
#define FLESH_SYSTEM_LAYOUT_H

#include "flesh/system.h"
#include "system/pattern.h"

typedef struct flesh_layout {
  const flesh_system *system; /* borrowed */
  flesh_pattern pattern;
  unsigned char *own;    /* [blocks] 1: the block is in the system's pattern */
  int **slots;           /* [effects] slots in the grown pattern; shared between entries as in the system */
  int left_count, *left; /* blocks that the assigning effect does not set */
} flesh_layout;

/* Makes the pattern of a finalized system with all pairs of further cells. FLESH_ERR_MEMORY, FLESH_ERR_ARGUMENT. */
int flesh_layout_create(const flesh_system *system, int count, const flesh_cells *const *cells, flesh_layout *layout);
void flesh_layout_clear(flesh_layout *layout);

#endif
