/* preconditioner.h: symmetric positive definite approximations of a block matrix's inverse. */
#ifndef FLESH_LINEAR_PRECONDITIONER_H
#define FLESH_LINEAR_PRECONDITIONER_H

#include <stddef.h>
#include <stdint.h>

#include "base/archive.h"
#include "base/isa.h"
#include "flesh/block_matrix.h"
#include "flesh/linear_solver.h"
#include "flesh/threads.h"
#include "linear/overlap.h"

/* The kind that AUTO means for a mesh of so many nodes; any other kind is itself. */
flesh_preconditioner flesh_preconditioner_choose(flesh_preconditioner kind, int nodes);
/* Whether the kind takes stiff rows out of the matrix: where it is asked to, or AUTO where that pays. `inertia`: the
 * modulus [Pa] that inertia gives the body as a whole, 0 in statics. */
int flesh_preconditioner_projects(flesh_preconditioner kind, const flesh_stiff_rows *rows, double inertia);
/* Whether so many rows that are so stiff are taken out in less time by polynomials than exactly. */
int flesh_preconditioner_takes_polynomials(const flesh_stiff_rows *rows);
/* Coarse levels: of the one that all ranks share, the most vertices; of each rank's own, over its overlap, nodes to
 * a vertex, 0: there is none. */
typedef struct flesh_levels {
  int shared;
  double own;
} flesh_levels;
/* For a matrix of so many nodes and blocks (a team's: of all ranks together) on so many ranks. */
flesh_levels flesh_levels_for(double nodes, double blocks, int ranks);
/* Names of the kinds; ended by NULL. */
extern const char *const flesh_preconditioner_names[];

typedef struct flesh_preconditioner_data flesh_preconditioner_data;

/* A power of two that takes x to about 1; of what has none, 1. */
FLESH_PER_ISA double flesh_power_to_one(double x);

/* Symbolic set-up for the pattern of A, all memory included. `positions` [3*rows] at rest are what
 * the two-level kind goes by (NULL: it has one level); `threads` (may be NULL) is borrowed. Returns
 * new. */
FLESH_PER_ISA int flesh_preconditioner_create(flesh_preconditioner kind, const flesh_block_matrix *A,
                                              const double *positions, flesh_threads *threads,
                                              flesh_preconditioner_data **preconditioner);
/* Like flesh_preconditioner_create, with these coarse levels; NULL: flesh_levels_for the matrix. */
FLESH_PER_ISA int flesh_preconditioner_create_levels(flesh_preconditioner kind, const flesh_block_matrix *A,
                                                     const double *positions, const flesh_levels *levels,
                                                     flesh_threads *threads,
                                                     flesh_preconditioner_data **preconditioner);
/* From now on the stiff terms of A's rows (borrowed; to be those of the matrix at every set-up) are taken out by a
 * volume projection, but for set-ups where they are left in; all memory included. Not for NONE. `positions`
 * [3*A->rows] at rest; `polynomial`: by Chebyshev polynomials, else exactly. With a team each rank has rows of its own, or
 * none; where there are other ranks it has to be by polynomials. Collective; FLESH_ERR_MEMORY, which ranks that go on have
 * to agree on. */
FLESH_PER_ISA int flesh_preconditioner_project(flesh_preconditioner_data *preconditioner, const flesh_block_matrix *A,
                                               const flesh_stiff_rows *rows, const double *positions, int polynomial);
FLESH_PER_ISA void flesh_preconditioner_destroy(flesh_preconditioner_data **preconditioner);

/* Numeric set-up. Always ends with a positive definite operator: incomplete Cholesky shifts A's
 * diagonal as far as it must, and the coarse level is left out where A is indefinite on it. The
 * rows of fixed dofs [3*rows] (NULL: none) are diagonal. FLESH_NONFINITE when A has a non-finite
 * diagonal. */
FLESH_PER_ISA int flesh_preconditioner_setup(flesh_preconditioner_data *preconditioner, const flesh_block_matrix *A,
                                             const uint8_t *fixed);

/* z = P^-1 r, both [3*rows]; z may be r. */
FLESH_PER_ISA void flesh_preconditioner_apply(flesh_preconditioner_data *preconditioner, const double *r, double *z);
/* Applies the preconditioner to four lanes per node, in the order of the pattern's bisection, in single precision and
 * for `scale` times the matrix, a power of two that takes its largest entry to about 1: z = (scale A)^-1 r, nearly, of
 * an r of about 1. z is kept inside. Returns r.z. */
FLESH_PER_ISA double flesh_preconditioner_solve(flesh_preconditioner_data *preconditioner, const float *r);
FLESH_PER_ISA double flesh_preconditioner_scale(const flesh_preconditioner_data *preconditioner);
/* z for begin <= p < end, which z begins with; the fourth lane is anything finite. */
FLESH_PER_ISA void flesh_preconditioner_result(const flesh_preconditioner_data *preconditioner, int begin, int end,
                                               float *z);

/* For conjugate gradients of a team (pcg_team.c), which keep the residual in the overlap and add up the coarse
 * level's load P^T r with their own sums.
 *
 * The overlap in which the residual is kept; NULL: it is not, nothing is found at ghosts, and there is no load. */
FLESH_PER_ISA const flesh_overlap *flesh_preconditioner_overlap(const flesh_preconditioner_data *preconditioner);
/* The ranks as solves see them: the threads' team, narrowed to the pattern of the matrix. */
FLESH_PER_ISA const flesh_team *flesh_preconditioner_team(const flesh_preconditioner_data *preconditioner);
/* Ghosts that solves leave out for that take their owners' values, in a vector [3*rows]. */
FLESH_PER_ISA void flesh_preconditioner_share_left_out(const flesh_preconditioner_data *preconditioner, double *vector);
/* How many numbers the load has. */
FLESH_PER_ISA int flesh_preconditioner_unknowns(const flesh_preconditioner_data *preconditioner);
/* This rank's part of the load for `scale` times r, which is not summed up; nothing where it has no numbers. */
FLESH_PER_ISA void flesh_preconditioner_load(flesh_preconditioner_data *preconditioner, const float *r, double scale,
                                             double *load);
/* flesh_preconditioner_solve where the residual is kept. r, `scale` times it, is zero at ghosts; `load`, the sum over the
 * ranks, without `scale`. */
FLESH_PER_ISA void flesh_preconditioner_solve_for(flesh_preconditioner_data *preconditioner, const float *r,
                                                  const double *load, double scale);
/* Room with a team: so many numbers, and three times those that a load may have. */
enum { FLESH_PRECONDITIONER_SUMS = 16 };
FLESH_PER_ISA double *flesh_preconditioner_room(flesh_preconditioner_data *preconditioner);

/* Removes from step [3*rows] the part that changes the stiff rows' products by `error` [rows of these], as far as the
 * projection goes. Returns 0 where nothing is projected and the step stays. Collective; steps are consistent. */
FLESH_PER_ISA int flesh_preconditioner_correct_volumes(flesh_preconditioner_data *preconditioner, const float *error,
                                                       double *step);

/* How far the stiff rows are from those of the last set-up, 0 where nothing is projected: from about 1 on there are many
 * iterations more. Collective. */
FLESH_PER_ISA double flesh_preconditioner_drift(const flesh_preconditioner_data *preconditioner);

/* Archives the results of set-ups and the figures that guide the next one. The stiff rows are not part of it. */
FLESH_PER_ISA void flesh_preconditioner_archive(flesh_preconditioner_data *preconditioner, flesh_archive *archive);

#endif
