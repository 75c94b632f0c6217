/* direct.h: direct factorisations of the block matrix by SuiteSparse: KLU, and CHOLMOD where built
 * in. */
#ifndef FLESH_LINEAR_DIRECT_H
#define FLESH_LINEAR_DIRECT_H

#include "base/archive.h"
#include "flesh/block_matrix.h"
#include "flesh/linear_solver.h"

typedef struct flesh_direct flesh_direct;

/* Analyses the pattern of A. FLESH_ERR_ARGUMENT when `kind` is not built in. Returns new. */
int flesh_direct_create(flesh_linear_solver kind, const flesh_block_matrix *A,
                        flesh_direct **direct);
void flesh_direct_destroy(flesh_direct **direct);

/* Returns about how many operations a factorisation by FLESH_LINEAR_KLU takes, which cannot be interrupted; negative: not
 * known. */
double flesh_direct_operations(const flesh_direct *direct);

/* Factors A. FLESH_NOT_POSITIVE where it is singular or, with CHOLMOD, not positive definite. */
int flesh_direct_factor(flesh_direct *direct, const flesh_block_matrix *A);

/* Computes x = A^-1 b [3*rows]; x and b must not overlap. */
int flesh_direct_solve(flesh_direct *direct, const double *b, double *x);

/* Drops the factors. */
void flesh_direct_forget(flesh_direct *direct);
/* Archives the factors. Their pivots were chosen for the first matrix, so that both this and the last one are kept; loading
 * factors both again. FLESH_ERR_MEMORY. */
int flesh_direct_archive(flesh_direct *direct, flesh_archive *archive);

#endif
