/* row_coupling.c: the pattern of S, its assembly node by node, and the choice of the solver. */
#include "linear/row_coupling.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "base/sort.h"

/* Lists the rows that share a main node with each row; returns their number. `mark` [rows] is work space; `neighbours`
 * NULL: only counts. */
static size_t find_neighbours(const flesh_row_lists *lists, int *mark, int *starts, int *neighbours)
{
  const int m = lists->m;
  size_t count = 0;
  for (int e = 0; e < lists->rows; e++) mark[e] = -1;
  starts[0] = 0; /* without rows, too, as a rank may have none */
  for (int e = 0; e < lists->rows; e++) {
    mark[e] = e;
    if (neighbours) starts[e] = (int)count;
    for (int a = 0; a < m; a++) {
      const int p = lists->place[m * e + a] / 4;
      for (int k = lists->start[p]; k < lists->start[p + 1] && lists->main[p]; k++) {
        if (mark[lists->row[k]] == e) continue;
        mark[lists->row[k]] = e;
        if (neighbours) neighbours[count] = lists->row[k];
        count++;
      }
    }
    if (!neighbours) continue;
    starts[e + 1] = (int)count;
    flesh_sort(neighbours + starts[e], count - (size_t)starts[e], sizeof *neighbours, flesh_compare_int);
  }
  return count;
}

/* Computes the centre of each row's nodes. */
static void find_middle(const flesh_stiff_rows *rows, const double *positions, double *middle)
{
  const int m = rows->nodes_per_row;
  for (int e = 0; e < rows->count; e++)
    for (int c = 0; c < 3; c++) {
      double sum = 0;
      for (int a = 0; a < m; a++) sum += positions[3 * (size_t)rows->nodes[m * e + a] + (size_t)c];
      middle[3 * (size_t)e + (size_t)c] = sum / m;
    }
}

static size_t entry_of(const flesh_row_coupling *self, int row, int other)
{
  return self->is_exact ? flesh_sparse_cholesky_entry(&self->exact, row, other)
                        : flesh_chebyshev_entry(&self->polynomial, row, other);
}

static int make_pairs(flesh_row_coupling *self, const flesh_row_lists *lists)
{
  self->pairs = 0;
  for (int p = 0; p < lists->nodes; p++) {
    const size_t n = (size_t)(lists->start[p + 1] - lists->start[p]);
    if (lists->main[p]) self->pairs += n * (n + 1) / 2;
  }
  self->pair = flesh_huge_pages_alloc((self->pairs + 1) * sizeof *self->pair);
  if (!self->pair || (self->is_exact && self->exact.start[self->exact.panels] > 0xffffffffu)) return FLESH_ERR_MEMORY;
  unsigned *pair = self->pair;
  for (int p = 0; p < lists->nodes; p++)
    for (int k = lists->start[p]; k < lists->start[p + 1] && lists->main[p]; k++)
      for (int l = lists->start[p]; l <= k; l++) *pair++ = (unsigned)entry_of(self, lists->row[k], lists->row[l]);
  return FLESH_OK;
}

/* Makes the solver for a pattern. */
static int make_solver(flesh_row_coupling *self, const flesh_stiff_rows *rows, const double *positions,
                       flesh_threads *threads, const int *starts, const int *neighbours)
{
  const size_t count = (size_t)rows->count;
  double *middle = flesh_malloc((3 * count + 1) * sizeof *middle);
  int status = middle ? FLESH_OK : FLESH_ERR_MEMORY;
  if (!status) find_middle(rows, positions, middle);
  if (!status)
    status = self->is_exact
                 ? flesh_sparse_cholesky_create(rows->count, starts, neighbours, middle, INFINITY, &self->exact)
                 : flesh_chebyshev_create(rows->count, starts, neighbours, middle, threads, &self->polynomial);
  flesh_free(middle);
  return status;
}

int flesh_row_coupling_create(const flesh_row_lists *lists, const flesh_stiff_rows *rows, const double *positions,
                              int polynomial, flesh_threads *threads, flesh_row_coupling *self)
{
  const size_t count = (size_t)rows->count;
  *self = (flesh_row_coupling){.rows = rows->count, .is_exact = !polynomial};
  int *room = flesh_malloc((2 * count + 2) * sizeof *room), *starts = room + count + 1;
  int *neighbours = NULL, status = room ? FLESH_OK : FLESH_ERR_MEMORY;
  if (!status) {
    const size_t all = find_neighbours(lists, room, starts, NULL);
    neighbours = all > 0x7fffffff ? NULL : flesh_huge_pages_alloc((all + 1) * sizeof *neighbours);
    if (!neighbours) status = FLESH_ERR_MEMORY;
  }
  if (!status) {
    find_neighbours(lists, room, starts, neighbours);
    status = make_solver(self, rows, positions, threads, starts, neighbours);
  }
  flesh_free(neighbours);
  flesh_free(room);
  return status ? status : make_pairs(self, lists);
}

void flesh_row_coupling_clear(flesh_row_coupling *self)
{
  flesh_free(self->pair);
  flesh_sparse_cholesky_clear(&self->exact);
  flesh_chebyshev_clear(&self->polynomial);
  *self = (flesh_row_coupling){0};
}

/* Sends B^T d of this rank's rows at the nodes that it shares; d is indexed by place. */
static void send_shared(void *data, const float *d)
{
  const flesh_row_coupling *self = data;
  const flesh_chebyshev *S = &self->polynomial;
  for (int s = 0; s < self->shared->count; s++) {
    const int p = self->shared->nodes[s];
    flesh_float4 sum = {0};
    for (int k = self->lists->start[p]; k < self->lists->start[p + 1]; k++) {
      const int place = S->place[self->lists->row[k]];
      sum += FLESH_LANES_FLOAT(self->by_node + 3 * (size_t)k) * (S->root[place] * d[place]);
    }
    for (int c = 0; c < 3; c++) self->shared->own[3 * (size_t)s + (size_t)c] = (double)sum[c];
  }
  flesh_shared_rows_begin(self->shared, 3);
}

/* Subtracts from r B D^-1 times what the other ranks have sent. */
static void take_shared(void *data, float *r)
{
  const flesh_row_coupling *self = data;
  const flesh_chebyshev *S = &self->polynomial;
  flesh_shared_rows_end(self->shared, 3);
  for (int s = 0; s < self->shared->count; s++) {
    const int p = self->shared->nodes[s];
    const double *y = self->shared->others + 3 * (size_t)s;
    const flesh_float4 w =
        flesh_block_times(self->inverse + 9 * (size_t)p, (flesh_float4){(float)y[0], (float)y[1], (float)y[2], 0});
    for (int k = self->lists->start[p]; k < self->lists->start[p + 1]; k++) {
      const int place = S->place[self->lists->row[k]];
      const float *b = self->by_node + 3 * (size_t)k;
      r[place] -= S->root[place] * (w[0] * b[0] + w[1] * b[1] + w[2] * b[2]);
    }
  }
}

void flesh_row_coupling_share(flesh_row_coupling *self, const flesh_shared_rows *shared, const flesh_row_lists *lists,
                              const float *inverse, const float *by_node)
{
  self->shared = shared;
  self->lists = lists;
  self->inverse = inverse;
  self->by_node = by_node;
  self->others = (flesh_chebyshev_others){self, send_shared, take_shared};
  self->polynomial.others = &self->others;
}

/* Adds to X the sum of b w^T / b.w over a node's rows, w = D^-1 b. */
static void add_share(const float *inverse, const float *by_node, int count, double *X)
{
  for (int k = 0; k < count; k++) {
    const float *b = by_node + 3 * (size_t)k;
    const flesh_float4 w = flesh_block_times(inverse, FLESH_LANES_FLOAT(b));
    const double own = (double)(w[0] * b[0] + w[1] * b[1] + w[2] * b[2]);
    for (int e = 0; e < 9 && own > 0; e++) X[e] += (double)b[e / 3] * (double)w[e % 3] / own;
  }
}

/* Returns the largest eigenvalue of a node's share of S, B D^-1 B^T of that node alone, with unit diagonal, or a little
 * more. It is that of X, to which `others` adds other ranks' parts (NULL: none), and at most the eighth root of the sum of
 * the eigenvalues' eighth powers. */
static double largest_of_node(const float *inverse, const float *by_node, int count, const double *others)
{
  double X[2][9] = {{0}}, sum = 0;
  add_share(inverse, by_node, count, X[0]);
  for (int e = 0; e < 9 && others; e++) X[0][e] += others[e];
  for (int square = 0; square < 2; square++) {
    const double *from = X[square];
    for (int e = 0; e < 9; e++)
      X[1 - square][e] = from[e / 3 * 3] * from[e % 3] + from[e / 3 * 3 + 1] * from[e % 3 + 3] +
                         from[e / 3 * 3 + 2] * from[e % 3 + 6];
  }
  for (int e = 0; e < 9; e++) sum += X[0][e] * X[0][e / 3 + e % 3 * 3];
  return pow(sum, 0.125);
}

/* Exchanges X with other ranks at the shared nodes. */
static void exchange_shares(const flesh_row_coupling *self)
{
  const flesh_shared_rows *shared = self->shared;
  for (int s = 0; s < shared->count; s++) {
    const int p = shared->nodes[s], first = self->lists->start[p];
    double *X = shared->own + 9 * (size_t)s;
    memset(X, 0, 9 * sizeof *X);
    add_share(self->inverse + 9 * (size_t)p, self->by_node + 3 * (size_t)first, self->lists->start[p + 1] - first, X);
  }
  flesh_shared_rows_begin(shared, 9);
  flesh_shared_rows_end(shared, 9);
}

/* Returns a bound of S's eigenvalues with unit diagonal: as S is shift I plus the nodes' shares, this is the largest mean
 * of the bounds of a row's nodes, weighted by what each adds to the diagonal. */
static double bound_largest(const flesh_row_coupling *self, const flesh_row_lists *lists, float shift,
                            const float *inverse, const float *by_node)
{
  const float *diagonal = self->polynomial.values + self->polynomial.start[self->rows];
  const flesh_shared_rows *shared = self->shared;
  float *sum = self->polynomial.r;
  double largest = 1;
  int next = 0; /* next shared node */
  if (shared) exchange_shares(self);
  for (int e = 0; e < self->rows; e++) sum[e] = shift;
  for (int p = 0; p < lists->nodes; p++) {
    const int first = lists->start[p], count = lists->start[p + 1] - first;
    if (!lists->main[p]) continue;
    const float *block = inverse + 9 * (size_t)p, *b = by_node + 3 * (size_t)first;
    const int is_shared = shared && next < shared->count && shared->nodes[next] == p;
    const float most =
        (float)largest_of_node(block, b, count, is_shared ? shared->others + 9 * (size_t)next : NULL);
    next += is_shared;
    for (int k = 0; k < count; k++, b += 3) {
      const flesh_float4 w = flesh_block_times(block, FLESH_LANES_FLOAT(b));
      sum[lists->row[first + k]] += most * (w[0] * b[0] + w[1] * b[1] + w[2] * b[2]);
    }
  }
  for (int e = 0; e < self->rows; e++)
    largest = fmax(largest, (double)(sum[e] / diagonal[self->polynomial.place[e]]));
  if (shared) flesh_team_largest(shared->team, 1, &largest);
  return largest;
}

int flesh_row_coupling_setup(flesh_row_coupling *self, const flesh_row_lists *lists, float shift, const float *inverse,
                             const float *by_node)
{
  const unsigned *pair = self->pair;
  float *values = self->is_exact ? self->exact.values : self->polynomial.values;
  if (self->is_exact) flesh_sparse_cholesky_zero(&self->exact);
  else flesh_chebyshev_zero(&self->polynomial);
  for (int e = 0; e < self->rows; e++) values[entry_of(self, e, e)] = shift;
  for (int p = 0; p < lists->nodes; p++) {
    if (!lists->main[p]) continue;
    for (int k = lists->start[p]; k < lists->start[p + 1]; k++) {
      const flesh_float4 w =
          flesh_block_times(inverse + 9 * (size_t)p, FLESH_LANES_FLOAT(by_node + 3 * (size_t)k));
      for (int l = lists->start[p]; l <= k; l++) {
        const float *b = by_node + 3 * (size_t)l;
        values[*pair++] += w[0] * b[0] + w[1] * b[1] + w[2] * b[2];
      }
    }
  }
  if (self->is_exact) return flesh_sparse_cholesky_factor(&self->exact);
  return flesh_chebyshev_setup(&self->polynomial, bound_largest(self, lists, shift, inverse, by_node));
}

void flesh_row_coupling_solve(flesh_row_coupling *self, const float *t, float *solution)
{
  const int *place = self->is_exact ? self->exact.place : self->polynomial.place;
  float *x = self->is_exact ? self->exact.x : self->polynomial.x;
  for (int e = 0; e < self->rows; e++) x[place[e]] = t[e];
  if (self->is_exact) flesh_sparse_cholesky_solve(&self->exact);
  else flesh_chebyshev_solve(&self->polynomial);
  for (int e = 0; e < self->rows; e++) solution[e] = x[place[e]];
}

void flesh_row_coupling_archive(flesh_row_coupling *self, flesh_archive *archive)
{
  if (self->is_exact) flesh_sparse_cholesky_archive(&self->exact, archive);
  else flesh_chebyshev_archive(&self->polynomial, archive);
}
