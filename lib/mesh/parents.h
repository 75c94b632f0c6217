/* parents.h: what is taken over from a mesh to one that was made of it. */
#ifndef FLESH_MESH_PARENTS_H
#define FLESH_MESH_PARENTS_H

#include "flesh/mesh.h"
#include "mesh/sets.h"

/* The field's value [components] at barycentric `place` in the tet, by its shape functions. */
void flesh_mesh_interpolate(const flesh_mesh *mesh, int tet, const double place[4], int components, const double *field,
                            double *value);

/* Adds the nodes that are new to the sets, which have those of `mesh`, as flesh_mesh_refine_marked has it.
 * FLESH_ERR_MEMORY. */
int flesh_mesh_parents_carry(const flesh_mesh *mesh, const flesh_mesh_parents *parents, flesh_mesh_sets *sets);

#endif
