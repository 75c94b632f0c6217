/* overlap.c: the pattern of the overlap's matrix, and exchanges of its blocks. */
#include "linear/overlap.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"
#include "linear/block_matrix.h"

int flesh_overlap_narrow(const flesh_block_matrix *A, const flesh_team *team, int status, uint8_t *needed,
                         const flesh_team **narrow)
{
  for (int i = 0; i < A->rows && !status; i++)
    for (int k = A->row_start[i] + 1; k < A->row_end[i]; k++) needed[i] = needed[A->column[k]] = 1;
  return flesh_team_narrow(team, status, needed, narrow);
}

void flesh_overlap_update_vector(const flesh_overlap *self) { flesh_team_update_overlap(self->team, 3, self->vector); }

/* Blocks of A that are sent to other ranks. */
typedef struct listing {
  int count;
  int *first;     /* [ranks+1] first block of each rank */
  int *blocks;    /* NULL: they are only counted */
  double *places; /* [2] for each block: its row and column in the list of nodes that the rank gets */
} listing;

/* Lists the blocks given to other ranks; `place` [rows] is work space. */
static void list_given(const flesh_block_matrix *A, const flesh_team_neighbours *neighbours, int *place, listing *list)
{
  memset(place, -1, (size_t)A->rows * sizeof *place);
  list->count = 0;
  for (int r = 0; r < neighbours->count; r++) {
    const int first = neighbours->first_given[r], count = neighbours->first_given[r + 1] - first;
    const int *nodes = neighbours->given + first;
    list->first[r] = list->count;
    for (int k = 0; k < count; k++) place[nodes[k]] = k;
    for (int k = 0; k < count; k++)
      for (int b = A->row_start[nodes[k]]; b < A->row_end[nodes[k]]; b++) {
        if (place[A->column[b]] < 0) continue;
        if (list->blocks) {
          list->blocks[list->count] = b;
          list->places[2 * list->count] = k;
          list->places[2 * list->count + 1] = place[A->column[b]];
        }
        list->count++;
      }
    for (int k = 0; k < count; k++) place[nodes[k]] = -1;
  }
  list->first[neighbours->count] = list->count;
}

/* Sends `width` numbers for each block from `sent`, and receives into `received`. */
static void exchange(const flesh_overlap *self, int width)
{
  flesh_exchange_now(self->team,
                     &(flesh_exchange){width, self->first_given, self->first_taken, self->sent, self->received});
}

/* A block of the overlap's matrix. */
typedef struct entry {
  int row, column;
} entry;

/* Returns the place of a received block; sets `flipped` if the block must be transposed. */
static entry entry_of(const flesh_overlap *self, int rank, int block, int *flipped)
{
  const int *nodes = self->team->neighbours.taken + self->team->neighbours.first_taken[rank];
  const int row = nodes[(int)self->received[2 * block]], column = nodes[(int)self->received[2 * block + 1]];
  *flipped = row > column;
  return *flipped ? (entry){column, row} : (entry){row, column};
}

/* Makes the pattern of the matrix: that of A, and `extra` sorted blocks that A does not have. */
static int make_pattern(flesh_overlap *self, const flesh_block_matrix *A, int extra, const entry *entries)
{
  const size_t rows = (size_t)self->team->overlap, blocks = (size_t)A->row_start[A->rows] + (size_t)extra;
  int next = 0, count = 0;
  self->row_start = flesh_malloc((rows + 1) * sizeof *self->row_start);
  self->column = flesh_malloc((blocks + 1) * sizeof *self->column);
  self->matrix.values = flesh_malloc((9 * blocks + 1) * sizeof *self->matrix.values);
  if (!self->row_start || !self->column || !self->matrix.values) return FLESH_ERR_MEMORY;
  for (int i = 0; i < (int)rows; i++) {
    self->row_start[i] = count;
    int k = i < A->rows ? A->row_start[i] : 0;
    const int end = i < A->rows ? A->row_end[i] : 0;
    while (k < end || (next < extra && entries[next].row == i)) {
      const int from_A = k < end && (next == extra || entries[next].row > i || A->column[k] < entries[next].column);
      if (from_A) self->own_place[k] = count;
      self->column[count++] = from_A ? A->column[k++] : entries[next++].column;
    }
  }
  self->row_start[rows] = count;
  self->matrix.rows = (int)rows;
  self->matrix.row_start = self->row_start;
  self->matrix.row_end = self->row_start + 1;
  self->matrix.column = self->column;
  return FLESH_OK;
}

/* Whether the matrix differs from A: this rank has nodes that others have, too, or ghosts that are left out. */
static int has_others(const flesh_overlap *self)
{
  return self->team && (self->team->neighbours.count > 0 || self->team->left_out);
}

/* Makes the matrix from the places received; uses A itself where that is possible. */
static int make_matrix(flesh_overlap *self, const flesh_block_matrix *A)
{
  if (!has_others(self)) {
    self->matrix = *A;
    return FLESH_OK;
  }
  const int taken = self->first_taken[self->team->neighbours.count];
  entry *entries = flesh_malloc(((size_t)taken + 1) * sizeof *entries);
  int extra = 0, kept = 0, flipped;
  if (!entries) return FLESH_ERR_MEMORY;
  for (int r = 0, k = 0; r < self->team->neighbours.count; r++)
    for (; k < self->first_taken[r + 1]; k++) {
      const entry e = entry_of(self, r, k, &flipped);
      if (e.column >= A->rows || flesh_block_find(A, e.row, e.column) < 0) entries[extra++] = e;
    }
  flesh_sort(entries, (size_t)extra, sizeof *entries, flesh_compare_two_ints);
  for (int k = 0; k < extra; k++)
    if (k == 0 || flesh_compare_two_ints(&entries[k], &entries[kept - 1])) entries[kept++] = entries[k];
  const int status = make_pattern(self, A, kept, entries);
  flesh_free(entries);
  for (int r = 0, k = 0; !status && r < self->team->neighbours.count; r++)
    for (; k < self->first_taken[r + 1]; k++) {
      const entry e = entry_of(self, r, k, &flipped);
      const int at = flesh_block_find(&self->matrix, e.row, e.column);
      self->taken[k] = flipped ? ~at : at;
    }
  return status;
}

/* Returns the room for a message with this many blocks, or with this many nodes. */
static size_t room_for(int blocks, int nodes)
{
  const size_t of_blocks = 9 * (size_t)blocks, of_nodes = 3 * (size_t)nodes;
  return (of_blocks > of_nodes ? of_blocks : of_nodes) + 1;
}

/* Returns the room for all vectors, in numbers. */
static size_t vector_room(const flesh_team *team)
{
  return 6 * (size_t)team->overlap + 6 * (size_t)(team->overlap - team->own);
}

static int allocate_given(flesh_overlap *self, const flesh_block_matrix *A, int *place)
{
  const size_t ranks = (size_t)self->team->neighbours.count, blocks = has_others(self) ? (size_t)A->row_start[A->rows] : 0;
  self->first_given = flesh_calloc(ranks + 1, sizeof *self->first_given);
  self->first_taken = flesh_calloc(ranks + 1, sizeof *self->first_taken);
  self->own_place = flesh_malloc((blocks + 1) * sizeof *self->own_place);
  self->vector = flesh_malloc((vector_room(self->team) + 1) * sizeof *self->vector);
  self->weight = flesh_malloc(((size_t)self->team->overlap + 1) * sizeof *self->weight);
  if (!place || !self->first_given || !self->first_taken || !self->own_place || !self->vector || !self->weight)
    return FLESH_ERR_MEMORY;
  self->found = self->vector + 3 * (size_t)self->team->overlap;
  self->r = self->found + 3 * (size_t)self->team->overlap;
  self->s = self->r + 3 * (size_t)(self->team->overlap - self->team->own);
  listing list = {.first = self->first_given};
  list_given(A, &self->team->neighbours, place, &list);
  self->given = flesh_malloc(((size_t)list.count + 1) * sizeof *self->given);
  self->sent = flesh_malloc(room_for(list.count, self->team->neighbours.first_taken[ranks]) * sizeof *self->sent);
  if (!self->given || !self->sent) return FLESH_ERR_MEMORY;
  list.blocks = self->given;
  list.places = self->sent;
  list_given(A, &self->team->neighbours, place, &list);
  return FLESH_OK;
}

static int allocate_taken(flesh_overlap *self)
{
  const flesh_team_neighbours *neighbours = &self->team->neighbours;
  const size_t blocks = (size_t)self->first_taken[neighbours->count];
  self->taken = flesh_malloc((blocks + 1) * sizeof *self->taken);
  self->received = flesh_malloc(room_for(self->first_taken[neighbours->count], neighbours->first_given[neighbours->count]) *
                                sizeof *self->received);
  return self->taken && self->received ? FLESH_OK : FLESH_ERR_MEMORY;
}

/* Lists the nodes that are given or taken, ascending. */
static int list_shared(flesh_overlap *self)
{
  const flesh_team *team = self->team;
  const flesh_team_neighbours *neighbours = &team->neighbours;
  char *is_shared = flesh_calloc((size_t)team->overlap + 1, sizeof *is_shared);
  for (int k = 0; is_shared && k < neighbours->first_given[neighbours->count]; k++) is_shared[neighbours->given[k]] = 1;
  for (int k = 0; is_shared && k < neighbours->first_taken[neighbours->count]; k++) is_shared[neighbours->taken[k]] = 1;
  for (int i = 0; is_shared && i < team->overlap; i++) self->shared_count += is_shared[i];
  self->shared = flesh_malloc(((size_t)self->shared_count + 1) * sizeof *self->shared);
  for (int i = 0, k = 0; is_shared && self->shared && i < team->overlap; i++)
    if (is_shared[i]) self->shared[k++] = i;
  flesh_free(is_shared);
  return is_shared && self->shared ? FLESH_OK : FLESH_ERR_MEMORY;
}

/* Sets the weights to k^(-1/4) on either side, k being the number of ranks whose overlaps have the node. Weights 1 would
 * count corrections twice where two ranks overlap, k^(-1/2) would average them; the middle took fewer iterations than
 * either (lib/parallel/README.md). */
static void set_weights(flesh_overlap *self)
{
  const flesh_team *team = self->team;
  for (int i = 0; i < team->overlap; i++) self->vector[i] = 1;
  flesh_team_sum_overlap(team, 1, self->vector);
  for (int i = 0; i < team->overlap; i++) self->weight[i] = (float)pow(self->vector[i], -0.25);
}

int flesh_overlap_create(const flesh_block_matrix *A, const flesh_team *team, const double *x, flesh_overlap *self)
{
  *self = (flesh_overlap){.team = team, .matrix = *A};
  if (!team) return FLESH_OK;
  self->matrix = (flesh_block_matrix){0};
  int *place = flesh_malloc(((size_t)A->rows + 1) * sizeof *place);
  double *counts = flesh_malloc((2 * (size_t)team->neighbours.count + 1) * sizeof *counts);
  int status = counts ? list_shared(self) : FLESH_ERR_MEMORY;
  status = flesh_team_agree(team, status ? status : allocate_given(self, A, place));
  if (!status) {
    set_weights(self);
    flesh_exchange_counts(team, self->first_given, counts, self->first_taken);
    status = flesh_team_agree(team, allocate_taken(self));
  }
  if (!status) {
    exchange(self, 2);
    if (x) memcpy(self->vector, x, 3 * (size_t)A->rows * sizeof *x);
    if (x) flesh_overlap_update_vector(self);
    status = make_matrix(self, A);
  }
  flesh_free(place);
  flesh_free(counts);
  return status ? flesh_fail(status, "no memory for the overlap of %d nodes", A->rows) : FLESH_OK;
}

int flesh_overlap_set_orders(flesh_overlap *self, const int *nodes, const int *overlap_order)
{
  const size_t own = (size_t)self->team->nodes, all = (size_t)self->team->overlap;
  self->there = flesh_malloc((2 * all + 2 * own + 1) * sizeof *self->there);
  if (!self->there) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the overlap of %zu nodes", own);
  self->here = self->there + all;
  self->place = self->here + all;
  self->from = self->place + own;
  for (size_t p = 0; p < own; p++) self->place[nodes[p]] = (int)p;
  for (size_t p = 0; p < all; p++) {
    self->there[overlap_order[p]] = (int)p;
    self->here[p] = (size_t)overlap_order[p] < own ? self->place[overlap_order[p]] : 0;
  }
  for (size_t p = 0; p < own; p++) self->from[p] = self->there[nodes[p]];
  return FLESH_OK;
}

void flesh_overlap_clear(flesh_overlap *self)
{
  void *arrays[] = {self->row_start, self->column, self->own_place, self->first_given, self->first_taken, self->given,
                    self->taken,     self->sent,   self->received,  self->vector,      self->weight,      self->shared,
                    self->there};
  for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) flesh_free(arrays[k]);
  if (has_others(self)) flesh_free(self->matrix.values);
  *self = (flesh_overlap){0};
}

/* Sets unit diagonals for ghosts that ranks leave out: their rows have nothing to solve for. */
static void set_left_out(flesh_overlap *self)
{
  const uint8_t *left_out = self->team->left_out;
  for (int i = 0; left_out && i < self->matrix.rows; i++)
    for (int c = 0; left_out[i] && c < 3; c++) self->matrix.values[9 * (size_t)self->row_start[i] + 4 * (size_t)c] = 1;
}

const flesh_block_matrix *flesh_overlap_update(flesh_overlap *self, const flesh_block_matrix *A)
{
  if (!has_others(self)) return A;
  const int ranks = self->team->neighbours.count;
  double *values = self->matrix.values;
  memset(values, 0, 9 * (size_t)self->row_start[self->matrix.rows] * sizeof *values);
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i]; k < A->row_end[i]; k++)
      memcpy(values + 9 * (size_t)self->own_place[k], A->values + 9 * (size_t)k, 9 * sizeof *values);
  for (int k = 0; k < self->first_given[ranks]; k++)
    memcpy(self->sent + 9 * (size_t)k, A->values + 9 * (size_t)self->given[k], 9 * sizeof *values);
  exchange(self, 9);
  for (int k = 0; k < self->first_taken[ranks]; k++) {
    const int at = self->taken[k], flipped = at < 0;
    const double *block = self->received + 9 * (size_t)k;
    double *to = values + 9 * (size_t)(flipped ? ~at : at);
    for (int e = 0; e < 9; e++) to[e] += block[flipped ? 3 * (e % 3) + e / 3 : e];
  }
  set_left_out(self);
  return &self->matrix;
}
