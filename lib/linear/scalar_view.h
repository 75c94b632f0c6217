/* scalar_view.h: the symmetric block matrix as a full scalar matrix in compressed columns (or rows, by symmetry), for KLU,
 * CHOLMOD and SUNDIALS' sparse matrix. */
#ifndef FLESH_LINEAR_SCALAR_VIEW_H
#define FLESH_LINEAR_SCALAR_VIEW_H

#include <stdint.h>

#include "flesh/block_matrix.h"

typedef struct flesh_scalar_view {
  int64_t n, entries;
  int64_t *starts;  /* [n+1] */
  int64_t *indices; /* [entries] ascending within a column */
  int *place; /* [2*blocks] place of block (i,j) within column j, and of its transpose within column i */
} flesh_scalar_view;

int flesh_scalar_view_create(const flesh_block_matrix *A, flesh_scalar_view *view);
void flesh_scalar_view_clear(flesh_scalar_view *view);

/* Sets values [entries] to those of A. */
void flesh_scalar_view_fill(const flesh_scalar_view *view, const flesh_block_matrix *A,
                            double *values);

#endif
