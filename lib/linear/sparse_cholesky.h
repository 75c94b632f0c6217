/* sparse_cholesky.h: the exact factor L L^T of a sparse symmetric positive definite matrix of numbers, by dense panels. Its
 * precision is FLESH_CHOLESKY_NUMBER, single unless a source defines it before including this file. */
#ifndef FLESH_LINEAR_SPARSE_CHOLESKY_H
#define FLESH_LINEAR_SPARSE_CHOLESKY_H

#include <stddef.h>

#include "base/archive.h"
#include "base/isa.h"
#include "linear/dissection.h"

#ifndef FLESH_CHOLESKY_NUMBER
#define FLESH_CHOLESKY_NUMBER float
#endif
typedef FLESH_CHOLESKY_NUMBER flesh_cholesky_number;

/* Panels are the columns of a part of the dissection: L is dense in the part's own rows and in the rows below that any of
 * its columns has; it is stored column by column, the own rows first. */
typedef struct flesh_sparse_cholesky {
  int n, panels;
  double operations; /* operations of a factorisation */
  int *place;      /* [n] place of each row in the order of elimination */
  int *first;      /* [panels+1] first column of each panel in that order */
  int *part;       /* [n] panel of each row in that order */
  int *below_start; /* [panels+1] first row of each panel in `below` */
  int *below;      /* rows below, in that order, ascending in a panel */
  size_t *start;   /* [panels+1] first number of each panel in `values` */
  int *stride;     /* [panels] distance from column to column */
  flesh_cholesky_number *values;   /* entries of the matrix, then of L; zero above the diagonal */
  flesh_cholesky_number *inverse;  /* [n] 1/L_ii, in the order of elimination */
  flesh_cholesky_number *x;        /* [n] right-hand side and solution, in the order of elimination */
  int *target;     /* [rows of the highest panel] places of a panel's rows in another */
  flesh_cholesky_number *packed;   /* [4*columns of the widest panel] */
  flesh_cholesky_number *column;   /* [rows of the highest panel] */
} flesh_sparse_cholesky;

/* Allocates all memory for rows as flesh_dissection_create takes them. FLESH_NOT_CONVERGED if a factorisation takes more
 * operations than `most`. Clear it also after a failure: FLESH_ERR_MEMORY. */
FLESH_PER_ISA int flesh_sparse_cholesky_create(int n, const int *starts, const int *neighbours, const double *points,
                                               double most, flesh_sparse_cholesky *cholesky);
FLESH_PER_ISA void flesh_sparse_cholesky_clear(flesh_sparse_cholesky *cholesky);
FLESH_PER_ISA void flesh_sparse_cholesky_archive(flesh_sparse_cholesky *cholesky, flesh_archive *archive);

/* Sets all entries to 0. */
FLESH_PER_ISA void flesh_sparse_cholesky_zero(flesh_sparse_cholesky *cholesky);
/* Returns the index in `values` of the entry of two rows, neighbours or the same. */
FLESH_PER_ISA size_t flesh_sparse_cholesky_entry(const flesh_sparse_cholesky *cholesky, int row, int other);

/* Factors the matrix. Returns 0 if it is not positive definite, or too nearly so. */
FLESH_PER_ISA int flesh_sparse_cholesky_factor(flesh_sparse_cholesky *cholesky);
/* Replaces x by the solution. */
FLESH_PER_ISA void flesh_sparse_cholesky_solve(flesh_sparse_cholesky *cholesky);

#endif
