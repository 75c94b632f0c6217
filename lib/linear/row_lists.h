/* row_lists.h: which nodes stiff rows have, and which rows nodes. */
#ifndef FLESH_LINEAR_ROW_LISTS_H
#define FLESH_LINEAR_ROW_LISTS_H

#include <stdint.h>

typedef struct flesh_row_lists {
  int rows, nodes, m; /* m nodes a row */
  int *place;         /* [rows][m] four times each node's place in vectors */
  /* The arrays below go by the node's place. */
  int *start;    /* [nodes+1] of its rows */
  int *row, *at; /* [rows][m] the rows, ascending, and where they have the node, m row + its number in the row */
  uint8_t *main; /* [nodes] D is not infinite there */
} flesh_row_lists;

#endif
