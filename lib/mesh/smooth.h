/* smooth.h: improves the shapes of tets by moving nodes, without changing the shape of the body. */
#ifndef FLESH_MESH_SMOOTH_H
#define FLESH_MESH_SMOOTH_H

#include "flesh/mesh.h"

/* Makes a mesh with its corners moved such that the worst tet around each has a larger radius ratio, as long as that is
 * below `least`: corners move one at a time, in several passes (after Freitag & Ollivier-Gooch, Int. J. Numer. Methods
 * Eng. 40, 1997). Inner corners move in space, those in a flat part of the surface within its plane, those on a
 * straight edge along it. Corners of curved tets, between regions, and at the rims of sets within flat parts stay;
 * nodes on straight edges move with the ends. The numbering of nodes and tets, the sets and the marks are those of the
 * mesh. Returns new. FLESH_ERR_MEMORY, FLESH_ERR_INTERRUPTED. */
int flesh_mesh_smooth(const flesh_mesh *mesh, double least, flesh_mesh **smoothed);

#endif
