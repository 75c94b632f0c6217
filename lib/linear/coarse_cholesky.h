/* coarse_cholesky.h: sparse Cholesky factorisation of a matrix of 12x12 blocks, for the few unknowns of a coarse space. */
#ifndef FLESH_LINEAR_COARSE_CHOLESKY_H
#define FLESH_LINEAR_COARSE_CHOLESKY_H

#include "base/archive.h"
#include "base/isa.h"

enum { FLESH_BLOCK12 = 12, FLESH_BLOCK12_SIZE = 144 };

typedef struct flesh_coarse_cholesky {
  int n;          /* block rows */
  int *place;     /* [n] place of each row in the order of elimination */
  int *start;     /* [n+1] first block below the diagonal of each column */
  int *row;       /* [start[n]] rows of the blocks, ascending within a column */
  int *find;      /* [n] places of the rows of the current column */
  double *blocks; /* [144*start[n]] blocks, each column by column: [m][r] is row r, column m */
  double *pivots; /* [144*n] diagonal blocks, likewise */
  float *kept;    /* [144*start[n]] blocks of the factor, rounded, because solves are limited by memory */
  float *inverses; /* [144*n] inverses of the factor's diagonal blocks, likewise; 0 in directions without stiffness */
  float *x;       /* [12*n] right-hand side and solution, in the order of elimination */
} flesh_coarse_cholesky;

/* Makes a matrix of a symmetric pattern: row i has neighbours[starts[i]] ..., without i itself. */
FLESH_PER_ISA int flesh_coarse_cholesky_create(int n, const int *starts, const int *neighbours,
                                               flesh_coarse_cholesky *matrix);
FLESH_PER_ISA void flesh_coarse_cholesky_clear(flesh_coarse_cholesky *matrix);
FLESH_PER_ISA void flesh_coarse_cholesky_archive(flesh_coarse_cholesky *matrix, flesh_archive *archive);

/* Sets all entries to 0, to be filled before flesh_coarse_cholesky_factor. */
FLESH_PER_ISA void flesh_coarse_cholesky_zero(flesh_coarse_cholesky *matrix);
/* Returns the block of the rows at two places in the order, low < high (column low) or low == high: the lower triangle. */
FLESH_PER_ISA double *flesh_coarse_cholesky_at(flesh_coarse_cholesky *matrix, int low, int high);

/* Factors the matrix; leaves out directions without stiffness. Returns 0 when it is indefinite. */
FLESH_PER_ISA int flesh_coarse_cholesky_factor(flesh_coarse_cholesky *matrix);
/* Replaces x [12*n], in the order of elimination, by the solution for the right-hand side that it holds. */
FLESH_PER_ISA void flesh_coarse_cholesky_solve(flesh_coarse_cholesky *matrix);

#endif
