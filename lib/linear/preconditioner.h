/* preconditioner.h: symmetric positive definite approximations of a block matrix's inverse. */
#ifndef FLESH_LINEAR_PRECONDITIONER_H
#define FLESH_LINEAR_PRECONDITIONER_H

#include <stdint.h>

#include "base/archive.h"
#include "base/isa.h"
#include "flesh/block_matrix.h"
#include "flesh/linear_solver.h"
#include "flesh/threads.h"
#include "linear/overlap.h"

/* Returns the kind that AUTO means for a mesh with `nodes` nodes, of order 1 or 2; any other kind is itself. */
flesh_preconditioner flesh_preconditioner_choose(flesh_preconditioner kind, double nodes, int order);
/* Whether the kind projects stiff rows out of the matrix: on request, or with AUTO where it pays off. `inertia`: the
 * modulus [Pa] that inertia gives the body as a whole, 0 in statics. */
int flesh_preconditioner_projects(flesh_preconditioner kind, const flesh_stiff_rows *rows, double inertia);
/* Whether polynomials project out these rows, by their number and stiffness, in less time than an exact solve. */
int flesh_preconditioner_takes_polynomials(const flesh_stiff_rows *rows);
/* Sizes of the coarse levels: the most vertices of the one that all ranks share, and the nodes per vertex of each rank's
 * own, over its overlap, 0: there is none. */
typedef struct flesh_levels {
  int shared;
  double own;
} flesh_levels;
/* Returns the levels for a matrix of `nodes` nodes and `blocks` blocks (of a team: of all ranks together) on `ranks`
 * ranks. */
flesh_levels flesh_levels_for(double nodes, double blocks, int ranks);
/* Names of the kinds, ended by NULL. */
extern const char *const flesh_preconditioner_names[];

typedef struct flesh_preconditioner_data flesh_preconditioner_data;

/* Returns a power of two that takes x to about 1; 1 if there is none. */
FLESH_PER_ISA double flesh_power_to_one(double x);

/* Chooses the kind for a mesh of this order with the nodes of all ranks, analyses the pattern of A and allocates all
 * memory. `positions` [3*rows] at rest are needed by the two-level kind (NULL: it has one level); borrows `threads` (may be
 * NULL). Returns new. */
FLESH_PER_ISA int flesh_preconditioner_create(flesh_preconditioner kind, const flesh_block_matrix *A,
                                              const double *positions, int order, flesh_threads *threads,
                                              flesh_preconditioner_data **preconditioner);
/* Does what flesh_preconditioner_create does, for a kind that flesh_preconditioner_choose returns, with these coarse
 * levels; NULL: flesh_levels_for the matrix. */
FLESH_PER_ISA int flesh_preconditioner_create_levels(flesh_preconditioner kind, const flesh_block_matrix *A,
                                                     const double *positions, const flesh_levels *levels,
                                                     flesh_threads *threads,
                                                     flesh_preconditioner_data **preconditioner);
/* Projects out the stiff terms of A's rows from now on, by a volume projection, except in set-ups for which they are left
 * in; allocates all memory. Borrows `rows`, which must be those of the matrix at every set-up. Not for NONE. `positions`
 * [3*A->rows] at rest; `polynomial`: by Chebyshev polynomials, else exactly. In a team each rank has rows of its own, or
 * none; with other ranks it must be by polynomials. Collective; FLESH_ERR_MEMORY, on which ranks must agree before they go
 * on. */
FLESH_PER_ISA int flesh_preconditioner_project(flesh_preconditioner_data *preconditioner, const flesh_block_matrix *A,
                                               const flesh_stiff_rows *rows, const double *positions, int polynomial);
FLESH_PER_ISA void flesh_preconditioner_destroy(flesh_preconditioner_data **preconditioner);

/* Sets up the preconditioner for A's values. Always ends with a positive definite operator: incomplete Cholesky shifts A's
 * diagonal as far as necessary, and the coarse level is left out where A is indefinite on it. The rows of fixed dofs
 * [3*rows] (NULL: none) are diagonal. FLESH_NONFINITE when A has a non-finite diagonal. */
FLESH_PER_ISA int flesh_preconditioner_setup(flesh_preconditioner_data *preconditioner, const flesh_block_matrix *A,
                                             const uint8_t *fixed);

/* Computes z = P^-1 r, both [3*rows]; z may be r. */
FLESH_PER_ISA void flesh_preconditioner_apply(flesh_preconditioner_data *preconditioner, const double *r, double *z);
/* Applies the preconditioner to vectors of four lanes per node, in the order of the pattern's bisection, in single
 * precision and for `scale` times the matrix, a power of two that takes its largest entry to about 1: z ~ (scale A)^-1 r
 * for an r of about 1. z is kept inside. Returns r.z. */
FLESH_PER_ISA double flesh_preconditioner_solve(flesh_preconditioner_data *preconditioner, const float *r);
FLESH_PER_ISA double flesh_preconditioner_scale(const flesh_preconditioner_data *preconditioner);
/* Copies z for begin <= p < end, to the start of `z`; the fourth lane is anything finite. */
FLESH_PER_ISA void flesh_preconditioner_result(const flesh_preconditioner_data *preconditioner, int begin, int end,
                                               float *z);

/* Functions for conjugate gradients of a team (pcg_team.c), which keep the residual in the overlap and add up the coarse
 * level's load P^T r with their own sums.
 *
 * Returns the overlap in which the residual is kept; NULL: it is not kept, there is no result at ghosts, and no load. */
FLESH_PER_ISA const flesh_overlap *flesh_preconditioner_overlap(const flesh_preconditioner_data *preconditioner);
/* Returns the ranks that take part in solves: the threads' team, narrowed to the pattern of the matrix. */
FLESH_PER_ISA const flesh_team *flesh_preconditioner_team(const flesh_preconditioner_data *preconditioner);
/* Sets ghosts that solves leave out to their owners' values, in a vector [3*rows]. */
FLESH_PER_ISA void flesh_preconditioner_share_left_out(const flesh_preconditioner_data *preconditioner, double *vector);
/* Returns how many numbers the load has. */
FLESH_PER_ISA int flesh_preconditioner_unknowns(const flesh_preconditioner_data *preconditioner);
/* Computes this rank's part of the load for `scale` times r, before it is summed up; nothing if the load has no numbers. */
FLESH_PER_ISA void flesh_preconditioner_load(flesh_preconditioner_data *preconditioner, const float *r, double scale,
                                             double *load);
/* Does what flesh_preconditioner_solve does, where the residual is kept. r, already times `scale`, is zero at ghosts;
 * `load` is the sum over the ranks, without `scale`. */
FLESH_PER_ISA void flesh_preconditioner_solve_for(flesh_preconditioner_data *preconditioner, const float *r,
                                                  const double *load, double scale);
/* Work space with a team: FLESH_PRECONDITIONER_SUMS numbers, and three times the length of a load. */
enum { FLESH_PRECONDITIONER_SUMS = 16 };
FLESH_PER_ISA double *flesh_preconditioner_room(flesh_preconditioner_data *preconditioner);

/* Removes from step [3*rows] the part that changes the stiff rows' products by `error` [rows of these], as far as the
 * projection can. Returns 0, with step unchanged, if nothing is projected. Collective; steps are consistent. */
FLESH_PER_ISA int flesh_preconditioner_correct_volumes(flesh_preconditioner_data *preconditioner, const float *error,
                                                       double *step);

/* Returns the distance of the stiff rows from those of the last set-up, 0 if nothing is projected: from about 1 on there
 * are many more iterations. Collective. */
FLESH_PER_ISA double flesh_preconditioner_drift(const flesh_preconditioner_data *preconditioner);

/* Archives the results of set-ups and the figures that guide the next one. The stiff rows are not part of it. */
FLESH_PER_ISA void flesh_preconditioner_archive(flesh_preconditioner_data *preconditioner, flesh_archive *archive);

#endif
