/* refine.h: transfers fields to a refined mesh of the same order, and checks the size of refined meshes. */
#ifndef FLESH_MESH_REFINE_H
#define FLESH_MESH_REFINE_H

#include "flesh/mesh.h"

/* Extends `field` [3*n], where n is the number of nodes of flesh_mesh_refine(mesh), from the nodes of `mesh`, which
 * come first, to the others by the mesh's shape functions. At order 1 these are the nodes of
 * flesh_mesh_raise_order(mesh), too. FLESH_ERR_MEMORY. */
int flesh_mesh_refine_field(const flesh_mesh *mesh, double *field);

/* Checks that `mesh`, refined that many times and then of this order, has a supported number of tets and fits into the
 * machine's memory. FLESH_ERR_ARGUMENT. */
int flesh_mesh_check_refine(const flesh_mesh *mesh, int order, int times);

#endif
