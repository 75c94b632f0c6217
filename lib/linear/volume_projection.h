/* volume_projection.h: takes stiff terms out of a matrix, so that what is left is easy to precondition.
 *
 * A = A_r + B^T B, B of stiff rows. With D the diagonal blocks of A_r on the rows' main nodes, elsewhere infinite,
 * P = D^-1 B^T and S = I + B P, an approximation M_r of A_r becomes one of A:
 *
 *   A^-1 ~ (I - B^T S^-1 P^T)^T M_r^-1 (I - B^T S^-1 P^T) + P S^-2 P^T.
 *
 * The factors in parentheses take out what B feels: B (I - P S^-1 B) = S^-1 B. Positive definite whatever S is. The
 * projection is that of deflation and balancing (Mandel 1993; Nicolaides 1987) with P for a coarse space of as many
 * vectors as rows. So S^-1 may be any fixed symmetric approximation that is near enough: the stiff terms then have
 * (S~ - S + I) S~^-1 B in place of S^-1 B, no more than a few times as much where the error is below s^(-1/2) for
 * eigenvalues s of S.
 *
 * Where ranks share out the body, rows are those of the rank's own tets, A and A_r are partial and D is that of all ranks.
 * B^T of what rows have is summed up over the ranks; S is solved by polynomials, in each product of which ranks exchange
 * what they have at the main nodes that their rows share. */
#ifndef FLESH_LINEAR_VOLUME_PROJECTION_H
#define FLESH_LINEAR_VOLUME_PROJECTION_H

#include <stddef.h>
#include <stdint.h>

#include "base/archive.h"
#include "base/isa.h"
#include "flesh/block_matrix.h"
#include "flesh/threads.h"
#include "linear/overlap.h"

typedef struct flesh_volume_projection flesh_volume_projection;

/* For matrices of A's pattern with these rows, all memory included; `rows` (its values change), `overlap` (of A, without
 * a team where there is none) and `threads` (may be NULL) are borrowed. `positions` [3*A->rows] at rest; `polynomial`:
 * S is solved by Chebyshev polynomials, as it has to be where there are other ranks, else exactly. Collective where
 * there is a team, as all of this is but the matrix. Returns new. */
FLESH_PER_ISA int flesh_volume_projection_create(const flesh_block_matrix *A, const flesh_stiff_rows *rows,
                                                 const double *positions, int polynomial, const flesh_overlap *overlap,
                                                 flesh_threads *threads, flesh_volume_projection **projection);
FLESH_PER_ISA void flesh_volume_projection_destroy(flesh_volume_projection **projection);
FLESH_PER_ISA void flesh_volume_projection_archive(flesh_volume_projection *projection, flesh_archive *archive);

/* A_r = A - B^T B, the rows' values zero at the fixed dofs [3*A->rows] (NULL: none). It stays until the next call. */
FLESH_PER_ISA const flesh_block_matrix *flesh_volume_projection_matrix(flesh_volume_projection *projection,
                                                                       const flesh_block_matrix *A,
                                                                       const uint8_t *fixed);
/* Then S, of scale times the matrices, with inverse [9*A->rows] the inverse blocks of scale A_r by the mesh's numbers
 * of the nodes, ghosts included. FLESH_NOT_POSITIVE, on all ranks, where single precision does not tell S from a singular
 * matrix. */
FLESH_PER_ISA int flesh_volume_projection_setup(flesh_volume_projection *projection, double scale,
                                                const float *inverse);

/* Vectors of four lanes a node as the halves order them, about 1. `before` returns (I - B^T S^-1 P^T) r, kept inside;
 * with M_r^-1 times that in z, `after` makes the whole of it and returns r.z. */
FLESH_PER_ISA const float *flesh_volume_projection_before(flesh_volume_projection *projection, const float *r);
FLESH_PER_ISA double flesh_volume_projection_after(flesh_volume_projection *projection, const float *r, float *z);
/* Like those two, for a team: r and the result are in `vector` of the overlap, at all its nodes. `before`
 * returns the result at the rank's nodes, ghosts included, which may be overwritten. z is consistent, and becomes
 * so. */
FLESH_PER_ISA float *flesh_volume_projection_before_in_team(flesh_volume_projection *projection);
FLESH_PER_ISA void flesh_volume_projection_after_in_team(flesh_volume_projection *projection, float *z);

/* Takes from step [3*nodes] what moves the rows by `error` [rows], or nearly: P S^-1 error, in the units of A, not
 * scaled. */
FLESH_PER_ISA void flesh_volume_projection_correct(flesh_volume_projection *projection, const float *error,
                                                   double *step);

/* How far the rows' values are from those of the last set-up: of the mean row's change the energy, in units of what A_r
 * makes of it. From about 1 on S is of no use for them. */
FLESH_PER_ISA double flesh_volume_projection_drift(const flesh_volume_projection *projection);

#endif
