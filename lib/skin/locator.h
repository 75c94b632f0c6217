/* locator.h: finds the tet of a mesh that contains a point or is nearest to it, by a tree of boxes. */
#ifndef FLESH_SKIN_LOCATOR_H
#define FLESH_SKIN_LOCATOR_H

#include "flesh/mesh.h"

typedef struct flesh_locator flesh_locator;

/* Place of a point in a mesh: its tet, its barycentric coordinates there and its distance from the tet (0 inside;
 * outside the coordinates extrapolate). With four nodes the coordinates are the nodes' weights. With ten they refer to
 * the straight tet of which the curved one is the image (flesh_tet10_weights gives the point back), and the distance is
 * that from the nearest of the image of the cut-off coordinates and the sixteen triangles between the nodes of the
 * tet's boundary; it is at least the true distance. */
typedef struct flesh_place {
  int tet;
  double weights[4];
  double distance; /* m */
} flesh_place;

/* Makes the locator of the mesh at rest, which it borrows. Returns new. FLESH_ERR_MEMORY. */
int flesh_locator_create(const flesh_mesh *mesh, flesh_locator **locator);
void flesh_locator_destroy(flesh_locator **locator); /* NULL-safe */

/* Finds the place of `point`. `hint`: a tet that may be near, or -1. The result does not depend on the hint: of the
 * tets at the least distance it is the one whose weights extrapolate least, then the first. */
void flesh_locator_find(const flesh_locator *locator, const double point[3], int hint,
                        flesh_place *place);

#endif
