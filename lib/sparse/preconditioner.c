/* preconditioner.c: block Jacobi, incomplete block Cholesky with the shift that it needs, and a coarse level. */
#include "sparse/preconditioner.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "sparse/block_matrix.h"
#include "sparse/cholesky.h"
#include "sparse/coarse.h"

struct flesh_preconditioner_data {
  flesh_preconditioner kind;
  int rows;
  double *inverse; /* [9*rows] of the diagonal blocks */
  flesh_cholesky *cholesky;
  double scale;    /* of the matrix that is factored */
  double shift;    /* that the last factorisation needed, relative to the diagonal */
  int by_diagonal; /* no shift helped: the diagonal blocks serve */
  flesh_coarse *coarse; /* NULL: one level */
  int two_levels;       /* it serves for the matrix at hand */
};

/* Nodes of a box of the coarse level. Fewer give fewer iterations, but the coarse factor's cost rises faster than the
 * number of boxes. */
enum { BOX_NODES = 300, FEWEST_BOXES = 2, MOST_BOXES = 600 };

const char *const flesh_preconditioner_names[] = {"auto", "two-level", "ic", "jacobi", "none", NULL};

const char *flesh_preconditioner_name(flesh_preconditioner kind)
{
  return (unsigned)kind <= FLESH_PRECONDITIONER_NONE ? flesh_preconditioner_names[kind] : NULL;
}

flesh_preconditioner flesh_preconditioner_choose(flesh_preconditioner kind, int nodes)
{
  if (kind != FLESH_PRECONDITIONER_AUTO) return kind;
  return nodes >= FEWEST_BOXES * BOX_NODES ? FLESH_PRECONDITIONER_TWO_LEVEL : FLESH_PRECONDITIONER_IC;
}

static int boxes_for(int nodes)
{
  int boxes = nodes / BOX_NODES;
  return boxes < FEWEST_BOXES ? FEWEST_BOXES : boxes > MOST_BOXES ? MOST_BOXES : boxes;
}

int flesh_preconditioner_create(flesh_preconditioner kind, const flesh_block_matrix *A,
                                const double *positions, flesh_threads *threads,
                                flesh_preconditioner_data **preconditioner)
{
  flesh_preconditioner_data *self = calloc(1, sizeof *self);
  *preconditioner = self;
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a preconditioner");
  self->kind = kind = flesh_preconditioner_choose(kind, A->rows);
  self->rows = A->rows;
  if (kind == FLESH_PRECONDITIONER_NONE) return FLESH_OK;
  int status = FLESH_OK;
  self->inverse = malloc(((size_t)A->rows * 9 + 1) * sizeof *self->inverse);
  if (!self->inverse)
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for the preconditioner of %d nodes", A->rows);
  if (!status && kind != FLESH_PRECONDITIONER_JACOBI) {
    flesh_halves halves;
    status = flesh_halves_create(A, &halves);
    if (!status) status = flesh_cholesky_create(A, &halves, threads, &self->cholesky);
    flesh_halves_clear(&halves);
  }
  if (!status && kind == FLESH_PRECONDITIONER_TWO_LEVEL && positions && A->rows >= FEWEST_BOXES)
    status = flesh_coarse_create(A, positions, boxes_for(A->rows), threads, &self->coarse);
  if (status) flesh_preconditioner_destroy(preconditioner);
  return status;
}

void flesh_preconditioner_destroy(flesh_preconditioner_data **preconditioner)
{
  if (!preconditioner || !*preconditioner) return;
  free((*preconditioner)->inverse);
  flesh_cholesky_destroy(&(*preconditioner)->cholesky);
  flesh_coarse_destroy(&(*preconditioner)->coarse);
  free(*preconditioner);
  *preconditioner = NULL;
}

static void set_jacobi(flesh_preconditioner_data *self, const flesh_block_matrix *A)
{
  self->by_diagonal = 1;
  for (int k = 0; k < self->rows; k++) {
    const double *block = A->values + 9 * (size_t)A->row_start[k];
    double *inverse = self->inverse + 9 * (size_t)k;
    double trace = fabs(block[0]) + fabs(block[4]) + fabs(block[8]);
    if (flesh_block_invert(block, inverse)) continue;
    memset(inverse, 0, 9 * sizeof *inverse);
    for (int c = 0; c < 3; c++) inverse[4 * c] = trace > 0 ? 3 / trace : 1;
  }
}

/* A power of two that takes x to about 1. */
static double power_to_one(double x) { return x > 0 && x < INFINITY ? ldexp(1, -ilogb(fmax(x, 1e-300))) : 1; }

int flesh_preconditioner_setup(flesh_preconditioner_data *self, const flesh_block_matrix *A,
                               const uint8_t *fixed)
{
  if (self->kind == FLESH_PRECONDITIONER_NONE) return FLESH_OK;
  double largest = 0;
  for (int k = 0; k < self->rows; k++)
    for (int c = 0; c < 3; c++) {
      double size = fabs(A->values[9 * (size_t)A->row_start[k] + 4 * c]);
      if (!(size < INFINITY)) return FLESH_NONFINITE;
      largest = fmax(largest, size);
    }
  self->by_diagonal = 0;
  if (self->kind == FLESH_PRECONDITIONER_JACOBI) {
    set_jacobi(self, A);
    return FLESH_OK;
  }
  self->two_levels = self->coarse && !flesh_coarse_setup(self->coarse, A, fixed);
  self->scale = power_to_one(largest);
  /* What was needed last is needed again, or nearly so: try a quarter of it, then four times as
   * much. */
  double shift = self->shift > 1e-3 ? self->shift / 4 : 0;
  while (flesh_cholesky_factor(self->cholesky, A, self->scale, shift)) {
    shift = shift > 0 ? 4 * shift : 1e-3;
    if (shift > 1e6) {
      /* A diagonal that is zero or negative somewhere: fall back to it alone, made positive. */
      self->shift = 0;
      set_jacobi(self, A);
      return FLESH_OK;
    }
  }
  self->shift = shift;
  return FLESH_OK;
}

static void apply_level(flesh_preconditioner_data *self, int stride, double norm, const double *r, double *z)
{
  const size_t step = (size_t)stride;
  if (self->kind == FLESH_PRECONDITIONER_NONE) {
    if (z != r) memcpy(z, r, (size_t)self->rows * step * sizeof *z);
    return;
  }
  if (!self->by_diagonal) {
    double scale = power_to_one(norm);
    flesh_cholesky_solve(self->cholesky, stride, scale, self->scale / scale, r, z);
    return;
  }
  for (int k = 0; k < self->rows; k++) {
    const double *b = self->inverse + 9 * (size_t)k, *from = r + step * (size_t)k;
    double *to = z + step * (size_t)k, x0 = from[0], x1 = from[1], x2 = from[2];
    for (int c = 0; c < 3; c++) to[c] = b[3 * c] * x0 + b[3 * c + 1] * x1 + b[3 * c + 2] * x2;
  }
}

static void apply(flesh_preconditioner_data *self, int stride, double norm, const double *r, double *z)
{
  if (self->two_levels) flesh_coarse_solve(self->coarse, stride, r); /* before z, which may be r */
  apply_level(self, stride, norm, r, z);
  if (self->two_levels) flesh_coarse_add(self->coarse, stride, z);
}

void flesh_preconditioner_apply(flesh_preconditioner_data *self, const double *r, double *z)
{
  double square = 0;
  for (int d = 0; d < 3 * self->rows; d++) square += r[d] * r[d];
  apply(self, 3, sqrt(square), r, z);
}

void flesh_preconditioner_apply_lanes(flesh_preconditioner_data *self, double norm, const double *r,
                                      double *z)
{
  apply(self, 4, norm, r, z);
}

size_t flesh_preconditioner_memory(const flesh_preconditioner_data *self)
{
  size_t bytes = sizeof *self;
  if (self->inverse) bytes += (size_t)self->rows * 9 * sizeof *self->inverse;
  return bytes + (self->cholesky ? flesh_cholesky_memory(self->cholesky) : 0) +
         (self->coarse ? flesh_coarse_memory(self->coarse) : 0);
}
