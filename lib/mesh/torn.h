/* torn.h: a mesh torn into its tets, of which no two share a node, so that one residual has the forces of each. */
#ifndef FLESH_MESH_TORN_H
#define FLESH_MESH_TORN_H

#include "flesh/mesh.h"

/* Makes a mesh of the same tets in the same order with nodes of their own, tet by tet, corners first. from [nodes of torn]:
 * the nodes of `mesh` that they were; to be freed with flesh_free, also where it fails. Returns new. FLESH_ERR_MEMORY, and
 * what creating meshes returns. */
int flesh_mesh_tear(const flesh_mesh *mesh, flesh_mesh **torn, int **from);

#endif
