/* pattern.h: the block pattern of a system's Jacobian and each cell's slots in it. */
#ifndef FLESH_SYSTEM_PATTERN_H
#define FLESH_SYSTEM_PATTERN_H

#include <stddef.h>

#include "flesh/effect.h"

typedef struct flesh_pattern {
  int rows;
  int *row_start; /* [rows+1], the last one is the number of all blocks */
  int *row_end;   /* [rows] */
  int *column;    /* [row_start[rows]] */
} flesh_pattern;

/* Checks an effect's cells in a mesh of `nodes` nodes. FLESH_ERR_ARGUMENT with what is wrong. */
int flesh_pattern_check(const char *effect, int nodes, const flesh_cells *cells);

/* Makes the pattern of all pairs in the cells [count]: the upper triangle, the diagonal first in every row, rows one after
 * the other in the order of the pattern's bisection (lib/linear/bisection.h). */
int flesh_pattern_create(int rows, int count, const flesh_cells *const *cells,
                         flesh_pattern *pattern);
void flesh_pattern_clear(flesh_pattern *pattern);
/* Makes the pattern of `base` with all pairs of further cells. Returns new in *place [blocks of base] the places of base's
 * blocks in it. */
int flesh_pattern_extend(const flesh_pattern *base, int count, const flesh_cells *const *cells, flesh_pattern *pattern,
                         int **place);

/* Returns a matrix of the pattern with these values. */
static inline flesh_block_matrix flesh_pattern_matrix(const flesh_pattern *pattern, double *values)
{
  return (flesh_block_matrix){.rows = pattern->rows, .row_start = pattern->row_start, .row_end = pattern->row_end,
                              .column = pattern->column, .values = values};
}

/* Returns the number of pairs in the cells. */
size_t flesh_pattern_pairs(const flesh_cells *cells);

/* Finds the slots of these pairs. Returns new in *slots. */
int flesh_pattern_slots(const flesh_pattern *pattern, const flesh_cells *cells, int **slots);

/* Lists the blocks that are not among the slots [pairs]. Returns new in *rest. */
int flesh_pattern_rest(const flesh_pattern *pattern, size_t pairs, const int *slots, int *count, int **rest);

#endif
