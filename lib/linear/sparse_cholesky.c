/* sparse_cholesky.c: supernodal Cholesky, left-looking within a panel and right-looking between panels (Davis 2006). */
#include "linear/sparse_cholesky.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "base/sort.h"
#include "linear/lanes.h"

typedef flesh_cholesky_number number;

enum {
  ASIDE = 64 / (int)sizeof(number), /* rows of a vector */
  TILE = 2 * ASIDE,    /* rows of a product */
  WIDE = 4,            /* columns of a product */
  PANEL_SLACK = 2 * TILE     /* numbers that products read beyond their last row */
};

typedef number vector __attribute__((vector_size(64)));
typedef number vector_loose __attribute__((vector_size(64), aligned(4), may_alias));
#define AT(pointer) (*(vector_loose *)(void *)(uintptr_t)(pointer))

static int own_rows(const flesh_sparse_cholesky *self, int k) { return self->first[k + 1] - self->first[k]; }

static int below_rows(const flesh_sparse_cholesky *self, int k)
{
  return self->below_start[k + 1] - self->below_start[k];
}

/* Work space for finding the rows of panels. */
typedef struct search {
  const flesh_dissection *order;
  const int *starts, *neighbours;
  int *mark;          /* [n] last panel that took a row; -1: none */
  int *child, *next;  /* [panels] first child of each panel, and the next panel with the same parent; -1: none */
  int count, room;
} search;

static int take_row(flesh_sparse_cholesky *self, search *s, int k, int row)
{
  if (row < self->first[k + 1] || s->mark[row] == k) return 1;
  if (s->count == s->room) {
    int *grown = s->room > 0x3fffffff ? NULL : flesh_realloc(self->below, 2 * (size_t)s->room * sizeof *grown);
    if (!grown) return 0;
    self->below = grown;
    s->room *= 2;
  }
  s->mark[row] = k;
  self->below[s->count++] = row;
  return 1;
}

/* Lists the rows below each panel: those of its columns, and those of the panels whose parent it is. */
static int find_below(flesh_sparse_cholesky *self, search *s)
{
  const flesh_dissection *d = s->order;
  int known = 1;
  for (int r = 0; r < self->n; r++) s->mark[r] = -1;
  for (int k = 0; k < self->panels; k++) s->child[k] = s->next[k] = -1;
  for (int k = 0; k < self->panels && known; k++) {
    self->below_start[k] = s->count;
    for (int p = self->first[k]; p < self->first[k + 1]; p++)
      for (int e = s->starts[d->order[p]]; e < s->starts[d->order[p] + 1] && known; e++)
        known = take_row(self, s, k, self->place[s->neighbours[e]]);
    for (int c = s->child[k]; c >= 0; c = s->next[c])
      for (int e = self->below_start[c]; e < self->below_start[c + 1] && known; e++)
        known = take_row(self, s, k, self->below[e]);
    self->below_start[k + 1] = s->count;
    flesh_sort(self->below + self->below_start[k], (size_t)(s->count - self->below_start[k]), sizeof *self->below,
               flesh_compare_int);
    if (d->parent[k] >= 0) s->next[k] = s->child[d->parent[k]], s->child[d->parent[k]] = k;
  }
  return known ? FLESH_OK : FLESH_ERR_MEMORY;
}

/* Places the panels, and finds the work space that they need, unless a factorisation takes more operations than `most`. */
static int make_panels(flesh_sparse_cholesky *self, double most)
{
  int highest = 0, widest = 0;
  self->start[0] = 0;
  for (int k = 0; k < self->panels; k++) {
    const int wide = own_rows(self, k), high = wide + below_rows(self, k);
    if (high > highest) highest = high;
    if (wide > widest) widest = wide;
    self->stride[k] = (high + ASIDE - 1) / ASIDE * ASIDE;
    self->start[k + 1] = self->start[k] + (size_t)self->stride[k] * (size_t)wide;
    for (int c = 0; c < wide; c++) self->operations += (double)(high - c) * (high - c);
  }
  if (self->operations > most) return FLESH_NOT_CONVERGED;
  const size_t rows = (size_t)highest + PANEL_SLACK;
  self->values = flesh_huge_pages_calloc((self->start[self->panels] + PANEL_SLACK) * sizeof *self->values);
  self->inverse = flesh_huge_pages_calloc(((size_t)self->n + 1) * sizeof *self->inverse);
  self->x = flesh_huge_pages_calloc(((size_t)self->n + 1) * sizeof *self->x);
  self->target = flesh_malloc(rows * sizeof *self->target);
  self->packed = flesh_huge_pages_calloc(((size_t)widest + 1) * WIDE * sizeof *self->packed);
  self->column = flesh_huge_pages_calloc(rows * sizeof *self->column);
  return self->values && self->inverse && self->x && self->target && self->packed && self->column ? FLESH_OK
                                                                                                  : FLESH_ERR_MEMORY;
}

static int list_panels(flesh_sparse_cholesky *self, const flesh_dissection *d, const int *starts, const int *neighbours)
{
  const size_t n = (size_t)self->n, panels = (size_t)d->count;
  self->place = flesh_malloc((n + 1) * sizeof(int));
  self->first = flesh_malloc((panels + 1) * sizeof(int));
  self->part = flesh_malloc((n + 1) * sizeof(int));
  self->below_start = flesh_malloc((panels + 1) * sizeof(int));
  self->below = flesh_malloc((4 * n + 16) * sizeof(int));
  self->start = flesh_malloc((panels + 1) * sizeof *self->start);
  self->stride = flesh_malloc((panels + 1) * sizeof(int));
  int *room = flesh_malloc((n + 2 * panels + 1) * sizeof *room);
  int status = self->place && self->first && self->part && self->below_start && self->below && self->start &&
                       self->stride && room
                   ? FLESH_OK
                   : FLESH_ERR_MEMORY;
  if (!status) {
    self->below_start[0] = 0;
    memcpy(self->first, d->first, (panels + 1) * sizeof(int));
    for (int k = 0; k < d->count; k++)
      for (int p = d->first[k]; p < d->first[k + 1]; p++) self->place[d->order[p]] = p, self->part[p] = k;
    search s = {.order = d, .starts = starts, .neighbours = neighbours, .mark = room, .child = room + n,
                .next = room + n + panels, .room = 4 * self->n + 16};
    status = find_below(self, &s);
  }
  flesh_free(room);
  return status;
}

int flesh_sparse_cholesky_create(int n, const int *starts, const int *neighbours, const double *points,
                                 double most, flesh_sparse_cholesky *self)
{
  *self = (flesh_sparse_cholesky){.n = n};
  flesh_dissection order;
  int status = flesh_dissection_create(n, starts, neighbours, points, &order);
  if (status) return status;
  self->panels = order.count;
  status = list_panels(self, &order, starts, neighbours);
  if (!status) status = make_panels(self, most);
  flesh_dissection_clear(&order);
  if (!status) return FLESH_OK;
  flesh_sparse_cholesky_clear(self);
  return status == FLESH_NOT_CONVERGED ? status : flesh_fail(FLESH_ERR_MEMORY, "no memory for the factorisation of %d rows", n);
}

void flesh_sparse_cholesky_clear(flesh_sparse_cholesky *self)
{
  void *arrays[] = {self->place, self->first, self->part, self->below_start, self->below, self->start, self->stride,
                    self->values, self->inverse, self->x, self->target, self->packed, self->column};
  for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) flesh_free(arrays[k]);
  *self = (flesh_sparse_cholesky){0};
}

void flesh_sparse_cholesky_zero(flesh_sparse_cholesky *self)
{
  memset(self->values, 0, self->start[self->panels] * sizeof *self->values);
}

size_t flesh_sparse_cholesky_entry(const flesh_sparse_cholesky *self, int row, int other)
{
  const int p = self->place[row], q = self->place[other], column = p < q ? p : q, low = p < q ? q : p;
  const int k = self->part[column];
  int at = low - self->first[k];
  if (low >= self->first[k + 1]) {
    int from = self->below_start[k], until = self->below_start[k + 1];
    while (until - from > 1) {
      const int middle = from + (until - from) / 2;
      if (self->below[middle] <= low) from = middle;
      else until = middle;
    }
    at = own_rows(self, k) + from - self->below_start[k];
  }
  return self->start[k] + (size_t)(column - self->first[k]) * (size_t)self->stride[k] + (size_t)at;
}

/* Packs four rows of a panel's columns before `columns`, side by side; missing rows are zero. */
static void pack(const flesh_sparse_cholesky *self, int k, int row, int rows, int columns)
{
  const number *from = self->values + self->start[k] + row;
  for (int j = 0; j < columns; j++, from += self->stride[k])
    for (int c = 0; c < WIDE; c++) self->packed[WIDE * j + c] = c < rows ? from[c] : 0;
}

/* Computes product[c][i], the sum over j < columns of L_ij times the packed rows, for TILE rows i of the panel from `row`
 * on. */
static inline void multiply_tile(const flesh_sparse_cholesky *self, int k, int row, int columns,
                            vector product[WIDE][2])
{
  const number *a = self->values + self->start[k] + row, *b = self->packed;
  const size_t stride = (size_t)self->stride[k];
  vector sum[WIDE][2] = {{{0}}};
  for (int j = 0; j < columns; j++, a += stride, b += WIDE) {
    const vector low = AT(a), high = AT(a + ASIDE);
#pragma GCC unroll 4
    for (int c = 0; c < WIDE; c++) sum[c][0] += low * b[c], sum[c][1] += high * b[c];
  }
  memcpy(product, sum, sizeof sum);
}

/* Factors at most WIDE columns of a panel from `column` on; earlier columns have been subtracted. */
static int factor_columns(flesh_sparse_cholesky *self, int k, int column, int wide)
{
  const int high = own_rows(self, k) + below_rows(self, k);
  const size_t stride = (size_t)self->stride[k];
  number *own = self->values + self->start[k] + (size_t)column * stride;
  for (int c = 0; c < wide; c++) {
    number *pivot = own + (size_t)c * stride + column;
    for (int d = 0; d < c; d++) { /* for the rows of these columns */
      const number factor = own[(size_t)d * stride + (size_t)(column + c)];
      for (int r = c; r < wide; r++) pivot[r] -= factor * own[(size_t)d * stride + (size_t)(column + r)];
    }
    if (!(pivot[c] > 0 && pivot[c] < INFINITY)) return 0;
    const number inverse = 1 / (number)sqrt((double)pivot[c]);
    self->inverse[self->first[k] + column + c] = inverse;
    for (int r = c; r < wide; r++) pivot[r] *= inverse;
    for (int r = 0; r < c; r++) pivot[r] = 0;
  }
  for (int i = column + wide; i < high; i += ASIDE)
    for (int c = 0; c < wide; c++) {
      number *at = own + (size_t)c * stride + i;
      vector sum = AT(at);
      for (int d = 0; d < c; d++)
        sum -= AT(own + (size_t)d * stride + i) * own[(size_t)d * stride + (size_t)(column + c)];
      sum *= self->inverse[self->first[k] + column + c];
      if (i + ASIDE <= high) AT(at) = sum;
      else
        for (int r = 0; i + r < high; r++) at[r] = sum[r];
    }
  return 1;
}

static int factor_panel(flesh_sparse_cholesky *self, int k)
{
  const int own = own_rows(self, k), high = own + below_rows(self, k);
  const size_t stride = (size_t)self->stride[k];
  for (int column = 0; column < own; column += WIDE) {
    const int wide = own - column < WIDE ? own - column : WIDE;
    pack(self, k, column, wide, column);
    for (int i = column; i < high && column; i += TILE) {
      vector product[WIDE][2];
      multiply_tile(self, k, i, column, product);
      const int rows = high - i < TILE ? high - i : TILE;
      for (int c = 0; c < wide; c++) {
        number *at = self->values + self->start[k] + (size_t)(column + c) * stride + (size_t)i;
        const number *less = (const number *)product[c];
        for (int r = 0; r < rows; r++) at[r] -= less[r];
      }
    }
    if (!factor_columns(self, k, column, wide)) return 0;
  }
  return 1;
}

/* Finds the rows in panel `other` of the rows below panel k, from its number `from` on. */
static void find_targets(const flesh_sparse_cholesky *self, int k, int from, int other)
{
  const int *below = self->below + self->below_start[k], count = below_rows(self, k);
  const int end = self->first[other + 1], own = own_rows(self, other);
  const int *theirs = self->below + self->below_start[other];
  for (int i = from, at = 0; i < count; i++) {
    if (below[i] < end) {
      self->target[i] = below[i] - self->first[other];
    } else {
      while (theirs[at] < below[i]) at++;
      self->target[i] = own + at;
    }
  }
}

/* Subtracts a panel's products from the panels of the rows below it. */
static void update_others(flesh_sparse_cholesky *self, int k)
{
  const int *below = self->below + self->below_start[k], count = below_rows(self, k), own = own_rows(self, k);
  for (int from = 0, until; from < count; from = until) {
    const int other = self->part[below[from]];
    until = from;
    while (until < count && below[until] < self->first[other + 1]) until++;
    find_targets(self, k, from, other);
    for (int column = from; column < until; column += WIDE) {
      const int wide = until - column < WIDE ? until - column : WIDE;
      number *to[WIDE];
      pack(self, k, own + column, wide, own);
      for (int c = 0; c < wide; c++)
        to[c] = self->values + self->start[other] + (size_t)self->target[column + c] * (size_t)self->stride[other];
      for (int i = column; i < count; i += TILE) {
        vector product[WIDE][2];
        multiply_tile(self, k, own + i, own, product);
        const int rows = count - i < TILE ? count - i : TILE, *target = self->target + i;
        for (int c = 0; c < wide; c++) {
          const number *less = (const number *)product[c];
          for (int r = i == column ? c : 0; r < rows; r++) to[c][target[r]] -= less[r];
        }
      }
    }
  }
}

int flesh_sparse_cholesky_factor(flesh_sparse_cholesky *self)
{
  for (int k = 0; k < self->panels; k++) {
    if (!factor_panel(self, k)) return 0;
    update_others(self, k);
  }
  return 1;
}

/* Returns up to WIDE columns of a panel; missing ones repeat the first. */
static int columns_of(const flesh_sparse_cholesky *self, int k, int column, const number *L[WIDE])
{
  const int own = own_rows(self, k), wide = own - column < WIDE ? own - column : WIDE;
  for (int c = 0; c < WIDE; c++)
    L[c] = self->values + self->start[k] + (size_t)(column + (c < wide ? c : 0)) * (size_t)self->stride[k];
  return wide;
}

/* Computes x = L^-1 x for the columns of a panel. */
static void forward_panel(flesh_sparse_cholesky *self, int k)
{
  const int own = own_rows(self, k), high = own + below_rows(self, k), *below = self->below + self->below_start[k];
  number *x = self->x + self->first[k], *column = self->column;
  const number *inverse = self->inverse + self->first[k], *L[WIDE];
  memcpy(column, x, (size_t)own * sizeof *x);
  memset(column + own, 0, (size_t)(self->stride[k] - own) * sizeof *x);
  for (int j = 0; j < own; j += WIDE) {
    const int wide = columns_of(self, k, j, L);
    number y[WIDE] = {0};
    for (int c = 0; c < wide; c++) {
      y[c] = column[j + c];
      for (int d = 0; d < c; d++) y[c] -= L[d][j + c] * y[d];
      x[j + c] = y[c] *= inverse[j + c];
    }
    /* Rows above the diagonal are zero, and those of y are no longer needed. */
    for (int i = j / ASIDE * ASIDE; i < high; i += ASIDE)
      AT(column + i) -= (AT(L[0] + i) * y[0] + AT(L[1] + i) * y[1]) + (AT(L[2] + i) * y[2] + AT(L[3] + i) * y[3]);
  }
  for (int i = own; i < high; i++) self->x[below[i - own]] += column[i];
}

static number sum_of(vector v)
{
  number half[ASIDE / 2], sum = 0;
  for (int l = 0; l < ASIDE / 2; l++) half[l] = v[l] + v[l + ASIDE / 2];
  for (int l = 0; l < ASIDE / 4; l++) sum += half[l] + half[l + ASIDE / 4];
  return sum;
}

/* Computes x = L^-T x for the columns of a panel. */
static void backward_panel(flesh_sparse_cholesky *self, int k)
{
  const int own = own_rows(self, k), high = own + below_rows(self, k), *below = self->below + self->below_start[k];
  number *x = self->x + self->first[k], *column = self->column;
  const number *inverse = self->inverse + self->first[k], *L[WIDE];
  memset(column, 0, (size_t)self->stride[k] * sizeof *x);
  for (int i = own; i < high; i++) column[i] = self->x[below[i - own]];
  for (int j = (own - 1) / WIDE * WIDE; j >= 0; j -= WIDE) {
    const int wide = columns_of(self, k, j, L);
    vector sum[WIDE] = {{0}};
    for (int i = j / ASIDE * ASIDE; i < high; i += ASIDE)
      for (int c = 0; c < WIDE; c++) sum[c] += AT(L[c] + i) * AT(column + i); /* x of these columns is still zero there */
    for (int c = wide - 1; c >= 0; c--) {
      number y = x[j + c] - sum_of(sum[c]);
      for (int d = c + 1; d < wide; d++) y -= L[c][j + d] * x[j + d];
      x[j + c] = y * inverse[j + c];
    }
    memcpy(column + j, x + j, (size_t)wide * sizeof *x);
  }
}

void flesh_sparse_cholesky_solve(flesh_sparse_cholesky *self)
{
  for (int k = 0; k < self->panels; k++) forward_panel(self, k);
  for (int k = self->panels - 1; k >= 0; k--) backward_panel(self, k);
}

void flesh_sparse_cholesky_archive(flesh_sparse_cholesky *self, flesh_archive *archive)
{
  flesh_archive_bytes(archive, self->values, self->start[self->panels] * sizeof *self->values);
  flesh_archive_bytes(archive, self->inverse, (size_t)self->n * sizeof *self->inverse);
}
