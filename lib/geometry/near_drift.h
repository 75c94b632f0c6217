/* near_drift.h: bounds how much nearer to each other a motion can have brought features that are near each other now.
 *
 * A surface that has moved by many edges seldom brings its parts nearer by as much: mostly it moves as a whole, turns
 * and bends. Space is divided into cubes twice as large as the largest group of faces. In each cube, the displacements
 * of its faces are split into an affine motion, fitted by least squares, and remainders in a bounding box. Two points
 * at most R apart whose midpoint is in the cube have moved relative to each other by at most |A| R plus the box's
 * diagonal, with A the gradient of the affine motion. The affine motion and the remainder at any point of a face are
 * means of those at its corners, so the bound holds for nodes, edges and faces alike, however good the fit is. */
#ifndef FLESH_GEOMETRY_NEAR_DRIFT_H
#define FLESH_GEOMETRY_NEAR_DRIFT_H

#include "geometry/near_finder.h"

/* Initialise with {0}; memory is kept from one call to the next. */
typedef struct flesh_near_drift {
  int leaf_room, cell_room, table_size, cell_count;
  struct flesh_near_drift_leaf *leaves; /* [leaf_room] */
  struct flesh_near_drift_cell *cells;  /* [cell_room] */
  int *table;                           /* [table_size] hash table of cells by their position; -1: empty */
} flesh_near_drift;

/* Returns an upper bound of |(x_p - x_q) - (from_p - from_q)| [m] for all points p and q of the surface's faces that
 * are at most `within` apart at x, given their former positions `from`; both [3*mesh_nodes]. INFINITY if no bound is
 * found: a position is not finite, there are too many cubes, or memory is missing. */
double flesh_near_drift_bound(flesh_near_drift *drift, const flesh_near_finder *finder, const double *from,
                              const double *x, double within);
void flesh_near_drift_clear(flesh_near_drift *drift);

#endif
