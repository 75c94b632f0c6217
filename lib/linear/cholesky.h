/* cholesky.h: incomplete Cholesky factorisation without fill, on 3x3 blocks. */
#ifndef FLESH_LINEAR_CHOLESKY_H
#define FLESH_LINEAR_CHOLESKY_H

#include "base/archive.h"
#include "base/isa.h"
#include "flesh/threads.h"
#include "linear/bisection.h"
#include "linear/coarse.h"

typedef struct flesh_cholesky flesh_cholesky;

/* Analyses the pattern of A and allocates all memory. `bisection` may be freed then; borrows `threads` (may be NULL).
 * Entries of the factor have sixteen binary digits if it is `alone`, else, with a coarse level for smooth displacements,
 * eight. Returns new. */
FLESH_PER_ISA int flesh_cholesky_create(const flesh_block_matrix *A, const flesh_bisection *bisection, int alone,
                                        flesh_threads *threads, flesh_cholesky **cholesky);
FLESH_PER_ISA void flesh_cholesky_destroy(flesh_cholesky **cholesky);

/* Factors scale * (A + shift |diag A|), scale a power of two that keeps single precision in its range. FLESH_NOT_POSITIVE
 * when a pivot block is not positive definite. */
FLESH_PER_ISA int flesh_cholesky_factor(flesh_cholesky *cholesky, const flesh_block_matrix *A, double scale,
                                        double shift);

/* Computes z = (factored matrix)^-1 r for an r of about 1, a vector of four lanes a node in the bisection's order. z is
 * kept inside. It includes half of the coarse level's correction (NULL: none). Returns r.z. */
FLESH_PER_ISA double flesh_cholesky_solve(flesh_cholesky *cholesky, flesh_coarse *coarse, const float *r);
/* Copies z for begin <= p < end, to the start of `z`; the fourth lane is anything finite. */
FLESH_PER_ISA void flesh_cholesky_result(const flesh_cholesky *cholesky, const flesh_coarse *coarse, int begin,
                                         int end, float *z);

FLESH_PER_ISA void flesh_cholesky_archive(flesh_cholesky *cholesky, flesh_archive *archive);

#endif
