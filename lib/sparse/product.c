/* product.c: each half's rows by one task, then the rows between, which may add to both.
 *
 * Both halves add to the nodes between: the first where they are, the second to twins of theirs behind the vectors. */
#include "sparse/product.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/large.h"
#include "sparse/six.h"

/* Where the twins of the nodes between begin in x and y: behind the padding. */
static int first_twin(const flesh_product *product)
{
  const int padding = FLESH_PRODUCT_PADDING;
  return (product->begin[3] + padding - 1) / padding * padding;
}

enum {
  GAP = 8 /* numbers between the parts' rounded blocks: rows are loaded with numbers after them */
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
        product->place[k] = 4 * (unsigned)place[A->column[k]];
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

/* Matrices beyond the caches, of MANY blocks, are fetched AHEAD blocks ahead. */
enum { MANY = 200000, AHEAD = 128 };

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

/* Four times a number, and the sums of three vectors' first three lanes. Where a register holds two, compilers would
 * take each lane through memory by itself, and what is then loaded as two waits until both have arrived there. */
#ifdef __AVX__
static inline flesh_double4 all_of(double number) { return number - (flesh_double4){0}; }
static inline flesh_double4 sums_of(const flesh_double4 s[3]) { return FLESH_LANES_SUMS(s[0], s[1], s[2]); }
#else
typedef double two_doubles __attribute__((vector_size(16)));

static inline flesh_double4 both_of(two_doubles first, two_doubles second)
{
  const two_doubles halves[2] = {first, second};
  flesh_double4 both;
  memcpy(&both, halves, sizeof both);
  return both;
}

static inline flesh_double4 all_of(double number)
{
  return both_of((two_doubles){number, number}, (two_doubles){number, number});
}

static inline flesh_double4 sums_of(const flesh_double4 s[3])
{
  return both_of((two_doubles){(s[0][0] + s[0][1]) + s[0][2], (s[1][0] + s[1][1]) + s[1][2]},
                 (two_doubles){(s[2][0] + s[2][1]) + s[2][2], 0});
}
#endif

/* A part's rows of y += A x; returns its share of x.A x. `far`: A lies beyond the caches. Of others the processor
 * fetches itself what comes next. */
static inline __attribute__((always_inline)) double rows_double(const multiplication *m, int part, int far)
{
  const flesh_product *product = m->product;
  const unsigned *place = product->place;
  double *x = m->x, *y = m->y;
  int k = product->first[product->begin[part]];
  const double *block = m->A->values + 9 * (size_t)k;
  flesh_double4 curvature = {0};
  for (int p = product->begin[part]; p < product->begin[part + 1]; p++) {
    const int end = product->first[p + 1];
    const flesh_double4 xi = *(const flesh_double4 *)(x + 4 * (size_t)p);
    const flesh_double4 x0 = all_of(xi[0]), x1 = all_of(xi[1]), x2 = all_of(xi[2]);
    flesh_double4 row[3], sum[3] = {{0}};
    for (int r = 0; r < 3; r++) row[r] = FLESH_LANES_DOUBLE(block + 3 * r);
    /* The diagonal block is symmetric. */
    const flesh_double4 diagonal = row[0] * x0 + row[1] * x1 + row[2] * x2;
    for (k++, block += 9; k < end; k++, block += 9) {
      if (far) FLESH_EXPECT_ONCE(block + 9 * AHEAD);
      const flesh_double4 xj = *(const flesh_double4 *)(x + place[k]);
      flesh_double4 *yj = (flesh_double4 *)(y + place[k]);
      for (int r = 0; r < 3; r++) {
        row[r] = FLESH_LANES_DOUBLE(block + 3 * r);
        FLESH_LANES_KEEP(row[r]);
        sum[r] += row[r] * xj;
      }
      *yj += row[0] * x0 + row[1] * x1 + row[2] * x2;
    }
    const flesh_double4 upper = sums_of(sum);
    *(flesh_double4 *)(y + 4 * (size_t)p) += diagonal + upper;
    curvature += xi * (diagonal + upper + upper);
  }
  return (curvature[0] + curvature[1]) + curvature[2];
}

/* In single precision a row's blocks go two by two: row r of two blocks are six numbers side by side. The first is the
 * diagonal one's half, which makes it like any other; where their number is odd, it goes alone. */

/* Row r of two blocks; `exact`, where the first one is as it was, has it rounded and stored, and what is behind it
 * overwritten. */
static inline __attribute__((always_inline)) flesh_six row_of_two(float *block, int r, const double *exact,
                                                                  double scale, double next_scale)
{
  if (!exact) return flesh_six_row(block + 6 * r);
  const flesh_float4 first = flesh_six_rounded(scale, exact + 3 * r);
  const flesh_float4 second = flesh_six_rounded(next_scale, exact + 9 + 3 * r);
  *(flesh_float4_loose *)(block + 6 * r) = first;
  *(flesh_float4_loose *)(block + 6 * r + 3) = second;
  return flesh_six_both(first, second);
}

/* The same of one. */
static inline __attribute__((always_inline)) flesh_six row_of_one(float *block, int r, const double *exact,
                                                                  double scale)
{
  flesh_float4_loose *row = (flesh_float4_loose *)(block + 3 * r);
  if (exact) *row = flesh_six_rounded(scale, exact + 3 * r);
  return flesh_six_one(*row);
}

/* The rows' transposes times x. */
static inline __attribute__((always_inline)) flesh_six transposed(const flesh_six row[3], const flesh_six x[3])
{
  return flesh_six_sum(flesh_six_sum(flesh_six_product(row[0], x[0]), row[1], x[1]), row[2], x[2]);
}

/* Asks for two blocks that are AHEAD. */
static inline __attribute__((always_inline)) void expect_two(const float *block, const double *exact)
{
  for (int b = AHEAD; b < AHEAD + 2; b++)
    FLESH_EXPECT_ONCE(exact ? (const void *)(exact + 9 * b) : (const void *)(block + 9 * b));
}

/* A row whose blocks have been multiplied. Its end, which waits for its sums, comes after the next row's blocks: no
 * more than two rows' instructions are on their way at once, and those that wait would hold up the others. */
typedef struct single_row {
  flesh_six sum[3];
  flesh_float4 diagonal, x;
  float *y;
} single_row;

/* Adds it to y; returns half its terms of x.A x. */
static inline __attribute__((always_inline)) flesh_float4 end_single(const single_row *row)
{
  const flesh_float4 upper = flesh_six_sums(row->sum[0], row->sum[1], row->sum[2]);
  *(flesh_float4 *)row->y += upper + row->diagonal;
  return row->x * upper;
}

/* As rows_double; `rounding`: from A's own blocks. */
static inline __attribute__((always_inline)) double rows_single(const multiplication *m, int part, int far,
                                                                int rounding)
{
  enum { RUN = 16 }; /* rows whose curvature is summed up in single precision */
  const flesh_product *product = m->product;
  const int *first = product->first, begin = product->begin[part], end = product->begin[part + 1];
  const unsigned *place = product->place + first[begin];
  const double *exact = rounding ? m->A->values + 9 * (size_t)first[begin] : NULL, scale = m->scale;
  const float *x = m->x;
  float *y = m->y, *block = product->rounded + 9 * (size_t)first[begin] + GAP * (size_t)part;
  single_row before = {.y = y + 4 * (size_t)begin};
  double curvature = 0;
  for (int p = begin, run_end; p < end;) {
    flesh_float4 of_run = {0};
    for (run_end = end - p > RUN ? p + RUN : end; p < run_end; p++) {
      const int n = first[p + 1] - first[p];
      const float *last = block + 9 * (size_t)n, *xi = x + 4 * (size_t)p;
      single_row now = {.x = *(const flesh_float4 *)xi, .y = y + 4 * (size_t)p};
      flesh_six own[3], row[3], from, turned;
      flesh_six_spread(xi, own);
      if (far) expect_two(block, exact);
      if (n % 2) {
        from = flesh_six_one(now.x);
        for (int r = 0; r < 3; r++) {
          row[r] = row_of_one(block, r, rounding ? exact : NULL, 0.5 * scale);
          now.sum[r] = flesh_six_product(row[r], from);
        }
        turned = transposed(row, own);
        block += 9, place++;
        if (rounding) exact += 9;
      } else {
        const size_t k = place[1];
        from = flesh_six_nodes(xi, x + k);
        for (int r = 0; r < 3; r++) {
          row[r] = row_of_two(block, r, rounding ? exact : NULL, 0.5 * scale, scale);
          FLESH_SIX_KEEP(row[r]);
          now.sum[r] = flesh_six_product(row[r], from);
        }
        turned = transposed(row, own);
        *(flesh_float4 *)(y + k) += flesh_six_second(turned);
        block += 18, place += 2;
        if (rounding) exact += 18;
      }
      now.diagonal = flesh_six_first(turned);
      for (; block != last; block += 18, place += 2) {
        const size_t j = place[0], k = place[1];
        if (far) expect_two(block, exact);
        from = flesh_six_nodes(x + j, x + k);
        for (int r = 0; r < 3; r++) {
          row[r] = row_of_two(block, r, rounding ? exact : NULL, scale, scale);
          FLESH_SIX_KEEP(row[r]);
          now.sum[r] = flesh_six_sum(now.sum[r], row[r], from);
        }
        turned = transposed(row, own);
        *(flesh_float4 *)(y + j) += flesh_six_first(turned);
        *(flesh_float4 *)(y + k) += flesh_six_second(turned);
        if (rounding) exact += 18;
      }
      of_run += end_single(&before);
      before = now;
    }
    if (p == end) of_run += end_single(&before);
    const flesh_double4 half = FLESH_LANES_WIDE(of_run);
    curvature += 2 * ((half[0] + half[1]) + half[2]);
  }
  return curvature;
}

static double multiply_rows(const multiplication *m, int part)
{
  const int far = m->product->blocks > MANY;
  if (!m->single) return far ? rows_double(m, part, 1) : rows_double(m, part, 0);
  if (m->A) return rows_single(m, part, 1, 1);
  return far ? rows_single(m, part, 1, 0) : rows_single(m, part, 0, 0);
}

/* Bytes of a node in vectors. */
static size_t size_of(const multiplication *m) { return 4 * (m->single ? sizeof(float) : sizeof(double)); }

static void *at(const multiplication *m, void *vector, int place)
{
  return (char *)vector + size_of(m) * (size_t)place;
}

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
