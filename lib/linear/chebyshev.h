/* chebyshev.h: an approximate solve with a sparse symmetric positive definite matrix of numbers, in time and memory
 * proportional to its rows: a fixed Chebyshev polynomial of the fourth kind (Lottes 2023) of the matrix scaled to unit
 * diagonal. Of all polynomials of a degree it leaves the least error weighted by the square root of the eigenvalue:
 * sqrt(largest eigenvalue) / (2 degree + 1), whatever the least eigenvalue is. */
#ifndef FLESH_LINEAR_CHEBYSHEV_H
#define FLESH_LINEAR_CHEBYSHEV_H

#include <stddef.h>

#include "base/archive.h"
#include "base/isa.h"
#include "flesh/threads.h"

/* Adds the other ranks' rows to a product, if they have rows of the matrix, too. Collective. */
typedef struct flesh_chebyshev_others {
  void *data;
  void (*begin)(void *data, const float *d); /* sends the entries of d that the others need, for unit diagonal */
  void (*end)(void *data, float *r);         /* subtracts their part of the product from r */
} flesh_chebyshev_others;

typedef struct flesh_chebyshev {
  int n;
  /* NULL: all rows are here; else the matrix is that of all ranks in the threads' team */
  const flesh_chebyshev_others *others;
  flesh_threads *threads;
  int *place;      /* [n] place of each row in an order that keeps neighbours together */
  int *start;      /* [n+1] first neighbour of each row, in that order */
  int *column;     /* [start[n]] neighbours, ascending in a row, without the row itself */
  /* [start[n]+n] entries of the matrix below the diagonal, then its diagonal; after the set-up, all entries off the
   * diagonal, scaled to unit diagonal */
  float *values;
  float *root;     /* [n] inverse square root of the diagonal */
  int *next;       /* [n] */
  float largest;   /* largest eigenvalue of the matrix with unit diagonal, or a little more */
  int degree;
  float *x;        /* [n] right-hand side and solution, in that order */
  float *r, *d[2]; /* [n] */
} flesh_chebyshev;

/* Makes room for rows as flesh_dissection_create takes them; nothing is allocated later. Borrows `threads` (may be NULL).
 * Clear it also after a failure: FLESH_ERR_MEMORY. */
FLESH_PER_ISA int flesh_chebyshev_create(int n, const int *starts, const int *neighbours, const double *points,
                                         flesh_threads *threads, flesh_chebyshev *chebyshev);
FLESH_PER_ISA void flesh_chebyshev_clear(flesh_chebyshev *chebyshev);

/* Sets all entries to 0. */
FLESH_PER_ISA void flesh_chebyshev_zero(flesh_chebyshev *chebyshev);
/* Returns the index in `values` of the entry of two rows, neighbours or the same. */
FLESH_PER_ISA size_t flesh_chebyshev_entry(const flesh_chebyshev *chebyshev, int row, int other);

/* Sets up solves with the entries filled in; they must be filled in anew for the next set-up. `largest` bounds the
 * eigenvalues of the matrix scaled to unit diagonal: the error along an eigenvector is below the inverse square root of its
 * eigenvalue. Returns 0 if the diagonal is not positive, on any rank. */
FLESH_PER_ISA int flesh_chebyshev_setup(flesh_chebyshev *chebyshev, double largest);
/* Replaces x by an approximate solution: a linear symmetric function of x, the same for any number of threads. */
FLESH_PER_ISA void flesh_chebyshev_solve(flesh_chebyshev *chebyshev);

/* Archives the results of the last set-up. */
FLESH_PER_ISA void flesh_chebyshev_archive(flesh_chebyshev *chebyshev, flesh_archive *archive);

#endif
