/* locator.h: which tet of a mesh holds a point, or lies nearest to it, by a tree of boxes. */
#ifndef FLESH_SKIN_LOCATOR_H
#define FLESH_SKIN_LOCATOR_H

#include "flesh/mesh.h"

typedef struct flesh_locator flesh_locator;

/* Where a point lies: its tet, weights of the tet's nodes that sum to one and give the point back,
 * and its distance from the tet (0 inside; the weights then extrapolate). */
typedef struct flesh_place {
  int tet;
  double weights[4];
  double distance; /* m */
} flesh_place;

/* Of the mesh at rest; borrows it. FLESH_ERR_MEMORY. Returns new. */
int flesh_locator_create(const flesh_mesh *mesh, flesh_locator **locator);
void flesh_locator_destroy(flesh_locator **locator); /* NULL-safe */

/* Finds the place of `point`. `hint`: a tet that may be near, or -1. The answer is the same for
 * every hint: of the tets at the least distance the one whose weights extrapolate least, then the
 * first. */
void flesh_locator_find(const flesh_locator *locator, const double point[3], int hint,
                        flesh_place *place);

#endif
