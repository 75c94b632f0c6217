/* exact_isa.c: a factor in double precision, by the supernodal Cholesky factorisation of numbers. */
#define FLESH_CHOLESKY_NUMBER double
#include "linear/exact.h"

#include <float.h>
#include <limits.h>
#include <math.h>

#include "linear/scalar_view.h"
#include "linear/sparse_cholesky.c"

struct flesh_exact {
  flesh_sparse_cholesky L;
  double scale; /* factor on the matrix in it */
};

/* Lists the rows that each scalar row meets, itself among them, and the place of its node. Not for matrices with more
 * entries than int can count. */
static int list(const flesh_block_matrix *A, const double *points, int **starts, int **neighbours, double **places)
{
  flesh_scalar_view view;
  int status = flesh_scalar_view_create(A, &view);
  if (status) return status;
  const size_t n = (size_t)view.n, entries = (size_t)view.entries;
  *starts = flesh_malloc((n + 1) * sizeof **starts);
  *neighbours = flesh_malloc((entries + 1) * sizeof **neighbours);
  *places = flesh_malloc((3 * n + 1) * sizeof **places);
  if (!*starts || !*neighbours || !*places) status = FLESH_ERR_MEMORY;
  if (entries > INT_MAX) status = FLESH_NOT_CONVERGED;
  for (size_t d = 0; d <= n && !status; d++) (*starts)[d] = (int)view.starts[d];
  for (size_t e = 0; e < entries && !status; e++) (*neighbours)[e] = (int)view.indices[e];
  for (size_t d = 0; d < 3 * n && !status; d++) (*places)[d] = points[d / 9 * 3 + d % 3];
  flesh_scalar_view_clear(&view);
  return status;
}

static void destroy(flesh_exact **exact)
{
  if (!*exact) return;
  flesh_sparse_cholesky_clear(&(*exact)->L);
  flesh_free(*exact);
  *exact = NULL;
}

static int create(const flesh_block_matrix *A, const double *points, double most, flesh_exact **exact)
{
  int *starts = NULL, *neighbours = NULL;
  double *places = NULL;
  *exact = flesh_calloc(1, sizeof **exact);
  int status = *exact ? list(A, points, &starts, &neighbours, &places) : FLESH_ERR_MEMORY;
  if (!status) status = flesh_sparse_cholesky_create(3 * A->rows, starts, neighbours, places, most, &(*exact)->L);
  flesh_free(starts);
  flesh_free(neighbours);
  flesh_free(places);
  if (status) destroy(exact);
  if (status == FLESH_NOT_CONVERGED) return FLESH_OK;
  return status ? flesh_fail(FLESH_ERR_MEMORY, "no memory for a factor of %d nodes", A->rows) : FLESH_OK;
}

static double operations(const flesh_exact *exact) { return exact->L.operations; }

/* Returns the power of two that brings the largest entry off the diagonal near 1: square roots of pivots are then rounded
 * alike in all units. */
static double scale_of(const flesh_block_matrix *A)
{
  double largest = 0;
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i]; k < A->row_end[i]; k++)
      for (int e = 0; e < 9 && A->column[k] != i; e++) largest = fmax(largest, fabs(A->values[9 * (size_t)k + (size_t)e]));
  return largest >= DBL_MIN && largest < INFINITY ? ldexp(1, -ilogb(largest)) : 1;
}

static int factor(flesh_exact *exact, const flesh_block_matrix *A)
{
  flesh_sparse_cholesky *L = &exact->L;
  const double scale = exact->scale = scale_of(A);
  flesh_sparse_cholesky_zero(L);
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i]; k < A->row_end[i]; k++)
      for (int e = 0; e < 9; e++)
        L->values[flesh_sparse_cholesky_entry(L, 3 * i + e / 3, 3 * A->column[k] + e % 3)] =
            scale * A->values[9 * (size_t)k + (size_t)e];
  return flesh_sparse_cholesky_factor(L) ? FLESH_OK : FLESH_NOT_POSITIVE;
}

static void solve(flesh_exact *exact, const double *b, double *x)
{
  flesh_sparse_cholesky *L = &exact->L;
  for (int d = 0; d < L->n; d++) L->x[L->place[d]] = exact->scale * b[d];
  flesh_sparse_cholesky_solve(L);
  for (int d = 0; d < L->n; d++) x[d] = L->x[L->place[d]];
}

const flesh_exact_solver FLESH_OF_ISA(flesh_exact) = {create, destroy, operations, factor, solve};
