/* coarse_cholesky.c: right-looking block Cholesky in the order of SuiteSparse's AMD or in the given order of the rows. */
#include "linear/coarse_cholesky.h"

#include <amd.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "base/sort.h"
#include "linear/lanes.h"

enum {
  N = FLESH_BLOCK12,
  SIZE = FLESH_BLOCK12_SIZE,
  BLOCKS_AHEAD = 16 /* blocks to prefetch, as other data goes through the caches between two solves */
};

/* Lists the rows of the factor's columns: a column has those of the matrix and, without their first, those of the columns
 * whose first row it is (Liu 1990). `order`: rows by place; `mark` [3*n]: work space. Returns their number; -1: more than
 * `room`. */
static int columns_of_factor(flesh_coarse_cholesky *self, const int *starts, const int *neighbours, const int *order,
                             int *mark, int room)
{
  int count = 0, *child = mark + self->n, *next = child + self->n;
  for (int k = 0; k < self->n; k++) mark[k] = child[k] = -1;
  for (int k = 0; k < self->n; k++) {
    self->start[k] = count;
    mark[k] = k;
    for (int e = starts[order[k]]; e < starts[order[k] + 1]; e++) {
      int r = self->place[neighbours[e]];
      if (r > k && mark[r] != k) {
        if (count == room) return -1;
        mark[r] = k;
        self->row[count++] = r;
      }
    }
    for (int c = child[k]; c >= 0; c = next[c])
      for (int e = self->start[c]; e < self->start[c + 1]; e++) {
        int r = self->row[e];
        if (mark[r] == k) continue;
        if (count == room) return -1;
        mark[r] = k;
        self->row[count++] = r;
      }
    self->start[k + 1] = count;
    flesh_sort(self->row + self->start[k], (size_t)(count - self->start[k]), sizeof *self->row, flesh_compare_int);
    if (count > self->start[k]) {
      int parent = self->row[self->start[k]];
      next[k] = child[parent];
      child[parent] = k;
    }
  }
  return count;
}

/* Returns the number of block products in the factorisation. */
static double work_of(const flesh_coarse_cholesky *self)
{
  double work = 0;
  for (int k = 0; k < self->n; k++) {
    const double column = self->start[k + 1] - self->start[k];
    work += column * (column + 1) / 2;
  }
  return work;
}

/* Makes the factor's columns in an order; `room` [3*n] is work space. Returns the number of their blocks, -1 without
 * memory. */
static int order_columns(flesh_coarse_cholesky *self, const int *starts, const int *neighbours, const int *order,
                         int *room)
{
  int blocks = -1;
  for (int k = 0; k < self->n; k++) self->place[order[k]] = k;
  for (int size = 4 * starts[self->n] + 64; blocks < 0; size *= 2) {
    int *grown = flesh_realloc(self->row, (size_t)size * sizeof *grown);
    if (!grown) return -1;
    self->row = grown;
    blocks = columns_of_factor(self, starts, neighbours, order, room, size);
  }
  return blocks;
}

/* Takes AMD's order, or the rows' own if that needs less work: for long bodies, an order from end to end is hard to beat. */
static int make_columns(flesh_coarse_cholesky *self, const int *starts, const int *neighbours, int *room)
{
  const size_t n = (size_t)self->n;
  int *order = room, *own = room + n, *rest = own + n;
  if (amd_order(self->n, starts, neighbours, order, NULL, NULL) < AMD_OK) return FLESH_ERR_MEMORY;
  for (int k = 0; k < self->n; k++) own[k] = k;
  int blocks = order_columns(self, starts, neighbours, order, rest);
  const double work = blocks < 0 ? 0 : work_of(self);
  if (blocks >= 0) blocks = order_columns(self, starts, neighbours, own, rest);
  if (blocks >= 0 && work < work_of(self)) blocks = order_columns(self, starts, neighbours, order, rest);
  if (blocks < 0) return FLESH_ERR_MEMORY;
  self->blocks = flesh_huge_pages_alloc(((size_t)blocks * SIZE + 1) * sizeof *self->blocks);
  self->kept = flesh_huge_pages_alloc(((size_t)blocks * SIZE + 1) * sizeof *self->kept);
  return self->blocks && self->kept ? FLESH_OK : FLESH_ERR_MEMORY;
}

int flesh_coarse_cholesky_create(int n, const int *starts, const int *neighbours, flesh_coarse_cholesky *self)
{
  const size_t rows = (size_t)n;
  *self = (flesh_coarse_cholesky){.n = n};
  self->place = flesh_malloc((rows + 1) * sizeof *self->place);
  self->start = flesh_malloc((rows + 1) * sizeof *self->start);
  self->find = flesh_malloc((rows + 1) * sizeof *self->find);
  self->pivots = flesh_huge_pages_alloc((rows * SIZE + 1) * sizeof *self->pivots);
  self->inverses = flesh_huge_pages_alloc((rows * SIZE + 1) * sizeof *self->inverses);
  self->x = flesh_huge_pages_alloc((rows * N + 1) * sizeof *self->x);
  int *room = flesh_malloc((5 * rows + 1) * sizeof *room);
  int failed = !self->place || !self->start || !self->find || !self->pivots || !self->inverses || !self->x || !room;
  if (!failed) failed = make_columns(self, starts, neighbours, room) != FLESH_OK;
  flesh_free(room);
  if (!failed) return FLESH_OK;
  flesh_coarse_cholesky_clear(self);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for a coarse matrix of %d patches", n);
}

void flesh_coarse_cholesky_clear(flesh_coarse_cholesky *self)
{
  flesh_free(self->place);
  flesh_free(self->start);
  flesh_free(self->row);
  flesh_free(self->find);
  flesh_free(self->blocks);
  flesh_free(self->kept);
  flesh_free(self->pivots);
  flesh_free(self->inverses);
  flesh_free(self->x);
  *self = (flesh_coarse_cholesky){0};
}

void flesh_coarse_cholesky_zero(flesh_coarse_cholesky *self)
{
  memset(self->blocks, 0, (size_t)self->start[self->n] * SIZE * sizeof *self->blocks);
  memset(self->pivots, 0, (size_t)self->n * SIZE * sizeof *self->pivots);
}

double *flesh_coarse_cholesky_at(flesh_coarse_cholesky *self, int low, int high)
{
  if (low == high) return self->pivots + SIZE * (size_t)low;
  const int *found = bsearch(&high, self->row + self->start[low], (size_t)(self->start[low + 1] - self->start[low]),
                             sizeof high, flesh_compare_int);
  return self->blocks + SIZE * (size_t)(found - self->row);
}

/* Computes L of a diagonal block, L[m][r] being row r of column m, and 1 / L[m][m]; returns 0 when the block is indefinite.
 * A pivot below a billionth of the direction's stiffness `whole` counts as zero, and its inverse is then 0. */
static int factor_pivot(double *L, double inverse[N], const double whole[N])
{
  for (int m = 0; m < N; m++) {
    double d = L[N * m + m];
    for (int s = 0; s < m; s++) d -= L[N * s + m] * L[N * s + m];
    if (!(d >= -1e-9 * whole[m]) || !(d < INFINITY)) return 0;
    double i = inverse[m] = d > 1e-9 * whole[m] ? 1 / sqrt(d) : 0;
    for (int r = m + 1; r < N; r++) {
      double sum = L[N * m + r];
      for (int s = 0; s < m; s++) sum -= L[N * s + r] * L[N * s + m];
      L[N * m + r] = sum * i;
    }
  }
  return 1;
}

/* Computes X = L^-1, with inverses of 0 like factor_pivot; returns 0 when it is too large for single precision. */
static int invert_pivot(const double *L, const double inverse[N], float *X)
{
  int fits = 1;
  for (int m = 0; m < N; m++) {
    double column[N] = {0};
    column[m] = 1;
    for (int s = m; s < N; s++) {
      column[s] *= inverse[s];
      for (int r = s + 1; r < N; r++) column[r] -= L[N * s + r] * column[s];
    }
    for (int r = 0; r < N; r++) {
      X[N * m + r] = (float)column[r];
      fits &= fabs(column[r]) < FLT_MAX;
    }
  }
  return fits;
}

/* B L^-T. */
static void divide(double *restrict B, const double *restrict L, const double *inverse)
{
  for (int m = 0; m < N; m++) {
    for (int s = 0; s < m; s++)
      for (int r = 0; r < N; r++) B[N * m + r] -= B[N * s + r] * L[N * s + m];
    for (int r = 0; r < N; r++) B[N * m + r] *= inverse[m];
  }
}

#ifdef __AVX512F__
enum { PAIRS = 6 }; /* pairs of columns whose sums fit the registers */

/* Two columns of twelve are three vectors of eight: eight of the first column, its last four and four of the second, and
 * the other eight of the second. The rows of either column are repeated in the same way: */
typedef struct twelve_doubles {
  flesh_double8 first, middle, last;
} twelve_doubles;

static inline twelve_doubles load_twelve(const double *x)
{
  const flesh_double8 first = FLESH_LANES_DOUBLE8(x), last = FLESH_LANES_DOUBLE8(x + 4);
  return (twelve_doubles){first, __builtin_shufflevector(last, first, 4, 5, 6, 7, 8, 9, 10, 11), last};
}

/* Computes C -= P Q^T, several pairs of columns at a time: P's are loaded once for all of them, and sums stay in
 * registers. */
static void subtract(double *restrict C, const double *restrict P, const double *restrict Q)
{
  for (int s = 0; s < N; s += 2 * PAIRS) {
    flesh_double8 sums[PAIRS][3];
    for (int t = 0; t < PAIRS; t++)
      for (int p = 0; p < 3; p++) sums[t][p] = FLESH_LANES_DOUBLE8(C + N * (s + 2 * t) + 8 * p);
    for (int m = 0; m < N; m++) {
      const twelve_doubles column = load_twelve(P + N * m);
#pragma GCC unroll 6
      for (int t = 0; t < PAIRS; t++) {
        const double one = Q[N * m + s + 2 * t], other = Q[N * m + s + 2 * t + 1];
        sums[t][0] -= column.first * one;
        sums[t][1] -= column.middle * (flesh_double8){one, one, one, one, other, other, other, other};
        sums[t][2] -= column.last * other;
      }
    }
    for (int t = 0; t < PAIRS; t++)
      for (int p = 0; p < 3; p++) FLESH_LANES_DOUBLE8(C + N * (s + 2 * t) + 8 * p) = sums[t][p];
  }
}
#else
/* Computes C -= P Q^T, three registers of rows and four columns at a time: their sums stay in registers. */
static void subtract(double *restrict C, const double *restrict P, const double *restrict Q)
{
  for (int s = 0; s < N; s += 4)
    for (int r = 0; r < N; r += 3 * FLESH_ASIDE) {
      flesh_aside sums[4][3];
      for (int t = 0; t < 4; t++)
        for (int p = 0; p < 3; p++) sums[t][p] = FLESH_LANES_ASIDE(C + N * (s + t) + r + FLESH_ASIDE * p);
      for (int m = 0; m < N; m++) {
        flesh_aside rows[3];
        for (int p = 0; p < 3; p++) rows[p] = FLESH_LANES_ASIDE(P + N * m + r + FLESH_ASIDE * p);
#pragma GCC unroll 4
        for (int t = 0; t < 4; t++)
          for (int p = 0; p < 3; p++) sums[t][p] -= rows[p] * Q[N * m + s + t];
      }
      for (int t = 0; t < 4; t++)
        for (int p = 0; p < 3; p++) FLESH_LANES_ASIDE(C + N * (s + t) + r + FLESH_ASIDE * p) = sums[t][p];
    }
}
#endif

int flesh_coarse_cholesky_factor(flesh_coarse_cholesky *self)
{
  const int *start = self->start, *row = self->row;
  int fits = 1;
  for (int k = 0; k < self->n; k++) /* x is free until the first solve */
    for (int m = 0; m < N; m++) self->x[N * k + m] = (float)self->pivots[SIZE * (size_t)k + (N + 1) * (size_t)m];
  for (int k = 0; k < self->n; k++) {
    double *L = self->pivots + SIZE * (size_t)k, inverse[N], whole[N];
    for (int m = 0; m < N; m++) whole[m] = self->x[N * k + m];
    if (!factor_pivot(L, inverse, whole)) return 0;
    fits &= invert_pivot(L, inverse, self->inverses + SIZE * (size_t)k);
    for (int e = start[k]; e < start[k + 1]; e++) divide(self->blocks + SIZE * (size_t)e, L, inverse);
    for (int e = start[k]; e < start[k + 1]; e++) {
      const double *Q = self->blocks + SIZE * (size_t)e;
      const int column = row[e];
      subtract(self->pivots + SIZE * (size_t)column, Q, Q);
      for (int f = start[column]; f < start[column + 1]; f++) self->find[row[f]] = f;
      for (int f = e + 1; f < start[k + 1]; f++)
        subtract(self->blocks + SIZE * (size_t)self->find[row[f]], self->blocks + SIZE * (size_t)f, Q);
    }
  }
  const size_t entries = (size_t)start[self->n] * SIZE;
  for (size_t e = 0; e < entries; e++) {
    self->kept[e] = (float)self->blocks[e];
    fits &= fabs(self->blocks[e]) < FLT_MAX;
  }
  return fits;
}

/* Twelve numbers in single precision, of a column or of an unknown. */
typedef struct twelve_floats {
  flesh_float4 part[N / 4];
} twelve_floats;

static inline twelve_floats load12_floats(const float *x)
{
  return (twelve_floats){{FLESH_LANES_FLOAT(x), FLESH_LANES_FLOAT(x + 4), FLESH_LANES_FLOAT(x + 8)}};
}

/* Returns sum + B x. */
static inline twelve_floats add_product(twelve_floats sum, const float *B, const float x[N])
{
#pragma GCC unroll 12
  for (int m = 0; m < N; m++)
    for (int p = 0; p < N / 4; p++) sum.part[p] += FLESH_LANES_FLOAT(B + N * m + 4 * p) * x[m];
  return sum;
}

/* Adds B^T y to sums[m], lane by lane. */
static inline void add_transposed(flesh_float4 sums[N], const float *B, twelve_floats y)
{
#pragma GCC unroll 12
  for (int m = 0; m < N; m++)
    for (int p = 0; p < N / 4; p++) sums[m] += FLESH_LANES_FLOAT(B + N * m + 4 * p) * y.part[p];
}

/* Adds up the lanes of the sums of add_transposed. */
static inline twelve_floats gathered(const flesh_float4 sums[N])
{
  twelve_floats all;
  for (int p = 0; p < N / 4; p++) {
    const flesh_float4 *s = sums + 4 * p, a = __builtin_shufflevector(s[0], s[1], 0, 4, 1, 5),
                       b = __builtin_shufflevector(s[0], s[1], 2, 6, 3, 7),
                       c = __builtin_shufflevector(s[2], s[3], 0, 4, 1, 5),
                       d = __builtin_shufflevector(s[2], s[3], 2, 6, 3, 7), ab = a + b, cd = c + d;
    all.part[p] = __builtin_shufflevector(ab, cd, 0, 1, 4, 5) + __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
  }
  return all;
}

static inline void expect_block(const float *block)
{
  for (int e = 0; e < SIZE; e += 16) __builtin_prefetch(block + e);
}

void flesh_coarse_cholesky_solve(flesh_coarse_cholesky *self)
{
  for (int k = 0; k < self->n; k++) {
    float *x = self->x + N * (size_t)k, less[N];
    const twelve_floats solved = add_product((twelve_floats){0}, self->inverses + SIZE * (size_t)k, x);
    memcpy(x, &solved, sizeof solved);
    for (int m = 0; m < N; m++) less[m] = -x[m];
    for (int e = self->start[k]; e < self->start[k + 1]; e++) {
      float *y = self->x + N * (size_t)self->row[e];
      const float *block = self->kept + SIZE * (size_t)e;
      expect_block(block + SIZE * BLOCKS_AHEAD);
      const twelve_floats sum = add_product(load12_floats(y), block, less);
      memcpy(y, &sum, sizeof sum);
    }
  }
  for (int k = self->n - 1; k >= 0; k--) {
    float *x = self->x + N * (size_t)k;
    flesh_float4 sums[N] = {{0}}, products[N] = {{0}};
    for (int e = self->start[k + 1] - 1; e >= self->start[k]; e--) {
      const float *block = self->kept + SIZE * (size_t)e;
      expect_block(block - SIZE * BLOCKS_AHEAD);
      add_transposed(sums, block, load12_floats(self->x + N * (size_t)self->row[e]));
    }
    twelve_floats rest = load12_floats(x), sum = gathered(sums);
    for (int p = 0; p < N / 4; p++) rest.part[p] -= sum.part[p];
    add_transposed(products, self->inverses + SIZE * (size_t)k, rest);
    rest = gathered(products);
    memcpy(x, &rest, sizeof rest);
  }
}

void flesh_coarse_cholesky_archive(flesh_coarse_cholesky *self, flesh_archive *archive)
{
  flesh_archive_bytes(archive, self->kept, FLESH_BLOCK12_SIZE * (size_t)self->start[self->n] * sizeof *self->kept);
  flesh_archive_bytes(archive, self->inverses, FLESH_BLOCK12_SIZE * (size_t)self->n * sizeof *self->inverses);
}
