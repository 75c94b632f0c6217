/* chebyshev.h: an approximate solve with a sparse symmetric positive definite matrix of numbers, in time and memory
 * proportional to its rows: a fixed Chebyshev polynomial of the fourth kind (Lottes 2023) of the matrix scaled to unit
 * diagonal. Of all polynomials of a degree it leaves the least error where that is weighed by the root of the
 * eigenvalue: sqrt(largest eigenvalue) / (2 degree + 1), whatever the least eigenvalue is. */
#ifndef FLESH_LINEAR_CHEBYSHEV_H
#define FLESH_LINEAR_CHEBYSHEV_H

#include <stddef.h>

#include "base/archive.h"
#include "base/isa.h"
#include "flesh/threads.h"

/* Adds the other ranks' rows to a product with the matrix, of which they have rows, too. Collective. */
typedef struct flesh_chebyshev_others {
  void *data;
  void (*begin)(void *data, const float *d); /* sends what they need of d, which is that of unit diagonal */
  void (*end)(void *data, float *r);         /* takes their part of the product from r */
} flesh_chebyshev_others;

typedef struct flesh_chebyshev {
  int n;
  const flesh_chebyshev_others *others; /* NULL: all rows are here; else the matrix is that of the threads' team */
  flesh_threads *threads;
  int *place;      /* [n] of each row in an order that keeps neighbours together */
  int *start;      /* [n+1] of the rows' neighbours in that order */
  int *column;     /* [start[n]] ascending in a row, without the row itself */
  float *values;   /* [start[n]+n] of the matrix below the diagonal, then its diagonal; when set up, all off the diagonal
                      with unit diagonal */
  float *root;     /* [n] 1 over the diagonal's root */
  int *next;       /* [n] */
  float largest;   /* eigenvalue of the matrix with unit diagonal, or a little more */
  int degree;
  float *x;        /* [n] right-hand side and solution, in the order */
  float *r, *d[2]; /* [n] */
} flesh_chebyshev;

/* All memory, for rows as flesh_dissection_create takes them. `threads` (may be NULL) is borrowed. To be cleared also
 * when it fails: FLESH_ERR_MEMORY. */
FLESH_PER_ISA int flesh_chebyshev_create(int n, const int *starts, const int *neighbours, const double *points,
                                         flesh_threads *threads, flesh_chebyshev *chebyshev);
FLESH_PER_ISA void flesh_chebyshev_clear(flesh_chebyshev *chebyshev);

/* All entries 0. */
FLESH_PER_ISA void flesh_chebyshev_zero(flesh_chebyshev *chebyshev);
/* Index in `values` of the entry of two rows, neighbours or the same. */
FLESH_PER_ISA size_t flesh_chebyshev_entry(const flesh_chebyshev *chebyshev, int row, int other);

/* For the entries filled in, which are then to be filled in anew, of a matrix that has no eigenvalue above `largest`
 * where its diagonal is 1: errors end below the inverse root of the eigenvalue that they belong to. 0 where the diagonal
 * is not positive, on any rank. */
FLESH_PER_ISA int flesh_chebyshev_setup(flesh_chebyshev *chebyshev, double largest);
/* x becomes the solution, or nearly: a linear symmetric function of what it was, the same for any number of threads. */
FLESH_PER_ISA void flesh_chebyshev_solve(flesh_chebyshev *chebyshev);

/* Archives the results of the last set-up. */
FLESH_PER_ISA void flesh_chebyshev_archive(flesh_chebyshev *chebyshev, flesh_archive *archive);

#endif
