/* sparse_cholesky.h: the exact factor L L^T of a sparse symmetric positive definite matrix of numbers, by dense panels;
 * in the precision of FLESH_CHOLESKY_NUMBER, which is single unless a source says otherwise before it includes this. */
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

/* Panels are the columns of a part of the dissection: L is dense in the part's own rows and in those below that any of
 * its columns has, column by column, the own rows first. */
typedef struct flesh_sparse_cholesky {
  int n, panels;
  double operations; /* of a factorisation */
  int *place;      /* [n] of each row in the order of elimination */
  int *first;      /* [panels+1] of the panels in that order */
  int *part;       /* [n] the panel of each row in that order */
  int *below_start; /* [panels+1] in `below` */
  int *below;      /* rows in that order, ascending in a panel */
  size_t *start;   /* [panels+1] of the panels in `values` */
  int *stride;     /* [panels] from column to column */
  flesh_cholesky_number *values;   /* of the matrix, then of L; zero above the diagonal */
  flesh_cholesky_number *inverse;  /* [n] 1/L_ii, in the order of elimination */
  flesh_cholesky_number *x;        /* [n] right-hand side and solution, likewise */
  int *target;     /* [rows of the highest panel] where a panel's rows are in another */
  flesh_cholesky_number *packed;   /* [4*columns of the widest panel] */
  flesh_cholesky_number *column;   /* [rows of the highest panel] */
} flesh_sparse_cholesky;

/* All memory, for rows as flesh_dissection_create takes them. FLESH_NOT_CONVERGED where a factorisation takes more
 * operations than `most`. To be cleared also when it fails: FLESH_ERR_MEMORY. */
FLESH_PER_ISA int flesh_sparse_cholesky_create(int n, const int *starts, const int *neighbours, const double *points,
                                               double most, flesh_sparse_cholesky *cholesky);
FLESH_PER_ISA void flesh_sparse_cholesky_clear(flesh_sparse_cholesky *cholesky);
FLESH_PER_ISA void flesh_sparse_cholesky_archive(flesh_sparse_cholesky *cholesky, flesh_archive *archive);

/* All entries 0. */
FLESH_PER_ISA void flesh_sparse_cholesky_zero(flesh_sparse_cholesky *cholesky);
/* Index in `values` of the entry of two rows, neighbours or the same. */
FLESH_PER_ISA size_t flesh_sparse_cholesky_entry(const flesh_sparse_cholesky *cholesky, int row, int other);

/* 0 where the matrix is not positive definite, or too nearly so. */
FLESH_PER_ISA int flesh_sparse_cholesky_factor(flesh_sparse_cholesky *cholesky);
/* x becomes the solution. */
FLESH_PER_ISA void flesh_sparse_cholesky_solve(flesh_sparse_cholesky *cholesky);

#endif
