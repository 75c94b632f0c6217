/* coarse.c: the coarse matrix P^T A P, assembled by pairs of cells, and its sparse Cholesky factor.
 *
 * The weight of corner a for a node at (x, y, z) of its cell is the product of x or 1 - x, y or 1 - y, z or 1 - z, by
 * the bits of a. A vertex has the rank 4 place + slot, `place` that of its patch in the order of elimination: component
 * c of its displacement is the unknown 3 rank + c. */
#include "linear/coarse.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "base/sort.h"
#include "linear/coarse_cell.h"
#include "linear/coarse_cholesky.h"
#include "linear/coarse_grid.h"
#include "linear/coarse_team.h"
#include "linear/lanes.h"

enum {
  CORNERS = FLESH_COARSE_CORNERS,
  SLOTS = 4,  /* vertices of a patch */
  PARTS = FLESH_COARSE_PARTS, /* tasks, also of the pairs of cells, summed in this order for any number of threads */
  MOST_VERTICES = 16384 /* vertices */
};

/* A block of A that couples the cells of a pair: `node` is in the first cell. Here and below, nodes are numbered by their
 * place in vectors. */
typedef struct term {
  int pair, node, other;
  int block; /* ~: its transpose */
} term;

/* Two cells that A couples, or one with itself. */
typedef struct pair {
  int low, high, first;           /* first of the pair's terms */
  /* Places of the blocks of corners a of `low` and b of `high`, at 8 a + b; ~: transposed. */
  int entry[CORNERS * CORNERS];
} pair;

/* Sums of r over the nodes of a cell, for each corner, component by component. */
typedef struct sums {
  flesh_float8 of[3];
} sums;

/* Coefficients of 1, x, y, xy, z, xz, yz, xyz in a cell's displacement by the last solve. */
typedef struct moves {
  flesh_float4 of[CORNERS];
} moves;

struct flesh_coarse {
  int rows;
  flesh_threads *threads;
  const flesh_team *team; /* the threads' team; NULL: none */
  flesh_coarse_grid grid; /* its corners are given by their ranks */
  int *stored;            /* [rows] the mesh's number of each node */
  sums *sums[PARTS];      /* [cells] zero between solves */
  moves *moves;           /* [cells] */
  term *terms;             /* [blocks] sorted by pair, then by node */
  pair *pairs;             /* [pair_count+1] */
  int pair_count, entry_count;
  int *ranks;              /* [2*entry_count] ranks of the two vertices of each entry, the lower first */
  double *entries[PARTS];  /* [9*entry_count] blocks of P^T A P */
  float *load; /* [12*patches] P^T r */
  flesh_coarse_cholesky matrix;
  flesh_coarse_sums summed; /* blocks that are summed over the ranks of the team */
};

static int compare_names(const void *a, const void *b)
{
  const int64_t p = *(const int64_t *)a, q = *(const int64_t *)b;
  return (p > q) - (p < q);
}

/* Sorts the blocks by the pair of cells that they couple; `place` [rows]: the place of each of the mesh's nodes in
 * vectors. */
static int make_terms(flesh_coarse *self, const flesh_block_matrix *A, const int *place)
{
  const int *cell = self->grid.cell;
  const int blocks = A->row_start[A->rows], cells = self->grid.cells;
  self->terms = flesh_huge_pages_alloc(((size_t)blocks + 1) * sizeof *self->terms);
  if (!self->terms || (int64_t)cells * cells > INT32_MAX) return FLESH_ERR_MEMORY;
  for (int i = 0, count = 0; i < A->rows; i++)
    for (int k = A->row_start[i]; k < A->row_end[i]; k++) {
      const int p = place[i], q = place[A->column[k]], swap = cell[p] > cell[q];
      const int low = swap ? cell[q] : cell[p], high = swap ? cell[p] : cell[q];
      self->terms[count++] = (term){low * cells + high, swap ? q : p, swap ? p : q, swap ? ~k : k};
    }
  flesh_sort(self->terms, (size_t)blocks, sizeof *self->terms, flesh_compare_three_ints);
  for (int k = 0; k < blocks; k++) self->pair_count += k == 0 || self->terms[k].pair != self->terms[k - 1].pair;
  self->pairs = flesh_huge_pages_alloc(((size_t)self->pair_count + 1) * sizeof *self->pairs);
  if (!self->pairs) return FLESH_ERR_MEMORY;
  pair *now = self->pairs;
  for (int k = 0; k < blocks; k++)
    if (k == 0 || self->terms[k].pair != self->terms[k - 1].pair) {
      now->low = self->terms[k].pair / cells;
      now->high = self->terms[k].pair % cells;
      now++->first = k;
    }
  now->first = blocks;
  return FLESH_OK;
}

/* Makes a factor for the patches that A couples; none if any rank has failed before. */
static int make_factor(flesh_coarse *self, int status)
{
  const int *corner = self->grid.corner, *patch = self->grid.patch;
  const size_t n = (size_t)self->grid.patches;
  uint8_t *touch = status ? NULL : flesh_calloc(n * n + 1, 1);
  for (int k = 0; touch && k < self->pair_count; k++)
    for (int e = 0; e < CORNERS * CORNERS; e++) {
      const size_t i = (size_t)patch[corner[CORNERS * self->pairs[k].low + e / CORNERS]],
                   j = (size_t)patch[corner[CORNERS * self->pairs[k].high + e % CORNERS]];
      touch[n * i + j] = touch[n * j + i] = 1;
    }
  status = flesh_coarse_sums_create(self->team, self->grid.patches, touch, &self->matrix, &self->summed);
  flesh_free(touch);
  return status;
}

/* Names an entry by its ranks, the lower first. */
static int64_t name_of_entry(int a, int b) { return a < b ? (int64_t)a << 32 | b : (int64_t)b << 32 | a; }

/* Lists the blocks of P^T A P, and to which of them each pair of cells adds. */
static int make_entries(flesh_coarse *self)
{
  const int *corner = self->grid.corner;
  const size_t most = (size_t)self->pair_count * CORNERS * CORNERS;
  int64_t *names = flesh_malloc((most + 1) * sizeof *names);
  if (!names) return FLESH_ERR_MEMORY;
  for (size_t e = 0; e < most; e++) {
    const pair *p = &self->pairs[e / (CORNERS * CORNERS)];
    names[e] = name_of_entry(corner[CORNERS * p->low + (int)(e / CORNERS % CORNERS)],
                             corner[CORNERS * p->high + (int)(e % CORNERS)]);
  }
  flesh_sort(names, most, sizeof *names, compare_names);
  for (size_t e = 0; e < most; e++)
    if (e == 0 || names[e] != names[self->entry_count - 1]) names[self->entry_count++] = names[e];
  self->ranks = flesh_malloc((2 * (size_t)self->entry_count + 1) * sizeof *self->ranks);
  int failed = !self->ranks;
  for (int part = 0; part < PARTS; part++)
    failed |= !(self->entries[part] = flesh_huge_pages_alloc((9 * (size_t)self->entry_count + 1) * sizeof(double)));
  for (int e = 0; e < self->entry_count && !failed; e++) {
    self->ranks[2 * e] = (int)(names[e] >> 32);
    self->ranks[2 * e + 1] = (int)(names[e] & 0x7fffffff);
  }
  for (int k = 0; k < self->pair_count && !failed; k++)
    for (int e = 0; e < CORNERS * CORNERS; e++) {
      const int a = corner[CORNERS * self->pairs[k].low + e / CORNERS],
                b = corner[CORNERS * self->pairs[k].high + e % CORNERS];
      const int64_t name = name_of_entry(a, b);
      const int64_t *found = bsearch(&name, names, (size_t)self->entry_count, sizeof name, compare_names);
      const int at = (int)(found - names);
      self->pairs[k].entry[e] = a <= b ? at : ~at;
    }
  flesh_free(names);
  return failed ? FLESH_ERR_MEMORY : FLESH_OK;
}

/* Builds the level from the grid; ranks call each other even if one of them has failed before, or has no memory. */
static int build(flesh_coarse *self, const flesh_block_matrix *A, const int *stored, int status)
{
  const size_t rows = (size_t)A->rows;
  int *place = flesh_malloc((rows + 1) * sizeof *place);
  self->stored = flesh_malloc((rows + 1) * sizeof *self->stored);
  if (!place || !self->stored) status = FLESH_ERR_MEMORY;
  if (!status) {
    memcpy(self->stored, stored, rows * sizeof *stored);
    for (int p = 0; p < A->rows; p++) place[stored[p]] = p;
    status = make_terms(self, A, place);
  }
  status = make_factor(self, status);
  if (!status) {
    for (int e = 0; e < CORNERS * self->grid.cells; e++) {
      const int v = self->grid.corner[e];
      self->grid.corner[e] = SLOTS * self->matrix.place[self->grid.patch[v]] + self->grid.slot[v];
    }
    const size_t cells = (size_t)self->grid.cells + 1;
    int failed = !(self->moves = flesh_huge_pages_alloc(cells * sizeof *self->moves));
    for (int part = 0; part < PARTS; part++)
      failed |= !(self->sums[part] = flesh_huge_pages_calloc(cells * sizeof *self->sums[part]));
    failed |= !(self->load = flesh_huge_pages_alloc(((size_t)self->grid.patches * FLESH_BLOCK12 + 1) * sizeof *self->load));
    status = failed ? FLESH_ERR_MEMORY : make_entries(self);
  }
  flesh_free(place);
  return status;
}

static void clear(flesh_coarse *self)
{
  void *arrays[] = {self->load,  self->stored, self->sums[0],    self->sums[1],   self->moves, self->terms,
                    self->pairs, self->ranks,  self->entries[0], self->entries[1]};
  for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) flesh_free(arrays[k]);
  flesh_coarse_grid_clear(&self->grid);
  flesh_coarse_cholesky_clear(&self->matrix);
  flesh_coarse_sums_clear(&self->summed);
}

int flesh_coarse_create(const flesh_block_matrix *A, const double *positions, int vertices,
                        const flesh_bisection *bisection, flesh_threads *threads, const flesh_team *team,
                        flesh_coarse **coarse)
{
  flesh_coarse made = {.rows = A->rows, .threads = threads, .team = team};
  const int most = vertices < MOST_VERTICES ? vertices : MOST_VERTICES, *stored = bisection->order;
  int status = flesh_coarse_grid_create(A, positions, stored, most, team, &made.grid);
  status = build(&made, A, stored, status);
  *coarse = status ? NULL : flesh_malloc(sizeof **coarse);
  if (*coarse) **coarse = made;
  else clear(&made);
  return *coarse ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for the coarse space of %d nodes", A->rows);
}

void flesh_coarse_destroy(flesh_coarse **coarse)
{
  if (!coarse || !*coarse) return;
  clear(*coarse);
  flesh_free(*coarse);
  *coarse = NULL;
}

typedef struct assembly {
  flesh_coarse *coarse;
  const flesh_block_matrix *A;
} assembly;

/* Computes T[3 c + d] += A[c][d] w_other. */
static inline void add_term(const flesh_coarse *self, const flesh_block_matrix *A, const term *t, int first,
                            flesh_aside T[9])
{
  const double *b = A->values + 9 * (size_t)(t->block < 0 ? ~t->block : t->block);
  const flesh_aside w = flesh_coarse_some_weights(self->grid.local[t->other], first);
  double a[9];
  for (int c = 0; c < 3; c++)
    for (int d = 0; d < 3; d++) a[3 * c + d] = t->block < 0 ? b[3 * d + c] : b[3 * c + d];
  const int constrained = (int)self->grid.local[t->node][3];
  if (t->node == t->other) /* half, as the transpose is added in the end; without fixed dofs */
    for (int e = 0; e < 9; e++) a[e] *= constrained >> e / 3 & 1 || constrained >> e % 3 & 1 ? 0 : 0.5;
  for (int e = 0; e < 9; e++) T[e] += a[e] * w;
}

/* Sums up a pair's terms, first over the nodes of one cell, then over those of the other: sum[a] is for corner a of the
 * first cell and corners of the second from `first` on. */
static void sum_pair(const flesh_coarse *self, const flesh_block_matrix *A, const pair *p, int first,
                     flesh_aside sum[CORNERS][9])
{
  const int end = p[1].first;
  memset(sum, 0, CORNERS * sizeof *sum);
  for (int k = p->first; k < end;) {
    const int node = self->terms[k].node;
    const flesh_float8 w = flesh_coarse_weights(self->grid.local[node]);
    flesh_aside T[9] = {{0}};
    for (; k < end && self->terms[k].node == node; k++) add_term(self, A, &self->terms[k], first, T);
    for (int a = 0; a < CORNERS; a++)
      for (int e = 0; e < 9; e++) sum[a][e] += (double)w[a] * T[e];
  }
}

/* Assembles a part of the pairs: what couples two vertices, once; what couples one with itself, with its transpose. */
static void assemble_part(void *data, int part)
{
  const assembly *s = data;
  const flesh_coarse *self = s->coarse;
  const int *corner = self->grid.corner;
  const long terms = self->pairs[self->pair_count].first;
  double *entries = self->entries[part];
  memset(entries, 0, 9 * (size_t)self->entry_count * sizeof *entries);
  for (int k = 0; k < self->pair_count; k++) {
    const pair *p = &self->pairs[k];
    if (p->first < terms * part / PARTS || p->first >= terms * (part + 1) / PARTS) continue;
    flesh_aside sum[CORNERS / FLESH_ASIDE][CORNERS][9];
    for (int first = 0; first < CORNERS; first += FLESH_ASIDE) sum_pair(self, s->A, p, first, sum[first / FLESH_ASIDE]);
    for (int e = 0; e < CORNERS * CORNERS; e++) {
      const int a = e / CORNERS, b = e % CORNERS, at = p->entry[e];
      const int own = corner[CORNERS * p->low + a] == corner[CORNERS * p->high + b];
      double *to = entries + 9 * (size_t)(at < 0 ? ~at : at);
      const flesh_aside *of_corner = sum[b / FLESH_ASIDE][a];
      for (int c = 0; c < 3; c++)
        for (int d = 0; d < 3; d++) {
          const double value = of_corner[3 * c + d][b % FLESH_ASIDE];
          if (at >= 0) to[3 * c + d] += value;
          if (at < 0 || own) to[3 * d + c] += value;
        }
    }
  }
}

/* Copies the entries to the matrix that is factored. */
static void load_matrix(flesh_coarse *self, double scale)
{
  flesh_coarse_cholesky_zero(&self->matrix);
  for (int e = 0; e < self->entry_count; e++) {
    const int low = self->ranks[2 * e], high = self->ranks[2 * e + 1];
    double *block = flesh_coarse_cholesky_at(&self->matrix, low / SLOTS, high / SLOTS);
    for (int c = 0; c < 3; c++)
      for (int d = 0; d < 3; d++) {
        const int m = 3 * (low % SLOTS) + c, r = 3 * (high % SLOTS) + d;
        const size_t at = 9 * (size_t)e + 3 * (size_t)c + (size_t)d;
        const double value = scale * (self->entries[0][at] + self->entries[1][at]);
        block[FLESH_BLOCK12 * m + r] = value;
        if (low / SLOTS == high / SLOTS) block[FLESH_BLOCK12 * r + m] = value;
      }
  }
  flesh_coarse_sum_matrix(self->team, &self->summed, &self->matrix);
}

int flesh_coarse_setup(flesh_coarse *self, const flesh_block_matrix *A, double scale, const uint8_t *fixed)
{
  for (int p = 0; p < self->rows; p++) {
    const uint8_t *constrained = fixed ? fixed + 3 * (size_t)self->stored[p] : NULL;
    self->grid.local[p][3] = (float)(constrained ? (constrained[0] != 0) | (constrained[1] != 0) << 1 | (constrained[2] != 0) << 2 : 0);
  }
  flesh_threads_run(self->threads, PARTS, assemble_part, &(assembly){self, A});
  load_matrix(self, scale);
  return flesh_coarse_cholesky_factor(&self->matrix) ? FLESH_OK : FLESH_NOT_POSITIVE;
}

/* Sets the fixed components of a node at `local` to 0: they are not in the coarse space. Few nodes have any. */
static inline flesh_float4 without_constrained(flesh_float4 x, flesh_float4 local)
{
  for (int c = 0; local[3] > 0 && c < 3; c++)
    if ((int)local[3] >> c & 1) x[c] = 0;
  return x;
}

void flesh_coarse_restrict(flesh_coarse *self, int part, int begin, int end, const float *r)
{
  for (size_t p = (size_t)begin; p < (size_t)end; p++) {
    const flesh_float4 local = self->grid.local[p],
                       own = without_constrained(*(const flesh_float4 *)(r + 4 * p), local);
    const flesh_float8 w = flesh_coarse_weights(local);
    flesh_float8 *sum = self->sums[part][self->grid.cell[p]].of;
    for (int c = 0; c < 3; c++) sum[c] += w * own[c];
  }
}

int flesh_coarse_unknowns(const flesh_coarse *self) { return self->grid.patches * FLESH_BLOCK12; }

/* Adds up the restricted residual in `load`, and clears it. */
static void take(flesh_coarse *self)
{
  const int *corner = self->grid.corner;
  float *load = self->load;
  memset(load, 0, (size_t)self->grid.patches * FLESH_BLOCK12 * sizeof *load);
  for (int k = 0; k < self->grid.cells; k++) {
    for (int c = 0; c < 3; c++) {
      const flesh_float8 sum = self->sums[0][k].of[c] + self->sums[1][k].of[c];
      for (int a = 0; a < CORNERS; a++) load[3 * (size_t)corner[CORNERS * k + a] + (size_t)c] += sum[a];
    }
    for (int part = 0; part < PARTS; part++) self->sums[part][k] = (sums){0};
  }
}

void flesh_coarse_take(flesh_coarse *self, double scale, double *load)
{
  take(self);
  for (int k = 0; k < flesh_coarse_unknowns(self); k++) load[k] = scale * self->load[k];
}

/* Solves for the load that the matrix's x has. */
static void solve(flesh_coarse *self)
{
  const int *corner = self->grid.corner;
  flesh_coarse_cholesky_solve(&self->matrix);
  for (int k = 0; k < self->grid.cells; k++) {
    flesh_float4 *moves = self->moves[k].of;
    for (int a = 0; a < CORNERS; a++) {
      const float *u = self->matrix.x + 3 * (size_t)corner[CORNERS * k + a];
      moves[a] = (flesh_float4){u[0], u[1], u[2], 0};
    }
    flesh_coarse_to_products(moves);
  }
}

double flesh_coarse_solve(flesh_coarse *self)
{
  const size_t unknowns = (size_t)self->grid.patches * FLESH_BLOCK12;
  float *x = self->matrix.x, *load = self->load;
  double product = 0;
  take(self);
  memcpy(x, load, unknowns * sizeof *x);
  flesh_coarse_sum(self->team, (int)unknowns, x);
  solve(self);
  for (size_t k = 0; k < unknowns; k++) product += (double)load[k] * (double)x[k];
  return product;
}

void flesh_coarse_solve_for(flesh_coarse *self, const double *load, double scale)
{
  for (int k = 0; k < flesh_coarse_unknowns(self); k++) self->matrix.x[k] = (float)(scale * load[k]);
  solve(self);
}

void flesh_coarse_add(const flesh_coarse *self, int begin, int end, float share, const float *y, float *z)
{
  for (size_t k = (size_t)begin; k < (size_t)end; k++, y += 4, z += 4) {
    const flesh_float4 at = self->grid.local[k], *m = self->moves[self->grid.cell[k]].of;
    const flesh_float4 low = (m[0] + m[1] * at[0]) + (m[2] + m[3] * at[0]) * at[1],
                       high = (m[4] + m[5] * at[0]) + (m[6] + m[7] * at[0]) * at[1];
    *(flesh_float4 *)z = *(const flesh_float4 *)y + share * without_constrained(low + high * at[2], at);
  }
}

void flesh_coarse_archive(flesh_coarse *self, flesh_archive *archive)
{
  flesh_archive_bytes(archive, self->grid.local, (size_t)self->rows * sizeof *self->grid.local);
  flesh_coarse_cholesky_archive(&self->matrix, archive);
}
