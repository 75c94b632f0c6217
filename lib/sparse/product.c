/* product.c: each half's rows by one task, then the rows between, which may add to both.
 *
 * Both halves add to the nodes between: the first where they are, the second to twins of theirs behind the vectors. */
#include "sparse/product.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/large.h"
#include "sparse/lanes.h"

static int compare_int(const void *a, const void *b)
{
  int x = *(const int *)a, y = *(const int *)b;
  return (x > y) - (x < y);
}

/* Where the twins of the nodes between begin in x and y: behind the padding. */
static int first_twin(const flesh_product *product)
{
  const int padding = FLESH_PRODUCT_PADDING;
  return (product->begin[3] + padding - 1) / padding * padding;
}

int flesh_product_create(const flesh_block_matrix *A, const flesh_halves *halves, flesh_product *product)
{
  const size_t rows = (size_t)A->rows, blocks = (size_t)A->row_start[A->rows];
  *product = (flesh_product){0};
  memcpy(product->begin, halves->begin, sizeof product->begin);
  product->blocks = (int)blocks;
  product->nodes = first_twin(product) + product->begin[3] - product->begin[2];
  product->rows = malloc((rows + 1) * sizeof *product->rows);
  product->place = flesh_large((blocks + 1) * sizeof *product->place);
  int *twin = malloc((rows + 1) * sizeof *twin);
  if (!product->rows || !product->place || !twin || product->nodes > INT_MAX / 4) {
    free(twin);
    flesh_product_clear(product);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the products of %d nodes", A->rows);
  }
  memcpy(product->rows, halves->order, rows * sizeof *product->rows);
  for (int part = 0; part < 3; part++)
    qsort(product->rows + product->begin[part],
          (size_t)(product->begin[part + 1] - product->begin[part]), sizeof *product->rows, compare_int);
  for (int i = 0; i < A->rows; i++) twin[i] = i;
  for (int p = product->begin[2]; p < A->rows; p++)
    twin[product->rows[p]] = first_twin(product) + p - product->begin[2];
  for (int p = 0; p < A->rows; p++) {
    const int second = p >= product->begin[1] && p < product->begin[2], i = product->rows[p];
    for (int k = A->row_start[i]; k < A->row_start[i + 1]; k++)
      product->place[k] = 4 * (second ? twin[A->column[k]] : A->column[k]);
  }
  free(twin);
  return FLESH_OK;
}

void flesh_product_clear(flesh_product *product)
{
  free(product->rows);
  free(product->place);
  *product = (flesh_product){0};
}

size_t flesh_product_memory(const flesh_product *product)
{
  return (size_t)product->begin[3] * sizeof(int) + (size_t)product->blocks * sizeof(int);
}

/* Rows that are fetched ahead: a part's are in runs, and not all neighbours in memory. */
enum { AHEAD = 16 };

typedef struct multiplication {
  flesh_product *product;
  const flesh_block_matrix *A;
  double *x, *y, curvature[3];
} multiplication;

static flesh_double4 *at(double *vector, int place) { return (flesh_double4 *)(vector + 4 * (size_t)place); }

/* The rows of a part. */
static double multiply_rows(const multiplication *m, int part)
{
  const flesh_product *product = m->product;
  const int *start = m->A->row_start, *place = product->place;
  const int end = product->begin[part + 1];
  double *x = m->x, *y = m->y;
  flesh_double4 curvature = {0};
  for (int p = product->begin[part]; p < end; p++) {
    const int i = product->rows[p], soon = product->rows[p + AHEAD < end ? p + AHEAD : end - 1];
    const ptrdiff_t ahead = 9 * ((ptrdiff_t)start[soon] - start[i]);
    const double *block = m->A->values + 9 * (size_t)start[i];
    const flesh_double4 xi = *at(x, i);
    const double x0 = xi[0], x1 = xi[1], x2 = xi[2];
    flesh_double4 row0 = FLESH_LANES_DOUBLE(block), row1 = FLESH_LANES_DOUBLE(block + 3),
                  row2 = {block[6], block[7], block[8], 0};
    /* The diagonal block is symmetric. */
    flesh_double4 diagonal = row0 * x0 + row1 * x1 + row2 * x2, sum0 = {0}, sum1 = {0}, sum2 = {0};
    for (int k = start[i] + 1; k < start[i + 1]; k++) {
      block += 9;
      __builtin_prefetch(block + ahead);
      const int j = place[k];
      const flesh_double4 xj = *(const flesh_double4 *)(x + j);
      flesh_double4 *yj = (flesh_double4 *)(y + j);
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
    const flesh_double4 upper = FLESH_LANES_SUMS(sum0, sum1, sum2);
    *at(y, i) += diagonal + upper;
    curvature += xi * (diagonal + upper + upper);
  }
  return (curvature[0] + curvature[1]) + curvature[2];
}

static void multiply_half(void *data, int half)
{
  multiplication *m = data;
  const int *begin = m->product->begin;
  for (int p = begin[half]; p < begin[half + 1]; p++) *at(m->y, m->product->rows[p]) = (flesh_double4){0};
  m->curvature[half] = multiply_rows(m, half);
}

void flesh_product_multiply(flesh_product *product, const flesh_block_matrix *A, flesh_threads *threads,
                            double *x, double *y, double *curvature)
{
  multiplication m = {product, A, x, y, {0}};
  const int first = product->begin[2], between = product->begin[3] - first, twin = first_twin(product);
  for (int b = 0; b < between; b++) {
    *at(x, twin + b) = *at(x, product->rows[first + b]);
    *at(y, twin + b) = *at(y, product->rows[first + b]) = (flesh_double4){0};
  }
  flesh_threads_run(threads, 2, multiply_half, &m);
  for (int b = 0; b < between; b++) *at(y, product->rows[first + b]) += *at(y, twin + b);
  m.curvature[2] = multiply_rows(&m, 2);
  *curvature = m.curvature[0] + m.curvature[1] + m.curvature[2];
}
