/* refine.h: fields on a mesh taken over to the one that has more nodes of the same elements, and how large that gets. */
#ifndef FLESH_MESH_REFINE_H
#define FLESH_MESH_REFINE_H

#include "flesh/mesh.h"

/* `field` [3*n], n the nodes of flesh_mesh_refine(mesh), has values at the nodes of `mesh` in front; fills in the
 * others by the mesh's shape functions. At order 1 these are the nodes of flesh_mesh_raise_order(mesh) too.
 * FLESH_ERR_MEMORY. */
int flesh_mesh_refine_field(const flesh_mesh *mesh, double *field);

/* Whether `mesh`, refined so many times and then of this order, has a number of tets that is supported and fits into the
 * machine's memory; FLESH_ERR_ARGUMENT otherwise. */
int flesh_mesh_check_refine(const flesh_mesh *mesh, int order, int times);

#endif
