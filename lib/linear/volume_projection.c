/* volume_projection.c: rows by node and nodes by row, the blocks that the rows stiffen, and the projection itself. */
#include "linear/volume_projection.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "base/parallel_vector.h"
#include "linear/lanes.h"
#include "linear/overlap_vectors.h"
#include "linear/row_coupling.h"

enum { NODE_SLACK = 4 }; /* three numbers are loaded with the one after them */

struct flesh_volume_projection {
  const flesh_stiff_rows *rows;
  const flesh_overlap *overlap;
  const flesh_team *team; /* the overlap's team; NULL: there is none */
  flesh_threads *threads;
  int nodes, m, entries; /* m nodes a row; entries: m * rows */
  int *order;            /* [nodes] the mesh's number of each node in vectors */
  int *slots;            /* [rows][m (m+1)/2] block of each pair of a row's nodes, or ~ if it is transposed */
  float *values;         /* [rows][m][3] scale^(1/2) B, zero at fixed dofs */
  flesh_row_lists lists;
  /* The arrays below are indexed by the node's place. */
  float *by_node; /* [entries][3] the same as `values` */
  float *inverse; /* [9*nodes] inverses of the diagonal blocks */
  flesh_row_coupling S;
  flesh_block_matrix soft; /* A_r, with the pattern of A */
  double root;             /* square root of the scale of everything in single precision */
  float *w, *q, *t;        /* [4*nodes]; [rows] S^-1 P^T r; [rows] what z lacks along the rows */
  flesh_shared_rows shared; /* with a team, like the next two */
  float *r;                 /* [4*nodes] residual, at ghosts too */
  double *r_overlap;        /* [3*team->overlap] residual at the overlap's nodes */
};

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

static int allocate_projection(flesh_volume_projection *self, const flesh_block_matrix *A)
{
  const size_t nodes = (size_t)self->nodes, entries = (size_t)self->entries, count = (size_t)self->rows->count;
  const size_t pairs = count * (size_t)self->m * (size_t)(self->m + 1) / 2;
  int failed = 0;
  failed |= !(self->order = flesh_malloc((nodes + 1) * sizeof *self->order));
  failed |= !(self->lists.place = flesh_huge_pages_alloc((entries + 1) * sizeof *self->lists.place));
  failed |= !(self->slots = flesh_huge_pages_alloc((pairs + 1) * sizeof *self->slots));
  failed |= !(self->values = flesh_huge_pages_calloc((3 * entries + NODE_SLACK) * sizeof *self->values));
  failed |= !(self->lists.start = flesh_calloc(nodes + 2, sizeof *self->lists.start));
  failed |= !(self->lists.row = flesh_huge_pages_alloc((entries + 1) * sizeof *self->lists.row));
  failed |= !(self->lists.at = flesh_huge_pages_alloc((entries + 1) * sizeof *self->lists.at));
  failed |= !(self->by_node = flesh_huge_pages_calloc((3 * entries + NODE_SLACK) * sizeof *self->by_node));
  failed |= !(self->lists.main = flesh_calloc(nodes + 1, 1));
  failed |= !(self->inverse = flesh_huge_pages_calloc((9 * nodes + NODE_SLACK) * sizeof *self->inverse));
  failed |= !(self->w = flesh_huge_pages_calloc((4 * nodes + NODE_SLACK) * sizeof *self->w));
  failed |= !(self->q = flesh_huge_pages_calloc((count + 1) * sizeof *self->q));
  failed |= !(self->t = flesh_huge_pages_calloc((count + 1) * sizeof *self->t));
  if (self->team) {
    failed |= !(self->r = flesh_huge_pages_calloc((4 * nodes + NODE_SLACK) * sizeof *self->r));
    failed |= !(self->r_overlap = flesh_malloc((3 * (size_t)self->team->overlap + 1) * sizeof *self->r_overlap));
  }
  self->soft = *A;
  self->soft.values = flesh_huge_pages_alloc((9 * (size_t)A->row_start[A->rows] + 1) * sizeof *self->soft.values);
  return failed || !self->soft.values ? FLESH_ERR_MEMORY : FLESH_OK;
}

/* Lists rows by node, main nodes, and the blocks of rows. `place_of` [nodes]: place of each node in vectors. */
static void list_nodes(flesh_volume_projection *self, const flesh_block_matrix *A, const int *place_of)
{
  const int m = self->m, *nodes = self->rows->nodes;
  for (int k = 0; k < self->entries; k++) {
    const int p = place_of[nodes[k]];
    self->lists.place[k] = 4 * p;
    self->lists.start[p + 2]++;
    if (k % m >= self->rows->first_main) self->lists.main[p] = 1;
  }
  for (int p = 0; p < self->nodes; p++) self->lists.start[p + 2] += self->lists.start[p + 1];
  for (int k = 0; k < self->entries; k++) {
    const int e = self->lists.start[self->lists.place[k] / 4 + 1]++;
    self->lists.row[e] = k / m;
    self->lists.at[e] = k;
  }
  int *slot = self->slots;
  for (int e = 0; e < self->rows->count; e++)
    for (int a = 0; a < m; a++)
      for (int b = a; b < m; b++) *slot++ = find_slot(A, nodes[m * e + a], nodes[m * e + b]);
}

int flesh_volume_projection_create(const flesh_block_matrix *A, const flesh_stiff_rows *rows, const double *positions,
                                   int polynomial, const flesh_overlap *overlap, flesh_threads *threads,
                                   flesh_volume_projection **projection)
{
  const flesh_team *team = overlap->team;
  flesh_volume_projection *self = flesh_calloc(1, sizeof *self);
  *projection = self;
  int *place_of = flesh_malloc(((size_t)A->rows + 1) * sizeof *place_of);
  int status = self && place_of && rows->count <= 0x7fffffff / (3 * rows->nodes_per_row) ? FLESH_OK : FLESH_ERR_MEMORY;
  if (!status) {
    *self = (flesh_volume_projection){.rows = rows, .overlap = overlap, .team = team, .threads = threads,
                                      .nodes = A->rows, .m = rows->nodes_per_row,
                                      .entries = rows->count * rows->nodes_per_row};
    self->lists = (flesh_row_lists){.rows = rows->count, .nodes = self->nodes, .m = self->m};
    status = allocate_projection(self, A);
  }
  flesh_bisection halves = {0};
  if (!status) status = flesh_bisection_create(A, NULL, &halves);
  if (!status) {
    memcpy(self->order, halves.order, (size_t)A->rows * sizeof *self->order);
    for (int p = 0; p < A->rows; p++) place_of[self->order[p]] = p;
    list_nodes(self, A, place_of);
  }
  flesh_bisection_clear(&halves);
  flesh_shared_rows shared = {0};
  status = flesh_shared_rows_create(self ? &self->lists : NULL, place_of, team, status, &shared);
  if (self) self->shared = shared;
  else flesh_shared_rows_clear(&shared);
  if (!status) {
    status = flesh_row_coupling_create(&self->lists, rows, positions, polynomial, threads, &self->S);
    if (team && polynomial)
      flesh_row_coupling_share(&self->S, &self->shared, &self->lists, self->inverse, self->by_node);
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
  flesh_row_lists *lists = &self->lists;
  void *arrays[] = {self->order, lists->place, lists->start, lists->row, lists->at, lists->main, self->slots,
                    self->values, self->by_node, self->inverse, self->w, self->q, self->t, self->soft.values,
                    self->r, self->r_overlap};
  for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) flesh_free(arrays[k]);
  flesh_shared_rows_clear(&self->shared);
  flesh_row_coupling_clear(&self->S);
  flesh_free(self);
  *projection = NULL;
}

/* Copies the rows' values, except those of fixed dofs. */
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

/* Scales the values, and sorts them by node, and the inverse blocks by place. */
static void scale_values(flesh_volume_projection *self, double scale, const float *inverse)
{
  const float root = (float)(self->root = sqrt(scale));
  for (size_t d = 0; d < 3 * (size_t)self->entries; d++) self->values[d] *= root;
  for (int k = 0; k < self->entries; k++)
    memcpy(self->by_node + 3 * (size_t)k, self->values + 3 * (size_t)self->lists.at[k], 3 * sizeof(float));
  for (int p = 0; p < self->nodes; p++)
    memcpy(self->inverse + 9 * (size_t)p, inverse + 9 * (size_t)self->order[p], 9 * sizeof(float));
}

int flesh_volume_projection_setup(flesh_volume_projection *self, double scale, const float *inverse)
{
  static const float LARGEST_SHIFT = 1e6f;
  scale_values(self, scale, inverse);
  for (float shift = 1; shift < LARGEST_SHIFT; shift *= 8) { /* with polynomials, all ranks leave this loop alike */
    if (flesh_row_coupling_setup(&self->S, &self->lists, shift, self->inverse, self->by_node)) return FLESH_OK;
  }
  return FLESH_NOT_POSITIVE;
}

/* Computes B x by rows, for x of four lanes, the fourth of which is in no sum. */
static void multiply_rows_of_nodes(const flesh_volume_projection *self, const float *x, int begin, int end, float *y)
{
  const int m = self->m;
  for (int e = begin; e < end; e++) {
    const float *b = self->values + 3 * (size_t)m * (size_t)e;
    const int *place = self->lists.place + (size_t)m * (size_t)e;
    flesh_float4 sum = {0};
    for (int a = 0; a < m; a++) sum += FLESH_LANES_FLOAT(b + 3 * a) * *(const flesh_float4 *)(x + place[a]);
    y[e] = (sum[0] + sum[1]) + sum[2];
  }
}

/* Returns B^T q at a node. */
static inline flesh_float4 at_node(const flesh_volume_projection *self, const float *q, int p)
{
  flesh_float4 sum = {0};
  for (int k = self->lists.start[p]; k < self->lists.start[p + 1]; k++)
    sum += FLESH_LANES_FLOAT(self->by_node + 3 * (size_t)k) * q[self->lists.row[k]];
  return sum;
}

/* Data of a pass over the nodes, which threads share. */
typedef struct row_pass {
  flesh_volume_projection *self;
  const float *r;
  float *z;
  double products[FLESH_PARALLEL_PARTS_MAX];
} row_pass;

static void divide_nodes(void *data, int k, int begin, int end)
{
  const row_pass *now = data;
  (void)k;
  for (int p = begin; p < end; p++)
    *(flesh_float4 *)(now->self->w + 4 * (size_t)p) =
        now->self->lists.main[p]
            ? flesh_block_times(now->self->inverse + 9 * (size_t)p, *(const flesh_float4 *)(now->r + 4 * (size_t)p))
            : (flesh_float4){0};
}

static void rows_of_w(void *data, int k, int begin, int end)
{
  const row_pass *now = data;
  (void)k;
  multiply_rows_of_nodes(now->self, now->self->w, begin, end, now->self->t);
}

static void project_nodes(void *data, int k, int begin, int end)
{
  const row_pass *now = data;
  (void)k;
  for (int p = begin; p < end; p++)
    *(flesh_float4 *)(now->self->w + 4 * (size_t)p) =
        *(const flesh_float4 *)(now->r + 4 * (size_t)p) - at_node(now->self, now->self->q, p);
}

const float *flesh_volume_projection_before(flesh_volume_projection *self, const float *r)
{
  row_pass now = {.self = self, .r = r};
  flesh_parallel_parts(self->threads, self->nodes, divide_nodes, &now);
  flesh_parallel_parts(self->threads, self->rows->count, rows_of_w, &now);
  flesh_row_coupling_solve(&self->S, self->t, self->q);
  flesh_parallel_parts(self->threads, self->nodes, project_nodes, &now);
  return self->w;
}

static void rows_of_z(void *data, int k, int begin, int end)
{
  const row_pass *now = data;
  (void)k;
  multiply_rows_of_nodes(now->self, now->z, begin, end, now->self->t);
  for (int e = begin; e < end; e++) now->self->t[e] = now->self->q[e] - now->self->t[e];
}

static void correct_nodes(void *data, int k, int begin, int end)
{
  row_pass *now = data;
  double product = 0;
  for (int p = begin; p < end; p++) {
    flesh_float4 *z = (flesh_float4 *)(now->z + 4 * (size_t)p);
    const flesh_float4 r = *(const flesh_float4 *)(now->r + 4 * (size_t)p);
    if (now->self->lists.main[p])
      *z += flesh_block_times(now->self->inverse + 9 * (size_t)p, at_node(now->self, now->self->t, p));
    product += (double)(*z)[0] * (double)r[0] + (double)(*z)[1] * (double)r[1] + (double)(*z)[2] * (double)r[2];
  }
  now->products[k] = product;
}

double flesh_volume_projection_after(flesh_volume_projection *self, const float *r, float *z)
{
  row_pass now = {.self = self, .r = r, .z = z};
  double product = 0;
  flesh_parallel_parts(self->threads, self->rows->count, rows_of_z, &now);
  flesh_row_coupling_solve(&self->S, self->t, self->t);
  const int parts = flesh_parallel_parts(self->threads, self->nodes, correct_nodes, &now);
  for (int k = 0; k < parts; k++) product += now.products[k];
  return product;
}

/* Computes B^T q of this rank's rows, in w. */
static void rows_at_nodes(void *data, int k, int begin, int end)
{
  const row_pass *now = data;
  (void)k;
  for (int p = begin; p < end; p++) *(flesh_float4 *)(now->self->w + 4 * (size_t)p) = at_node(now->self, now->r, p);
}

/* Computes B^T q of all ranks' rows, in the overlap's vector. */
static void sum_rows(flesh_volume_projection *self, const float *q)
{
  flesh_parallel_parts(self->threads, self->nodes, rows_at_nodes, &(row_pass){.self = self, .r = q});
  flesh_overlap_sum(self->overlap, self->order, self->w);
}

/* Returns three numbers of the overlap's vector. */
static inline flesh_float4 summed(const flesh_volume_projection *self, int p)
{
  const double *y = self->overlap->vector + 3 * (size_t)self->order[p];
  return (flesh_float4){(float)y[0], (float)y[1], (float)y[2], 0};
}

float *flesh_volume_projection_before_in_team(flesh_volume_projection *self)
{
  const size_t numbers = 3 * (size_t)self->team->overlap;
  double *vector = self->overlap->vector;
  row_pass now = {.self = self, .r = self->r};
  for (int p = 0; p < self->nodes; p++) *(flesh_float4 *)(self->r + 4 * (size_t)p) = summed(self, p);
  memcpy(self->r_overlap, vector, numbers * sizeof *vector);
  flesh_parallel_parts(self->threads, self->nodes, divide_nodes, &now);
  flesh_parallel_parts(self->threads, self->rows->count, rows_of_w, &now);
  flesh_row_coupling_solve(&self->S, self->t, self->q);
  sum_rows(self, self->q);
  for (size_t d = 0; d < numbers; d++) vector[d] = self->r_overlap[d] - vector[d];
  for (int p = 0; p < self->nodes; p++) *(flesh_float4 *)(self->w + 4 * (size_t)p) = summed(self, p);
  return self->w;
}

void flesh_volume_projection_after_in_team(flesh_volume_projection *self, float *z)
{
  flesh_parallel_parts(self->threads, self->rows->count, rows_of_z, &(row_pass){.self = self, .z = z});
  flesh_row_coupling_solve(&self->S, self->t, self->t);
  sum_rows(self, self->t);
  for (int p = 0; p < self->nodes; p++)
    if (self->lists.main[p])
      *(flesh_float4 *)(z + 4 * (size_t)p) += flesh_block_times(self->inverse + 9 * (size_t)p, summed(self, p));
}

void flesh_volume_projection_correct(flesh_volume_projection *self, const float *error, double *step)
{
  flesh_row_coupling_solve(&self->S, error, self->t);
  if (self->team) sum_rows(self, self->t);
  for (int p = 0; p < self->nodes; p++) {
    if (!self->lists.main[p]) continue;
    const flesh_float4 y = self->team ? summed(self, p) : at_node(self, self->t, p);
    const flesh_float4 z = flesh_block_times(self->inverse + 9 * (size_t)p, y);
    for (int c = 0; c < 3; c++) step[3 * (size_t)self->order[p] + (size_t)c] -= self->root * (double)z[c];
  }
}

double flesh_volume_projection_drift(const flesh_volume_projection *self)
{
  const float root = (float)self->root;
  double sum = 0;
  for (int k = 0; k < self->entries; k++) {
    const int p = self->lists.place[k] / 4;
    const float *old = self->values + 3 * (size_t)k, *now = self->rows->values + 3 * (size_t)k;
    flesh_float4 change = {0};
    for (int c = 0; c < 3; c++) change[c] = old[c] != 0 ? root * now[c] - old[c] : 0; /* 0: the dof is fixed */
    const flesh_float4 moved = flesh_block_times(self->inverse + 9 * (size_t)p, change);
    sum += (double)(moved[0] * change[0] + moved[1] * change[1] + moved[2] * change[2]);
  }
  double sums[] = {sum, self->rows->count}; /* over all ranks, so that they decide alike */
  flesh_team_sum(self->team, 2, sums);
  return sums[0] / sums[1];
}

void flesh_volume_projection_archive(flesh_volume_projection *self, flesh_archive *archive)
{
  flesh_archive_bytes(archive, self->values, 3 * (size_t)self->entries * sizeof *self->values);
  flesh_archive_bytes(archive, self->by_node, 3 * (size_t)self->entries * sizeof *self->by_node);
  flesh_archive_bytes(archive, self->inverse, 9 * (size_t)self->nodes * sizeof *self->inverse);
  flesh_row_coupling_archive(&self->S, archive);
  FLESH_ARCHIVE(archive, self->root);
}
