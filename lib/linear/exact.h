/* exact.h: the factor L L^T of the block matrix, exact up to round-off, compiled for each instruction set: for systems that
 * conjugate gradients cannot solve. */
#ifndef FLESH_LINEAR_EXACT_H
#define FLESH_LINEAR_EXACT_H

#include "base/isa.h"
#include "flesh/block_matrix.h"

typedef struct flesh_exact flesh_exact;

typedef struct flesh_exact_solver {
  /* Orders the pattern of A by the positions of its nodes, points [3*rows]. *exact is NULL where a factorisation would take
   * more than `most` operations. FLESH_ERR_MEMORY. */
  int (*create)(const flesh_block_matrix *A, const double *points, double most, flesh_exact **exact);
  void (*destroy)(flesh_exact **exact);
  double (*operations)(const flesh_exact *exact); /* operations of a factorisation */
  /* Factors A. FLESH_NOT_POSITIVE: A is not positive definite. */
  int (*factor)(flesh_exact *exact, const flesh_block_matrix *A);
  void (*solve)(flesh_exact *exact, const double *b, double *x); /* x = A^-1 b [3*rows] */
} flesh_exact_solver;

extern const flesh_exact_solver flesh_exact_portable, flesh_exact_avx2, flesh_exact_avx512;

#endif
