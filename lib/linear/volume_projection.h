/* volume_projection.h: projects stiff terms out of a matrix, so that the rest is easy to precondition.
 *
 * A = A_r + B^T B, with stiff rows B. With D the diagonal blocks of A_r on the rows' main nodes, elsewhere infinite, P =
 * D^-1 B^T and S = I + B P, an approximation M_r of A_r becomes one of A:
 *
 *   A^-1 ~ (I - B^T S^-1 P^T)^T M_r^-1 (I - B^T S^-1 P^T) + P S^-2 P^T.
 *
 * The factors in parentheses remove what B feels: B (I - P S^-1 B) = S^-1 B. The result is positive definite for any S.
 * This is the projection of deflation and balancing (Mandel 1993; Nicolaides 1987) with P as a coarse space of as many
 * vectors as rows. S^-1 may therefore be any fixed symmetric approximation that is near enough: the stiff terms then have
 * (S~ - S + I) S~^-1 B in place of S^-1 B, at most a few times as much if the error is below s^(-1/2) for eigenvalues s of
 * S.
 *
 * Where ranks share the body, each has the rows of its own tets, A and A_r are partial, and D is that of all ranks.
 * Products with B^T are summed up over the ranks; S is solved by polynomials, in each product of which ranks exchange their
 * values at the main nodes that their rows share. */
#ifndef FLESH_LINEAR_VOLUME_PROJECTION_H
#define FLESH_LINEAR_VOLUME_PROJECTION_H

#include <stdint.h>

#include "base/archive.h"
#include "base/isa.h"
#include "flesh/block_matrix.h"
#include "flesh/threads.h"
#include "linear/overlap.h"

typedef struct flesh_volume_projection flesh_volume_projection;

/* Makes a projection for matrices of A's pattern with these rows, and allocates all memory. Borrows `rows` (its values
 * change), `overlap` (of A, without a team where there is none) and `threads` (may be NULL). `positions` [3*A->rows] at
 * rest; `polynomial`: S is solved by Chebyshev polynomials, which is required with other ranks, else exactly. In a team,
 * this and all other functions but the matrix are collective. Returns new. */
FLESH_PER_ISA int flesh_volume_projection_create(const flesh_block_matrix *A, const flesh_stiff_rows *rows,
                                                 const double *positions, int polynomial, const flesh_overlap *overlap,
                                                 flesh_threads *threads, flesh_volume_projection **projection);
FLESH_PER_ISA void flesh_volume_projection_destroy(flesh_volume_projection **projection);
FLESH_PER_ISA void flesh_volume_projection_archive(flesh_volume_projection *projection, flesh_archive *archive);

/* Computes A_r = A - B^T B, with the rows' values zero at the fixed dofs [3*A->rows] (NULL: none). It is valid until the
 * next call. */
FLESH_PER_ISA const flesh_block_matrix *flesh_volume_projection_matrix(flesh_volume_projection *projection,
                                                                       const flesh_block_matrix *A,
                                                                       const uint8_t *fixed);
/* Sets up S, for scale times the matrices, after flesh_volume_projection_matrix. inverse [9*A->rows] has the inverse blocks
 * of scale A_r by the mesh's numbers of the nodes, ghosts included. FLESH_NOT_POSITIVE, on all ranks, where S is singular
 * within single precision. */
FLESH_PER_ISA int flesh_volume_projection_setup(flesh_volume_projection *projection, double scale,
                                                const float *inverse);

/* Apply the projection to vectors of four lanes a node in the halves' order, of size about 1. `before` returns (I - B^T
 * S^-1 P^T) r, kept inside; `after` takes M_r^-1 times that in z, replaces it by the whole result and returns r.z. */
FLESH_PER_ISA const float *flesh_volume_projection_before(flesh_volume_projection *projection, const float *r);
FLESH_PER_ISA double flesh_volume_projection_after(flesh_volume_projection *projection, const float *r, float *z);
/* Apply the projection in a team: r and the result are in the overlap's `vector`, at all its nodes. `before` returns its
 * result at the rank's nodes, ghosts included, which may be overwritten. `after` takes and returns a consistent z. */
FLESH_PER_ISA float *flesh_volume_projection_before_in_team(flesh_volume_projection *projection);
FLESH_PER_ISA void flesh_volume_projection_after_in_team(flesh_volume_projection *projection, float *z);

/* Removes from step [3*nodes] the part that moves the rows by `error` [rows], exactly or nearly: P S^-1 error, in the units
 * of A, not scaled. */
FLESH_PER_ISA void flesh_volume_projection_correct(flesh_volume_projection *projection, const float *error,
                                                   double *step);

/* Returns the distance of the rows' values from those of the last set-up: the energy of the mean row's change, relative to
 * A_r. From about 1 on S is of no use for them. */
FLESH_PER_ISA double flesh_volume_projection_drift(const flesh_volume_projection *projection);

#endif
