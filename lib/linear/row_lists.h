/* row_lists.h: the nodes of stiff rows, and the rows of nodes. */
#ifndef FLESH_LINEAR_ROW_LISTS_H
#define FLESH_LINEAR_ROW_LISTS_H

#include <stdint.h>

typedef struct flesh_row_lists {
  int rows, nodes, m; /* m nodes a row */
  int *place;         /* [rows][m] four times each node's place in vectors */
  /* The arrays below are indexed by the node's place. */
  int *start;    /* [nodes+1] first row of each node */
  int *row, *at; /* [rows][m] rows of each node, ascending, and the node's entry in them: m row + its number in the row */
  uint8_t *main; /* [nodes] 1: main node, where D is not infinite */
} flesh_row_lists;

#endif
