/* pattern.h: the block pattern of a system's Jacobian and each cell's slots in it. */
#ifndef FLESH_SYSTEM_PATTERN_H
#define FLESH_SYSTEM_PATTERN_H

#include "flesh/effect.h"

typedef struct flesh_pattern {
  int rows;
  int *row_start; /* [rows+1] */
  int *column;    /* [row_start[rows]] */
} flesh_pattern;

/* The upper triangle, diagonal first in every row, of all pairs in the cells [count]. */
int flesh_pattern_create(int rows, int count, const flesh_cells *const *cells,
                         flesh_pattern *pattern);
void flesh_pattern_clear(flesh_pattern *pattern);

/* Index of block (row, column), row <= column; -1 if it is not in the pattern. */
int flesh_pattern_find(const int *row_start, const int *columns, int row, int column);

/* Slots [cells->count * pairs] of every cell's pairs. Returns new in *slots. */
int flesh_pattern_slots(const flesh_pattern *pattern, const flesh_cells *cells, int **slots);

#endif
