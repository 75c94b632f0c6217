/* coarse_team.c: exchanges the coarse level's pattern, matrix and loads, some numbers at a time. */
#include "linear/coarse_team.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"

enum { ROOM = 1024 }; /* numbers that ranks exchange at a time */

/* Unites the couplings of all ranks' matrices. Collective, even if memory is lacking. */
static int unite(const flesh_team *team, size_t n, uint8_t *touch)
{
  double *row = team ? flesh_malloc((n + 1) * sizeof *row) : NULL;
  const int status = flesh_team_agree(team, touch && (row || !team) ? FLESH_OK : FLESH_ERR_MEMORY);
  for (size_t i = 0; team && !status && i < n; i++) {
    for (size_t j = 0; j < n; j++) row[j] = touch[n * i + j];
    flesh_team_largest(team, (int)n, row);
    for (size_t j = 0; j < n; j++) touch[n * i + j] = row[j] > 0;
  }
  flesh_free(row);
  return status;
}

/* Lists the blocks by rising place in the factor; `order` [n] is work space. */
static int list_blocks(const flesh_coarse_cholesky *matrix, const uint8_t *touch, int couplings, int *order,
                       flesh_coarse_sums *self)
{
  self->blocks = flesh_malloc(((size_t)couplings + 1) * sizeof *self->blocks);
  if (!self->blocks) return FLESH_ERR_MEMORY;
  for (int i = 0; i < matrix->n; i++) order[matrix->place[i]] = i;
  for (int k = 0; k < matrix->n; k++)
    for (int e = matrix->start[k]; e < matrix->start[k + 1]; e++)
      if (touch[(size_t)matrix->n * (size_t)order[k] + (size_t)order[matrix->row[e]]]) self->blocks[self->count++] = e;
  return FLESH_OK;
}

int flesh_coarse_sums_create(const flesh_team *team, int patches, uint8_t *touch, flesh_coarse_cholesky *matrix,
                             flesh_coarse_sums *self)
{
  const size_t n = (size_t)patches;
  int status = unite(team, n, touch), *starts = NULL, *neighbours = NULL;
  if (!status) {
    starts = flesh_calloc(n + 1, sizeof *starts);
    status = starts ? FLESH_OK : FLESH_ERR_MEMORY;
  }
  for (size_t i = 0; !status && i < n; i++) {
    starts[i + 1] = starts[i];
    for (size_t j = 0; j < n; j++) starts[i + 1] += i != j && touch[n * i + j];
  }
  if (!status) {
    neighbours = flesh_malloc(((size_t)starts[n] + 1) * sizeof *neighbours);
    status = neighbours ? FLESH_OK : FLESH_ERR_MEMORY;
  }
  int count = 0;
  for (size_t i = 0; !status && i < n; i++)
    for (size_t j = 0; j < n; j++)
      if (i != j && touch[n * i + j]) neighbours[count++] = (int)j;
  if (!status) status = flesh_coarse_cholesky_create(patches, starts, neighbours, matrix);
  if (!status && team) status = list_blocks(matrix, touch, count / 2, starts, self);
  flesh_free(starts);
  flesh_free(neighbours);
  return status;
}

void flesh_coarse_sums_clear(flesh_coarse_sums *self)
{
  flesh_free(self->blocks);
  *self = (flesh_coarse_sums){0};
}

/* Moves a block and leaves 0 in its place. */
static void move_block(double *blocks, int from, int to)
{
  double *block = blocks + FLESH_BLOCK12_SIZE * (size_t)from;
  memcpy(blocks + FLESH_BLOCK12_SIZE * (size_t)to, block, FLESH_BLOCK12_SIZE * sizeof *block);
  memset(block, 0, FLESH_BLOCK12_SIZE * sizeof *block);
}

/* Sums up the blocks over the ranks, after moving them to the front of the array. */
void flesh_coarse_sum_matrix(const flesh_team *team, const flesh_coarse_sums *self, flesh_coarse_cholesky *matrix)
{
  if (!team) return;
  for (int k = 0; k < self->count; k++)
    if (self->blocks[k] != k) move_block(matrix->blocks, self->blocks[k], k);
  flesh_team_sum(team, FLESH_BLOCK12_SIZE * self->count, matrix->blocks);
  for (int k = self->count - 1; k >= 0; k--)
    if (self->blocks[k] != k) move_block(matrix->blocks, k, self->blocks[k]);
  flesh_team_sum(team, FLESH_BLOCK12_SIZE * matrix->n, matrix->pivots);
}

void flesh_coarse_sum(const flesh_team *team, int count, float *x)
{
  double some[ROOM];
  for (int begin = 0; team && begin < count; begin += ROOM) {
    const int size = count - begin < ROOM ? count - begin : ROOM;
    for (int k = 0; k < size; k++) some[k] = x[begin + k];
    flesh_team_sum(team, size, some);
    for (int k = 0; k < size; k++) x[begin + k] = (float)some[k];
  }
}
