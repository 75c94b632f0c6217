/* boomeramg.h: hypre's algebraic multigrid, BoomerAMG (Henson & Yang 2002), as a preconditioner of the body's matrix on
 * one rank of MPI or on all. hypre allocates whenever a matrix is set up. */
#ifndef FLESH_LINEAR_BOOMERAMG_H
#define FLESH_LINEAR_BOOMERAMG_H

#include <stddef.h>

#include "base/team.h"
#include "flesh/block_matrix.h"

typedef struct flesh_boomeramg flesh_boomeramg;

/* Numbers as in hypre's manual. */
typedef struct flesh_boomeramg_options {
  double strength;     /* threshold of strong connections */
  int coarsening;      /* 8 PMIS, 10 HMIS */
  int nodal;           /* norm of blocks by which nodes are coarsened; 0: each of x, y, z by itself */
  int interpolation;   /* 6 extended+i, 17 the same by products of matrices */
  int longest;         /* entries in a row of it, at most */
  int smoother;        /* 6 symmetric Gauss-Seidel within ranks, 8 with l1 scaling, 13 one sweep of that down, and the
                        * reverse up, 16 Chebyshev, 18 l1-Jacobi */
  int aggressive;      /* finest levels that are coarsened twice */
  int rotations;       /* 1 to 3: interpolates rotations, too, by variants GM-1, GM-2 and LN; 0: translations alone */
  int longest_rotation; /* entries in a row of what that adds */
} flesh_boomeramg_options;

extern const flesh_boomeramg_options flesh_boomeramg_defaults;

/* For matrices of A's rows; `positions` [3*rows] at rest. `team` (may be NULL) is borrowed. Returns new. Collective, and
 * fails on all ranks or none: FLESH_ERR_ARGUMENT where flesh is built without hypre, where MPI has not begun, or where
 * the body has more unknowns than hypre's indices; FLESH_ERR_MEMORY. */
int flesh_boomeramg_create(const flesh_boomeramg_options *options, int rows, const double *positions,
                           const flesh_team *team, flesh_boomeramg **boomeramg);
void flesh_boomeramg_destroy(flesh_boomeramg **boomeramg);

/* For `scale` A. Collective, and fails on all ranks or none: FLESH_ERR_MEMORY; FLESH_ERR_SOLVE where hypre reports an
 * error. */
int flesh_boomeramg_setup(flesh_boomeramg *boomeramg, const flesh_block_matrix *A, double scale);
/* One cycle: z [4*rows] of r [4*rows], both of four lanes a node, `order` [rows] being the node of each. Of own nodes;
 * z of ghosts is 0. Collective. */
void flesh_boomeramg_solve(flesh_boomeramg *boomeramg, const int *order, const float *r, float *z);
/* Without the coarser levels, of which hypre does not tell: two to three times as much again (README.md). */
size_t flesh_boomeramg_memory(const flesh_boomeramg *boomeramg);

#endif
