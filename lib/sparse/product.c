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
  product->first = malloc((rows + 1) * sizeof *product->first);
  product->place = flesh_large((blocks + 1) * sizeof *product->place);
  int *place = malloc((rows + 1) * sizeof *place);
  if (!product->rows || !product->first || !product->place || !place || product->nodes > INT_MAX / 4) {
    free(place);
    flesh_product_clear(product);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the products of %d nodes", A->rows);
  }
  memcpy(product->rows, halves->order, rows * sizeof *product->rows);
  for (int p = 0; p <= A->rows; p++) product->first[p] = A->row_start[p < A->rows ? product->rows[p] : p];
  for (int part = 0; part < 3; part++) {
    for (int p = 0; p < A->rows; p++)
      place[product->rows[p]] = part == 1 && p >= product->begin[2] ? first_twin(product) + p - product->begin[2] : p;
    for (int p = product->begin[part]; p < product->begin[part + 1]; p++)
      for (int k = A->row_start[product->rows[p]]; k < A->row_end[product->rows[p]]; k++)
        product->place[k] = 4 * place[A->column[k]];
  }
  free(place);
  return FLESH_OK;
}

void flesh_product_clear(flesh_product *product)
{
  free(product->rows);
  free(product->first);
  free(product->place);
  *product = (flesh_product){0};
}

size_t flesh_product_memory(const flesh_product *product)
{
  return 2 * (size_t)product->begin[3] * sizeof(int) + (size_t)product->blocks * sizeof(int);
}

/* Matrices beyond the caches, of MANY blocks, are fetched AHEAD blocks ahead. Of others the processor fetches itself
 * what comes next, and faster, if every row asks for two lines so that it does not forget to. */
enum { MANY = 200000, AHEAD = 128, APART = 4 };

typedef struct multiplication {
  flesh_product *product;
  const flesh_block_matrix *A;
  double *x, *y, curvature[3];
  void (*make)(void *data, int begin, int end); /* NULL: x is ready */
  void *data;
} multiplication;

static flesh_double4 *at(double *vector, int place) { return (flesh_double4 *)(vector + 4 * (size_t)place); }

/* The rows of a part. */
static inline __attribute__((always_inline)) double multiply_part(const multiplication *m, int part, int far)
{
  const flesh_product *product = m->product;
  const int *place = product->place;
  double *x = m->x, *y = m->y;
  int k = product->first[product->begin[part]];
  const double *block = m->A->values + 9 * (size_t)k;
  flesh_double4 curvature = {0};
  for (int p = product->begin[part]; p < product->begin[part + 1]; p++) {
    const int end = product->first[p + 1];
    const flesh_double4 xi = *at(x, p);
    for (int line = 0; line < 2 && !far; line++) FLESH_EXPECT_ONCE(block + 9 * AHEAD + 8 * APART * line);
    const double x0 = xi[0], x1 = xi[1], x2 = xi[2];
    flesh_double4 row0 = FLESH_LANES_DOUBLE(block), row1 = FLESH_LANES_DOUBLE(block + 3),
                  row2 = {block[6], block[7], block[8], 0};
    /* The diagonal block is symmetric. */
    flesh_double4 diagonal = row0 * x0 + row1 * x1 + row2 * x2, sum0 = {0}, sum1 = {0}, sum2 = {0};
    block += 9;
    for (k++; k < end; k++, block += 9) {
      if (far) FLESH_EXPECT_ONCE(block + 9 * AHEAD);
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
    *at(y, p) += diagonal + upper;
    curvature += xi * (diagonal + upper + upper);
  }
  return (curvature[0] + curvature[1]) + curvature[2];
}

static double multiply_rows(const multiplication *m, int part)
{
  return m->product->blocks > MANY ? multiply_part(m, part, 1) : multiply_part(m, part, 0);
}

/* x of a part before its rows are multiplied, and y = 0. */
static void make_ready(const multiplication *m, int part)
{
  const int begin = m->product->begin[part], end = m->product->begin[part + 1];
  if (m->make) m->make(m->data, begin, end);
  memset(at(m->y, begin), 0, (size_t)(end - begin) * sizeof(flesh_double4));
}

static void multiply_half(void *data, int half)
{
  multiplication *m = data;
  make_ready(m, half);
  m->curvature[half] = multiply_rows(m, half);
}

static double multiply(multiplication *m, flesh_threads *threads)
{
  const flesh_product *product = m->product;
  const int first = product->begin[2], between = product->begin[3] - first, twin = first_twin(product);
  make_ready(m, 2);
  for (int b = 0; b < between; b++) {
    *at(m->x, twin + b) = *at(m->x, first + b);
    *at(m->y, twin + b) = (flesh_double4){0};
  }
  flesh_threads_run(threads, 2, multiply_half, m);
  for (int b = 0; b < between; b++) *at(m->y, first + b) += *at(m->y, twin + b);
  m->curvature[2] = multiply_rows(m, 2);
  return m->curvature[0] + m->curvature[1] + m->curvature[2];
}

void flesh_product_multiply(flesh_product *product, const flesh_block_matrix *A, flesh_threads *threads,
                            double *x, double *y, double *curvature)
{
  *curvature = multiply(&(multiplication){.product = product, .A = A, .x = x, .y = y}, threads);
}

void flesh_product_make_and_multiply(flesh_product *product, const flesh_block_matrix *A, flesh_threads *threads,
                                     void (*make)(void *data, int begin, int end), void *data, double *x, double *y,
                                     double *curvature)
{
  multiplication m = {.product = product, .A = A, .x = x, .y = y, .make = make, .data = data};
  *curvature = multiply(&m, threads);
}
