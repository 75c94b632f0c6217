/* block_matrix.c: products, sums and constraints of the symmetric block matrix. */
#include "linear/block_matrix.h"

#include <math.h>
#include <string.h>

void flesh_block_multiply(const flesh_block_matrix *A, const double *x, double *y)
{
  const int *start = A->row_start, *end = A->row_end, *column = A->column;
  memset(y, 0, (size_t)A->rows * 3 * sizeof *y);
  for (int i = 0; i < A->rows; i++) {
    const double *b = A->values + 9 * (size_t)start[i];
    double x0 = x[3 * i], x1 = x[3 * i + 1], x2 = x[3 * i + 2];
    double y0 = b[0] * x0 + b[1] * x1 + b[2] * x2;
    double y1 = b[3] * x0 + b[4] * x1 + b[5] * x2;
    double y2 = b[6] * x0 + b[7] * x1 + b[8] * x2;
    for (int k = start[i] + 1; k < end[i]; k++) {
      b += 9;
      const double *xj = x + 3 * (size_t)column[k];
      double *yj = y + 3 * (size_t)column[k];
      y0 += b[0] * xj[0] + b[1] * xj[1] + b[2] * xj[2];
      y1 += b[3] * xj[0] + b[4] * xj[1] + b[5] * xj[2];
      y2 += b[6] * xj[0] + b[7] * xj[1] + b[8] * xj[2];
      yj[0] += b[0] * x0 + b[3] * x1 + b[6] * x2;
      yj[1] += b[1] * x0 + b[4] * x1 + b[7] * x2;
      yj[2] += b[2] * x0 + b[5] * x1 + b[8] * x2;
    }
    y[3 * i] += y0;
    y[3 * i + 1] += y1;
    y[3 * i + 2] += y2;
  }
}

void flesh_block_sum_of_team(const flesh_team *team, int count, const flesh_block_term *terms, double *room, double *y)
{
  const int n = 3 * terms->A->rows;
  for (int k = 0; k < count; k++) {
    flesh_block_multiply(terms[k].A, terms[k].x, k ? room : y);
    for (int d = 0; d < n && !k; d++) y[d] *= terms[k].scale;
    for (int d = 0; d < n && k; d++) y[d] += terms[k].scale * room[d];
  }
  flesh_team_add_ghosts(team, y);
}

void flesh_block_multiply_of_team(const flesh_team *team, const flesh_block_matrix *A, const double *x, double *y)
{
  flesh_block_sum_of_team(team, 1, &(flesh_block_term){1, A, x}, NULL, y);
}

/* Fixes row i of a matrix with fixed dofs. */
static inline void fix_row(flesh_block_matrix *A, const uint8_t *fixed, double diagonal, int i)
{
  const uint8_t *row = fixed + 3 * (size_t)i;
  const int any_row = row[0] | row[1] | row[2];
  for (int k = A->row_start[i]; k < A->row_end[i]; k++) {
    const uint8_t *col = fixed + 3 * (size_t)A->column[k];
    if (!any_row && !(col[0] | col[1] | col[2])) continue;
    double *b = A->values + 9 * (size_t)k;
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < 3; c++) {
        if (row[r] || col[c]) b[3 * r + c] = k == A->row_start[i] && r == c ? diagonal : 0;
      }
  }
}

int flesh_block_rows_to_fix(const flesh_block_matrix *A, const uint8_t *fixed, int *rows)
{
  int count = 0;
  for (int i = 0; i < A->rows; i++) {
    int any = 0;
    for (int k = A->row_start[i]; k < A->row_end[i] && !any; k++) {
      const uint8_t *col = fixed + 3 * (size_t)A->column[k]; /* the first one is the row's own */
      any = col[0] | col[1] | col[2];
    }
    if (any) rows[count++] = i;
  }
  return count;
}

void flesh_block_fix_rows(flesh_block_matrix *A, const uint8_t *fixed, double diagonal, int count, const int *rows)
{
  for (int k = 0; k < count; k++) fix_row(A, fixed, diagonal, rows[k]);
}

typedef struct fixing {
  flesh_block_matrix *A;
  const uint8_t *fixed;
  double diagonal;
} fixing;

enum { FIXED_ROWS = 512 /* rows of a task */ };

static void fix_rows(void *data, int task)
{
  const fixing *f = data;
  const int begin = FIXED_ROWS * task, end = f->A->rows - begin < FIXED_ROWS ? f->A->rows : begin + FIXED_ROWS;
  for (int i = begin; i < end; i++) fix_row(f->A, f->fixed, f->diagonal, i);
}

void flesh_block_fix(flesh_block_matrix *A, const uint8_t *fixed, double diagonal, flesh_threads *threads)
{
  flesh_threads_run(threads, (A->rows + FIXED_ROWS - 1) / FIXED_ROWS, fix_rows, &(fixing){A, fixed, diagonal});
}

void flesh_block_combine(double c, flesh_block_matrix *A, const flesh_block_matrix *B)
{
  const size_t count = 9 * (size_t)A->row_start[A->rows];
  if (c == 0 && B) memcpy(A->values, B->values, count * sizeof *A->values);
  else if (c == 0) memset(A->values, 0, count * sizeof *A->values);
  else
    for (size_t k = 0; k < count; k++) A->values[k] = c * A->values[k] + (B ? B->values[k] : 0);
}

int flesh_block_find(const flesh_block_matrix *A, int row, int column)
{
  int low = A->row_start[row], high = A->row_end[row] - 1;
  while (low <= high) {
    const int middle = low + (high - low) / 2;
    if (A->column[middle] == column) return middle;
    if (A->column[middle] < column) low = middle + 1;
    else high = middle - 1;
  }
  return -1;
}

int flesh_block_is_diagonal(const flesh_block_matrix *A)
{
  for (int i = 0; i < A->rows; i++)
    for (size_t k = 9 * ((size_t)A->row_start[i] + 1); k < 9 * (size_t)A->row_end[i]; k++)
      if (A->values[k] != 0) return 0;
  return 1;
}

int flesh_block_is_diagonal_of_team(const flesh_team *team, const flesh_block_matrix *A)
{
  return !flesh_team_any(team, !flesh_block_is_diagonal(A));
}

double flesh_block_mean_diagonal(const flesh_block_matrix *A)
{
  double sum = 0;
  for (int i = 0; i < A->rows; i++)
    for (int c = 0; c < 3; c++) sum += fabs(A->values[9 * (size_t)A->row_start[i] + 4 * c]);
  return sum > 0 && sum < INFINITY ? sum / (3. * A->rows) : 1;
}

int flesh_block_invert(const double A[9], double B[9])
{
  /* Cholesky factor, by hand; the entries below the diagonal are not read. */
  if (!(A[0] > 0)) return 0;
  double i00 = 1 / sqrt(A[0]), l10 = A[1] * i00, l20 = A[2] * i00;
  double d1 = A[4] - l10 * l10;
  if (!(d1 > 1e-14 * A[4])) return 0;
  double i11 = 1 / sqrt(d1), l21 = (A[5] - l20 * l10) * i11;
  double d2 = A[8] - l20 * l20 - l21 * l21;
  if (!(d2 > 1e-14 * A[8]) || !(d2 < INFINITY)) return 0;
  double i22 = 1 / sqrt(d2);
  /* Inverse of L, then L^-T L^-1. */
  double m10 = -l10 * i00 * i11, m21 = -l21 * i11 * i22;
  double m20 = -(l20 * i00 + l21 * m10) * i22;
  B[0] = i00 * i00 + m10 * m10 + m20 * m20;
  B[1] = B[3] = m10 * i11 + m20 * m21;
  B[2] = B[6] = m20 * i22;
  B[4] = i11 * i11 + m21 * m21;
  B[5] = B[7] = m21 * i22;
  B[8] = i22 * i22;
  return 1;
}
