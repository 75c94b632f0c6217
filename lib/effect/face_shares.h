/* face_shares.h: what the nodes of a surface bear of a load that is uniform on some of its triangles. */
#ifndef FLESH_EFFECT_FACE_SHARES_H
#define FLESH_EFFECT_FACE_SHARES_H

#include "flesh/mesh.h"

/* Adds to shares [nodes] the integrals of the nodes' shape functions over triangles [3*count] of the rest shape, m^2. At
 * order 2 they must be of flesh_mesh_surface: FLESH_ERR_ARGUMENT otherwise, and for a node out of range. */
int flesh_face_shares(const flesh_mesh *mesh, int count, const int *triangles, double *shares);

#endif
