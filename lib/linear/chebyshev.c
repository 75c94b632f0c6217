/* chebyshev.c: rows in the order of a dissection, and the polynomial's recurrence. */
#include "linear/chebyshev.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "base/parallel_vector.h"
#include "base/sort.h"
#include "base/team.h"
#include "linear/dissection.h"

enum {
  ROW_SLACK = 16,
  HIGHEST_DEGREE = 200 /* largest degree */
};

/* Degree over the square root of the largest eigenvalue. 0.6 takes a fifth more iterations, 1.2 as many. */
static const double DEGREE = 0.9;

static void make_rows(flesh_chebyshev *self, const int *starts, const int *neighbours)
{
  for (int i = 0; i < self->n; i++) self->start[self->place[i] + 1] = starts[i + 1] - starts[i];
  for (int p = 0; p < self->n; p++) self->start[p + 1] += self->start[p];
  for (int i = 0; i < self->n; i++) {
    const int from = self->start[self->place[i]], count = starts[i + 1] - starts[i];
    for (int k = 0; k < count; k++) self->column[from + k] = self->place[neighbours[starts[i] + k]];
    flesh_sort(self->column + from, (size_t)count, sizeof *self->column, flesh_compare_int);
  }
}

static int allocate_polynomial(flesh_chebyshev *self, size_t entries)
{
  const size_t n = (size_t)self->n;
  int **ints[] = {&self->place, &self->start, &self->next};
  float **floats[] = {&self->root, &self->x, &self->r, &self->d[0], &self->d[1]};
  int failed = 0;
  for (size_t k = 0; k < sizeof ints / sizeof ints[0]; k++)
    failed |= !(*ints[k] = flesh_huge_pages_calloc((n + 2) * sizeof(int)));
  for (size_t k = 0; k < sizeof floats / sizeof floats[0]; k++)
    failed |= !(*floats[k] = flesh_huge_pages_calloc((n + ROW_SLACK) * sizeof(float)));
  failed |= !(self->column = flesh_huge_pages_calloc((entries + ROW_SLACK) * sizeof *self->column));
  failed |= !(self->values = flesh_huge_pages_calloc((entries + n + ROW_SLACK) * sizeof *self->values));
  return failed ? FLESH_ERR_MEMORY : FLESH_OK;
}

int flesh_chebyshev_create(int n, const int *starts, const int *neighbours, const double *points,
                           flesh_threads *threads, flesh_chebyshev *self)
{
  *self = (flesh_chebyshev){.n = n, .threads = threads};
  flesh_dissection order;
  int status = flesh_dissection_create(n, starts, neighbours, points, &order);
  if (!status) status = allocate_polynomial(self, (size_t)starts[n]);
  if (!status) {
    for (int p = 0; p < n; p++) self->place[order.order[p]] = p;
    make_rows(self, starts, neighbours);
  }
  flesh_dissection_clear(&order);
  if (!status) return FLESH_OK;
  flesh_chebyshev_clear(self);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for a polynomial of %d rows", n);
}

void flesh_chebyshev_clear(flesh_chebyshev *self)
{
  void *arrays[] = {self->place, self->start, self->column, self->values, self->root,
                    self->next, self->x, self->r, self->d[0], self->d[1]};
  for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) flesh_free(arrays[k]);
  *self = (flesh_chebyshev){0};
}

void flesh_chebyshev_zero(flesh_chebyshev *self)
{
  memset(self->values, 0, ((size_t)self->start[self->n] + (size_t)self->n) * sizeof *self->values);
}

size_t flesh_chebyshev_entry(const flesh_chebyshev *self, int row, int other)
{
  const int p = self->place[row], q = self->place[other], low = p < q ? q : p, column = p < q ? p : q;
  if (p == q) return (size_t)self->start[self->n] + (size_t)p;
  int from = self->start[low], until = self->start[low + 1];
  while (until - from > 1) {
    const int middle = from + (until - from) / 2;
    if (self->column[middle] <= column) from = middle;
    else until = middle;
  }
  return (size_t)from;
}

/* Scales the rows to unit diagonal, and fills in both triangles. */
static void scale_rows(flesh_chebyshev *self)
{
  float *values = self->values, *diagonal = values + self->start[self->n];
  const int *start = self->start, *column = self->column;
  int *next = self->next;
  for (int p = 0; p < self->n; p++) {
    self->root[p] = 1 / sqrtf(diagonal[p]);
    next[p] = start[p];
  }
  /* Rows ascend, and so do the columns of each, so that the entries above the diagonal are found in order. */
  for (int q = 0; q < self->n; q++)
    for (int k = start[q]; k < start[q + 1] && column[k] < q; k++) {
      const int p = column[k];
      values[k] *= self->root[p] * self->root[q];
      while (column[next[p]] < q) next[p]++;
      values[next[p]] = values[k];
    }
}

/* Data of a pass over the rows, which threads share. */
typedef struct polynomial_pass {
  flesh_chebyshev *self;
  const float *d;
  float *to;
  float keep, add; /* the next direction is keep d + add r */
} polynomial_pass;

static void run(flesh_chebyshev *self, void (*part)(void *data, int k, int begin, int end), polynomial_pass now)
{
  now.self = self;
  flesh_parallel_parts(self->threads, self->n, part, &now);
}

static inline float product_row(const int *restrict column, const float *restrict values, int count,
                                const float *restrict d, float own)
{
  float sum[4] = {own, 0, 0, 0};
  int k = 0;
  for (; k + 4 <= count; k += 4)
    for (int l = 0; l < 4; l++) sum[l] += values[k + l] * d[column[k + l]];
  for (; k < count; k++) sum[k % 4] += values[k] * d[column[k]];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/* Computes r -= A d. */
static void subtract_product(void *data, int part, int begin, int end)
{
  const polynomial_pass *now = data;
  const int *start = now->self->start;
  (void)part;
  for (int p = begin; p < end; p++)
    now->self->r[p] -= product_row(now->self->column + start[p], now->self->values + start[p], start[p + 1] - start[p],
                                   now->d, now->d[p]);
}

/* Computes the next direction, and adds it to x. */
static void move(void *data, int part, int begin, int end)
{
  const polynomial_pass *now = data;
  (void)part;
  for (int p = begin; p < end; p++) {
    now->to[p] = now->keep * now->d[p] + now->add * now->self->r[p];
    now->self->x[p] += now->to[p];
  }
}

/* Does subtract_product and move in one pass. */
static void add_power(void *data, int part, int begin, int end)
{
  const polynomial_pass *now = data;
  const int *restrict start = now->self->start, *restrict column = now->self->column;
  const float *restrict values = now->self->values, *restrict d = now->d, keep = now->keep, add = now->add;
  float *restrict to = now->to, *restrict r = now->self->r, *restrict x = now->self->x;
  (void)part;
  for (int p = begin; p < end; p++) {
    r[p] -= product_row(column + start[p], values + start[p], start[p + 1] - start[p], d, d[p]);
    to[p] = keep * d[p] + add * r[p];
    x[p] += to[p];
  }
}

/* Returns the mean of the diagonal, over all ranks if others have rows, too; 0 where it is not positive. */
static double mean_diagonal(const flesh_chebyshev *self)
{
  const float *diagonal = self->values + self->start[self->n];
  double mean = 0;
  int bad = 0;
  for (int p = 0; p < self->n; p++) {
    bad |= !(diagonal[p] > 0 && diagonal[p] < INFINITY);
    mean += (double)diagonal[p] / self->n;
  }
  if (!self->others) return bad ? 0 : mean;
  double sums[] = {bad ? 0 : mean * self->n, self->n, bad};
  flesh_team_sum(flesh_threads_team(self->threads), 3, sums);
  return sums[2] > 0 ? 0 : sums[0] / sums[1];
}

int flesh_chebyshev_setup(flesh_chebyshev *self, double largest)
{
  const double mean = mean_diagonal(self);
  if (!(mean > 0)) return 0;
  scale_rows(self);
  self->largest = (float)largest;
  self->degree = (int)fmin(fmax(ceil(DEGREE * sqrt(mean * largest)), 2), HIGHEST_DEGREE);
  return 1;
}

static void begin_part(void *data, int part, int begin, int end)
{
  const polynomial_pass *now = data;
  flesh_chebyshev *self = now->self;
  (void)part;
  for (int p = begin; p < end; p++) {
    self->r[p] = self->root[p] * self->x[p];
    self->x[p] = now->to[p] = now->add * self->r[p];
  }
}

static void end_part(void *data, int part, int begin, int end)
{
  flesh_chebyshev *self = ((const polynomial_pass *)data)->self;
  (void)part;
  for (int p = begin; p < end; p++) self->x[p] *= self->root[p];
}

/* Implements algorithm 1 of Lottes 2023, from zero. */
void flesh_chebyshev_solve(flesh_chebyshev *self)
{
  const flesh_chebyshev_others *others = self->others;
  const float top = self->largest;
  float *d = self->d[0], *other = self->d[1];
  run(self, begin_part, (polynomial_pass){.to = d, .add = 4 / (3 * top)});
  for (int k = 1; k < self->degree; k++) {
    const float below = (float)(2 * k + 3);
    const polynomial_pass next = {.d = d, .to = other, .keep = (float)(2 * k - 1) / below, .add = (float)(8 * k + 4) / (below * top)};
    if (others) {
      others->begin(others->data, d);
      run(self, subtract_product, next);
      others->end(others->data, self->r);
      run(self, move, next);
    } else {
      run(self, add_power, next);
    }
    float *swap = d;
    d = other, other = swap;
  }
  run(self, end_part, (polynomial_pass){0});
}

void flesh_chebyshev_archive(flesh_chebyshev *self, flesh_archive *archive)
{
  flesh_archive_bytes(archive, self->values, (size_t)self->start[self->n] * sizeof *self->values);
  flesh_archive_bytes(archive, self->root, (size_t)self->n * sizeof *self->root);
  FLESH_ARCHIVE(archive, self->largest);
  flesh_archive_int(archive, &self->degree, 0, HIGHEST_DEGREE);
}
