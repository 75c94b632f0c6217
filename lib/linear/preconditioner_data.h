/* preconditioner_data.h: what a preconditioner has, for what makes it (preconditioner.c) and what solves with it
 * (preconditioner_solve.c). */
#ifndef FLESH_LINEAR_PRECONDITIONER_DATA_H
#define FLESH_LINEAR_PRECONDITIONER_DATA_H

#include "flesh/linear_solver.h"
#include "linear/cholesky.h"
#include "linear/coarse.h"
#include "linear/local_level.h"
#include "linear/overlap.h"
#include "linear/volume_projection.h"

struct flesh_preconditioner_data {
  flesh_preconditioner kind;
  int rows;
  flesh_overlap overlap; /* what is factored; of a rank by itself all of A */
  float *inverse; /* [9*rows] of the diagonal blocks of scale A */
  flesh_cholesky *cholesky;
  double scale;    /* of the matrix that is factored, or inverted by blocks */
  double shift;    /* that the last factorisation needed, relative to the diagonal */
  double less;     /* the share of it to be tried first the next time */
  int by_diagonal; /* no shift helped: the diagonal blocks serve */
  flesh_coarse *coarse; /* NULL: one level */
  flesh_local_level local; /* beside it, of a team whose coarse level has too few vertices */
  int two_levels;       /* it serves for the matrix at hand */
  flesh_volume_projection *projection; /* NULL: the matrix is preconditioned as it is */
  const flesh_stiff_rows *stiff;       /* that it takes out; borrowed */
  int projects;         /* it serves for the matrix at hand */
  double *blocks;       /* [9*rows] of a team's: diagonal blocks that it sums up; NULL: there is none, or no projection */
  flesh_threads *threads;
  const flesh_team *team; /* the threads', for matrices of this pattern (flesh_team_narrow); NULL: there is none */
  int *order;       /* [rows] the mesh's numbers of the nodes as vectors hold them */
  float *r;         /* [4*rows] where vectors come in the mesh's order */
  float *z;         /* [4*rows] of the last solve by blocks or with a team; the others keep it themselves */
  int *overlap_order; /* [team->overlap] in the order of the factor; NULL: there is no team */
  float *wide;      /* [4*team->overlap] */
  double *room;     /* of a team's conjugate gradients */
};

#endif
