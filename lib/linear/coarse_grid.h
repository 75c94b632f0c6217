/* coarse_grid.h: a grid of cells over a body at rest. Trilinear interpolation of the displacements of its vertices moves
 * the body's nodes. */
#ifndef FLESH_LINEAR_COARSE_GRID_H
#define FLESH_LINEAR_COARSE_GRID_H

#include "base/team.h"
#include "flesh/block_matrix.h"
#include "linear/lanes.h"

/* Nodes are numbered by their place in vectors (bisection.h). If a vertex would move parts of a body that are not connected
 * near it (two bodies, the fingers of a hand), each part has a vertex of its own, unless they are too many.
 *
 * In a team, every rank has the cells of its nodes, and vertices and patches have the same numbers on all ranks; vertices
 * are never split. */
typedef struct flesh_coarse_grid {
  int vertices, cells, patches;
  int *cell;           /* [rows] cell of each node */
  flesh_float4 *local; /* [rows] position in the cell, (0,0,0) to (1,1,1); the fourth lane is free for the user */
  int *corner;         /* [8*cells] vertices; corner a is at the upper end of axis k where bit k of a is set */
  int *patch, *slot;   /* [vertices] patch of each vertex, a group of at most four neighbours, and its place 0 to 3 in it */
} flesh_coarse_grid;

/* Makes a grid for nodes connected as in A's pattern, at rest at `positions` [3*rows] and stored in the order `stored`. It
 * is as fine as at most `vertices` allow before any are split, but has at least one cell. `team` may be NULL. Clear it also
 * after a failure. */
int flesh_coarse_grid_create(const flesh_block_matrix *A, const double *positions, const int *stored, int vertices,
                             const flesh_team *team, flesh_coarse_grid *grid);
void flesh_coarse_grid_clear(flesh_coarse_grid *grid);

#endif
