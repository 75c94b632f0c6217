/* coarse.c: boxes by recursive bisection, P^T A P by pairs of boxes, and its sparse Cholesky factor.
 *
 * In the box of node i, w_i = (1, (X_i - centre) / size) are the four weights of its affine displacements, and the
 * coarse unknown 4 c + a moves component c of node i by w_i[a]. */
#include "sparse/coarse.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/large.h"
#include "sparse/block12.h"
#include "sparse/lanes.h"

enum {
  N = FLESH_BLOCK12,
  AHEAD = 64 /* members whose r is fetched ahead, as boxes are not contiguous in memory */
};

/* A block of A that couples a pair of boxes: `node` in the one that is eliminated first. Nodes go by where vectors
 * store them, here and below. */
typedef struct term {
  int pair, node, other;
  int block; /* ~: of the transpose */
} term;

struct flesh_coarse {
  int rows, boxes, pairs;
  flesh_threads *threads;
  int *stored;             /* [rows] the mesh's number of each node */
  int *box;                /* [rows] of each node, boxes in the order of elimination */
  int *begin, *member;     /* [boxes+1], [rows] nodes of each box */
  flesh_float4 *weights;   /* [rows] by node; numbers near the exact ones span as good a space */
  flesh_float4 *of_member; /* [rows] the same by member */
  uint8_t *held;           /* [rows] bits of the fixed components */
  flesh_double4 *moves;    /* [4*boxes] displacement by weight, from the last solve */
  term *terms;             /* [blocks] by pair, then by node */
  int *first;              /* [pairs+1] of each pair's terms */
  int *low, *high;         /* [pairs] its boxes in the order */
  flesh_block12 matrix;
};

typedef struct located {
  double at;
  int node;
} located;

static int compare_located(const void *a, const void *b)
{
  const located *p = a, *q = b;
  return p->at != q->at ? (p->at > q->at) - (p->at < q->at) : (p->node > q->node) - (p->node < q->node);
}

/* Numbers the boxes of the nodes from `first` on. */
static void bisect(const double *X, located *nodes, int count, int boxes, int first, int *box)
{
  if (boxes == 1) {
    for (int k = 0; k < count; k++) box[nodes[k].node] = first;
    return;
  }
  double longest = -1;
  int axis = 0;
  for (int c = 0; c < 3; c++) {
    double low = INFINITY, high = -INFINITY;
    for (int k = 0; k < count; k++) {
      low = fmin(low, X[3 * (size_t)nodes[k].node + c]);
      high = fmax(high, X[3 * (size_t)nodes[k].node + c]);
    }
    if (high - low > longest) longest = high - low, axis = c;
  }
  for (int k = 0; k < count; k++) nodes[k].at = X[3 * (size_t)nodes[k].node + axis];
  qsort(nodes, (size_t)count, sizeof *nodes, compare_located);
  int half = boxes / 2, split = (int)((long long)count * half / boxes);
  bisect(X, nodes, split, half, first, box);
  bisect(X, nodes + split, count - split, boxes - half, first + half, box);
}

static int compare_terms(const void *a, const void *b)
{
  const term *p = a, *q = b;
  if (p->pair != q->pair) return (p->pair > q->pair) - (p->pair < q->pair);
  if (p->node != q->node) return (p->node > q->node) - (p->node < q->node);
  return (p->other > q->other) - (p->other < q->other);
}

/* Which boxes touch, as lists of neighbours. */
static int make_graph(const flesh_coarse *self, const flesh_block_matrix *A, const int *box, int **starts,
                      int **neighbours)
{
  const size_t boxes = (size_t)self->boxes;
  uint8_t *touch = calloc(boxes * boxes, 1);
  *starts = calloc(boxes + 1, sizeof **starts);
  if (!touch || !*starts) {
    free(touch);
    return FLESH_ERR_MEMORY;
  }
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i]; k < A->row_end[i]; k++)
      touch[(size_t)box[i] * boxes + (size_t)box[A->column[k]]] =
          touch[(size_t)box[A->column[k]] * boxes + (size_t)box[i]] = 1;
  for (size_t i = 0; i < boxes; i++)
    for (size_t j = 0; j < boxes; j++) (*starts)[i + 1] += i != j && touch[i * boxes + j];
  for (size_t i = 0; i < boxes; i++) (*starts)[i + 1] += (*starts)[i];
  *neighbours = malloc(((size_t)(*starts)[boxes] + 1) * sizeof **neighbours);
  for (size_t i = 0, count = 0; *neighbours && i < boxes; i++)
    for (size_t j = 0; j < boxes; j++)
      if (i != j && touch[i * boxes + j]) (*neighbours)[count++] = (int)j;
  free(touch);
  return *neighbours ? FLESH_OK : FLESH_ERR_MEMORY;
}

static void make_members(flesh_coarse *self, const double *X)
{
  const int *box = self->box;
  for (int i = 0; i < self->rows; i++) self->begin[box[i] + 1]++;
  for (int b = 0; b < self->boxes; b++) self->begin[b + 1] += self->begin[b];
  for (int i = 0; i < self->rows; i++) self->member[self->begin[box[i]]++] = i;
  for (int b = self->boxes; b > 0; b--) self->begin[b] = self->begin[b - 1];
  self->begin[0] = 0;
  for (int b = 0; b < self->boxes; b++) {
    double centre[3] = {0}, size = 0;
    int count = self->begin[b + 1] - self->begin[b];
    for (int m = self->begin[b]; m < self->begin[b + 1]; m++)
      for (int c = 0; c < 3; c++) centre[c] += X[3 * (size_t)self->stored[self->member[m]] + c] / count;
    for (int m = self->begin[b]; m < self->begin[b + 1]; m++)
      for (int c = 0; c < 3; c++) size = fmax(size, fabs(X[3 * (size_t)self->stored[self->member[m]] + c] - centre[c]));
    for (int m = self->begin[b]; m < self->begin[b + 1]; m++) {
      flesh_float4 w = {1, 0, 0, 0};
      for (int c = 0; c < 3 && size > 0; c++)
        w[c + 1] = (float)((X[3 * (size_t)self->stored[self->member[m]] + c] - centre[c]) / size);
      self->of_member[m] = self->weights[self->member[m]] = w;
    }
  }
}

/* Blocks sorted by the pair of boxes that they couple. */
static int make_terms(flesh_coarse *self, const flesh_block_matrix *A, const int *place)
{
  const int *box = self->box;
  const int blocks = A->row_start[A->rows];
  if ((long long)self->boxes * self->boxes > 0x7fffffff) return FLESH_ERR_MEMORY;
  for (int i = 0, count = 0; i < A->rows; i++)
    for (int k = A->row_start[i]; k < A->row_end[i]; k++) {
      int p = place[i], q = place[A->column[k]], swap = box[p] > box[q];
      int low = swap ? box[q] : box[p], high = swap ? box[p] : box[q];
      self->terms[count++] =
          (term){low * self->boxes + high, swap ? q : p, swap ? p : q, swap ? ~k : k};
    }
  qsort(self->terms, (size_t)blocks, sizeof *self->terms, compare_terms);
  for (int k = 0; k < blocks; k++)
    self->pairs += k == 0 || self->terms[k].pair != self->terms[k - 1].pair;
  self->first = malloc(((size_t)self->pairs + 1) * sizeof *self->first);
  self->low = malloc(((size_t)self->pairs + 1) * sizeof *self->low);
  self->high = malloc(((size_t)self->pairs + 1) * sizeof *self->high);
  if (!self->first || !self->low || !self->high || self->pairs > FLESH_TASKS_MAX) return FLESH_ERR_MEMORY;
  for (int k = 0, p = 0; k < blocks; k++) {
    if (k > 0 && self->terms[k].pair == self->terms[k - 1].pair) continue;
    self->low[p] = self->terms[k].pair / self->boxes;
    self->high[p] = self->terms[k].pair % self->boxes;
    self->first[p++] = k;
  }
  self->first[self->pairs] = blocks;
  return FLESH_OK;
}

static int build(flesh_coarse *self, const flesh_block_matrix *A, const double *X, const int *stored)
{
  const size_t rows = (size_t)A->rows, vector = (rows + 1) * sizeof(flesh_float4);
  int *box = malloc((rows + 1) * sizeof *box), *starts = NULL, *neighbours = NULL;
  located *nodes = malloc((rows + 1) * sizeof *nodes);
  self->stored = malloc((rows + 1) * sizeof *self->stored);
  self->box = flesh_large((rows + 1) * sizeof *self->box);
  self->begin = calloc((size_t)self->boxes + 1, sizeof *self->begin);
  self->member = calloc(rows + AHEAD, sizeof *self->member);
  self->weights = flesh_large(vector);
  self->of_member = flesh_large(vector);
  self->held = malloc(rows + 1);
  self->moves = flesh_large(4 * (size_t)self->boxes * sizeof *self->moves);
  self->terms = flesh_large(((size_t)A->row_start[A->rows] + 1) * sizeof *self->terms);
  int failed = !box || !nodes || !self->stored || !self->box || !self->begin || !self->member || !self->weights ||
               !self->of_member || !self->held || !self->moves || !self->terms;
  if (!failed) {
    for (int i = 0; i < A->rows; i++) nodes[i].node = i;
    bisect(X, nodes, A->rows, self->boxes, 0, box);
    failed = make_graph(self, A, box, &starts, &neighbours) ||
             flesh_block12_create(self->boxes, starts, neighbours, &self->matrix);
  }
  if (!failed) {
    memcpy(self->stored, stored, rows * sizeof *stored);
    for (int p = 0; p < A->rows; p++) self->box[p] = self->matrix.place[box[stored[p]]];
    make_members(self, X);
    int *place = box; /* the boxes by the mesh's numbers are not needed any more */
    for (int p = 0; p < A->rows; p++) place[stored[p]] = p;
    failed = make_terms(self, A, place) != FLESH_OK;
  }
  free(box);
  free(nodes);
  free(starts);
  free(neighbours);
  return failed ? flesh_fail(FLESH_ERR_MEMORY, "no memory for the coarse space of %d nodes", A->rows) : FLESH_OK;
}

int flesh_coarse_create(const flesh_block_matrix *A, const double *positions, int boxes, const flesh_halves *halves,
                        flesh_threads *threads, flesh_coarse **coarse)
{
  flesh_coarse *self = calloc(1, sizeof *self);
  *coarse = self;
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a coarse space");
  self->rows = A->rows;
  self->boxes = boxes;
  self->threads = threads;
  int status = build(self, A, positions, halves->stored);
  if (status) flesh_coarse_destroy(coarse);
  return status;
}

void flesh_coarse_destroy(flesh_coarse **coarse)
{
  if (!coarse || !*coarse) return;
  flesh_coarse *self = *coarse;
  void *arrays[] = {self->stored, self->box,   self->begin, self->member, self->weights, self->of_member, self->held,
                    self->moves, self->terms, self->first,  self->low,     self->high};
  for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) free(arrays[k]);
  flesh_block12_clear(&self->matrix);
  free(self);
  *coarse = NULL;
}

typedef struct assembly {
  flesh_coarse *coarse;
  const flesh_block_matrix *A;
  double scale;
} assembly;

/* T[3 c + d] += A[c][d] w_other. */
static inline void add_term(const flesh_coarse *self, const flesh_block_matrix *A, const term *t,
                            flesh_double4 T[9])
{
  const double *b = A->values + 9 * (size_t)(t->block < 0 ? ~t->block : t->block);
  const flesh_double4 w = FLESH_LANES_WIDE(self->weights[t->other]);
  double a[9];
  for (int c = 0; c < 3; c++)
    for (int d = 0; d < 3; d++) a[3 * c + d] = t->block < 0 ? b[3 * d + c] : b[3 * c + d];
  const int held = self->held[t->node];
  if (t->node == t->other) /* half, as the transpose is added in the end; fixed dofs have no part in it */
    for (int e = 0; e < 9; e++) a[e] *= held >> e / 3 & 1 || held >> e % 3 & 1 ? 0 : 0.5;
  for (int e = 0; e < 9; e++) T[e] += a[e] * w;
}

/* The coarse block of a pair: first the sum over the other box's nodes, then over this one's. */
static void assemble_pair(void *data, int pair)
{
  const assembly *s = data;
  flesh_coarse *self = s->coarse;
  const int low = self->low[pair], high = self->high[pair], end = self->first[pair + 1];
  double *block = flesh_block12_at(&self->matrix, low, high);
  flesh_double4 sum[3][4][3] = {{{{0}}}};
  for (int k = self->first[pair]; k < end;) {
    const int node = self->terms[k].node;
    const flesh_double4 w = FLESH_LANES_WIDE(self->weights[node]);
    flesh_double4 T[9] = {{0}};
    for (; k < end && self->terms[k].node == node; k++) add_term(self, s->A, &self->terms[k], T);
    for (int c = 0; c < 3; c++)
      for (int a = 0; a < 4; a++)
        for (int d = 0; d < 3; d++) sum[c][a][d] += s->scale * w[a] * T[3 * c + d];
  }
  memcpy(block, sum, sizeof sum);
  for (int m = 0; m < N && low == high; m++)
    for (int r = 0; r <= m; r++) block[N * m + r] = block[N * r + m] = block[N * m + r] + block[N * r + m];
}

int flesh_coarse_setup(flesh_coarse *self, const flesh_block_matrix *A, double scale, const uint8_t *fixed)
{
  assembly s = {self, A, scale};
  for (int p = 0; p < self->rows; p++) {
    const uint8_t *held = fixed ? fixed + 3 * (size_t)self->stored[p] : NULL;
    self->held[p] = (uint8_t)(held ? (held[0] != 0) | (held[1] != 0) << 1 | (held[2] != 0) << 2 : 0);
  }
  flesh_block12_zero(&self->matrix);
  flesh_threads_run(self->threads, self->pairs, assemble_pair, &s);
  return flesh_block12_factor(&self->matrix) ? FLESH_OK : FLESH_NOT_POSITIVE;
}

/* Fixed components have no part in the coarse space; few nodes have any. */
static inline flesh_double4 without(flesh_double4 x, int held)
{
  for (int c = 0; held && c < 3; c++)
    if (held >> c & 1) x[c] = 0;
  return x;
}

int flesh_coarse_boxes(const flesh_coarse *self) { return self->boxes; }

void flesh_coarse_restrict(flesh_coarse *self, int box, double scale, const double *r)
{
  enum { CHAINS = 2 }; /* additions wait for each other */
  flesh_double4 sums[CHAINS][3] = {{{0}}};
  for (int m = self->begin[box], end = self->begin[box + 1]; m < end; m += CHAINS)
    for (int l = 0; l < CHAINS && m + l < end; l++) {
      const size_t node = (size_t)self->member[m + l];
      __builtin_prefetch(r + 4 * (size_t)self->member[m + l + AHEAD]);
      const flesh_double4 w = FLESH_LANES_WIDE(self->of_member[m + l]),
                          own = without(*(const flesh_double4 *)(r + 4 * node), self->held[node]);
      for (int c = 0; c < 3; c++) sums[l][c] += w * own[c];
    }
  flesh_float4 x[3];
  for (int c = 0; c < 3; c++) x[c] = FLESH_LANES_NARROW(scale * (sums[0][c] + sums[1][c]));
  memcpy(self->matrix.x + N * (size_t)box, x, sizeof x);
}

void flesh_coarse_solve(flesh_coarse *self, double back)
{
  flesh_block12_solve(&self->matrix);
  const float *x = self->matrix.x;
  for (int b = 0; b < self->boxes; b++, x += N)
    for (int a = 0; a < 4; a++)
      self->moves[4 * (size_t)b + (size_t)a] = back * (flesh_double4){x[a], x[4 + a], x[8 + a], 0};
}

void flesh_coarse_add(const flesh_coarse *self, int begin, int end, double *z)
{
  for (size_t p = (size_t)begin; p < (size_t)end; p++) {
    const flesh_double4 w = FLESH_LANES_WIDE(self->weights[p]), *moves = self->moves + 4 * (size_t)self->box[p];
    *(flesh_double4 *)(z + 4 * p) +=
        without(moves[0] * w[0] + moves[1] * w[1] + moves[2] * w[2] + moves[3] * w[3], self->held[p]);
  }
}

size_t flesh_coarse_memory(const flesh_coarse *self)
{
  const size_t rows = (size_t)self->rows, terms = (size_t)self->first[self->pairs];
  return sizeof *self + rows * (2 * sizeof(flesh_float4) + 1 + 3 * sizeof(int)) + terms * sizeof(term) +
         (size_t)self->boxes * 16 * sizeof(double) +
         (size_t)self->pairs * 3 * sizeof(int) + flesh_block12_memory(&self->matrix);
}
