/* near_drift.h: how much nearer to each other a motion can have brought what is near each other now.
 *
 * A surface that moves by many edges seldom brings its parts nearer by as much: it moves as a whole, turns and bends.
 * Space is cut into cubes twice as large as the largest group of faces. In each the displacements of the faces there are those
 * of an affine motion, fitted by least squares, and a rest that is in a box: two points no further apart than R, whose
 * middle is in that cube, have moved by |A| R and the box's diagonal relative to each other, at most. What an affine
 * motion and its rest are at a face's corners they are, as means, at all of its points; so this is a bound for nodes,
 * edges and faces alike, however good the fit is. */
#ifndef FLESH_GEOMETRY_NEAR_DRIFT_H
#define FLESH_GEOMETRY_NEAR_DRIFT_H

#include "geometry/near_finder.h"

/* Begins as {0}; keeps its memory from one call to the next. */
typedef struct flesh_near_drift {
  int leaf_room, cell_room, table_size, cell_count;
  struct flesh_near_drift_leaf *leaves; /* [leaf_room] */
  struct flesh_near_drift_cell *cells;  /* [cell_room] */
  int *table;                           /* [table_size] cells by their places; -1: none */
} flesh_near_drift;

/* An upper bound of |(x_p - x_q) - (from_p - from_q)| [m] for all points p and q of the surface's faces that are at most
 * `within` apart at x; from: where they were; both [3*mesh_nodes]. INFINITY where it is not
 * known: where a place is not finite, where cubes were too many, and where there is no memory. */
double flesh_near_drift_bound(flesh_near_drift *drift, const flesh_near_finder *finder, const double *from,
                              const double *x, double within);
void flesh_near_drift_clear(flesh_near_drift *drift);

#endif
