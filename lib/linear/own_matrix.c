/* own_matrix.c: a view of a rank's matrix without ghosts, whose diagonal blocks are lent from all ranks. */
#include "linear/own_matrix.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "linear/block_matrix.h"

int flesh_own_matrix_create(const flesh_block_matrix *A, const flesh_team *team, flesh_own_matrix *self)
{
  const size_t rows = (size_t)A->rows;
  *self = (flesh_own_matrix){.team = team, .view = *A};
  if (!team) return FLESH_OK;
  self->row_end = flesh_malloc((rows + 1) * sizeof *self->row_end);
  self->saved = flesh_malloc((9 * rows + 1) * sizeof *self->saved);
  self->diagonal = flesh_malloc((9 * rows + 1) * sizeof *self->diagonal);
  if (!self->row_end || !self->saved || !self->diagonal)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the own matrix of %d nodes", A->rows);
  for (int i = 0; i < A->rows; i++) {
    int end = i < team->own ? A->row_end[i] : A->row_start[i] + 1;
    while (end > A->row_start[i] + 1 && A->column[end - 1] >= team->own) end--;
    self->row_end[i] = end;
  }
  self->view.row_end = self->row_end;
  return FLESH_OK;
}

void flesh_own_matrix_clear(flesh_own_matrix *self)
{
  flesh_free(self->row_end);
  flesh_free(self->saved);
  flesh_free(self->diagonal);
  *self = (flesh_own_matrix){0};
}

const flesh_block_matrix *flesh_own_matrix_begin(flesh_own_matrix *self, const flesh_block_matrix *A)
{
  const flesh_team *team = self->team;
  if (!team) return A;
  const size_t block = 9 * sizeof(double);
  const double scale = flesh_block_mean_diagonal(A);
  for (size_t i = 0; i < (size_t)A->rows; i++)
    memcpy(self->saved + 9 * i, A->values + 9 * (size_t)A->row_start[i], block);
  memcpy(self->diagonal, self->saved, (size_t)A->rows * block);
  team->operations->collect(team->data, &(flesh_team_vector){9, 9, NULL, self->diagonal});
  for (size_t i = (size_t)team->own; i < (size_t)A->rows; i++)
    for (size_t c = 0; c < 3; c++) self->diagonal[9 * i + 4 * c] = scale;
  for (size_t i = 0; i < (size_t)A->rows; i++)
    memcpy(A->values + 9 * (size_t)A->row_start[i], self->diagonal + 9 * i, block);
  self->view.values = A->values;
  return &self->view;
}

void flesh_own_matrix_end(flesh_own_matrix *self, const flesh_block_matrix *A)
{
  for (size_t i = 0; self->team && i < (size_t)A->rows; i++)
    memcpy(A->values + 9 * (size_t)A->row_start[i], self->saved + 9 * i, 9 * sizeof(double));
}
