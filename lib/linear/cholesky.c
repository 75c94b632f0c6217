/* cholesky.c: incomplete block Cholesky without fill, in single precision, its factor kept in half of that or less.
 *
 * The factorisation is A + shift |diag A| ~ (I + U)^T D (I + U) on A's own pattern, right-looking: once row k is final,
 * every pair (j,l) of its neighbours that is itself in the pattern is updated. These pairs depend on the pattern alone and
 * are found once.
 *
 * Updates outside the pattern are not dropped altogether: they are added to the diagonal, as in the modified factorisation
 * of Gustafsson 1978, so that smooth displacements have nearly the right stiffness. They are added fully where they
 * stiffen; where they soften, by no more than SOFTENED, or rotations of few irregular tets would have too little stiffness.
 *
 * Pairs of nodes that both have more than CROWDED neighbours are left out: a joint or a spring couples each of its nodes
 * with every other, and its factor would cost the cube of their number, for a term of low rank.
 *
 * Rows are in the order of bisection.h, each half by a task of its own. Updates by the second half to the separator's rows
 * go to a spill first. The blocks are kept twice, by rows and by columns, so that both substitutions gather: in columns a
 * row of the separator has blocks of both halves side by side (triangle.h). */
#include "linear/cholesky.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "base/sort.h"
#include "base/sort_by_length.h"
#include "linear/block_matrix.h"
#include "linear/three.h"
#include "linear/triangle.h"

/* Largest part of the trace of its diagonal block that a node may lose to dropped updates. */
static const double SOFTENED = 0.05;

enum {
  BLOCK_SLACK = 4, /* a block's last row is loaded with the number after it */
  /* Factors beyond the caches (MANY_PAIRS pairs) are prefetched far ahead, in lines of 64 bytes: FAR lines are some thirty
   * rows, a row is about LINES. */
  MANY_PAIRS = 60000, FAR = 64, LINES = 3, CROWDED = 300
};

struct flesh_cholesky {
  int rows, begin[4]; /* bounds of the halves and the separator */
  int *order;   /* [rows] nodes in the order of elimination */
  flesh_threads *threads;
  int *start, *column;             /* U above the diagonal, in the order of elimination */
  int *source;                     /* number of A's block of each, or ~ of its transpose's */
  int *target;                     /* U's block that each pair of each row's neighbours updates, -1: dropped */
  int *pairs;                      /* [rows+1] first target of each row */
  int *lower_place;                /* place of each block of U in `lower` */
  double *diagonal;                /* [9*rows] diagonal blocks of A, then D */
  double *diagonal_spill;          /* [9*separator] */
  three *dropped;                  /* [rows] dropped updates of every diagonal block */
  three *dropped_spill;            /* [separator] */
  int longest;                     /* largest number of blocks in a row of U */
  three *partners;                 /* [3 parts][longest] sums of a row's blocks, over those whose products are dropped */
  float *work, *spill;             /* [12*blocks], [12*separator_blocks]: blocks of four-lane rows */
  flesh_triangle upper, lower;     /* U; U^T */
  float *inverse, *y;              /* [9*rows] inverse of D; [4*rows] */
};

static int separator_blocks(const flesh_cholesky *self)
{
  return self->start[self->rows] - self->start[self->begin[2]];
}

/* Orders the rows for substitutions: none of those side by side waits for another, and longer ones come first. `latest`
 * [rows]: the last row before each that it waits for, -1: none. */
static void order_rows(const flesh_cholesky *self, const int *latest, const int *blocks, int *order)
{
  for (int part = 0; part < 3; part++)
    for (int begin = self->begin[part], end; begin < self->begin[part + 1]; begin = end) {
      end = begin + 1;
      while (end < self->begin[part + 1] && latest[end] < begin) end++;
      flesh_sort_by_length(begin, end, blocks, order);
    }
}

/* Makes U's pattern, the sources of its blocks and the targets of their products. `place` [rows]: place of each node in the
 * order. `sorted` [blocks] and `below` [4*rows], which is zero, are work space. */
static int make_pattern(flesh_cholesky *self, const flesh_block_matrix *A, const int *place, int split,
                        long long *sorted, int *below)
{
  const int rows = A->rows;
  int *latest = below + rows, *order = latest + rows, *degree = order + rows;
  for (int i = 0; i < rows; i++)
    for (int k = A->row_start[i] + 1; k < A->row_end[i]; k++) degree[i]++, degree[A->column[k]]++;
  for (int p = 0; p < rows; p++) latest[p] = -1;
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i] + 1; k < A->row_end[i]; k++) {
      const int here = place[i], there = place[A->column[k]];
      if (degree[i] > CROWDED && degree[A->column[k]] > CROWDED) continue;
      const int p = here < there ? here : there, q = here < there ? there : here;
      self->start[p]++;
      below[q]++;
      if (p > latest[q]) latest[q] = p;
    }
  order_rows(self, latest, self->start, order);
  if (flesh_triangle_create(rows, self->start, order, split, &self->upper)) return FLESH_ERR_MEMORY;
  order_rows(self, latest, below, order);
  if (flesh_triangle_create(rows, below, order, split, &self->lower)) return FLESH_ERR_MEMORY;
  int blocks = 0;
  for (int p = 0; p < rows; p++) { /* first block of each row, and place of its next one */
    const int own = self->start[p];
    self->start[p] = below[p] = blocks;
    blocks += own;
  }
  self->start[rows] = blocks;
  for (int i = 0; i < rows; i++) /* column and source in one number, which sorts by the column */
    for (int k = A->row_start[i] + 1; k < A->row_end[i]; k++) {
      int p = place[i], q = place[A->column[k]];
      if (degree[i] > CROWDED && degree[A->column[k]] > CROWDED) continue;
      sorted[below[p < q ? p : q]++] = (long long)(p < q ? q : p) << 32 | (unsigned)(p < q ? k : ~k);
    }
  memset(below, 0, (size_t)rows * sizeof *below);
  for (int p = 0; p < rows; p++) {
    const int first = self->start[p], count = self->start[p + 1] - first;
    flesh_sort(sorted + first, (size_t)count, sizeof *sorted, flesh_compare_long);
    for (int n = 0; n < count; n++) {
      const int column = self->column[first + n] = (int)(sorted[first + n] >> 32);
      self->source[first + n] = (int)(unsigned)sorted[first + n];
      self->lower_place[first + n] = flesh_triangle_place(&self->lower, column, below[column]);
      flesh_triangle_set_column(&self->upper, p, n, column);
      flesh_triangle_set_column(&self->lower, column, below[column]++, p);
    }
  }
  return FLESH_OK;
}

static int find(const flesh_cholesky *self, int row, int column)
{
  for (int k = self->start[row]; k < self->start[row + 1]; k++)
    if (self->column[k] == column) return k;
  return -1;
}

static int make_targets(flesh_cholesky *self)
{
  size_t pairs = 0;
  for (int p = 0; p < self->rows; p++) {
    int n = self->start[p + 1] - self->start[p];
    pairs += (size_t)n * (size_t)(n - (n > 0)) / 2;
  }
  if (pairs > 0x7fffffff) return FLESH_ERR_MEMORY;
  self->target = flesh_huge_pages_alloc((pairs + 1) * sizeof *self->target);
  if (!self->target) return FLESH_ERR_MEMORY;
  int count = 0;
  for (int p = 0; p < self->rows; p++) {
    if (self->start[p + 1] - self->start[p] > self->longest) self->longest = self->start[p + 1] - self->start[p];
    self->pairs[p] = count;
    for (int k = self->start[p]; k < self->start[p + 1]; k++)
      for (int l = k + 1; l < self->start[p + 1]; l++)
        self->target[count++] = find(self, self->column[k], self->column[l]);
  }
  self->pairs[self->rows] = count;
  return FLESH_OK;
}

static int allocate_factor(flesh_cholesky *self, const flesh_block_matrix *A)
{
  const size_t rows = (size_t)A->rows, blocks = (size_t)(A->row_start[A->rows] - A->rows);
  int **integers[] = {&self->column, &self->source, &self->lower_place};
  int **by_row[] = {&self->start, &self->pairs}, failed = 0;
  for (size_t k = 0; k < sizeof integers / sizeof integers[0]; k++)
    failed |= !(*integers[k] = flesh_huge_pages_alloc((blocks + 1) * sizeof(int)));
  for (size_t k = 0; k < sizeof by_row / sizeof by_row[0]; k++)
    failed |= !(*by_row[k] = flesh_calloc(rows + 1, sizeof(int)));
  failed |= !(self->order = flesh_malloc((rows + 1) * sizeof *self->order));
  failed |= !(self->diagonal = flesh_huge_pages_alloc((9 * rows + BLOCK_SLACK) * sizeof *self->diagonal));
  failed |= !(self->dropped = flesh_huge_pages_alloc((rows + 1) * sizeof *self->dropped));
  failed |= !(self->work = flesh_huge_pages_alloc((12 * blocks + BLOCK_SLACK) * sizeof(float)));
  failed |= !(self->inverse = flesh_huge_pages_calloc((9 * rows + BLOCK_SLACK) * sizeof(float)));
  failed |= !(self->y = flesh_huge_pages_alloc((4 * rows + BLOCK_SLACK) * sizeof(float)));
  return failed ? FLESH_ERR_MEMORY : FLESH_OK;
}

static int allocate_spill(flesh_cholesky *self)
{
  const size_t separator = (size_t)(self->rows - self->begin[2]);
  self->diagonal_spill = flesh_malloc((9 * separator + 1) * sizeof *self->diagonal_spill);
  self->spill = flesh_huge_pages_alloc((12 * (size_t)separator_blocks(self) + BLOCK_SLACK) * sizeof(float));
  self->dropped_spill = flesh_huge_pages_alloc((separator + 1) * sizeof *self->dropped_spill);
  self->partners = flesh_huge_pages_alloc((3 * (size_t)self->longest + 1) * sizeof *self->partners);
  return self->diagonal_spill && self->spill && self->dropped_spill && self->partners ? FLESH_OK : FLESH_ERR_MEMORY;
}

int flesh_cholesky_create(const flesh_block_matrix *A, const flesh_bisection *bisection, int alone,
                          flesh_threads *threads, flesh_cholesky **cholesky)
{
  flesh_cholesky *self = flesh_calloc(1, sizeof *self);
  *cholesky = self;
  int *place = flesh_malloc(((size_t)A->rows + 1) * sizeof *place);
  int status = self && place ? FLESH_OK : FLESH_ERR_MEMORY;
  if (!status) {
    self->rows = A->rows;
    self->threads = threads;
    memcpy(self->begin, bisection->begin, sizeof self->begin);
    status = allocate_factor(self, A);
  }
  if (!status) {
    const size_t rows = (size_t)A->rows, blocks = (size_t)A->row_start[A->rows] - rows;
    memcpy(self->order, bisection->order, (size_t)A->rows * sizeof *self->order);
    for (int p = 0; p < A->rows; p++) place[self->order[p]] = p;
    long long *sorted = flesh_malloc((blocks + 1) * sizeof *sorted);
    int *room = flesh_calloc(4 * rows + 1, sizeof *room);
    status = sorted && room ? make_pattern(self, A, place, alone, sorted, room) : FLESH_ERR_MEMORY;
    flesh_free(sorted);
    flesh_free(room);
  }
  if (!status) status = make_targets(self);
  if (!status) status = allocate_spill(self);
  flesh_free(place);
  if (!status) return FLESH_OK;
  flesh_cholesky_destroy(cholesky);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for the factorisation of %d nodes", A->rows);
}

void flesh_cholesky_destroy(flesh_cholesky **cholesky)
{
  if (!cholesky || !*cholesky) return;
  flesh_cholesky *self = *cholesky;
  void *arrays[] = {self->start, self->column, self->source, self->target, self->pairs, self->lower_place,
                    self->diagonal, self->diagonal_spill, self->work, self->spill, self->dropped, self->dropped_spill,
                    self->partners, self->inverse, self->y, self->order};
  for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) flesh_free(arrays[k]);
  flesh_triangle_clear(&self->upper);
  flesh_triangle_clear(&self->lower);
  flesh_free(self);
  *cholesky = NULL;
}

typedef struct factorisation {
  flesh_cholesky *cholesky;
  const flesh_block_matrix *A;
  double scale, shift;
  int failed[3];
} factorisation;

/* Loads the rows of a part from A. */
static void load_rows(const factorisation *f, int part)
{
  flesh_cholesky *self = f->cholesky;
  for (int p = self->begin[part]; p < self->begin[part + 1]; p++) {
    const double *block = f->A->values + 9 * (size_t)f->A->row_start[self->order[p]];
    double *diagonal = self->diagonal + 9 * (size_t)p;
    for (int e = 0; e < 9; e++) diagonal[e] = f->scale * block[e];
    for (int c = 0; c < 3; c++) diagonal[4 * c] += f->shift * fabs(diagonal[4 * c]);
    self->dropped[p] = (three){0};
    for (int k = self->start[p]; k < self->start[p + 1]; k++) {
      const int source = self->source[k];
      const double *b = f->A->values + 9 * (size_t)(source < 0 ? ~source : source);
      float *w = self->work + 12 * (size_t)k;
      for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
          w[4 * r + c] = (float)(f->scale * (source < 0 ? b[3 * c + r] : b[3 * r + c]));
      w[3] = w[7] = w[11] = 0;
    }
  }
}

/* Takes the dropped updates off D of row p, which is then final. */
static void modify_pivot(flesh_cholesky *self, int p)
{
  double *D = self->diagonal + 9 * (size_t)p;
  const three *C = &self->dropped[p];
  const double loss = (double)(C->row[0][0] + C->row[1][1] + C->row[2][2]) / (D[0] + D[4] + D[8]);
  const double share = loss > 0 ? SOFTENED / (SOFTENED + loss) : 1;
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++) /* for a fixed component, the row of C is zero, the column is not */
      if (C->row[r][r] != 0 && C->row[c][c] != 0) D[3 * r + c] -= share * (C->row[r][c] + C->row[c][r]) / 2;
}

/* Inverts D. Returns 0 when it is not positive definite, or too nearly so for single precision. */
static int invert_diagonal(flesh_cholesky *self, int p)
{
  const double *D = self->diagonal + 9 * (size_t)p;
  double inverse[9];
  if (!flesh_block_invert(D, inverse)) return 0;
  for (int c = 0; c < 3; c++)
    if (!(inverse[4 * c] * D[4 * c] < 1e6 && inverse[4 * c] < 1e30)) return 0;
  for (int e = 0; e < 9; e++) self->inverse[9 * (size_t)p + e] = (float)inverse[e];
  return 1;
}

/* Factors the rows of a part, one by one: scales, then subtracts from the rows that follow. */
static int factor_rows(flesh_cholesky *self, int part, int spilling)
{
  const int *start = self->start, *column = self->column, first_separator = self->begin[2];
  const int first_spilt = start[first_separator];
  three *partners = self->partners + (size_t)self->longest * (size_t)part;
  for (int p = self->begin[part]; p < self->begin[part + 1]; p++) {
    modify_pivot(self, p);
    if (!invert_diagonal(self, p)) return 0;
    const float *v = self->inverse + 9 * (size_t)p;
    const int *target = self->target + self->pairs[p], n = start[p + 1] - start[p];
    const int upper_first = flesh_triangle_place(&self->upper, p, 0),
              upper_step = flesh_triangle_place(&self->upper, p, 1) - upper_first;
    const three *rows = (const three *)(self->work + 12 * (size_t)start[p]);
    memset(partners, 0, (size_t)n * sizeof *partners);
    for (int a = 0; a < n; a++) {
      const int k = start[p] + a, j = column[k], spilt = spilling && j >= first_separator;
      double *D = spilt ? self->diagonal_spill + 9 * (size_t)(j - first_separator) : self->diagonal + 9 * (size_t)j;
      three scaled;
      for (int r = 0; r < 3; r++)
        scaled.row[r] = rows[a].row[0] * v[3 * r] + rows[a].row[1] * v[3 * r + 1] + rows[a].row[2] * v[3 * r + 2];
      for (int b = a + 1; b < n; b++, target++) {
        if (*target < 0) {
          three_add(&partners[a], &rows[b]);
          three_add(&partners[b], &rows[a]);
          continue;
        }
        three *to = (three *)(spilling && *target >= first_spilt ? self->spill + 12 * (size_t)(*target - first_spilt)
                                                                 : self->work + 12 * (size_t)*target);
        const three update = three_transposed_product(&scaled, &rows[b]);
        for (int r = 0; r < 3; r++) to->row[r] -= update.row[r];
      }
      const three own = three_transposed_product(&scaled, &rows[a]),
                  lost = three_transposed_product(&scaled, &partners[a]);
      three_add(spilt ? &self->dropped_spill[j - first_separator] : &self->dropped[j], &lost);
      float upper[9], lower[9];
      for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
          upper[3 * r + c] = lower[3 * c + r] = scaled.row[r][c];
          D[3 * r + c] -= own.row[r][c];
        }
      flesh_triangle_set(&self->upper, upper_first + a * upper_step, upper);
      flesh_triangle_set(&self->lower, self->lower_place[k], lower);
    }
  }
  return 1;
}

static void load_part(void *data, int part) { load_rows(data, part); }

static void factor_half(void *data, int half)
{
  factorisation *f = data;
  f->failed[half] = !factor_rows(f->cholesky, half, half == 1);
}

int flesh_cholesky_factor(flesh_cholesky *self, const flesh_block_matrix *A, double scale, double shift)
{
  factorisation f = {self, A, scale, shift, {0}};
  const size_t separator = (size_t)(self->rows - self->begin[2]), blocks = (size_t)separator_blocks(self),
               first = (size_t)self->begin[2], first_block = (size_t)self->start[first];
  flesh_threads_run(self->threads, 3, load_part, &f);
  memset(self->diagonal_spill, 0, 9 * separator * sizeof *self->diagonal_spill);
  memset(self->spill, 0, 12 * blocks * sizeof *self->spill);
  memset(self->dropped_spill, 0, separator * sizeof *self->dropped_spill);
  flesh_threads_run(self->threads, 2, factor_half, &f);
  if (f.failed[0] || f.failed[1]) return FLESH_NOT_POSITIVE;
  for (size_t e = 0; e < 9 * separator; e++) self->diagonal[9 * first + e] += self->diagonal_spill[e];
  for (size_t k = 0; k < separator; k++) three_add(&self->dropped[first + k], &self->dropped_spill[k]);
  for (size_t e = 0; e < 12 * blocks; e++) self->work[12 * first_block + e] += self->spill[e];
  return factor_rows(self, 2, 0) ? FLESH_OK : FLESH_NOT_POSITIVE;
}

typedef struct substitution {
  flesh_cholesky *cholesky;
  flesh_coarse *coarse;
  const float *r;
  double products[3]; /* products of r and z, part by part */
} substitution;

static inline void expect_pairs(const flesh_triangle *triangle, int pair, int lines)
{
  const uint32_t *words = triangle->words + 9 * (size_t)pair + 16 * (ptrdiff_t)lines;
  for (int line = 0; line < LINES; line++) FLESH_EXPECT_ONCE(words + 16 * line);
}

/* Computes y = (I + U^T)^-1 r on the rows of a part, and passes their r to the coarse level. */
static void forward(const substitution *s, int part)
{
  flesh_cholesky *self = s->cholesky;
  const flesh_triangle lower = self->lower;
  const int far = lower.start[lower.rows] > MANY_PAIRS;
  float *y = self->y;
  for (int q = self->begin[part]; q < self->begin[part + 1]; q++) {
    const size_t p = (size_t)lower.row[q];
    if (far) expect_pairs(&lower, lower.start[q], FAR);
    *(flesh_float4 *)(y + 4 * p) =
        *(const flesh_float4 *)(s->r + 4 * p) - flesh_triangle_product(&lower, lower.start[q], lower.start[q + 1], y);
  }
  if (s->coarse) flesh_coarse_restrict(s->coarse, part == 1, self->begin[part], self->begin[part + 1], s->r);
}

/* Computes z = (I + U)^-1 D^-1 y, in y, on the rows of a part; r.z = y.D^-1 y. */
static void backward(substitution *s, int part)
{
  flesh_cholesky *self = s->cholesky;
  const flesh_triangle upper = self->upper;
  const int far = upper.start[upper.rows] > MANY_PAIRS;
  flesh_double4 product = {0};
  for (int q = self->begin[part + 1] - 1; q >= self->begin[part]; q--) {
    const size_t p = (size_t)upper.row[q];
    if (far) expect_pairs(&upper, upper.start[q], -FAR);
    const float *v = self->inverse + 9 * p; /* symmetric */
    flesh_float4 *y = (flesh_float4 *)(self->y + 4 * p);
    const flesh_float4 divided =
        FLESH_LANES_FLOAT(v) * (*y)[0] + FLESH_LANES_FLOAT(v + 3) * (*y)[1] + FLESH_LANES_FLOAT(v + 6) * (*y)[2];
    product += FLESH_LANES_WIDE(*y * divided);
    *y = divided - flesh_triangle_product(&upper, upper.start[q], upper.start[q + 1], self->y);
  }
  s->products[part] = (product[0] + product[1]) + product[2];
}

static void forward_half(void *data, int half) { forward(data, half); }

static void backward_half(void *data, int half) { backward(data, half); }

double flesh_cholesky_solve(flesh_cholesky *self, flesh_coarse *coarse, const float *r)
{
  substitution s = {self, coarse, r, {0}};
  flesh_threads_run(self->threads, 2, forward_half, &s);
  forward(&s, 2);
  const double smooth = coarse ? (double)FLESH_COARSE_SHARE * flesh_coarse_solve(coarse) : 0;
  backward(&s, 2);
  flesh_threads_run(self->threads, 2, backward_half, &s);
  return s.products[0] + s.products[1] + s.products[2] + smooth;
}

void flesh_cholesky_result(const flesh_cholesky *self, const flesh_coarse *coarse, int begin, int end, float *z)
{
  const float *y = self->y + 4 * (size_t)begin;
  if (coarse) flesh_coarse_add(coarse, begin, end, FLESH_COARSE_SHARE, y, z);
  else memcpy(z, y, 4 * (size_t)(end - begin) * sizeof *z);
}

void flesh_cholesky_archive(flesh_cholesky *self, flesh_archive *archive)
{
  flesh_triangle_archive(&self->upper, archive);
  flesh_triangle_archive(&self->lower, archive);
  flesh_archive_bytes(archive, self->inverse, 9 * (size_t)self->rows * sizeof *self->inverse);
}
