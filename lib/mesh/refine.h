/* refine.h: fields on a mesh taken over to the one that has more nodes of the same elements. */
#ifndef FLESH_MESH_REFINE_H
#define FLESH_MESH_REFINE_H

#include "flesh/mesh.h"

/* `field` [3*n], n the nodes of flesh_mesh_refine(mesh), has values at the nodes of `mesh` in front; fills in the
 * others by the mesh's shape functions. At order 1 these are the nodes of flesh_mesh_raise_order(mesh) too.
 * FLESH_ERR_MEMORY. */
int flesh_mesh_refine_field(const flesh_mesh *mesh, double *field);

#endif
