/* product.c: multiplies the rows of each half in a task of its own, then those of the separator.
 *
 * Both halves add to the separator's nodes: the first half in place, the second to copies (twins) of these nodes behind the
 * vectors, which are added at the end.
 *
 * In single precision rows go side by side, as many as a register has lanes, and their blocks in columns: the first of
 * each, the second, and so on. Rows of about the same length are grouped, so that few lanes are empty. */
#include "linear/product.h"

#include <limits.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "base/sort_by_length.h"
#include "linear/sliced_ell.h"

/* Returns the place in x and y of the first twin of a separator's node, behind the padding. */
static int first_twin(const flesh_product *product)
{
  const int padding = FLESH_PRODUCT_PADDING;
  return (product->begin[3] + padding - 1) / padding * padding;
}

enum {
  WINDOW = 256, /* rows, in whole slices, that are sorted by length together, so that they stay near each other */
  BEHIND = 1,   /* numbers: three are loaded with the one behind them */
  DIAGONAL = 6  /* vectors of a slice's diagonal blocks, which are symmetric: xx, xy, xz, yy, yz, zz */
};

_Static_assert(WINDOW % FLESH_SLICE == 0, "a slice lies in one window");

/* Returns the index of a slice's first rounded block, nine vectors for each column. */
static size_t rounded_at(const flesh_product *product, int slice)
{
  return FLESH_SLICE * 9 * (size_t)product->column[slice];
}

/* Returns the index of a slice's diagonal blocks, which are behind all the others: processors prefetch data that is read
 * with one stride. */
static size_t diagonal_at(const flesh_product *product, int slice)
{
  return rounded_at(product, product->slices[3]) + FLESH_SLICE * DIAGONAL * (size_t)slice;
}

/* Returns how many lanes of a slice of `part` have a row. */
static int rows_of_slice(const flesh_product *product, int part, int slice)
{
  const int left = product->begin[part + 1] - product->begin[part] - FLESH_SLICE * (slice - product->slices[part]);
  return left < FLESH_SLICE ? left : FLESH_SLICE;
}

/* Distributes the rows to slices, and finds where the slices' columns begin. `length`: blocks of each row. `sorted`: work
 * space. */
static void place_slices(flesh_product *product, const int *length, int *sorted)
{
  int slice = 0, columns = 0;
  for (int part = 0; part < 3; part++) {
    product->slices[part] = slice;
    for (int begin = product->begin[part], end; begin < product->begin[part + 1]; begin = end) {
      end = product->begin[part + 1] - begin > WINDOW ? begin + WINDOW : product->begin[part + 1];
      flesh_sort_by_length(begin, end, length, sorted);
      if (length[sorted[begin]] > product->longest) product->longest = length[sorted[begin]];
      for (int p = begin; p < end; p += FLESH_SLICE, slice++) {
        for (int l = 0; l < FLESH_SLICE; l++)
          product->own[FLESH_SLICE * slice + l] = 4 * (unsigned)sorted[p + l < end ? p + l : p];
        product->column[slice] = columns;
        columns += length[sorted[p]] - 1;
      }
    }
  }
  product->slices[3] = slice;
  product->column[slice] = columns;
}

/* Makes the slices and their places. A lane without a row, or past its row's end, has the place of its row, or of the first
 * one: zero is added there. FLESH_ERR_MEMORY: the caller clears the product. */
static int make_slices(flesh_product *product)
{
  const size_t rows = (size_t)product->begin[3], most = rows / FLESH_SLICE + 3;
  int *length = flesh_malloc((2 * rows + 1) * sizeof *length);
  product->column = flesh_malloc((most + 1) * sizeof *product->column);
  product->own = flesh_malloc((FLESH_SLICE * most + 1) * sizeof *product->own);
  if (!length || !product->column || !product->own) {
    flesh_free(length);
    return FLESH_ERR_MEMORY;
  }
  for (size_t p = 0; p < rows; p++) length[p] = product->first[p + 1] - product->first[p];
  place_slices(product, length, length + rows);
  const int slices = product->slices[3], columns = product->column[slices];
  product->other = flesh_huge_pages_alloc((FLESH_SLICE * (size_t)columns + 1) * sizeof *product->other);
  product->rounded = flesh_huge_pages_alloc((diagonal_at(product, slices) + 1) * sizeof *product->rounded);
  product->nothing = flesh_calloc(9 * (size_t)product->longest + BEHIND, sizeof *product->nothing);
  const int made = product->other && product->rounded && product->nothing;
  for (int part = 0; part < 3 && made; part++)
    for (int s = product->slices[part]; s < product->slices[part + 1]; s++)
      for (int l = 0; l < FLESH_SLICE; l++) {
        const unsigned own = product->own[FLESH_SLICE * s + l];
        const int blocks = l < rows_of_slice(product, part, s) ? length[own / 4] : 0;
        for (int c = product->column[s], b = 1; c < product->column[s + 1]; c++, b++)
          product->other[FLESH_SLICE * c + l] = b < blocks ? product->place[product->first[own / 4] + b] : own;
      }
  flesh_free(length);
  return made ? FLESH_OK : FLESH_ERR_MEMORY;
}

int flesh_product_create(const flesh_block_matrix *A, const flesh_bisection *bisection, int single,
                         flesh_product *product)
{
  const size_t rows = (size_t)A->rows, blocks = (size_t)A->row_start[A->rows];
  *product = (flesh_product){0};
  memcpy(product->begin, bisection->begin, sizeof product->begin);
  product->blocks = (int)blocks;
  product->nodes = first_twin(product) + product->begin[3] - product->begin[2];
  product->rows = flesh_malloc((rows + 1) * sizeof *product->rows);
  product->first = flesh_malloc((rows + 1) * sizeof *product->first);
  product->place = flesh_huge_pages_alloc((blocks + 1) * sizeof *product->place);
  int *place = flesh_malloc((rows + 1) * sizeof *place);
  if (!product->rows || !product->first || !product->place || !place || product->nodes > INT_MAX / 4) {
    flesh_free(place);
    flesh_product_clear(product);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the products of %d nodes", A->rows);
  }
  memcpy(product->rows, bisection->order, rows * sizeof *product->rows);
  for (int p = 0; p <= A->rows; p++) product->first[p] = A->row_start[p < A->rows ? product->rows[p] : p];
  for (int part = 0; part < 3; part++) {
    for (int p = 0; p < A->rows; p++)
      place[product->rows[p]] = part == 1 && p >= product->begin[2] ? first_twin(product) + p - product->begin[2] : p;
    for (int p = product->begin[part]; p < product->begin[part + 1]; p++)
      for (int k = A->row_start[product->rows[p]]; k < A->row_end[product->rows[p]]; k++)
        product->place[k] = 4 * (unsigned)place[A->column[k]];
  }
  flesh_free(place);
  if (single && make_slices(product)) {
    flesh_product_clear(product);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the products of %d nodes", A->rows);
  }
  return FLESH_OK;
}

void flesh_product_clear(flesh_product *product)
{
  flesh_free(product->rows);
  flesh_free(product->first);
  flesh_free(product->place);
  flesh_free(product->column);
  flesh_free(product->own);
  flesh_free(product->other);
  flesh_free(product->rounded);
  flesh_free(product->nothing);
  *product = (flesh_product){0};
}

enum {
  MANY_BLOCKS = 200000, /* blocks of a matrix beyond the caches, which is prefetched AHEAD */
  AHEAD = 9216,  /* bytes */
  SOON = 2,      /* slices by which rows to be rounded are prefetched */
  WRITTEN = 8,   /* columns by which written data is prefetched */
  LINE = 64      /* bytes */
};

/* Prefetches `bytes` of the matrix, AHEAD. */
static inline void expect(const void *matrix, int bytes)
{
  for (int b = 0; b < bytes; b += LINE) FLESH_EXPECT_ONCE((const char *)matrix + AHEAD + b);
}

typedef struct multiplication {
  flesh_product *product;
  const flesh_block_matrix *A; /* NULL: its rounded blocks are used */
  double scale;
  int single; /* 1: x and y are in single precision */
  void *x, *y;
  double curvature[3];
  const flesh_product_maker *maker; /* NULL: x is ready */
} multiplication;

/* Functions for four times a number, and for the sums of three vectors' first three lanes. With AVX they avoid a detour
 * that compilers would make: each lane through memory by itself, so that loading two of them waits for both. */
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

/* Multiplies a part's rows, y += A x; returns its share of x.A x. If A fits the caches, the processor prefetches by
 * itself. */
static __attribute__((noinline)) double rows_double(const multiplication *m, int part)
{
  const flesh_product *product = m->product;
  const int far = product->blocks > MANY_BLOCKS;
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
      if (far) expect(block, LINE);
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

/* Rounds blocks of several rows side by side, `offset` behind the beginnings of the rows, scaled, entry by entry. */
static inline __attribute__((always_inline)) void round_blocks(const double *const begin[FLESH_SLICE], size_t offset,
                                                               double scale, flesh_sliced_ell entry[9])
{
  for (int r = 0; r < 9; r += 3) {
    flesh_sliced_ell row[4];
    for (int q = 0; q < 4; q++)
      row[q] = flesh_sliced_ell_rounded(scale, begin[q] + offset + r, begin[q + FLESH_SLICE - 4] + offset + r);
    flesh_sliced_ell_turn(row, entry + r);
  }
}

/* A slice that is being rounded. */
typedef struct rounding {
  const double *block[FLESH_SLICE], *soon[FLESH_SLICE]; /* first blocks of its rows, and of rows that come SOON */
  int length[FLESH_SLICE], left;                        /* lengths; number of lanes with blocks left, which come first */
} rounding;

/* Begins to round slice s of a part, with its diagonal blocks. */
static void begin_rounding(const multiplication *m, int part, int s, rounding *now)
{
  const flesh_product *product = m->product;
  const int last = FLESH_SLICE * product->slices[part + 1] - 1;
  now->left = rows_of_slice(product, part, s);
  for (int l = 0; l < FLESH_SLICE; l++) {
    const int lane = FLESH_SLICE * s + l, later = lane + FLESH_SLICE * SOON;
    const unsigned row = product->own[lane] / 4, later_row = product->own[later < last ? later : last] / 4;
    now->block[l] = l < now->left ? m->A->values + 9 * (size_t)product->first[row] : product->nothing;
    now->soon[l] = m->A->values + 9 * (size_t)product->first[later_row];
    now->length[l] = product->first[row + 1] - product->first[row];
    FLESH_EXPECT_ONCE(now->soon[l]);
  }
  flesh_sliced_ell entry[9], *diagonal = (flesh_sliced_ell *)(product->rounded + diagonal_at(product, s));
  round_blocks(now->block, 0, m->scale, entry);
  for (int r = 0, e = 0; r < 3; r++)
    for (int c = r; c < 3; c++) diagonal[e++] = entry[3 * r + c];
}

/* Rounds the slice's b-th blocks, b > 0. */
static inline __attribute__((always_inline)) void round_column(rounding *now, int b, double scale,
                                                               const double *nothing, flesh_sliced_ell to[9])
{
  for (; now->left > 0 && now->length[now->left - 1] <= b; now->left--) now->block[now->left - 1] = nothing;
  for (int l = 0; l < FLESH_SLICE; l++) FLESH_EXPECT_ONCE(now->soon[l] + LINE / (int)sizeof(double) * b);
  for (size_t line = 0; line < 9 * sizeof *to; line += LINE)
    __builtin_prefetch((const char *)(to + 9 * WRITTEN) + line, 1, 3);
  flesh_sliced_ell entry[9];
  round_blocks(now->block, 9 * (size_t)b, scale, entry);
  for (int e = 0; e < 9; e++) to[e] = entry[e];
}

/* Multiplies like rows_double, in slices; `anew`: from A's own blocks, which it rounds. */
static inline __attribute__((always_inline)) double rows_single(const multiplication *m, int part, int anew)
{
  const flesh_product *product = m->product;
  const int begin = product->slices[part], end = product->slices[part + 1], far = product->blocks > MANY_BLOCKS;
  const float *x = m->x;
  float *y = m->y;
  flesh_sliced_ell *block = (flesh_sliced_ell *)(product->rounded + rounded_at(product, begin));
  const flesh_sliced_ell *d = (const flesh_sliced_ell *)(product->rounded + diagonal_at(product, begin));
  const unsigned *own = product->own + FLESH_SLICE * (size_t)begin;
  const unsigned *other = product->other + FLESH_SLICE * (size_t)product->column[begin];
  const double scale = m->scale;
  rounding now;
  flesh_double4 curvature = {0};
  for (int s = begin; s < end; s++, own += FLESH_SLICE, d += DIAGONAL) {
    flesh_sliced_ell xi[3], xj[3], upper[3] = {{0}}, turned[3];
    if (anew) begin_rounding(m, part, s, &now);
    flesh_sliced_ell_gather(x, own, xi);
    const int columns = product->column[s + 1] - product->column[s];
    for (int b = 1; b <= columns; b++, block += 9, other += FLESH_SLICE) {
      if (anew) round_column(&now, b, scale, product->nothing, block);
      else if (far) expect(block, 9 * sizeof *block);
      flesh_sliced_ell_gather(x, other, xj);
      for (int r = 0; r < 3; r++) {
        flesh_sliced_ell row[3];
        for (int k = 0; k < 3; k++) {
          row[k] = block[3 * r + k];
          FLESH_LANES_KEEP(row[k]);
          upper[r] += row[k] * xj[k];
          turned[k] = r > 0 ? turned[k] + row[k] * xi[r] : row[k] * xi[r];
        }
      }
      flesh_sliced_ell_add(y, other, turned);
    }
    const flesh_sliced_ell sum[3] = {upper[0] + (d[0] * xi[0] + d[1] * xi[1] + d[2] * xi[2]),
                                upper[1] + (d[1] * xi[0] + d[3] * xi[1] + d[4] * xi[2]),
                                upper[2] + (d[2] * xi[0] + d[4] * xi[1] + d[5] * xi[2])};
    flesh_sliced_ell_add(y, own, sum);
    const flesh_sliced_ell terms =
        xi[0] * (sum[0] + upper[0]) + xi[1] * (sum[1] + upper[1]) + xi[2] * (sum[2] + upper[2]);
    for (int g = 0; g < FLESH_SLICE / 4; g++) curvature += FLESH_LANES_WIDE(flesh_sliced_ell_part(terms, g));
  }
  return (curvature[0] + curvature[1]) + (curvature[2] + curvature[3]);
}

/* These loops have enough registers as functions of their own. */
static __attribute__((noinline)) double rows_rounded_anew(const multiplication *m, int part)
{
  return rows_single(m, part, 1);
}

static __attribute__((noinline)) double rows_rounded_before(const multiplication *m, int part)
{
  return rows_single(m, part, 0);
}

static double multiply_rows(const multiplication *m, int part)
{
  if (!m->single) return rows_double(m, part);
  return m->A ? rows_rounded_anew(m, part) : rows_rounded_before(m, part);
}

/* Returns the bytes of a node in vectors. */
static size_t size_of(const multiplication *m) { return 4 * (m->single ? sizeof(float) : sizeof(double)); }

static void *at(const multiplication *m, void *vector, int place)
{
  return (char *)vector + size_of(m) * (size_t)place;
}

/* Makes x of a part ready before its rows are multiplied, and sets y = 0. */
static void make_ready(const multiplication *m, int part)
{
  const int begin = m->product->begin[part], end = m->product->begin[part + 1];
  if (m->maker) m->maker->make(m->maker->data, begin, end);
  memset(at(m, m->y, begin), 0, (size_t)(end - begin) * size_of(m));
}

static void multiply_half(void *data, int half)
{
  multiplication *m = data;
  make_ready(m, half);
  m->curvature[half] = multiply_rows(m, half);
}

/* Adds the second half's sums for the separator's nodes, which are in their twins. */
static void add_twins(const multiplication *m, int first, int separator, int twin)
{
  for (int e = 0; e < 4 * separator; e++) {
    if (m->single) ((float *)m->y)[4 * (size_t)first + (size_t)e] += ((float *)m->y)[4 * (size_t)twin + (size_t)e];
    else ((double *)m->y)[4 * (size_t)first + (size_t)e] += ((double *)m->y)[4 * (size_t)twin + (size_t)e];
  }
}

static double multiply(multiplication *m, flesh_threads *threads)
{
  const flesh_product *product = m->product;
  const int first = product->begin[2], separator = product->begin[3] - first, twin = first_twin(product);
  make_ready(m, 2);
  memcpy(at(m, m->x, twin), at(m, m->x, first), (size_t)separator * size_of(m));
  memset(at(m, m->y, twin), 0, (size_t)separator * size_of(m));
  flesh_threads_run(threads, 2, multiply_half, m);
  add_twins(m, first, separator, twin);
  m->curvature[2] = multiply_rows(m, 2);
  return m->curvature[0] + m->curvature[1] + m->curvature[2];
}

double flesh_product_multiply(flesh_product *product, const flesh_block_matrix *A, flesh_threads *threads,
                              const flesh_product_maker *maker, double *x, double *y)
{
  return multiply(&(multiplication){.product = product, .A = A, .x = x, .y = y, .maker = maker}, threads);
}

double flesh_product_multiply_single(flesh_product *product, const flesh_block_matrix *A, double scale,
                                     flesh_threads *threads, const flesh_product_maker *maker, float *x, float *y)
{
  multiplication m = {.product = product, .A = A, .scale = scale, .single = 1, .x = x, .y = y, .maker = maker};
  return multiply(&m, threads);
}
