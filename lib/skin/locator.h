/* locator.h: which tet of a mesh holds a point, or lies nearest to it, by a tree of boxes. */
#ifndef FLESH_SKIN_LOCATOR_H
#define FLESH_SKIN_LOCATOR_H

#include "flesh/mesh.h"

typedef struct flesh_locator flesh_locator;

/* A point's place in a mesh: its tet, its barycentric coordinates there and its distance from the tet (0 inside; the
 * coordinates then extrapolate). With four nodes the coordinates are the nodes' weights; with ten they are of the
 * straight tet that the curved one is the image of (flesh_tet10_weights gives the point back), and the distance from a
 * curved tet is that from the nearest of its image's point and of the sixteen triangles between its boundary's nodes,
 * at least the true one. */
typedef struct flesh_place {
  int tet;
  double weights[4];
  double distance; /* m */
} flesh_place;

/* Makes the locator of the mesh at rest, which it borrows. FLESH_ERR_MEMORY. Returns new. */
int flesh_locator_create(const flesh_mesh *mesh, flesh_locator **locator);
void flesh_locator_destroy(flesh_locator **locator); /* NULL-safe */

/* Finds the place of `point`. `hint`: a tet that may be near, or -1. The answer is the same for
 * every hint: of the tets at the least distance the one whose weights extrapolate least, then the
 * first. */
void flesh_locator_find(const flesh_locator *locator, const double point[3], int hint,
                        flesh_place *place);

#endif
