/* smooth.h: better shapes of tets by other places of nodes, which leave the shape of the body as it is. */
#ifndef FLESH_MESH_SMOOTH_H
#define FLESH_MESH_SMOOTH_H

#include "flesh/mesh.h"

/* The mesh whose corners lie where the worst tet around each has a larger radius ratio, as long as that is below `least`:
 * each is moved by itself, again and again (after Freitag & Ollivier-Gooch, Int. J. Numer. Methods Eng. 40, 1997). Inner
 * corners move in space, those of a flat part of the surface in its plane, those of a straight edge along it. Corners of
 * curved tets, between regions, and at the rims of sets within flat parts stay; nodes on straight edges go with the ends. The
 * numbers of nodes and tets, the sets and the marks are the mesh's. Returns new. FLESH_ERR_MEMORY, FLESH_ERR_INTERRUPTED. */
int flesh_mesh_smooth(const flesh_mesh *mesh, double least, flesh_mesh **smoothed);

#endif
