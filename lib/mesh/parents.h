/* parents.h: transfers fields and sets from a mesh to one that was made from it. */
#ifndef FLESH_MESH_PARENTS_H
#define FLESH_MESH_PARENTS_H

#include "flesh/mesh.h"
#include "mesh/sets.h"

/* Interpolates the field [components] at barycentric `place` in the tet by its shape functions. */
void flesh_mesh_interpolate(const flesh_mesh *mesh, int tet, const double place[4], int components, const double *field,
                            double *value);

/* Adds the new nodes to the sets, which already have the nodes of `mesh`, by the rule of flesh_mesh_refine_marked.
 * FLESH_ERR_MEMORY. */
int flesh_mesh_parents_carry(const flesh_mesh *mesh, const flesh_mesh_parents *parents, flesh_mesh_sets *sets);

#endif
