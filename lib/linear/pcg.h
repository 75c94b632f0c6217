/* pcg.h: preconditioned conjugate gradients that detect negative curvature. */
#ifndef FLESH_LINEAR_PCG_H
#define FLESH_LINEAR_PCG_H

#include "base/isa.h"
#include "flesh/threads.h"
#include "linear/pcg_request.h"

/* Vectors of a solve and order of its products. */
typedef struct flesh_pcg_space flesh_pcg_space;

/* Makes space for matrices of A's pattern; `single`: solves may be asked for in single precision. Borrows `threads` (may be
 * NULL). Returns new. */
FLESH_PER_ISA int flesh_pcg_space_create(const flesh_block_matrix *A, int single, flesh_threads *threads,
                                         flesh_pcg_space **space);
FLESH_PER_ISA void flesh_pcg_space_destroy(flesh_pcg_space **space);

/* Solves A x = b from x [3*rows] = 0 until || weights . (b - A x) ||_2 <= tolerance. FLESH_OK; FLESH_NOT_CONVERGED at the
 * iteration limit, x the last iterate (still a descent direction); FLESH_NOT_POSITIVE at the first direction p with p.Ap <=
 * 0, x the iterate before it; FLESH_NONFINITE; the status of `stop`. */
FLESH_PER_ISA int flesh_pcg(flesh_pcg_space *space, const flesh_pcg_request *request, double *x,
                            flesh_pcg_result *result);

/* Returns || r - (A x - b) ||_2 for the last solve's x: the error of the linear model's prediction of r [3*rows] at the end
 * of x. Before the first solve || r ||_2. */
FLESH_PER_ISA double flesh_pcg_model_error(const flesh_pcg_space *space, const double *weights, const double *r);

#endif
