/* coarse.h: a coarse level for smooth displacements, which incomplete factorisations do not see.
 *
 * A grid lies over the body at rest (coarse_grid.h), and the coarse space holds every displacement that is trilinear within
 * each of its cells, among them the affine ones of the whole body: translations, rotations from any deformed state,
 * stretches. With P its basis, the level adds P (P^T A P)^-1 P^T to a preconditioner: the additive Schwarz method with a
 * coarse space. P, the factor of P^T A P and the solution are rounded to single precision, as they are read in every
 * iteration. */
#ifndef FLESH_LINEAR_COARSE_H
#define FLESH_LINEAR_COARSE_H

#include <stdint.h>

#include "base/archive.h"
#include "base/isa.h"
#include "base/team.h"
#include "flesh/threads.h"
#include "linear/bisection.h"

typedef struct flesh_coarse flesh_coarse;

/* Makes a coarse level for matrices of A's pattern, with at most `vertices` of the grid, or eight; `positions` [3*rows] at
 * rest. `bisection` may be freed then; borrows `threads` (may be NULL). Returns new. */
FLESH_PER_ISA int flesh_coarse_create(const flesh_block_matrix *A, const double *positions, int vertices,
                                      const flesh_bisection *bisection, flesh_threads *threads, const flesh_team *team,
                                      flesh_coarse **coarse);
FLESH_PER_ISA void flesh_coarse_destroy(flesh_coarse **coarse);

/* Factors scale P^T A P, with P zero at the constrained dofs, `fixed` [3*rows] (NULL: none), whose rows in A are diagonal;
 * `scale` takes A's largest entry to about 1. FLESH_NOT_POSITIVE when P^T A P, and so A, is indefinite. */
FLESH_PER_ISA int flesh_coarse_setup(flesh_coarse *coarse, const flesh_block_matrix *A, double scale,
                                     const uint8_t *fixed);

/* Corrects for a residual r of about 1 in three steps. `restrict`: P^T r, range by range of nodes, each of two parts by one
 * thread at a time. `solve`: keeps the correction inside and returns its product with r. The last one: z = y + share P
 * times it for begin <= p < end, whose first entries y and z begin with. Vectors have four lanes a node in the bisection's
 * order. */
enum { FLESH_COARSE_PARTS = 2 };
/* Weight of the correction: smooth displacements get one from each of the two levels. */
#define FLESH_COARSE_SHARE 0.5f
FLESH_PER_ISA void flesh_coarse_restrict(flesh_coarse *coarse, int part, int begin, int end, const float *r);
FLESH_PER_ISA double flesh_coarse_solve(flesh_coarse *coarse);
/* Functions for loads that a team's ranks add up elsewhere: P^T r of this rank, times `scale`, one number for each unknown;
 * and the solve for `scale` times the sum, which all ranks have. */
FLESH_PER_ISA int flesh_coarse_unknowns(const flesh_coarse *coarse);
FLESH_PER_ISA void flesh_coarse_take(flesh_coarse *coarse, double scale, double *load);
FLESH_PER_ISA void flesh_coarse_solve_for(flesh_coarse *coarse, const double *load, double scale);
FLESH_PER_ISA void flesh_coarse_add(const flesh_coarse *coarse, int begin, int end, float share, const float *y,
                                    float *z);

FLESH_PER_ISA void flesh_coarse_archive(flesh_coarse *coarse, flesh_archive *archive);

#endif
