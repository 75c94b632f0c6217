/* scalar_view.c: maps from blocks to entries of the full scalar matrix, made once per pattern. */
#include "linear/scalar_view.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"

int flesh_scalar_view_create(const flesh_block_matrix *A, flesh_scalar_view *view)
{
  size_t blocks = (size_t)A->row_start[A->rows];
  *view = (flesh_scalar_view){.n = 3 * (int64_t)A->rows,
                              .entries = 9 * (2 * (int64_t)blocks - A->rows)};
  view->starts = flesh_malloc(((size_t)view->n + 1) * sizeof *view->starts);
  view->indices = flesh_malloc((size_t)view->entries * sizeof *view->indices);
  view->place = flesh_malloc((2 * blocks + 1) * sizeof *view->place);
  /* Counts the entries of each block column so far. */
  int *length = flesh_calloc((size_t)A->rows + 1, sizeof *length);
  if (!view->starts || !view->indices || !view->place || !length) {
    flesh_free(length);
    flesh_scalar_view_clear(view);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a matrix of %zu blocks", blocks);
  }
  /* Column j first has the blocks (i,j), i < j, in the order of i, then its row, transposed. */
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i] + 1; k < A->row_end[i]; k++) {
      view->place[2 * (size_t)k] = length[A->column[k]];
      length[A->column[k]] += 3;
    }
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i]; k < A->row_end[i]; k++) {
      view->place[2 * (size_t)k + 1] = length[i];
      if (k == A->row_start[i]) view->place[2 * (size_t)k] = length[i];
      length[i] += 3;
    }
  view->starts[0] = 0;
  for (int64_t d = 0; d < view->n; d++) view->starts[d + 1] = view->starts[d] + length[d / 3];
  flesh_free(length);
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i]; k < A->row_end[i]; k++) {
      int j = A->column[k];
      for (int c = 0; c < 3; c++)
        for (int r = 0; r < 3; r++) {
          view->indices[view->starts[3 * (size_t)j + c] + view->place[2 * (size_t)k] + r] =
              3 * (int64_t)i + r;
          view->indices[view->starts[3 * (size_t)i + c] + view->place[2 * (size_t)k + 1] + r] =
              3 * (int64_t)j + r;
        }
    }
  return FLESH_OK;
}

void flesh_scalar_view_clear(flesh_scalar_view *view)
{
  flesh_free(view->starts);
  flesh_free(view->indices);
  flesh_free(view->place);
  *view = (flesh_scalar_view){0};
}

void flesh_scalar_view_fill(const flesh_scalar_view *view, const flesh_block_matrix *A,
                            double *values)
{
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i]; k < A->row_end[i]; k++) {
      const double *block = A->values + 9 * (size_t)k;
      int j = A->column[k];
      for (int c = 0; c < 3; c++) {
        double *upper = values + view->starts[3 * (size_t)j + c] + view->place[2 * (size_t)k];
        double *lower = values + view->starts[3 * (size_t)i + c] + view->place[2 * (size_t)k + 1];
        for (int r = 0; r < 3; r++) {
          lower[r] = block[3 * c + r];
          upper[r] = block[3 * r + c];
        }
      }
    }
}
