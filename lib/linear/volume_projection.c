/* volume_projection.c: rows by node and nodes by row, the blocks that the rows stiffen, and the matrix S of all pairs of
 * rows that share a main node. */
#include "linear/volume_projection.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "base/parallel_vector.h"
#include "base/sort.h"
#include "linear/lanes.h"
#include "linear/sparse_cholesky.h"

enum { SLACK = 4 }; /* three numbers are loaded with the one after them */

struct flesh_volume_projection {
  const flesh_stiff_rows *rows;
  flesh_threads *threads;
  int nodes, m, entries; /* m nodes a row; entries: m * rows */
  int *order;            /* [nodes] the mesh's numbers of the nodes as vectors hold them */
  int *place;            /* [rows][m] four times each node's place in vectors */
  int *slots;            /* [rows][m (m+1)/2] the block of each pair of a row's nodes, or ~ where it is transposed */
  float *values;         /* [rows][m][3] of scale^(1/2) B, zero at fixed dofs */
  /* By place of the node: */
  int *start;     /* [nodes+1] of its rows */
  int *row, *at;  /* [entries] the rows, ascending, and where they have the node, m row + its number in the row */
  float *by_node; /* [entries][3] the same as `values` */
  uint8_t *main;  /* [nodes] P is not zero there */
  float *inverse; /* [9*nodes] of the diagonal blocks */
  unsigned *pair; /* where each pair of rows of each main node is in S's values */
  flesh_sparse_cholesky S;
  flesh_block_matrix soft; /* A_r, with the pattern of A */
  double root;             /* of the scale of all that is single */
  float *w, *q, *t;        /* [4*nodes]; [rows] S^-1 P^T r; [rows] what z lacks along the rows */
};

static int compare_int(const void *a, const void *b)
{
  int x = *(const int *)a, y = *(const int *)b;
  return (x > y) - (x < y);
}

static int find_slot(const flesh_block_matrix *A, int i, int j)
{
  const int row = i < j ? i : j, column = i < j ? j : i;
  int from = A->row_start[row], until = A->row_end[row];
  while (until - from > 1) {
    const int middle = from + (until - from) / 2;
    if (A->column[middle] <= column) from = middle;
    else until = middle;
  }
  return i <= j ? from : ~from;
}

static int allocate(flesh_volume_projection *self, const flesh_block_matrix *A)
{
  const size_t nodes = (size_t)self->nodes, entries = (size_t)self->entries, count = (size_t)self->rows->count;
  const size_t pairs = count * (size_t)self->m * (size_t)(self->m + 1) / 2;
  int failed = 0;
  failed |= !(self->order = flesh_malloc((nodes + 1) * sizeof *self->order));
  failed |= !(self->place = flesh_huge_pages_alloc((entries + 1) * sizeof *self->place));
  failed |= !(self->slots = flesh_huge_pages_alloc((pairs + 1) * sizeof *self->slots));
  failed |= !(self->values = flesh_huge_pages_calloc((3 * entries + SLACK) * sizeof *self->values));
  failed |= !(self->start = flesh_calloc(nodes + 2, sizeof *self->start));
  failed |= !(self->row = flesh_huge_pages_alloc((entries + 1) * sizeof *self->row));
  failed |= !(self->at = flesh_huge_pages_alloc((entries + 1) * sizeof *self->at));
  failed |= !(self->by_node = flesh_huge_pages_calloc((3 * entries + SLACK) * sizeof *self->by_node));
  failed |= !(self->main = flesh_calloc(nodes + 1, 1));
  failed |= !(self->inverse = flesh_huge_pages_calloc((9 * nodes + SLACK) * sizeof *self->inverse));
  failed |= !(self->w = flesh_huge_pages_calloc((4 * nodes + SLACK) * sizeof *self->w));
  failed |= !(self->q = flesh_huge_pages_calloc((count + 1) * sizeof *self->q));
  failed |= !(self->t = flesh_huge_pages_calloc((count + 1) * sizeof *self->t));
  self->soft = *A;
  self->soft.values = flesh_huge_pages_alloc((9 * (size_t)A->row_start[A->rows] + 1) * sizeof *self->soft.values);
  return failed || !self->soft.values ? FLESH_ERR_MEMORY : FLESH_OK;
}

/* Rows by node, which nodes are main, and the blocks of rows. `place_of` [nodes]. */
static void make_lists(flesh_volume_projection *self, const flesh_block_matrix *A, const int *place_of)
{
  const int m = self->m, *nodes = self->rows->nodes;
  for (int k = 0; k < self->entries; k++) {
    const int p = place_of[nodes[k]];
    self->place[k] = 4 * p;
    self->start[p + 2]++;
    if (k % m >= self->rows->first_main) self->main[p] = 1;
  }
  for (int p = 0; p < self->nodes; p++) self->start[p + 2] += self->start[p + 1];
  for (int k = 0; k < self->entries; k++) {
    const int e = self->start[self->place[k] / 4 + 1]++;
    self->row[e] = k / m;
    self->at[e] = k;
  }
  int *slot = self->slots;
  for (int e = 0; e < self->rows->count; e++)
    for (int a = 0; a < m; a++)
      for (int b = a; b < m; b++) *slot++ = find_slot(A, nodes[m * e + a], nodes[m * e + b]);
}

/* The rows that share a main node with each; returns how many in all. `mark` [rows]; `neighbours` NULL: only counts. */
static size_t find_neighbours(const flesh_volume_projection *self, int *mark, int *starts, int *neighbours)
{
  const int m = self->m;
  size_t count = 0;
  for (int e = 0; e < self->rows->count; e++) mark[e] = -1;
  for (int e = 0; e < self->rows->count; e++) {
    mark[e] = e;
    if (neighbours) starts[e] = (int)count;
    for (int a = 0; a < m; a++) {
      const int p = self->place[m * e + a] / 4;
      for (int k = self->start[p]; k < self->start[p + 1] && self->main[p]; k++) {
        if (mark[self->row[k]] == e) continue;
        mark[self->row[k]] = e;
        if (neighbours) neighbours[count] = self->row[k];
        count++;
      }
    }
    if (!neighbours) continue;
    starts[e + 1] = (int)count;
    flesh_sort(neighbours + starts[e], count - (size_t)starts[e], sizeof *neighbours, compare_int);
  }
  return count;
}

/* The middle of a row's nodes. */
static void find_middle(const flesh_volume_projection *self, const double *positions, double *middle)
{
  for (int e = 0; e < self->rows->count; e++)
    for (int c = 0; c < 3; c++) {
      double sum = 0;
      for (int a = 0; a < self->m; a++)
        sum += positions[3 * (size_t)self->rows->nodes[self->m * e + a] + (size_t)c];
      middle[3 * (size_t)e + (size_t)c] = sum / self->m;
    }
}

static int make_pairs(flesh_volume_projection *self)
{
  size_t count = 0;
  for (int p = 0; p < self->nodes; p++) {
    const size_t n = (size_t)(self->start[p + 1] - self->start[p]);
    if (self->main[p]) count += n * (n + 1) / 2;
  }
  self->pair = flesh_huge_pages_alloc((count + 1) * sizeof *self->pair);
  if (!self->pair || self->S.start[self->S.panels] > 0xffffffffu) return FLESH_ERR_MEMORY;
  unsigned *pair = self->pair;
  for (int p = 0; p < self->nodes; p++)
    for (int k = self->start[p]; k < self->start[p + 1] && self->main[p]; k++)
      for (int l = self->start[p]; l <= k; l++)
        *pair++ = (unsigned)flesh_sparse_cholesky_entry(&self->S, self->row[k], self->row[l]);
  return FLESH_OK;
}

static int make_factor(flesh_volume_projection *self, const double *positions)
{
  const size_t count = (size_t)self->rows->count;
  int *room = flesh_malloc((2 * count + 2) * sizeof *room), *starts = room + count + 1;
  double *middle = flesh_malloc((3 * count + 1) * sizeof *middle);
  int *neighbours = NULL, status = room && middle ? FLESH_OK : FLESH_ERR_MEMORY;
  if (!status) {
    const size_t all = find_neighbours(self, room, starts, NULL);
    neighbours = all > 0x7fffffff ? NULL : flesh_huge_pages_alloc((all + 1) * sizeof *neighbours);
    if (!neighbours) status = FLESH_ERR_MEMORY;
  }
  if (!status) {
    find_neighbours(self, room, starts, neighbours);
    find_middle(self, positions, middle);
    status = flesh_sparse_cholesky_create(self->rows->count, starts, neighbours, middle, &self->S);
  }
  flesh_free(neighbours);
  flesh_free(middle);
  flesh_free(room);
  return status ? status : make_pairs(self);
}

int flesh_volume_projection_create(const flesh_block_matrix *A, const flesh_stiff_rows *rows, const double *positions,
                                   const flesh_bisection *halves, flesh_threads *threads,
                                   flesh_volume_projection **projection)
{
  flesh_volume_projection *self = flesh_calloc(1, sizeof *self);
  *projection = self;
  int *place_of = flesh_malloc(((size_t)A->rows + 1) * sizeof *place_of);
  int status = self && place_of && rows->count <= 0x7fffffff / (3 * rows->nodes_per_row) ? FLESH_OK : FLESH_ERR_MEMORY;
  if (!status) {
    *self = (flesh_volume_projection){.rows = rows, .threads = threads, .nodes = A->rows, .m = rows->nodes_per_row,
                                      .entries = rows->count * rows->nodes_per_row};
    status = allocate(self, A);
  }
  if (!status) {
    memcpy(self->order, halves->order, (size_t)A->rows * sizeof *self->order);
    for (int p = 0; p < A->rows; p++) place_of[self->order[p]] = p;
    make_lists(self, A, place_of);
    status = make_factor(self, positions);
  }
  flesh_free(place_of);
  if (!status) return FLESH_OK;
  flesh_volume_projection_destroy(projection);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for the volume projection of %d elements", rows->count);
}

void flesh_volume_projection_destroy(flesh_volume_projection **projection)
{
  if (!projection || !*projection) return;
  flesh_volume_projection *self = *projection;
  void *arrays[] = {self->order, self->place, self->slots, self->values, self->start, self->row, self->at,
                    self->by_node, self->main, self->inverse, self->pair, self->w, self->q, self->t, self->soft.values};
  for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) flesh_free(arrays[k]);
  flesh_sparse_cholesky_clear(&self->S);
  flesh_free(self);
  *projection = NULL;
}

size_t flesh_volume_projection_memory(const flesh_volume_projection *self)
{
  const size_t nodes = (size_t)self->nodes, entries = (size_t)self->entries, count = (size_t)self->rows->count;
  size_t pairs = 0;
  for (int p = 0; p < self->nodes; p++) {
    const size_t n = (size_t)(self->start[p + 1] - self->start[p]);
    if (self->main[p]) pairs += n * (n + 1) / 2;
  }
  return sizeof *self + nodes * (2 * sizeof(int) + 1 + 13 * sizeof(float)) +
         entries * (3 * sizeof(int) + 6 * sizeof(float)) +
         count * ((size_t)(self->m * (self->m + 1) / 2) * sizeof(int) + 2 * sizeof(float)) +
         pairs * sizeof *self->pair + 9 * (size_t)self->soft.row_start[self->nodes] * sizeof *self->soft.values +
         flesh_sparse_cholesky_memory(&self->S);
}

/* The rows' values, but for those of fixed dofs. */
static void take_values(flesh_volume_projection *self, const uint8_t *fixed)
{
  for (int k = 0; k < self->entries; k++)
    for (int c = 0; c < 3; c++) {
      const size_t d = 3 * (size_t)k + (size_t)c;
      const int is_fixed = fixed && fixed[3 * (size_t)self->rows->nodes[k] + (size_t)c];
      self->values[d] = is_fixed ? 0 : self->rows->values[d];
    }
}

const flesh_block_matrix *flesh_volume_projection_matrix(flesh_volume_projection *self, const flesh_block_matrix *A,
                                                         const uint8_t *fixed)
{
  const int m = self->m, *slot = self->slots;
  double *values = self->soft.values;
  memcpy(values, A->values, 9 * (size_t)A->row_start[A->rows] * sizeof *values);
  take_values(self, fixed);
  for (int e = 0; e < self->rows->count; e++) {
    const float *b = self->values + 3 * (size_t)m * (size_t)e;
    for (int i = 0; i < m; i++)
      for (int j = i; j < m; j++, slot++) {
        const int swap = *slot < 0;
        const float *low = b + 3 * (swap ? j : i), *high = b + 3 * (swap ? i : j);
        double *block = values + 9 * (size_t)(swap ? ~*slot : *slot);
        for (int r = 0; r < 3; r++)
          for (int c = 0; c < 3; c++) block[3 * r + c] -= (double)low[r] * (double)high[c];
      }
  }
  return &self->soft;
}

/* The values scaled, and by node; the blocks by place. */
static void scale_values(flesh_volume_projection *self, double scale, const float *inverse)
{
  const float root = (float)(self->root = sqrt(scale));
  for (size_t d = 0; d < 3 * (size_t)self->entries; d++) self->values[d] *= root;
  for (int k = 0; k < self->entries; k++)
    memcpy(self->by_node + 3 * (size_t)k, self->values + 3 * (size_t)self->at[k], 3 * sizeof(float));
  for (int p = 0; p < self->nodes; p++)
    memcpy(self->inverse + 9 * (size_t)p, inverse + 9 * (size_t)self->order[p], 9 * sizeof(float));
}

static inline flesh_float4 times(const float *inverse, flesh_float4 x)
{
  flesh_float4 y = FLESH_LANES_FLOAT(inverse) * x[0] + FLESH_LANES_FLOAT(inverse + 3) * x[1] +
                   FLESH_LANES_FLOAT(inverse + 6) * x[2];
  y[3] = 0;
  return y;
}

/* S = shift I + B P. */
static void assemble(flesh_volume_projection *self, float shift)
{
  const unsigned *pair = self->pair;
  flesh_sparse_cholesky_zero(&self->S);
  for (int e = 0; e < self->rows->count; e++) self->S.values[flesh_sparse_cholesky_entry(&self->S, e, e)] = shift;
  for (int p = 0; p < self->nodes; p++) {
    if (!self->main[p]) continue;
    for (int k = self->start[p]; k < self->start[p + 1]; k++) {
      const flesh_float4 w = times(self->inverse + 9 * (size_t)p, FLESH_LANES_FLOAT(self->by_node + 3 * (size_t)k));
      for (int l = self->start[p]; l <= k; l++) {
        const float *b = self->by_node + 3 * (size_t)l;
        self->S.values[*pair++] += w[0] * b[0] + w[1] * b[1] + w[2] * b[2];
      }
    }
  }
}

int flesh_volume_projection_setup(flesh_volume_projection *self, double scale, const float *inverse)
{
  static const float LARGEST_SHIFT = 1e6f;
  scale_values(self, scale, inverse);
  for (float shift = 1; shift < LARGEST_SHIFT; shift *= 8) {
    assemble(self, shift);
    if (flesh_sparse_cholesky_factor(&self->S)) return FLESH_OK;
  }
  return FLESH_NOT_POSITIVE;
}

/* B x by rows, x of four lanes, the fourth of which is in no sum. */
static void multiply_rows(const flesh_volume_projection *self, const float *x, int begin, int end, float *y)
{
  const int m = self->m;
  for (int e = begin; e < end; e++) {
    const float *b = self->values + 3 * (size_t)m * (size_t)e;
    const int *place = self->place + (size_t)m * (size_t)e;
    flesh_float4 sum = {0};
    for (int a = 0; a < m; a++) sum += FLESH_LANES_FLOAT(b + 3 * a) * *(const flesh_float4 *)(x + place[a]);
    y[e] = (sum[0] + sum[1]) + sum[2];
  }
}

/* B^T q at a node. */
static inline flesh_float4 at_node(const flesh_volume_projection *self, const float *q, int p)
{
  flesh_float4 sum = {0};
  for (int k = self->start[p]; k < self->start[p + 1]; k++)
    sum += FLESH_LANES_FLOAT(self->by_node + 3 * (size_t)k) * q[self->row[k]];
  return sum;
}

/* What threads share out. */
typedef struct pass {
  flesh_volume_projection *self;
  const float *r;
  float *z;
  double products[FLESH_PARALLEL_PARTS_MAX];
} pass;

static void divide_nodes(void *data, int k, int begin, int end)
{
  const pass *now = data;
  (void)k;
  for (int p = begin; p < end; p++)
    *(flesh_float4 *)(now->self->w + 4 * (size_t)p) =
        now->self->main[p]
            ? times(now->self->inverse + 9 * (size_t)p, *(const flesh_float4 *)(now->r + 4 * (size_t)p))
            : (flesh_float4){0};
}

static void rows_of_w(void *data, int k, int begin, int end)
{
  const pass *now = data;
  (void)k;
  multiply_rows(now->self, now->self->w, begin, end, now->self->t);
}

static void project_nodes(void *data, int k, int begin, int end)
{
  const pass *now = data;
  (void)k;
  for (int p = begin; p < end; p++)
    *(flesh_float4 *)(now->self->w + 4 * (size_t)p) =
        *(const flesh_float4 *)(now->r + 4 * (size_t)p) - at_node(now->self, now->self->q, p);
}

/* t = S^-1 t. */
static void solve(flesh_volume_projection *self, const float *t, float *solution)
{
  const int *place = self->S.place;
  for (int e = 0; e < self->rows->count; e++) self->S.x[place[e]] = t[e];
  flesh_sparse_cholesky_solve(&self->S);
  for (int e = 0; e < self->rows->count; e++) solution[e] = self->S.x[place[e]];
}

const float *flesh_volume_projection_before(flesh_volume_projection *self, const float *r)
{
  pass now = {.self = self, .r = r};
  flesh_parallel_parts(self->threads, self->nodes, divide_nodes, &now);
  flesh_parallel_parts(self->threads, self->rows->count, rows_of_w, &now);
  solve(self, self->t, self->q);
  flesh_parallel_parts(self->threads, self->nodes, project_nodes, &now);
  return self->w;
}

static void rows_of_z(void *data, int k, int begin, int end)
{
  const pass *now = data;
  (void)k;
  multiply_rows(now->self, now->z, begin, end, now->self->t);
  for (int e = begin; e < end; e++) now->self->t[e] = now->self->q[e] - now->self->t[e];
}

static void correct_nodes(void *data, int k, int begin, int end)
{
  pass *now = data;
  double product = 0;
  for (int p = begin; p < end; p++) {
    flesh_float4 *z = (flesh_float4 *)(now->z + 4 * (size_t)p);
    const flesh_float4 r = *(const flesh_float4 *)(now->r + 4 * (size_t)p);
    if (now->self->main[p]) *z += times(now->self->inverse + 9 * (size_t)p, at_node(now->self, now->self->t, p));
    product += (double)(*z)[0] * (double)r[0] + (double)(*z)[1] * (double)r[1] + (double)(*z)[2] * (double)r[2];
  }
  now->products[k] = product;
}

double flesh_volume_projection_after(flesh_volume_projection *self, const float *r, float *z)
{
  pass now = {.self = self, .r = r, .z = z};
  double product = 0;
  flesh_parallel_parts(self->threads, self->rows->count, rows_of_z, &now);
  solve(self, self->t, self->t);
  const int parts = flesh_parallel_parts(self->threads, self->nodes, correct_nodes, &now);
  for (int k = 0; k < parts; k++) product += now.products[k];
  return product;
}

void flesh_volume_projection_restore(flesh_volume_projection *self, const float *error, double *step)
{
  solve(self, error, self->t);
  for (int p = 0; p < self->nodes; p++) {
    if (!self->main[p]) continue;
    const flesh_float4 z = times(self->inverse + 9 * (size_t)p, at_node(self, self->t, p));
    for (int c = 0; c < 3; c++) step[3 * (size_t)self->order[p] + (size_t)c] -= self->root * (double)z[c];
  }
}

double flesh_volume_projection_turned(const flesh_volume_projection *self)
{
  const float root = (float)self->root;
  double sum = 0;
  for (int k = 0; k < self->entries; k++) {
    const int p = self->place[k] / 4;
    const float *old = self->values + 3 * (size_t)k, *now = self->rows->values + 3 * (size_t)k;
    flesh_float4 change = {0};
    for (int c = 0; c < 3; c++) change[c] = old[c] != 0 ? root * now[c] - old[c] : 0; /* 0: the dof is fixed */
    const flesh_float4 moved = times(self->inverse + 9 * (size_t)p, change);
    sum += (double)(moved[0] * change[0] + moved[1] * change[1] + moved[2] * change[2]);
  }
  return sum / self->rows->count;
}

void flesh_volume_projection_archive(flesh_volume_projection *self, flesh_archive *archive)
{
  flesh_archive_bytes(archive, self->values, 3 * (size_t)self->entries * sizeof *self->values);
  flesh_archive_bytes(archive, self->by_node, 3 * (size_t)self->entries * sizeof *self->by_node);
  flesh_archive_bytes(archive, self->inverse, 9 * (size_t)self->nodes * sizeof *self->inverse);
  flesh_sparse_cholesky_archive(&self->S, archive);
  FLESH_ARCHIVE(archive, self->root);
}
