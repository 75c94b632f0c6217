/* smooth.h: better shapes of tets by other places of inner nodes. */
#ifndef FLESH_MESH_SMOOTH_H
#define FLESH_MESH_SMOOTH_H

#include "flesh/mesh.h"

/* The mesh whose inner corners lie where the worst tet around each has a larger radius ratio, as long as that is below
 * `least`: each is moved by itself, again and again (after Freitag & Ollivier-Gooch, Int. J. Numer. Methods Eng. 40, 1997).
 * What holds the body's shape stays: nodes of the surface and of curved tets, between regions or sets of tets, and in sets of
 * nodes. Numbers of nodes and tets, sets and marks stay. Returns new. FLESH_ERR_MEMORY. */
int flesh_mesh_smooth(const flesh_mesh *mesh, double least, flesh_mesh **smoothed);

#endif
