/* preconditioner.h: symmetric positive definite approximations of a block matrix's inverse. */
#ifndef FLESH_SPARSE_PRECONDITIONER_H
#define FLESH_SPARSE_PRECONDITIONER_H

#include <stddef.h>
#include <stdint.h>

#include "flesh/effect.h"
#include "flesh/solver.h"

/* By kind; NULL ends them. */
extern const char *const flesh_preconditioner_names[];

typedef struct flesh_preconditioner_data flesh_preconditioner_data;

/* Symbolic set-up for the pattern of A, all memory included. `positions` [3*rows] at rest are what
 * the two-level kind goes by (NULL: it has one level); `threads` (may be NULL) is borrowed. Returns
 * new. */
int flesh_preconditioner_create(flesh_preconditioner kind, const flesh_block_matrix *A,
                                const double *positions, flesh_threads *threads,
                                flesh_preconditioner_data **preconditioner);
void flesh_preconditioner_destroy(flesh_preconditioner_data **preconditioner);

/* Numeric set-up. Always ends with a positive definite operator: incomplete Cholesky shifts A's
 * diagonal as far as it must, and the coarse level is left out where A is indefinite on it. The
 * rows of fixed dofs [3*rows] (NULL: none) are diagonal. FLESH_NONFINITE when A has a non-finite
 * diagonal. */
int flesh_preconditioner_setup(flesh_preconditioner_data *preconditioner,
                               const flesh_block_matrix *A, const uint8_t *fixed);

/* z = P^-1 r, both [3*rows]; z may be r. */
void flesh_preconditioner_apply(flesh_preconditioner_data *preconditioner, const double *r,
                                double *z);
/* The same on four lanes per node, as the halves of the pattern store them, the fourth of r 0; `norm` of r. z is kept
 * inside. Returns r.z. */
double flesh_preconditioner_solve(flesh_preconditioner_data *preconditioner, double norm, const double *r);
/* p = z + beta p for begin <= p < end, vectors as above; the fourth lane is anything finite. */
void flesh_preconditioner_turn(const flesh_preconditioner_data *preconditioner, int begin, int end, double beta,
                               double *p);

size_t flesh_preconditioner_memory(const flesh_preconditioner_data *preconditioner);

#endif
