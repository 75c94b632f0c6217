/* triangle.c: room for the rows of a triangle. */
#include "sparse/triangle.h"

#include <stdlib.h>

#include "base/error.h"
#include "base/large.h"

enum { BEHIND = 16 }; /* words: of a pair sixteen are loaded */

int flesh_triangle_create(int rows, const int *blocks, int split, flesh_triangle *triangle)
{
  *triangle = (flesh_triangle){.rows = rows, .split = split, .start = malloc(((size_t)rows + 1) * sizeof(int))};
  if (!triangle->start) return FLESH_ERR_MEMORY;
  triangle->start[0] = 0;
  for (int p = 0; p < rows; p++)
    triangle->start[p + 1] = triangle->start[p] + (split ? blocks[p] : (blocks[p] + 1) / 2);
  const size_t pairs = (size_t)triangle->start[rows];
  triangle->column = flesh_large_zeroed((2 * pairs + 1) * sizeof *triangle->column);
  triangle->words = flesh_large_zeroed((9 * pairs + BEHIND) * sizeof *triangle->words);
  if (triangle->column && triangle->words) return FLESH_OK;
  flesh_triangle_clear(triangle);
  return FLESH_ERR_MEMORY;
}

void flesh_triangle_clear(flesh_triangle *triangle)
{
  free(triangle->start);
  free(triangle->column);
  free(triangle->words);
  *triangle = (flesh_triangle){0};
}

size_t flesh_triangle_memory(const flesh_triangle *triangle)
{
  const size_t pairs = (size_t)triangle->start[triangle->rows];
  return ((size_t)triangle->rows + 1) * sizeof(int) + 2 * pairs * sizeof(int) + 9 * pairs * sizeof(uint32_t);
}
