/* row_coupling.h: the matrix S = I + B D^-1 B^T of stiff rows B, with an entry for each pair of rows that share a main
 * node, and solves with it: exact ones, or polynomials, whose work grows no faster than the number of rows. */
#ifndef FLESH_LINEAR_ROW_COUPLING_H
#define FLESH_LINEAR_ROW_COUPLING_H

#include <stddef.h>

#include "base/archive.h"
#include "base/isa.h"
#include "flesh/block_matrix.h"
#include "flesh/threads.h"
#include "linear/chebyshev.h"
#include "linear/lanes.h"
#include "linear/row_lists.h"
#include "linear/shared_rows.h"
#include "linear/sparse_cholesky.h"

typedef struct flesh_row_coupling {
  int rows, is_exact;
  unsigned *pair; /* index in S's values of each pair of rows of each main node */
  size_t pairs;
  flesh_sparse_cholesky exact;
  flesh_chebyshev polynomial;
  /* For a body that ranks share; borrowed. */
  const flesh_shared_rows *shared; /* NULL: all rows are here */
  const flesh_row_lists *lists;
  const float *inverse, *by_node;
  flesh_chebyshev_others others;
} flesh_row_coupling;

/* Allocates all memory; the lists may be freed afterwards. Borrows `threads` (may be NULL). `positions` [3*nodes] at rest
 * by the numbers in `rows`; `polynomial`: solves are Chebyshev polynomials, else exact. Clear it also after a failure:
 * FLESH_ERR_MEMORY. */
FLESH_PER_ISA int flesh_row_coupling_create(const flesh_row_lists *lists, const flesh_stiff_rows *rows,
                                            const double *positions, int polynomial, flesh_threads *threads,
                                            flesh_row_coupling *coupling);
FLESH_PER_ISA void flesh_row_coupling_clear(flesh_row_coupling *coupling);
/* Makes the rows those of one rank of several, which share these nodes: from now on set-ups and solves, by polynomials, are
 * those of all ranks together. Borrows all arguments; inverse and by_node are those that set-ups take. The coupling must
 * not move afterwards. */
FLESH_PER_ISA void flesh_row_coupling_share(flesh_row_coupling *coupling, const flesh_shared_rows *shared,
                                            const flesh_row_lists *lists, const float *inverse, const float *by_node);

/* Makes S = shift I + B D^-1 B^T from inverse [9*nodes], of D's blocks, and B by_node [start[nodes]][3]. Returns 0 if S is
 * singular within single precision. */
FLESH_PER_ISA int flesh_row_coupling_setup(flesh_row_coupling *coupling, const flesh_row_lists *lists, float shift,
                                           const float *inverse, const float *by_node);
/* Computes solution [rows] = S^-1 t, exactly or approximately; it may be t. A linear symmetric function of t. */
FLESH_PER_ISA void flesh_row_coupling_solve(flesh_row_coupling *coupling, const float *t, float *solution);

/* Archives the results of the last set-up. */
FLESH_PER_ISA void flesh_row_coupling_archive(flesh_row_coupling *coupling, flesh_archive *archive);

/* Multiplies a block by three lanes; the fourth lane of the product is 0. */
static inline flesh_float4 flesh_block_times(const float *block, flesh_float4 x)
{
  flesh_float4 y =
      FLESH_LANES_FLOAT(block) * x[0] + FLESH_LANES_FLOAT(block + 3) * x[1] + FLESH_LANES_FLOAT(block + 6) * x[2];
  y[3] = 0;
  return y;
}

#endif
