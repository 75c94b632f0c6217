/* coarse_cholesky.h: sparse Cholesky factorisation of a matrix of 12x12 blocks, for the few unknowns of a coarse space.
 * */
#ifndef FLESH_LINEAR_COARSE_CHOLESKY_H
#define FLESH_LINEAR_COARSE_CHOLESKY_H

#include "base/archive.h"
#include "base/isa.h"

enum { FLESH_BLOCK12 = 12, FLESH_BLOCK12_SIZE = 144 };

typedef struct flesh_coarse_cholesky {
  int n;          /* block rows */
  int *place;     /* [n] of each row in the order of elimination */
  int *start;     /* [n+1] of the columns' blocks below the diagonal */
  int *row;       /* [start[n]] ascending within a column */
  int *find;      /* [n] where the rows of the column at hand are */
  double *blocks; /* [144*start[n]] column by column of each block: [m][r] is row r, column m */
  double *pivots; /* [144*n] the diagonal blocks, likewise */
  float *kept;    /* [144*start[n]] the factor's blocks, rounded: solutions wait for them */
  float *inverses; /* [144*n] of the factor's diagonal blocks, likewise; 0 in directions that are not there */
  float *x;       /* [12*n] in the order of elimination */
} flesh_coarse_cholesky;

/* For the pattern of neighbours[starts[i]] ... of each row i, symmetric, without i itself. */
FLESH_PER_ISA int flesh_coarse_cholesky_create(int n, const int *starts, const int *neighbours,
                                               flesh_coarse_cholesky *matrix);
FLESH_PER_ISA void flesh_coarse_cholesky_clear(flesh_coarse_cholesky *matrix);
FLESH_PER_ISA void flesh_coarse_cholesky_archive(flesh_coarse_cholesky *matrix, flesh_archive *archive);

/* All entries 0, to be filled before flesh_coarse_cholesky_factor. */
FLESH_PER_ISA void flesh_coarse_cholesky_zero(flesh_coarse_cholesky *matrix);
/* Block of the rows at two places in the order, low < high (column low), or low == high: the lower triangle. */
FLESH_PER_ISA double *flesh_coarse_cholesky_at(flesh_coarse_cholesky *matrix, int low, int high);

/* 0 when the matrix is indefinite; directions without stiffness are left out. */
FLESH_PER_ISA int flesh_coarse_cholesky_factor(flesh_coarse_cholesky *matrix);
/* x [12*n], in the order of elimination, becomes the solution for the right-hand side that it holds. */
FLESH_PER_ISA void flesh_coarse_cholesky_solve(flesh_coarse_cholesky *matrix);

#endif
