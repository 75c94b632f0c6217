/* inspect.h: parts of the inspection of a mesh that the `mesh info` command shows one by one. */
#ifndef FLESH_MESH_INSPECT_H
#define FLESH_MESH_INSPECT_H

#include "mesh/mesh.h"

/* Returns 3 * inradius / circumradius of a tet with straight edges: 1 for a regular tet, near 0 for a flat one. */
double flesh_mesh_radius_ratio(const flesh_mesh *mesh, int tet);
/* Returns the radius ratio of a tet by its four nodes at x; below 0 if the tet is inverted. */
double flesh_radius_ratio(const double *x, const int nodes[4]);

/* Returns the mean length of the tets' edges at rest, between corners. */
double flesh_mesh_mean_edge(const flesh_mesh *mesh);
/* Computes the mean of a tet's corners, for nodes at x [3*nodes]. */
void flesh_mesh_centre(const flesh_mesh *mesh, const double *x, int tet, double centre[3]);

/* Puts the distinct region tags in rising order into *list (new; NULL when out of memory); returns their number. */
int flesh_mesh_region_list(const flesh_mesh *mesh, int **list);

#endif
