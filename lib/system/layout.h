/* layout.h: where the blocks of a system's effects are in a matrix whose pattern has grown beyond the system's own, by
 * nodes that came near each other (flesh_effect_barrier.coupled). */
#ifndef FLESH_SYSTEM_LAYOUT_H
#define FLESH_SYSTEM_LAYOUT_H

#include "flesh/system.h"
#include "system/pattern.h"

typedef struct flesh_layout {
  const flesh_system *system; /* borrowed */
  flesh_pattern pattern;
  unsigned char *own;    /* [blocks] 1: the system's pattern has it */
  int **slots;           /* [effects] as those of the system's entries; the same ones are shared as there */
  int left_count, *left; /* the blocks that the leader leaves */
} flesh_layout;

/* The pattern of a finished system with all pairs of more cells. FLESH_ERR_MEMORY, FLESH_ERR_ARGUMENT. */
int flesh_layout_create(const flesh_system *system, int count, const flesh_cells *const *cells, flesh_layout *layout);
void flesh_layout_clear(flesh_layout *layout);

#endif
