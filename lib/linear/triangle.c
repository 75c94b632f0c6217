/* triangle.c: memory of a triangle's rows. */
#include "linear/triangle.h"

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"

enum { BEHIND = 16 }; /* words: sixteen are loaded for a pair */

int flesh_triangle_create(int rows, const int *blocks, const int *order, int split, flesh_triangle *triangle)
{
  *triangle = (flesh_triangle){.rows = rows, .split = split, .row = flesh_malloc((3 * (size_t)rows + 1) * sizeof(int))};
  if (!triangle->row) return FLESH_ERR_MEMORY;
  triangle->at = triangle->row + rows;
  triangle->start = triangle->at + rows;
  triangle->start[0] = 0;
  for (int q = 0; q < rows; q++) {
    const int row = triangle->row[q] = order[q];
    triangle->at[row] = q;
    triangle->start[q + 1] = triangle->start[q] + (split ? blocks[row] : (blocks[row] + 1) / 2);
  }
  const size_t pairs = (size_t)triangle->start[rows];
  triangle->column = flesh_huge_pages_calloc((2 * pairs + 1) * sizeof *triangle->column);
  triangle->words = flesh_huge_pages_calloc((9 * pairs + BEHIND) * sizeof *triangle->words);
  if (triangle->column && triangle->words) return FLESH_OK;
  flesh_triangle_clear(triangle);
  return FLESH_ERR_MEMORY;
}

void flesh_triangle_clear(flesh_triangle *triangle)
{
  flesh_free(triangle->row); /* the other arrays are in the same allocation */
  flesh_free(triangle->column);
  flesh_free(triangle->words);
  *triangle = (flesh_triangle){0};
}

void flesh_triangle_archive(flesh_triangle *self, flesh_archive *archive)
{
  flesh_archive_bytes(archive, self->words, 9 * (size_t)self->start[self->rows] * sizeof *self->words);
}
