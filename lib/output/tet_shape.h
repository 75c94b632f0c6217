/* tet_shape.h: positions and deformation gradients at points of tets of four and ten nodes. */
#ifndef FLESH_OUTPUT_TET_SHAPE_H
#define FLESH_OUTPUT_TET_SHAPE_H

#include "flesh/mesh.h"

/* Computes the weights of a tet's nodes at barycentric coordinates L, in the order of flesh_mesh_tet_nodes
 * (mesh/pieces.h); returns the number of nodes. */
int flesh_tet_weights(const flesh_mesh *mesh, int tet, const double L[4], int nodes[10], double weights[10]);

/* Computes F at L for a body at x [3*n]; returns the rest volume that the tet would have if it were everywhere as large
 * as at L, m^3. */
double flesh_tet_gradient(const flesh_mesh *mesh, int tet, const double L[4], const double *x, double F[9]);
/* Adds to by_x [3*n] the derivative by x of a function of F at L whose derivative by F is by_F. */
void flesh_tet_gradient_back(const flesh_mesh *mesh, int tet, const double L[4], const double by_F[9], double *by_x);

#endif
