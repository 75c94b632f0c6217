/* torn.h: a mesh torn into tets that share no nodes, so that one residual has the forces of each. */
#ifndef FLESH_MESH_TORN_H
#define FLESH_MESH_TORN_H

#include "flesh/mesh.h"

/* Makes a mesh of the same tets in the same order, each with nodes of its own, numbered tet by tet, corners first. from
 * [nodes of torn] is the node of `mesh` that each was; the caller frees it by flesh_free, also after an error. Returns
 * new. FLESH_ERR_MEMORY, and errors of creating meshes. */
int flesh_mesh_tear(const flesh_mesh *mesh, flesh_mesh **torn, int **from);

#endif
