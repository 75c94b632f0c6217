/* preconditioner.c: block Jacobi and incomplete block Cholesky without fill.
 *
 * The factorisation is A + shift diag(A) ~ (I + U)^T D (I + U) on A's own pattern, right-looking:
 * once row k is final, every pair (j,l) of its neighbours that is itself in the pattern is updated.
 * Which pairs those are depends on the pattern alone and is worked out once. */
#include "sparse/preconditioner.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "sparse/block_matrix.h"
#include "system/pattern.h"

struct flesh_preconditioner_data {
  flesh_preconditioner kind;
  int rows;
  const int *row_start, *column; /* the matrix's */
  double *inverse;               /* [9*rows] of the diagonal blocks of D */
  double *factor; /* [9*blocks] U; the diagonal blocks' places hold D while it is made */
  int *target;    /* block updated by each pair of each row's neighbours, -1: dropped */
  size_t targets;
  double shift; /* that the last factorisation needed, relative to the diagonal */
};

static size_t neighbour_pairs(const flesh_block_matrix *A)
{
  size_t pairs = 0;
  for (int k = 0; k < A->rows; k++) {
    size_t n = (size_t)(A->row_start[k + 1] - A->row_start[k] - 1);
    pairs += n * (n + 1) / 2;
  }
  return pairs;
}

int flesh_preconditioner_create(flesh_preconditioner kind, const flesh_block_matrix *A,
                                flesh_preconditioner_data **preconditioner)
{
  flesh_preconditioner_data *self = calloc(1, sizeof *self);
  *preconditioner = self;
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a preconditioner");
  self->kind = kind;
  self->rows = A->rows;
  self->row_start = A->row_start;
  self->column = A->column;
  if (kind == FLESH_PRECONDITIONER_NONE) return FLESH_OK;
  int failed = !(self->inverse = malloc((size_t)A->rows * 9 * sizeof *self->inverse));
  if (kind == FLESH_PRECONDITIONER_IC && !failed) {
    self->targets = neighbour_pairs(A);
    self->factor = malloc((size_t)A->row_start[A->rows] * 9 * sizeof *self->factor);
    self->target = malloc((self->targets + 1) * sizeof *self->target);
    failed = !self->factor || !self->target;
  }
  if (failed) {
    flesh_preconditioner_destroy(preconditioner);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the preconditioner of %d nodes", A->rows);
  }
  if (kind != FLESH_PRECONDITIONER_IC) return FLESH_OK;
  int *target = self->target;
  for (int k = 0; k < A->rows; k++)
    for (int p = A->row_start[k] + 1; p < A->row_start[k + 1]; p++)
      for (int q = p; q < A->row_start[k + 1]; q++)
        *target++ = flesh_pattern_find(A->row_start, A->column, A->column[p], A->column[q]);
  return FLESH_OK;
}

void flesh_preconditioner_destroy(flesh_preconditioner_data **preconditioner)
{
  if (!preconditioner || !*preconditioner) return;
  free((*preconditioner)->inverse);
  free((*preconditioner)->factor);
  free((*preconditioner)->target);
  free(*preconditioner);
  *preconditioner = NULL;
}

/* C -= A^T B. */
static inline void subtract_product(const double *restrict A, const double *restrict B,
                                    double *restrict C)
{
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      C[3 * i + j] -= A[i] * B[j] + A[3 + i] * B[3 + j] + A[6 + i] * B[6 + j];
}

/* One attempt; 0 when a pivot block is not positive definite. */
static int factorise(flesh_preconditioner_data *self, const flesh_block_matrix *A, double shift)
{
  const int *start = self->row_start;
  memcpy(self->factor, A->values, (size_t)start[self->rows] * 9 * sizeof *self->factor);
  if (shift > 0)
    for (int k = 0; k < self->rows; k++)
      for (int c = 0; c < 3; c++)
        self->factor[9 * (size_t)start[k] + 4 * c] +=
            shift * fabs(self->factor[9 * (size_t)start[k] + 4 * c]);
  const int *target = self->target;
  for (int k = 0; k < self->rows; k++) {
    double *inverse = self->inverse + 9 * (size_t)k;
    if (!flesh_block_invert(self->factor + 9 * (size_t)start[k], inverse)) return 0;
    for (int p = start[k] + 1; p < start[k + 1]; p++) {
      double *row = self->factor + 9 * (size_t)p, scaled[9];
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
          scaled[3 * i + j] = inverse[3 * i] * row[j] + inverse[3 * i + 1] * row[3 + j] +
                              inverse[3 * i + 2] * row[6 + j];
      /* Blocks after p of this row are still unscaled: (j,l) -= (D^-1 A_kj)^T A_kl. */
      for (int q = p; q < start[k + 1]; q++, target++)
        if (*target >= 0)
          subtract_product(scaled, self->factor + 9 * (size_t)q,
                           self->factor + 9 * (size_t)*target);
      memcpy(row, scaled, sizeof scaled);
    }
  }
  return 1;
}

static int set_jacobi(flesh_preconditioner_data *self, const flesh_block_matrix *A)
{
  for (int k = 0; k < self->rows; k++) {
    const double *block = A->values + 9 * (size_t)A->row_start[k];
    double *inverse = self->inverse + 9 * (size_t)k;
    double trace = fabs(block[0]) + fabs(block[4]) + fabs(block[8]);
    if (!(trace < INFINITY)) return FLESH_NONFINITE;
    if (flesh_block_invert(block, inverse)) continue;
    memset(inverse, 0, 9 * sizeof *inverse);
    for (int c = 0; c < 3; c++) inverse[4 * c] = trace > 0 ? 3 / trace : 1;
  }
  return FLESH_OK;
}

int flesh_preconditioner_setup(flesh_preconditioner_data *self, const flesh_block_matrix *A)
{
  if (self->kind == FLESH_PRECONDITIONER_NONE) return FLESH_OK;
  if (self->kind == FLESH_PRECONDITIONER_JACOBI) return set_jacobi(self, A);
  for (int k = 0; k < self->rows; k++)
    for (int c = 0; c < 3; c++)
      if (!(fabs(A->values[9 * (size_t)A->row_start[k] + 4 * c]) < INFINITY))
        return FLESH_NONFINITE;
  /* What was needed last is needed again, or nearly so: try a quarter of it, then four times as
   * much. */
  double shift = self->shift > 1e-3 ? self->shift / 4 : 0;
  while (!factorise(self, A, shift)) {
    shift = shift > 0 ? 4 * shift : 1e-3;
    if (shift > 1e6) {
      /* A diagonal that is zero or negative somewhere: fall back to it alone, made positive. */
      memset(self->factor, 0, (size_t)self->row_start[self->rows] * 9 * sizeof *self->factor);
      self->shift = 0;
      return set_jacobi(self, A);
    }
  }
  self->shift = shift;
  return FLESH_OK;
}

static inline void block_times(const double *b, const double *x, double *y)
{
  double x0 = x[0], x1 = x[1], x2 = x[2];
  y[0] = b[0] * x0 + b[1] * x1 + b[2] * x2;
  y[1] = b[3] * x0 + b[4] * x1 + b[5] * x2;
  y[2] = b[6] * x0 + b[7] * x1 + b[8] * x2;
}

void flesh_preconditioner_apply(const flesh_preconditioner_data *self, const double *r, double *z)
{
  const int *start = self->row_start, *column = self->column;
  if (z != r) memcpy(z, r, (size_t)self->rows * 3 * sizeof *z);
  if (self->kind == FLESH_PRECONDITIONER_NONE) return;
  if (self->kind == FLESH_PRECONDITIONER_JACOBI) {
    for (int k = 0; k < self->rows; k++)
      block_times(self->inverse + 9 * (size_t)k, z + 3 * k, z + 3 * k);
    return;
  }
  for (int k = 0; k < self->rows; k++) {
    double z0 = z[3 * k], z1 = z[3 * k + 1], z2 = z[3 * k + 2];
    const double *b = self->factor + 9 * (size_t)start[k];
    for (int p = start[k] + 1; p < start[k + 1]; p++) {
      b += 9;
      double *zj = z + 3 * (size_t)column[p];
      zj[0] -= b[0] * z0 + b[3] * z1 + b[6] * z2;
      zj[1] -= b[1] * z0 + b[4] * z1 + b[7] * z2;
      zj[2] -= b[2] * z0 + b[5] * z1 + b[8] * z2;
    }
    block_times(self->inverse + 9 * (size_t)k, z + 3 * k, z + 3 * k);
  }
  for (int k = self->rows - 1; k >= 0; k--) {
    double z0 = 0, z1 = 0, z2 = 0;
    const double *b = self->factor + 9 * (size_t)start[k];
    for (int p = start[k] + 1; p < start[k + 1]; p++) {
      b += 9;
      const double *zj = z + 3 * (size_t)column[p];
      z0 += b[0] * zj[0] + b[1] * zj[1] + b[2] * zj[2];
      z1 += b[3] * zj[0] + b[4] * zj[1] + b[5] * zj[2];
      z2 += b[6] * zj[0] + b[7] * zj[1] + b[8] * zj[2];
    }
    z[3 * k] -= z0;
    z[3 * k + 1] -= z1;
    z[3 * k + 2] -= z2;
  }
}

size_t flesh_preconditioner_memory(const flesh_preconditioner_data *self)
{
  size_t bytes = sizeof *self;
  if (self->inverse) bytes += (size_t)self->rows * 9 * sizeof *self->inverse;
  if (self->factor) bytes += (size_t)self->row_start[self->rows] * 9 * sizeof *self->factor;
  return bytes + self->targets * sizeof *self->target;
}
