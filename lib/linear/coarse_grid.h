/* coarse_grid.h: a grid of cells over a body at rest. The displacements of its vertices, interpolated trilinearly, move
 * the body's nodes. */
#ifndef FLESH_LINEAR_COARSE_GRID_H
#define FLESH_LINEAR_COARSE_GRID_H

#include "base/team.h"
#include "flesh/block_matrix.h"
#include "linear/lanes.h"

/* Nodes are numbered as vectors store them (bisection.h). Where a vertex would move parts of a body that are not
 * connected near it (two bodies, the fingers of a hand), each part has a vertex of its own, unless they are too many.
 *
 * Of a team every rank has the cells that its nodes are in, and all vertices and patches by the same numbers; vertices
 * are never split. */
typedef struct flesh_coarse_grid {
  int vertices, cells, patches;
  int *cell;           /* [rows] of each node */
  flesh_float4 *local; /* [rows] where in it, (0,0,0) to (1,1,1); the fourth lane is the user's */
  int *corner;         /* [8*cells] vertices; corner a is at the upper end of axis k where bit k of a is set */
  int *patch, *slot;   /* [vertices] the group of at most four neighbours it belongs to, and its place 0 to 3 in it */
} flesh_coarse_grid;

/* For nodes connected as by A's pattern, at rest at `positions` [3*rows] and stored in the order `stored`: as fine
 * as at most `vertices` allow before any are split, but one cell at least. `team` may be NULL. To be cleared also when
 * it fails. */
int flesh_coarse_grid_create(const flesh_block_matrix *A, const double *positions, const int *stored, int vertices,
                             const flesh_team *team, flesh_coarse_grid *grid);
void flesh_coarse_grid_clear(flesh_coarse_grid *grid);

#endif
