/* diagonal_blocks.c: sizes and inverses of diagonal blocks. */
#include "linear/diagonal_blocks.h"

#include <math.h>
#include <string.h>

#include "base/parallel_vector.h"
#include "linear/block_matrix.h"

typedef struct diagonal {
  const flesh_block_matrix *A;
  double largest[FLESH_PARALLEL_PARTS_MAX];
} diagonal;

/* Finds the largest entry of some rows' diagonals; infinite where one is NaN. */
static void largest_of_part(void *data, int k, int begin, int end)
{
  diagonal *d = data;
  double largest = 0;
  for (int i = begin; i < end; i++)
    for (int c = 0; c < 3; c++) {
      const double size = fabs(d->A->values[9 * (size_t)d->A->row_start[i] + 4 * (size_t)c]);
      if (!(size <= largest)) largest = size < INFINITY ? size : INFINITY;
    }
  d->largest[k] = largest;
}

double flesh_diagonal_largest(const flesh_block_matrix *A, flesh_threads *threads)
{
  diagonal d = {.A = A};
  const int parts = flesh_parallel_parts(threads, A->rows, largest_of_part, &d);
  double largest = 0;
  for (int k = 0; k < parts; k++) largest = fmax(largest, d.largest[k]);
  return largest;
}

/* Largest entry of an inverse block: products with it stay in the range of single precision. */
static const double LARGEST = 1e30;

static void invert(const double *of_A, double scale, float *to)
{
  double block[9], inverse[9] = {0};
  for (int e = 0; e < 9; e++) block[e] = scale * of_A[e];
  const double trace = fabs(block[0]) + fabs(block[4]) + fabs(block[8]);
  if (!flesh_block_invert(block, inverse))
    for (int c = 0; c < 3; c++) inverse[4 * c] = trace > 0 ? 3 / trace : 1;
  for (int e = 0; e < 9; e++) to[e] = (float)fmin(fmax(inverse[e], -LARGEST), LARGEST);
}

void flesh_diagonal_invert(const flesh_block_matrix *A, int rows, double scale, float *inverse)
{
  for (size_t k = 0; k < (size_t)rows; k++)
    invert(A->values + 9 * (size_t)A->row_start[k], scale, inverse + 9 * k);
}

void flesh_diagonal_invert_sums(const flesh_block_matrix *A, const flesh_team *team, double scale, double *blocks,
                                float *inverse)
{
  const flesh_team_vector vector = {9, 9, NULL, blocks, 0};
  const size_t own = (size_t)team->own, rows = (size_t)A->rows;
  for (size_t k = 0; k < rows; k++) memcpy(blocks + 9 * k, A->values + 9 * (size_t)A->row_start[k], 9 * sizeof *blocks);
  team->operations->add_ghosts(team->data, &vector);
  for (size_t k = 0; k < own; k++) invert(blocks + 9 * k, scale, inverse + 9 * k);
  for (size_t e = 0; e < 9 * own; e++) blocks[e] = (double)inverse[e];
  team->operations->update_ghosts(team->data, &vector);
  for (size_t e = 9 * own; e < 9 * rows; e++) inverse[e] = (float)blocks[e];
}
