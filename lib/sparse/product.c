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

enum {
  GAP = 4 /* numbers between the parts' rounded blocks: a block's last row is stored with the number after it */
};

int flesh_product_create(const flesh_block_matrix *A, const flesh_halves *halves, int single, flesh_product *product)
{
  const size_t rows = (size_t)A->rows, blocks = (size_t)A->row_start[A->rows];
  *product = (flesh_product){0};
  memcpy(product->begin, halves->begin, sizeof product->begin);
  product->blocks = (int)blocks;
  product->nodes = first_twin(product) + product->begin[3] - product->begin[2];
  product->rows = malloc((rows + 1) * sizeof *product->rows);
  product->first = malloc((rows + 1) * sizeof *product->first);
  product->place = flesh_large((blocks + 1) * sizeof *product->place);
  if (single) product->rounded = flesh_large((9 * blocks + 3 * GAP) * sizeof *product->rounded);
  int *place = malloc((rows + 1) * sizeof *place);
  if (!product->rows || !product->first || !product->place || !place || (single && !product->rounded) ||
      product->nodes > INT_MAX / 4) {
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
  free(product->rounded);
  *product = (flesh_product){0};
}

size_t flesh_product_memory(const flesh_product *product)
{
  const size_t blocks = (size_t)product->blocks;
  return 2 * (size_t)product->begin[3] * sizeof(int) + blocks * sizeof(int) +
         (product->rounded ? 9 * blocks * sizeof *product->rounded : 0);
}

/* Matrices beyond the caches, of MANY blocks, are fetched AHEAD blocks ahead. Of others the processor fetches itself
 * what comes next, and faster, if every row asks for two lines so that it does not forget to. */
enum { MANY = 200000, AHEAD = 128, APART = 4, LINE = 64 };

typedef struct multiplication {
  flesh_product *product;
  const flesh_block_matrix *A; /* NULL: its rounded blocks */
  double scale;
  int single; /* which x and y are */
  void *x, *y;
  double curvature[3];
  void (*make)(void *data, int begin, int end); /* NULL: x is ready */
  void *data;
} multiplication;

/* A block's rows as they are. */
static inline __attribute__((always_inline)) void take_double(const multiplication *m, const double **block,
                                                              const double **exact, int rounding, flesh_double4 row[3])
{
  (void)m, (void)exact, (void)rounding;
  for (int r = 0; r < 3; r++) row[r] = FLESH_LANES_DOUBLE(*block + 3 * r);
  *block += 9;
}

/* Its rounded rows, which are made at first. */
static inline __attribute__((always_inline)) void take_single(const multiplication *m, float **block,
                                                              const double **exact, int rounding, flesh_float4 row[3])
{
  for (int r = 0; r < 3; r++) {
    flesh_float4_loose *rounded = (flesh_float4_loose *)(*block + 3 * r);
    if (rounding) *rounded = row[r] = FLESH_LANES_NARROW(m->scale * FLESH_LANES_DOUBLE(*exact + 3 * r));
    else row[r] = *rounded;
  }
  *block += 9;
  if (rounding) *exact += 9;
}

#define ROWS rows_double
#define REAL double
#define LANES flesh_double4
#define BLOCK const double
#define FIRST_BLOCK(m, part, k) ((m)->A->values + 9 * (size_t)(k))
#define TAKE take_double
#include "sparse/product_rows.h"
#undef ROWS
#undef REAL
#undef LANES
#undef BLOCK
#undef FIRST_BLOCK
#undef TAKE

#define ROWS rows_single
#define REAL float
#define LANES flesh_float4
#define BLOCK float
#define FIRST_BLOCK(m, part, k) ((m)->product->rounded + 9 * (size_t)(k) + GAP * (part))
#define TAKE take_single
#include "sparse/product_rows.h"

static double multiply_rows(const multiplication *m, int part)
{
  const int far = m->product->blocks > MANY;
  if (!m->single) return far ? rows_double(m, part, 1, 0) : rows_double(m, part, 0, 0);
  if (m->A) return rows_single(m, part, 1, 1);
  return far ? rows_single(m, part, 1, 0) : rows_single(m, part, 0, 0);
}

/* Bytes of a node in vectors. */
static size_t size_of(const multiplication *m) { return 4 * (m->single ? sizeof(float) : sizeof(double)); }

static void *at(const multiplication *m, void *vector, int place) { return (char *)vector + size_of(m) * (size_t)place; }

/* x of a part before its rows are multiplied, and y = 0. */
static void make_ready(const multiplication *m, int part)
{
  const int begin = m->product->begin[part], end = m->product->begin[part + 1];
  if (m->make) m->make(m->data, begin, end);
  memset(at(m, m->y, begin), 0, (size_t)(end - begin) * size_of(m));
}

static void multiply_half(void *data, int half)
{
  multiplication *m = data;
  make_ready(m, half);
  m->curvature[half] = multiply_rows(m, half);
}

/* What the second half has added to the twins of the nodes between. */
static void add_twins(const multiplication *m, int first, int between, int twin)
{
  for (int e = 0; e < 4 * between; e++) {
    if (m->single) ((float *)m->y)[4 * (size_t)first + (size_t)e] += ((float *)m->y)[4 * (size_t)twin + (size_t)e];
    else ((double *)m->y)[4 * (size_t)first + (size_t)e] += ((double *)m->y)[4 * (size_t)twin + (size_t)e];
  }
}

static double multiply(multiplication *m, flesh_threads *threads)
{
  const flesh_product *product = m->product;
  const int first = product->begin[2], between = product->begin[3] - first, twin = first_twin(product);
  make_ready(m, 2);
  memcpy(at(m, m->x, twin), at(m, m->x, first), (size_t)between * size_of(m));
  memset(at(m, m->y, twin), 0, (size_t)between * size_of(m));
  flesh_threads_run(threads, 2, multiply_half, m);
  add_twins(m, first, between, twin);
  m->curvature[2] = multiply_rows(m, 2);
  return m->curvature[0] + m->curvature[1] + m->curvature[2];
}

double flesh_product_multiply(flesh_product *product, const flesh_block_matrix *A, flesh_threads *threads,
                              void (*make)(void *data, int begin, int end), void *data, double *x, double *y)
{
  return multiply(&(multiplication){.product = product, .A = A, .x = x, .y = y, .make = make, .data = data}, threads);
}

double flesh_product_multiply_single(flesh_product *product, const flesh_block_matrix *A, double scale,
                                     flesh_threads *threads, void (*make)(void *data, int begin, int end), void *data,
                                     float *x, float *y)
{
  multiplication m = {.product = product, .A = A, .scale = scale, .single = 1, .x = x, .y = y, .make = make,
                      .data = data};
  return multiply(&m, threads);
}
