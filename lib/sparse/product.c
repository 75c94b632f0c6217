/* product.c: each half's rows by one task, then the rows between, which may add to both. */
#include "sparse/product.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "sparse/lanes.h"

static int compare_int(const void *a, const void *b)
{
  int x = *(const int *)a, y = *(const int *)b;
  return (x > y) - (x < y);
}

int flesh_product_create(const flesh_block_matrix *A, const flesh_halves *halves, flesh_product *product)
{
  const size_t rows = (size_t)A->rows, between = rows - (size_t)halves->begin[2];
  *product = (flesh_product){0};
  memcpy(product->begin, halves->begin, sizeof product->begin);
  product->rows = malloc((rows + 1) * sizeof *product->rows);
  product->between = malloc((rows + 1) * sizeof *product->between);
  int failed = !product->rows || !product->between;
  for (int h = 0; h < 2; h++) {
    product->spill[h] = aligned_alloc(32, (between + 1) * 4 * sizeof *product->spill[h]);
    failed |= !product->spill[h];
  }
  if (failed) {
    flesh_product_clear(product);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the products of %d nodes", A->rows);
  }
  memcpy(product->rows, halves->order, rows * sizeof *product->rows);
  for (int part = 0; part < 3; part++)
    qsort(product->rows + product->begin[part],
          (size_t)(product->begin[part + 1] - product->begin[part]), sizeof *product->rows, compare_int);
  for (int p = 0; p < A->rows; p++)
    product->between[product->rows[p]] = p < product->begin[2] ? -1 : p - product->begin[2];
  return FLESH_OK;
}

void flesh_product_clear(flesh_product *product)
{
  free(product->rows);
  free(product->between);
  free(product->spill[0]);
  free(product->spill[1]);
  *product = (flesh_product){0};
}

size_t flesh_product_memory(const flesh_product *product)
{
  return (size_t)product->begin[3] * 2 * sizeof(int) +
         (size_t)(product->begin[3] - product->begin[2]) * 8 * sizeof(double);
}

/* Blocks that are fetched ahead: beyond the caches that takes a quarter off a product, as rows are not all neighbours
 * in memory. */
enum { AHEAD = 24 };

typedef struct multiplication {
  flesh_product *product;
  const flesh_block_matrix *A;
  const double *x;
  double *y, curvature[3];
} multiplication;

/* Rows of a part; columns between go to the spill where there is one. */
static double multiply_rows(const multiplication *m, int part, double *spill)
{
  const flesh_product *product = m->product;
  const int *start = m->A->row_start, *column = m->A->column, *between = product->between;
  const double *x = m->x;
  double *y = m->y, curvature = 0;
  for (int p = product->begin[part]; p < product->begin[part + 1]; p++) {
    const int i = product->rows[p];
    const double *block = m->A->values + 9 * (size_t)start[i];
    const double x0 = x[4 * (size_t)i], x1 = x[4 * (size_t)i + 1], x2 = x[4 * (size_t)i + 2];
    flesh_double4 row0 = FLESH_LANES_DOUBLE(block), row1 = FLESH_LANES_DOUBLE(block + 3),
                  row2 = {block[6], block[7], block[8], 0};
    /* The diagonal block is symmetric. */
    flesh_double4 diagonal = row0 * x0 + row1 * x1 + row2 * x2, sum0 = {0}, sum1 = {0}, sum2 = {0};
    for (int k = start[i] + 1; k < start[i + 1]; k++) {
      block += 9;
      __builtin_prefetch(block + 9 * AHEAD);
      const int j = column[k];
      flesh_double4 xj = *(const flesh_double4 *)(x + 4 * (size_t)j);
      flesh_double4 *yj = (flesh_double4 *)(spill && between[j] >= 0 ? spill + 4 * (size_t)between[j]
                                                                     : y + 4 * (size_t)j);
      row0 = FLESH_LANES_DOUBLE(block);
      row1 = FLESH_LANES_DOUBLE(block + 3);
      row2 = FLESH_LANES_DOUBLE(block + 6);
      FLESH_LANES_KEEP(row0);
      FLESH_LANES_KEEP(row1);
      FLESH_LANES_KEEP(row2);
      sum0 += row0 * xj;
      sum1 += row1 * xj;
      sum2 += row2 * xj;
      *yj += row0 * x0 + row1 * x1 + row2 * x2;
    }
    flesh_double4 upper = FLESH_LANES_SUMS(sum0, sum1, sum2), twice = diagonal + upper + upper;
    *(flesh_double4 *)(y + 4 * (size_t)i) += diagonal + upper;
    curvature += x0 * twice[0] + x1 * twice[1] + x2 * twice[2];
  }
  return curvature;
}

static void multiply_half(void *data, int half)
{
  multiplication *m = data;
  const flesh_product *product = m->product;
  const int *begin = product->begin;
  memset(product->spill[half], 0, (size_t)(begin[3] - begin[2]) * 4 * sizeof(double));
  for (int p = begin[half]; p < begin[half + 1]; p++)
    *(flesh_double4 *)(m->y + 4 * (size_t)product->rows[p]) = (flesh_double4){0};
  m->curvature[half] = multiply_rows(m, half, product->spill[half]);
}

void flesh_product_multiply(flesh_product *product, const flesh_block_matrix *A, flesh_threads *threads,
                            const double *x, double *y, double *curvature)
{
  multiplication m = {product, A, x, y, {0}};
  flesh_threads_run(threads, 2, multiply_half, &m);
  for (int p = product->begin[2]; p < product->begin[3]; p++) {
    size_t s = 4 * (size_t)(p - product->begin[2]);
    for (int c = 0; c < 4; c++)
      y[4 * (size_t)product->rows[p] + c] = product->spill[0][s + c] + product->spill[1][s + c];
  }
  m.curvature[2] = multiply_rows(&m, 2, NULL);
  *curvature = m.curvature[0] + m.curvature[1] + m.curvature[2];
}
