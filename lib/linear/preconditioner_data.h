/* preconditioner_data.h: the data of a preconditioner, for its making (preconditioner.c) and its solves
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
  flesh_overlap overlap; /* matrix that is factored; for a single rank all of A */
  float *inverse; /* [9*rows] inverses of the diagonal blocks of scale A */
  flesh_cholesky *cholesky;
  double scale;    /* scale of the matrix that is factored, or inverted by blocks */
  double shift;    /* shift that the last factorisation needed, relative to the diagonal */
  double less;     /* fraction of that shift to try first the next time */
  int by_diagonal; /* no shift helped: the diagonal blocks are used */
  flesh_coarse *coarse; /* NULL: one level */
  flesh_local_level local; /* in addition, with a team whose coarse level has too few vertices */
  int two_levels;       /* the coarse level serves for the present matrix */
  flesh_volume_projection *projection; /* NULL: the matrix is preconditioned as it is */
  const flesh_stiff_rows *stiff;       /* the rows that it projects out; borrowed */
  int projects;         /* the projection serves for the present matrix */
  double *blocks;       /* [9*rows] with a team: sums of diagonal blocks; NULL: no team, or no projection */
  flesh_threads *threads;
  const flesh_team *team; /* the threads' team, narrowed to this pattern (flesh_team_narrow); NULL: there is none */
  int *order;       /* [rows] the mesh's number of each node in vectors */
  float *r;         /* [4*rows] for vectors that come in the mesh's order */
  float *z;         /* [4*rows] z of the last solve by blocks or with a team; other kinds keep it themselves */
  int *overlap_order; /* [team->overlap] order of the factor; NULL: there is no team */
  float *wide;      /* [4*team->overlap] */
  double *room;     /* work space of a team's conjugate gradients */
};

#endif
